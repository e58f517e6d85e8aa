//! The search for a way to the goal, over positions and headings.
//!
//! ```text
//! stance   position and heading; of all stances in one square of `CELL_M` and one sector of `HEADING_DEG` the one with the
//!          smallest sum is kept
//! motions  those of `moves.rs`, finally those that end at the goal
//! order    A*: sum of the cost so far and T from there (cost: `moves.rs`, T: `route.rs`)
//! pocket   if the search backwards from a place ends after few stances, bad ground encloses the place. Only these motions
//!          are tried, so that a place with another way may seem enclosed.
//! ```
//! Every motion is subject to the vetoes of [`super::navigator`], except that of unknown ground, because distant ground
//! becomes known as the rover approaches it. A gap between rocks that requires a stance between two squares may be missed.
//!
//! Frame: site, horizontal. Source: hybrid A* [Dolgov08].

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashSet};

use sightline_geometry::frames::Pose;

use crate::driving::motion::Motion;
use crate::hazards::goodness::GoodnessMap;
use crate::hazards::grid::Grid;

use super::ground::Ground;
use super::limits::VetoLimits;
use super::moves::{HEADING_DEG, Moves, STEP_M};
use super::path::Stance;
use super::route::Route;
use super::settings::NavigatorSettings;
use super::way::{Way, distance_m};

const CELL_M: f64 = 0.15;
/// Number of headings at a place from which ways to it are followed backwards.
const POCKET_HEADINGS: u32 = 72;

/// The motions of a way from a pose to a goal, x and y of the site frame, m; `None` if there is none.
pub fn way(
    map: &GoodnessMap,
    site_from_rover: &Pose,
    goal_m: [f64; 2],
    settings: &NavigatorSettings,
) -> Option<Vec<Motion>> {
    let ground = Ground::new(map, VetoLimits::new(&map.settings, settings));
    let route = Route::new(&ground, goal_m, settings);
    let moves = Moves::new(&ground, settings);
    match Search::new(&moves, &route, Stance::of(site_from_rover)).run(usize::MAX) {
        Found::Goal(way) => Some(way.motions),
        Found::Nearest(_) | Found::Unfinished => None,
    }
}

/// The result of a search.
pub(super) enum Found {
    /// A way to the goal.
    Goal(Way),
    /// No way to the goal: a way to the nearest stance to it that can be reached.
    Nearest(Way),
    /// The limit of stances was reached first, or motions lead out of the window.
    Unfinished,
}

/// A reached stance.
struct Node {
    stance: Stance,
    /// Sum of the costs up to it, m.
    cost_m: f64,
    /// Index of the previous stance and the motion from it; `None` for the start.
    parent: Option<(usize, Motion)>,
}

/// State of a search.
pub(super) struct Search<'a> {
    moves: &'a Moves<'a>,
    route: &'a Route<'a>,
    nodes: Vec<Node>,
    /// Open nodes: bits of the sum, and index. Non-negative floating-point numbers have the same order as their bits.
    open: BinaryHeap<(Reverse<u64>, usize)>,
    least: LeastSums,
    /// Number of expanded stances.
    count: usize,
    /// Smallest distance from the goal, m, with its node.
    nearest: (f64, usize),
    /// Whether a motion leads out of the window.
    leads_out: bool,
}

impl<'a> Search<'a> {
    /// A search from a stance to the goal of a route.
    pub(super) fn new(moves: &'a Moves<'a>, route: &'a Route<'a>, start: Stance) -> Self {
        Self {
            moves,
            route,
            nodes: vec![Node { stance: start, cost_m: 0.0, parent: None }],
            open: BinaryHeap::from([(Reverse(0), 0)]),
            least: LeastSums::new(&route.ground.map.grid),
            count: 0,
            nearest: (f64::INFINITY, 0),
            leads_out: false,
        }
    }

    /// Searches until the goal is found or `stances_max` stances are examined.
    pub(super) fn run(mut self, stances_max: usize) -> Found {
        while self.count < stances_max {
            let Some((_, index)) = self.open.pop() else {
                let is_enclosed = !self.leads_out;
                let nearest = is_enclosed.then(|| self.way(self.nearest.1, Vec::new()));
                return nearest.map_or(Found::Unfinished, Found::Nearest);
            };
            let stance = self.nodes[index].stance;
            if !self.least.close(&stance) {
                continue;
            }
            self.count += 1;
            let goal_m = distance_m(stance.at_m, self.route.goal_m);
            if goal_m < self.nearest.0 {
                self.nearest = (goal_m, index);
            }
            if let Some(last) = self.moves.last(&stance, self.route.goal_m) {
                return Found::Goal(self.way(index, last));
            }
            self.search_on(index);
        }
        Found::Unfinished
    }

    /// Opens the stances after those motions from a node that are safe and lower a sum.
    fn search_on(&mut self, index: usize) {
        let Node { stance, cost_m, .. } = self.nodes[index];
        let start = self.moves.start(stance);
        for footprint in self.moves.footprints() {
            let after = start.after(footprint);
            let Some(left_m) = self.route.cost_at(after.at_m) else {
                self.leads_out |= self.moves.is_safe(&start, footprint);
                continue;
            };
            // Good ground is the lower bound of a motion's cost.
            if !self.least.is_less(&after, cost_m + footprint.cost_m(1.0) + left_m) {
                continue;
            }
            let Some(cost) = self.moves.cost(&start, footprint, self.route) else { continue };
            let cost_m = cost_m + cost;
            let sum_m = cost_m + left_m;
            if self.least.lower(&after, sum_m) {
                self.open.push((Reverse(sum_m.to_bits()), self.nodes.len()));
                self.nodes.push(Node { stance: after, cost_m, parent: Some((index, footprint.motion)) });
            }
        }
    }

    /// The way to a node and on by the last motions, given in reverse order.
    fn way(&self, mut at: usize, last: Vec<Motion>) -> Way {
        let mut motions = last;
        while let Some((before, motion)) = self.nodes[at].parent {
            motions.push(motion);
            at = before;
        }
        motions.reverse();
        Way::of(motions, self.nodes[0].stance)
    }
}

/// The smallest sum found so far in each square and sector.
struct LeastSums {
    first: [i64; 2],
    side: usize,
    /// m; infinite if none was found, negative if the stance was expanded.
    sums_m: Vec<f64>,
}

impl LeastSums {
    fn new(grid: &Grid) -> Self {
        let edge = |cells: i64| square_of(grid.first.map(|number| (number + cells) as f64 * grid.cell_m));
        let (first, last) = (edge(0), edge(grid.side as i64));
        let side = (last[0] - first[0]).max(last[1] - first[1]) as usize + 1;
        Self { first, side, sums_m: vec![f64::INFINITY; side * side * sector_count()] }
    }

    /// Index of the sum of a stance; `None` outside the window.
    fn index(&self, stance: &Stance) -> Option<usize> {
        let [x, y, sector] = bin_of(stance);
        let within = |number: i64, axis: usize| {
            usize::try_from(number.saturating_sub(self.first[axis])).ok().filter(|number| *number < self.side)
        };
        Some((within(x, 0)? * self.side + within(y, 1)?) * sector_count() + sector as usize)
    }

    /// Whether a sum is smaller than all previous ones.
    fn is_less(&self, stance: &Stance, sum_m: f64) -> bool {
        self.index(stance).is_some_and(|index| sum_m < self.sums_m[index])
    }

    /// Stores a sum if it is smaller than all previous ones; returns whether it is.
    fn lower(&mut self, stance: &Stance, sum_m: f64) -> bool {
        let Some(index) = self.index(stance).filter(|index| sum_m < self.sums_m[*index]) else {
            return false;
        };
        self.sums_m[index] = sum_m;
        true
    }

    /// Marks a stance as expanded; false if another stance of the same square and sector already was.
    fn close(&mut self, stance: &Stance) -> bool {
        let Some(index) = self.index(stance) else { return true };
        std::mem::replace(&mut self.sums_m[index], -1.0) >= 0.0
    }
}

/// The squares from which a way can lead to a place, x and y of the site frame, m, if bad ground encloses them; `None` if
/// they have `stances_max` or more stances, or if the rover is among them or on bad ground. Ways are followed backwards
/// from the place.
pub(super) fn pocket(
    moves: &Moves<'_>,
    at_m: [f64; 2],
    rover: &Stance,
    stances_max: usize,
) -> Option<HashSet<[i64; 2]>> {
    // A rover on bad ground leaves it by motions that no other stance may use.
    if !moves.start(*rover).is_free() {
        return None;
    }
    let heading_rad = |k: u32| std::f64::consts::TAU * f64::from(k) / f64::from(POCKET_HEADINGS);
    let at_place = |k: u32| Stance { at_m, heading_rad: heading_rad(k) };
    let mut open: Vec<Stance> =
        (0..POCKET_HEADINGS).map(at_place).filter(|stance| moves.can_stand(stance)).collect();
    let mut seen: HashSet<[i64; 3]> = open.iter().map(bin_of).collect();
    while let Some(stance) = open.pop() {
        if distance_m(stance.at_m, rover.at_m) <= STEP_M || seen.len() >= stances_max {
            return None;
        }
        for footprint in moves.footprints() {
            let before = stance.before(&footprint.motion);
            let is_new = !seen.contains(&bin_of(&before)) && moves.can_stand(&before);
            if is_new && moves.is_safe(&moves.start(before), footprint) {
                seen.insert(bin_of(&before));
                open.push(before);
            }
        }
    }
    Some(seen.into_iter().map(|[x, y, _]| [x, y]).collect())
}

/// Square of a position, site frame, m.
pub(super) fn square_of(at_m: [f64; 2]) -> [i64; 2] {
    at_m.map(|along| (along / CELL_M).floor() as i64)
}

/// Square and sector of a stance.
fn bin_of(stance: &Stance) -> [i64; 3] {
    let [x, y] = square_of(stance.at_m);
    let sector = (stance.heading_rad.to_degrees() / HEADING_DEG).round().rem_euclid(sector_count() as f64);
    [x, y, sector as i64]
}

fn sector_count() -> usize {
    (360.0 / HEADING_DEG) as usize
}

#[cfg(test)]
mod tests {
    use super::super::tests::{known, known_to, pose};
    use super::*;
    use crate::hazards::HazardSettings;

    #[test]
    fn every_stance_in_the_window_has_a_sum() {
        let map = known(&pose([0.37, -0.81], 0.0), &HazardSettings::default(), |_, _| 0.0);
        let grid = &map.grid;
        let mut sums = LeastSums::new(grid);
        for heading_deg in [-179.9, 0.0, 7.4, 179.9, 725.0] {
            for index in [0, grid.side - 1, grid.len() - grid.side, grid.len() - 1] {
                let centre = grid.centre_m(index);
                for offset in [-0.499, 0.499] {
                    let at_m = centre.map(|along| along + offset * grid.cell_m);
                    let stance = Stance { at_m, heading_rad: f64::to_radians(heading_deg) };
                    assert!(sums.index(&stance).is_some(), "{stance:?}");
                }
            }
        }
        let stance = Stance { at_m: grid.centre_m(0), heading_rad: 1.0 };
        assert!(sums.lower(&stance, 3.0) && !sums.lower(&stance, 3.0) && sums.is_less(&stance, 2.9));
        assert!(sums.close(&stance) && !sums.close(&stance) && !sums.is_less(&stance, 0.0));
        let far = Stance { at_m: [f64::INFINITY, f64::NEG_INFINITY], heading_rad: 0.0 };
        assert!(sums.index(&far).is_none() && !sums.lower(&far, 0.0));
    }

    #[test]
    fn a_way_out_of_the_window_leaves_the_search_unfinished() {
        // A corridor to the left of the rover, 2 m wide, with walls up to the border; the goal is behind its right end.
        let settings = NavigatorSettings::default();
        let found = |open: bool| {
            let is_free = |x: f64, y: f64| x.abs() < 1.2 && (y < 1.2 && (open || y > -4.0));
            let walls = |x: f64, y: f64| if is_free(x, y) { 0.0 } else { -0.5 };
            let stance = pose([0.0, 0.0], 0.0);
            let map = known_to(12.0, &stance, &HazardSettings::default(), walls);
            let ground = Ground::new(&map, VetoLimits::new(&map.settings, &settings));
            let route = Route::new(&ground, [0.0, 5.0], &settings);
            let moves = Moves::new(&ground, &settings);
            let start = Stance { at_m: [0.0, 0.0], heading_rad: -std::f64::consts::FRAC_PI_2 };
            Search::new(&moves, &route, start).run(usize::MAX)
        };
        assert!(matches!(found(true), Found::Unfinished));
        assert!(matches!(found(false), Found::Nearest(_)));
    }
}
