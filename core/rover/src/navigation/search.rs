//! The search for a way to the goal, over positions and headings.
//!
//! ```text
//! stance   position and heading; of stances in one square of `CELL_M` and one sector of `HEADING_DEG` the one with the least sum counts
//! motions  those of `moves.rs`, at last one that ends at the goal
//! order    A*: sum of the cost so far and T from there (cost: `moves.rs`, T: `route.rs`)
//! pocket   the search backwards from a place ends after few stances: bad ground encloses it
//! ```
//! Every motion is subject to the vetoes of [`super::navigator`], except that of unknown ground, because distant ground becomes known as
//! the rover approaches it. A gap between rocks that needs a stance between two squares may be missed.
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
use super::moves::{HEADING_DEG, Moves};
use super::path::Stance;
use super::route::Route;
use super::settings::NavigatorSettings;
use super::way::{Way, distance_m};

const CELL_M: f64 = 0.15;
/// Headings at a place from which ways to it are followed backwards.
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

/// The outcome of a search.
pub(super) enum Found {
    /// A way to the goal.
    Goal(Way),
    /// There is none: a way to the nearest stance to the goal that can be reached.
    Nearest(Way),
    /// The limit of stances was met first.
    Unfinished,
}

/// A stance that was reached, and by which motion from which other one.
struct Node {
    stance: Stance,
    cost_m: f64,
    came: Option<(usize, Motion)>,
}

/// A search under way.
pub(super) struct Search<'a> {
    moves: &'a Moves<'a>,
    route: &'a Route<'a>,
    nodes: Vec<Node>,
    /// Bits of the sum, and the node. Bits of numbers that are not negative are ordered as the numbers are.
    open: BinaryHeap<(Reverse<u64>, usize)>,
    least: LeastSums,
    /// Stances from which it has searched on.
    count: usize,
    /// Distance from the goal, m, and the node.
    nearest: (f64, usize),
}

impl<'a> Search<'a> {
    /// A search from a stance to the goal of a route.
    pub(super) fn new(moves: &'a Moves<'a>, route: &'a Route<'a>, start: Stance) -> Self {
        Self {
            moves,
            route,
            nodes: vec![Node { stance: start, cost_m: 0.0, came: None }],
            open: BinaryHeap::from([(Reverse(0), 0)]),
            least: LeastSums::new(&route.ground.map.grid),
            count: 0,
            nearest: (f64::INFINITY, 0),
        }
    }

    /// Searches until the goal is found or `stances_max` stances are examined.
    pub(super) fn run(mut self, stances_max: usize) -> Found {
        while self.count < stances_max {
            let Some((_, index)) = self.open.pop() else {
                return Found::Nearest(self.way(self.nearest.1, Vec::new()));
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

    fn search_on(&mut self, index: usize) {
        let Node { stance, cost_m, .. } = self.nodes[index];
        let start = self.moves.start(stance);
        for footprint in self.moves.footprints() {
            let after = start.after(footprint);
            let Some(left_m) = self.route.cost_at(after.at_m) else { continue };
            // Good ground is the least that a motion costs.
            if !self.least.is_less(&after, cost_m + footprint.cost_m(1.0) + left_m) {
                continue;
            }
            let Some(cost) = self.moves.cost(&start, footprint, self.route) else { continue };
            let cost_m = cost_m + cost;
            let sum_m = cost_m + left_m;
            if self.least.lower(&after, sum_m) {
                self.open.push((Reverse(sum_m.to_bits()), self.nodes.len()));
                self.nodes.push(Node { stance: after, cost_m, came: Some((index, footprint.motion)) });
            }
        }
    }

    /// The way to a node and on by the last motions, which are in reverse order.
    fn way(&self, mut at: usize, last: Vec<Motion>) -> Way {
        let mut motions = last;
        while let Some((before, motion)) = self.nodes[at].came {
            motions.push(motion);
            at = before;
        }
        motions.reverse();
        Way::of(motions, self.nodes[0].stance)
    }
}

/// The least sum with which the search has met each square and sector.
struct LeastSums {
    first: [i64; 2],
    side: usize,
    /// m; infinite where it has met none, negative where it has searched on.
    sums_m: Vec<f64>,
}

impl LeastSums {
    fn new(grid: &Grid) -> Self {
        let first = square_of(grid.centre_m(0));
        let last = square_of(grid.centre_m(grid.len() - 1));
        // A square more on either side: a window may begin within one.
        let side = (last[0] - first[0]).max(last[1] - first[1]) as usize + 3;
        let count = side * side * sector_count();
        Self { first: first.map(|number| number - 1), side, sums_m: vec![f64::INFINITY; count] }
    }

    fn index(&self, stance: &Stance) -> Option<usize> {
        let [x, y, sector] = square(stance);
        let within = |number: i64, axis: usize| {
            usize::try_from(number - self.first[axis]).ok().filter(|number| *number < self.side)
        };
        Some((within(x, 0)? * self.side + within(y, 1)?) * sector_count() + sector as usize)
    }

    fn is_less(&self, stance: &Stance, sum_m: f64) -> bool {
        self.index(stance).is_some_and(|index| sum_m < self.sums_m[index])
    }

    /// Notes a sum; whether it is less than all before.
    fn lower(&mut self, stance: &Stance, sum_m: f64) -> bool {
        let Some(index) = self.index(stance).filter(|index| sum_m < self.sums_m[*index]) else {
            return false;
        };
        self.sums_m[index] = sum_m;
        true
    }

    /// Notes that the search goes on from a stance; whether it has not done so from another one there.
    fn close(&mut self, stance: &Stance) -> bool {
        let Some(index) = self.index(stance) else { return true };
        std::mem::replace(&mut self.sums_m[index], -1.0) >= 0.0
    }
}

/// The squares from which a way can lead to a place, x and y of the site frame, m, if bad ground encloses them; `None` if they have
/// `stances_max` or more stances, or if the rover is among them. Ways are followed backwards from the place.
pub(super) fn pocket(
    moves: &Moves<'_>,
    at_m: [f64; 2],
    rover_m: [f64; 2],
    stances_max: usize,
) -> Option<HashSet<[i64; 2]>> {
    let heading_rad = |k: u32| std::f64::consts::TAU * f64::from(k) / f64::from(POCKET_HEADINGS);
    let at_place = |k: u32| Stance { at_m, heading_rad: heading_rad(k) };
    let mut open: Vec<Stance> =
        (0..POCKET_HEADINGS).map(at_place).filter(|stance| moves.is_free(stance)).collect();
    let mut seen: HashSet<[i64; 3]> = open.iter().map(square).collect();
    while let Some(stance) = open.pop() {
        if square_of(stance.at_m) == square_of(rover_m) || seen.len() >= stances_max {
            return None;
        }
        for footprint in moves.footprints() {
            let before = stance.before(&footprint.motion);
            let is_new = !seen.contains(&square(&before)) && moves.is_free(&before);
            if is_new && moves.is_safe(&moves.start(before), footprint) {
                seen.insert(square(&before));
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
fn square(stance: &Stance) -> [i64; 3] {
    let [x, y] = square_of(stance.at_m);
    let sector = (stance.heading_rad.to_degrees() / HEADING_DEG).round().rem_euclid(sector_count() as f64);
    [x, y, sector as i64]
}

fn sector_count() -> usize {
    (360.0 / HEADING_DEG) as usize
}
