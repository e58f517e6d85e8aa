//! The goal layer: least cost from every cell to the goal, and the route of steepest descent.
//!
//! ```text
//! |∇T| = F      T(goal) = 0      F = 1/quality, `unknown_cost` on unknown, `bad_cost` on bad cells
//! ```
//! Solved by fast marching [Sethian96]: cells are accepted in order of T; with the smaller neighbours a along x, b along y
//! and f = F · cell:
//!
//! ```text
//! T = (a + b + √(2 f² − (a − b)²))/2   if |a − b| < f,   else  min(a, b) + f
//! ```
//! Unlike A* over eight neighbours the result is isotropic, so that its gradient is a heading. A goal outside the window
//! is reached from its border along a straight line over unknown ground.
//!
//! Frame: site, m.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::hazards::goodness::CellBasis;

use super::ground::{Ground, Part, Spot};
use super::settings::NavigatorSettings;

/// Smallest quality, which limits the cost of ground that is not bad.
const QUALITY_MIN: f64 = 0.1;
/// Largest number of half-cell steps along a route.
const STEPS_MAX: usize = 2000;

/// Least cost from every cell to a goal.
pub(super) struct Route<'a> {
    pub(super) ground: &'a Ground<'a>,
    pub(super) goal_m: [f64; 2],
    /// F, row by row.
    costs: Vec<f32>,
    /// T, in metres of good ground, row by row.
    cost_m: Vec<f32>,
}

impl<'a> Route<'a> {
    /// The costs to a goal, site frame, m.
    pub(super) fn new(ground: &'a Ground<'a>, goal_m: [f64; 2], settings: &NavigatorSettings) -> Self {
        let grid = &ground.map.grid;
        let costs: Vec<f32> =
            (0..grid.len()).map(|index| cell_cost(ground, index, settings) as f32).collect();
        let distance = |index: usize| {
            let centre = grid.centre_m(index);
            ((centre[0] - goal_m[0]).hypot(centre[1] - goal_m[1])) as f32
        };
        let side = grid.side;
        let seeds: Vec<(usize, f32)> = if grid.index_at(goal_m).is_some() {
            let is_near = |index: &usize| distance(*index) <= 2.0 * grid.cell_m as f32;
            // At the cost of good ground: T is then minimal at the goal, even next to bad ground.
            (0..grid.len()).filter(is_near).map(|index| (index, distance(index))).collect()
        } else {
            let is_border = |index: &usize| {
                [index / side, index % side].into_iter().any(|number| number == 0 || number + 1 == side)
            };
            let unknown_cost = settings.unknown_cost as f32;
            (0..grid.len()).filter(is_border).map(|index| (index, distance(index) * unknown_cost)).collect()
        };
        let cost_m = march(&costs, side, grid.cell_m as f32, &seeds);
        Self { ground, goal_m, costs, cost_m }
    }

    /// T at a position; `None` outside the window.
    pub(super) fn cost_at(&self, at_m: [f64; 2]) -> Option<f64> {
        self.ground.map.grid.index_at(at_m)?;
        Some(self.interpolated(at_m))
    }

    /// F of a cell; 1 outside the window.
    pub(super) fn cost_of(&self, index: Option<usize>) -> f64 {
        index.map_or(1.0, |index| f64::from(self.costs[index]))
    }

    /// Mean of F over spots.
    pub(super) fn mean_cost(&self, spots: impl Iterator<Item = Spot>) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for spot in spots {
            sum += self.cost_of(spot.index);
            count += 1.0;
        }
        if count > 0.0 { sum / count } else { 1.0 }
    }

    /// The point at `length_m` along the route from a position; the goal if the route ends before.
    pub(super) fn ahead(&self, from_m: [f64; 2], length_m: f64) -> [f64; 2] {
        let mut last = self.goal_m;
        self.follow(from_m, length_m, |at| last = at);
        last
    }

    /// The route from a position to the goal or the border of the window, a point every cell.
    pub(super) fn points(&self, from_m: [f64; 2]) -> Vec<[f64; 2]> {
        let mut points = vec![from_m];
        let mut count = 0;
        self.follow(from_m, f64::INFINITY, |at| {
            count += 1;
            if count % 2 == 0 {
                points.push(at);
            }
        });
        points.push(self.goal_m);
        points
    }

    /// Visits the points of the route; the last one is the goal if the route ends there.
    fn follow(&self, from_m: [f64; 2], length_m: f64, mut visit: impl FnMut([f64; 2])) {
        let cell_m = self.ground.map.grid.cell_m;
        let (mut at, mut left_m) = (from_m, length_m);
        for _ in 0..STEPS_MAX {
            let to_goal = [self.goal_m[0] - at[0], self.goal_m[1] - at[1]];
            let distance_m = to_goal[0].hypot(to_goal[1]);
            if distance_m <= left_m.min(1.5 * cell_m) {
                visit(self.goal_m);
                return;
            }
            if left_m <= 0.0 {
                return;
            }
            let step_m = left_m.min(0.5 * cell_m);
            let slope = self.gradient(at).map_or([-to_goal[0], -to_goal[1]], |slope| slope);
            let norm = slope[0].hypot(slope[1]);
            if norm <= 0.0 {
                return;
            }
            at = [at[0] - step_m * slope[0] / norm, at[1] - step_m * slope[1] / norm];
            left_m -= step_m;
            visit(at);
            if self.ground.map.grid.index_at(at).is_none() && length_m.is_infinite() {
                return;
            }
        }
    }

    /// ∇T at a position; `None` outside the window.
    fn gradient(&self, at_m: [f64; 2]) -> Option<[f64; 2]> {
        let grid = &self.ground.map.grid;
        grid.index_at(at_m)?;
        let half = 0.5 * grid.cell_m;
        let [x, y] = at_m;
        Some([
            self.interpolated([x + half, y]) - self.interpolated([x - half, y]),
            self.interpolated([x, y + half]) - self.interpolated([x, y - half]),
        ])
    }

    /// T between the centres of four cells; beyond the border that of the border.
    fn interpolated(&self, at_m: [f64; 2]) -> f64 {
        let grid = &self.ground.map.grid;
        let last = (grid.side - 1) as f64;
        let place =
            [0, 1].map(|axis| (at_m[axis] / grid.cell_m - grid.first[axis] as f64 - 0.5).clamp(0.0, last));
        let [row, column] = place.map(|place| (place as usize).min(grid.side.saturating_sub(2)));
        let (u, v) = (place[0] - row as f64, place[1] - column as f64);
        let cost = |row: usize, column: usize| f64::from(self.cost_m[row * grid.side + column]);
        (1.0 - u) * ((1.0 - v) * cost(row, column) + v * cost(row, column + 1))
            + u * ((1.0 - v) * cost(row + 1, column) + v * cost(row + 1, column + 1))
    }
}

/// Cost of a metre over a cell, in metres of good ground.
fn cell_cost(ground: &Ground<'_>, index: usize, settings: &NavigatorSettings) -> f64 {
    let spot = ground.spot_of(index, Part::Origin);
    if spot.is_bad() {
        return settings.bad_cost;
    }
    match spot.cell.basis {
        CellBasis::Unknown => settings.unknown_cost,
        _ => (1.0 / spot.quality(settings).max(QUALITY_MIN)).min(settings.bad_cost),
    }
}

/// T of all cells by fast marching.
fn march(costs: &[f32], side: usize, cell_m: f32, seeds: &[(usize, f32)]) -> Vec<f32> {
    let mut tentative = vec![f32::INFINITY; costs.len()];
    let mut accepted = vec![f32::INFINITY; costs.len()];
    // Non-negative floating-point numbers have the same order as their bits.
    let mut heap = BinaryHeap::with_capacity(costs.len());
    for (index, cost) in seeds {
        tentative[*index] = *cost;
        heap.push(Reverse((cost.to_bits(), *index as u32)));
    }
    while let Some(Reverse((bits, index))) = heap.pop() {
        let index = index as usize;
        if accepted[index].is_finite() || bits != tentative[index].to_bits() {
            continue;
        }
        accepted[index] = tentative[index];
        let (row, column) = (index / side, index % side);
        let neighbours = [
            (row > 0).then(|| index - side),
            (row + 1 < side).then(|| index + side),
            (column > 0).then(|| index - 1),
            (column + 1 < side).then(|| index + 1),
        ];
        for at in neighbours.into_iter().flatten() {
            if accepted[at].is_finite() {
                continue;
            }
            let cost = marched(&accepted, side, at, costs[at] * cell_m);
            if cost < tentative[at] {
                tentative[at] = cost;
                heap.push(Reverse((cost.to_bits(), at as u32)));
            }
        }
    }
    accepted
}

/// T of a cell from its accepted neighbours.
fn marched(accepted: &[f32], side: usize, at: usize, f: f32) -> f32 {
    let (row, column) = (at / side, at % side);
    let of = |is_there: bool, index: usize| if is_there { accepted[index] } else { f32::INFINITY };
    let a = of(row > 0, at.wrapping_sub(side)).min(of(row + 1 < side, at + side));
    let b = of(column > 0, at.wrapping_sub(1)).min(of(column + 1 < side, at + 1));
    let apart = (a - b).abs();
    if apart < f { 0.5 * (a + b + (2.0 * f * f - apart * apart).sqrt()) } else { a.min(b) + f }
}
