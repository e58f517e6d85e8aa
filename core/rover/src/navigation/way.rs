//! A way to the goal: a search over positions and headings, which the rover can follow where the route is only a line.
//!
//! ```text
//! stance      position and heading; of stances in one square of `CELL_M` and one sector of `HEADING_DEG` the first one counts
//! motions     arcs of `STEP_M` ahead with `CURVATURES` times the tightest curvature, straight back, turns of `HEADING_DEG`
//! at the goal within `LAST_M`: one arc, backwards within `LAST_BACKWARDS_M`, or the turn that faces the goal and straight ahead to it
//! order       A*: Σ F Δs + `TURN_M_PER_RAD` Σ |Δψ| and T from there (F, T: `route.rs`)
//! ```
//! The first part of a way ends before its first turn of more than `PART_TURN_DEG` or motion backwards: arcs can follow it.
//!
//! Every motion is subject to the vetoes of [`super::navigator`], except that of unknown ground, because distant ground becomes known as
//! the rover approaches it. A gap between rocks that needs a stance between two squares may be missed.
//!
//! Frame: site, horizontal. Source: hybrid A* [Dolgov08].

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashSet};

use sightline_geometry::frames::Pose;

use crate::driving::motion::Motion;
use crate::driving::select_path::ArcNavigator;
use crate::hazards::goodness::GoodnessMap;

use super::ground::Ground;
use super::limits::VetoLimits;
use super::path::{Path, Stance};
use super::route::Route;
use super::settings::NavigatorSettings;

const CELL_M: f64 = 0.15;
const HEADING_DEG: f64 = 15.0;
const STEP_M: f64 = 0.3;
const CURVATURES: [f64; 5] = [0.0, -0.5, 0.5, -1.0, 1.0];
const TURN_M_PER_RAD: f64 = 1.0;
const LAST_M: f64 = 1.5;
const LAST_BACKWARDS_M: f64 = 0.5;
const PART_TURN_DEG: f64 = 10.0;
/// Distance of the points of a way, m.
const POINT_M: f64 = 0.05;
/// Stances from which the navigator searches on, before it does without a way.
pub(super) const STANCES_MAX: usize = 6000;

/// A pocket has fewer stances.
const POCKET_STANCES_MAX: usize = 4000;

/// A stance that was reached, and by which motion from which other one.
struct Node {
    stance: Stance,
    cost_m: f64,
    came: Option<(usize, Motion)>,
}

/// A way from a stance to a goal.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Way {
    motions: Vec<Motion>,
    /// Its line, site frame, m; a point every `POINT_M`.
    points: Vec<[f64; 2]>,
    /// Number of points of its first part, that of the start included.
    part: usize,
}

/// The motions of a way from a pose to a goal, x and y of the site frame, m; `None` if there is none.
pub fn way(
    map: &GoodnessMap,
    site_from_rover: &Pose,
    goal_m: [f64; 2],
    settings: &NavigatorSettings,
) -> Option<Vec<Motion>> {
    let ground = Ground::new(map, VetoLimits::new(&map.settings, settings));
    let route = Route::new(&ground, goal_m, settings);
    match Way::search(&route, Stance::of(site_from_rover), settings, usize::MAX) {
        Search::Found(way) => Some(way.motions),
        Search::Nearest(_) | Search::Unfinished => None,
    }
}

/// The outcome of a search.
pub(super) enum Search {
    /// A way to the goal.
    Found(Way),
    /// There is none: a way to the nearest stance to the goal that can be reached.
    Nearest(Way),
    /// The limit of stances was met first.
    Unfinished,
}

impl Way {
    /// Searches a way from a stance to the goal of a route, from at most `stances_max` stances on.
    pub(super) fn search(
        route: &Route<'_>,
        start: Stance,
        settings: &NavigatorSettings,
        stances_max: usize,
    ) -> Search {
        let moves = Moves { route, settings };
        let mut nodes = vec![Node { stance: start, cost_m: 0.0, came: None }];
        let (mut seen, mut nearest) = (HashSet::new(), (f64::INFINITY, 0));
        let mut open = BinaryHeap::from([(Reverse(0_u64), 0_usize)]);
        while let Some((_, index)) = open.pop() {
            let (stance, cost_m) = (nodes[index].stance, nodes[index].cost_m);
            if !seen.insert(square(&stance)) {
                continue;
            }
            let goal_m = distance_m(stance.at_m, route.goal_m);
            if goal_m < nearest.0 {
                nearest = (goal_m, index);
            }
            if let Some(last) = moves.last(&stance) {
                return Search::Found(Self::along(&nodes, index, last));
            }
            if seen.len() >= stances_max {
                return Search::Unfinished;
            }
            for motion in moves.motions() {
                let after = stance.after(&motion, 1.0);
                let Some(left_m) = route.cost_at(after.at_m) else { continue };
                if seen.contains(&square(&after)) {
                    continue;
                }
                let Some(cost) = moves.cost(&stance, &motion) else { continue };
                let cost_m = cost_m + cost;
                // Bits of numbers that are not negative are ordered as the numbers are.
                open.push((Reverse((cost_m + left_m).to_bits()), nodes.len()));
                nodes.push(Node { stance: after, cost_m, came: Some((index, motion)) });
            }
        }
        Search::Nearest(Self::along(&nodes, nearest.1, Vec::new()))
    }

    /// The way to a node and on by the last motions, which are in reverse order.
    fn along(nodes: &[Node], mut at: usize, last: Vec<Motion>) -> Self {
        let mut motions = last;
        while let Some((before, motion)) = nodes[at].came {
            motions.push(motion);
            at = before;
        }
        motions.reverse();
        Self::of(joined(motions), nodes[0].stance)
    }

    fn of(motions: Vec<Motion>, start: Stance) -> Self {
        let (mut points, mut stance, mut part) = (vec![start.at_m], start, None);
        for motion in &motions {
            if is_manoeuvre(motion) {
                part = part.or(Some(points.len()));
            }
            if let Motion::Arc { length_m, .. } = motion {
                let count = (length_m.abs() / POINT_M).ceil().max(1.0) as usize;
                points.extend((1..=count).map(|k| stance.after(motion, k as f64 / count as f64).at_m));
            }
            stance = stance.after(motion, 1.0);
        }
        Self { motions, part: part.unwrap_or(points.len()), points }
    }

    /// Its line, site frame, m.
    pub(super) fn points(&self) -> &[[f64; 2]] {
        &self.points
    }

    /// The end of its first part, site frame, m.
    pub(super) fn part_end(&self) -> [f64; 2] {
        self.points[self.part - 1]
    }

    /// Length of its first part, m.
    pub(super) fn part_m(&self) -> f64 {
        self.points[..self.part].windows(2).map(|pair| distance_m(pair[0], pair[1])).sum()
    }

    /// Its end, site frame, m.
    pub(super) fn end(&self) -> [f64; 2] {
        self.points[self.points.len() - 1]
    }

    /// Whether it begins with a turn or backwards.
    pub(super) fn begins_with_manoeuvre(&self) -> bool {
        self.part == 1
    }

    /// The turn or the motion backwards, of at most `step_m`, with which it begins; `None` where it begins ahead.
    pub(super) fn manoeuvre(&self, step_m: f64) -> Option<Motion> {
        let first = self.motions.first().filter(|_| self.part == 1)?;
        Some(match *first {
            Motion::Arc { length_m, curvature_per_m } => {
                Motion::Arc { length_m: length_m.clamp(-step_m, step_m), curvature_per_m }
            }
            turn @ Motion::Turn { .. } => turn,
        })
    }

    /// The point of its first part that is `length_m` after the one nearest to a position, or the end of that part.
    pub(super) fn ahead(&self, at_m: [f64; 2], length_m: f64) -> [f64; 2] {
        let part = &self.points[..self.part];
        let of = |index: &usize| distance_m(part[*index], at_m);
        let nearest = (0..part.len()).min_by(|a, b| of(a).total_cmp(&of(b))).unwrap_or(0);
        part[(nearest + (length_m / POINT_M).round() as usize).min(part.len() - 1)]
    }
}

fn is_manoeuvre(motion: &Motion) -> bool {
    match *motion {
        Motion::Arc { length_m, .. } => length_m < 0.0,
        Motion::Turn { angle_rad } => angle_rad.abs() > PART_TURN_DEG.to_radians(),
    }
}

fn distance_m(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// The squares from which a way can lead to the goal of a route, if bad ground encloses them; `None` if they are many or the rover is among
/// them. Ways are followed backwards from the goal.
pub(super) fn pocket(
    route: &Route<'_>,
    rover: &Stance,
    settings: &NavigatorSettings,
) -> Option<HashSet<[i64; 2]>> {
    let moves = Moves { route, settings };
    let sectors = (360.0 / HEADING_DEG).round() as u32;
    let at_goal =
        |k: u32| Stance { at_m: route.goal_m, heading_rad: (f64::from(k) * HEADING_DEG).to_radians() };
    let mut open: Vec<Stance> = (0..sectors).map(at_goal).filter(|stance| moves.is_free(stance)).collect();
    let mut seen: HashSet<[i64; 3]> = open.iter().map(square).collect();
    while let Some(stance) = open.pop() {
        if square_of(stance.at_m) == square_of(rover.at_m) || seen.len() >= POCKET_STANCES_MAX {
            return None;
        }
        for motion in moves.motions() {
            let before = stance.before(&motion);
            if seen.contains(&square(&before))
                || !moves.is_free(&before)
                || moves.cost(&before, &motion).is_none()
            {
                continue;
            }
            seen.insert(square(&before));
            open.push(before);
        }
    }
    Some(seen.into_iter().map(|[x, y, _]| [x, y]).collect())
}

struct Moves<'a> {
    route: &'a Route<'a>,
    settings: &'a NavigatorSettings,
}

impl Moves<'_> {
    /// The cost of a motion; `None` if it is vetoed.
    fn cost(&self, start: &Stance, motion: &Motion) -> Option<f64> {
        let path = Path::new(self.route.ground, start, motion, 0.0, self.settings);
        if path.is_bad() {
            return None;
        }
        Some(match *motion {
            Motion::Arc { length_m, .. } => length_m.abs() * self.route.mean_cost(path.centres()),
            Motion::Turn { angle_rad } => TURN_M_PER_RAD * angle_rad.abs(),
        })
    }

    /// Whether the rover stands on no bad cell.
    fn is_free(&self, stance: &Stance) -> bool {
        let ground = self.route.ground;
        [0.0, self.settings.reach_m].iter().all(|ahead| !ground.spot(stance.place([*ahead, 0.0])).is_bad())
    }

    fn motions(&self) -> impl Iterator<Item = Motion> {
        let max = self.settings.curvature_max_per_m;
        let arc = |length_m: f64, curvature_per_m: f64| Motion::Arc { length_m, curvature_per_m };
        let turns = [-1.0, 1.0].map(|side| Motion::Turn { angle_rad: side * HEADING_DEG.to_radians() });
        let arcs = CURVATURES.into_iter().map(move |part| arc(STEP_M, part * max));
        arcs.chain([arc(-STEP_M, 0.0)]).chain(turns)
    }

    /// The last motions in reverse order, if the goal is near and they are safe: one arc, or a turn and a straight line.
    fn last(&self, stance: &Stance) -> Option<Vec<Motion>> {
        let [ahead, right] = stance.seen(self.route.goal_m);
        let length_m = ahead.hypot(right);
        if length_m > LAST_M {
            return None;
        }
        let curvature_max_per_m = self.settings.curvature_max_per_m;
        let navigator = ArcNavigator { curvature_max_per_m, reverse_max_m: LAST_BACKWARDS_M };
        let arc = navigator.motion([ahead, right], f64::INFINITY);
        if matches!(arc, Motion::Arc { .. }) && self.cost(stance, &arc).is_some() {
            return Some(vec![arc]);
        }
        let turn = Motion::Turn { angle_rad: right.atan2(ahead) };
        let straight = Motion::Arc { length_m, curvature_per_m: 0.0 };
        self.cost(stance, &turn)?;
        self.cost(&stance.after(&turn, 1.0), &straight)?;
        Some(vec![straight, turn])
    }
}

/// Motions with those of one kind joined that follow each other.
fn joined(motions: Vec<Motion>) -> Vec<Motion> {
    let mut all: Vec<Motion> = Vec::with_capacity(motions.len());
    for motion in motions {
        match (all.last_mut(), motion) {
            (Some(Motion::Turn { angle_rad: before }), Motion::Turn { angle_rad }) => *before += angle_rad,
            (
                Some(Motion::Arc { length_m: before_m, curvature_per_m: before }),
                Motion::Arc { length_m, curvature_per_m },
            ) if *before == curvature_per_m && *before_m * length_m > 0.0 => *before_m += length_m,
            _ => all.push(motion),
        }
    }
    all
}

/// Square of a position, site frame, m.
pub(super) fn square_of(at_m: [f64; 2]) -> [i64; 2] {
    at_m.map(|along| (along / CELL_M).floor() as i64)
}

/// Square and sector of a stance.
fn square(stance: &Stance) -> [i64; 3] {
    let [x, y] = square_of(stance.at_m);
    let sectors = (360.0 / HEADING_DEG).round();
    let sector = (stance.heading_rad.to_degrees() / HEADING_DEG).round().rem_euclid(sectors);
    [x, y, sector as i64]
}
