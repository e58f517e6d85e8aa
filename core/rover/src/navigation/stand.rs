//! The aim of the rover: its goal, or the nearest place to it where it can stand and that is not enclosed.
//!
//! The rover can stand where, for one of `HEADINGS` directions, the disc at its origin and the leading one are on no bad
//! cell (`path.rs`). Unknown cells count as good: they become known on the way there. A place is enclosed if closed bad
//! ground separates it from the rover (`reachable.rs`), or if the way to it cannot begin outside a small pocket
//! (`search.rs`).
//!
//! Frame: site, m.

use std::collections::HashSet;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::hazards::goodness::HazardTerm;

use super::ground::{Part, Spot};
use super::moves::Moves;
use super::path::Stance;
use super::reachable::Reachable;
use super::search::{pocket, square_of};

const HEADINGS: u32 = 24;
/// Largest distance from the goal at which other places are searched, m.
const SEARCH_M: f64 = 3.0;
/// The rover stays if it is no more than this farther from the goal than the nearest place, m: on the other side of a rock
/// some place always appears slightly nearer.
const NEAR_M: f64 = 0.3;
/// Largest number of excluded pockets.
const POCKETS_MAX: usize = 4;
/// A place is in a pocket if ways to it lead from fewer stances than this.
const STANCES_MIN: usize = 100;

/// A goal that the rover cannot reach according to its map.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct BlockedGoal {
    /// The bad ground at the goal; null if the goal is on good ground that bad ground encloses.
    pub ground: Option<BadGround>,
    /// The place that the rover heads for instead, x and y of the site frame, m; null if there is none within 3 m.
    pub nearest_m: Option<[f64; 2]>,
    /// Its distance from the goal, m; null without one.
    pub nearest_from_goal_m: Option<f64>,
}

/// Ground beyond a limit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct BadGround {
    /// The term.
    pub term: HazardTerm,
    /// Value: deg, m, m.
    pub value: f64,
    /// Limit, in the same unit.
    pub limit: f64,
}

/// The place that the rover heads for.
#[derive(Clone)]
pub(super) struct Aim<'a> {
    moves: &'a Moves<'a>,
    rover: Stance,
    goal_m: [f64; 2],
    reachable: Reachable,
    pockets: Vec<HashSet<[i64; 2]>>,
    /// The place, site frame, m.
    pub(super) at_m: [f64; 2],
    /// Why it is not the goal; `None` if it is.
    pub(super) blocked: Option<BlockedGoal>,
}

impl<'a> Aim<'a> {
    /// The goal, or the nearest place to it where the rover can stand and that is not enclosed; the goal if there is none.
    /// Positions: site frame, m.
    pub(super) fn of(moves: &'a Moves<'a>, rover: Stance, goal_m: [f64; 2]) -> Self {
        let (reachable, pockets) = (Reachable::new(moves.ground, rover.at_m), Vec::new());
        let aim = Self { moves, rover, goal_m, reachable, pockets, at_m: goal_m, blocked: None };
        let bad = aim.bad_spot(goal_m);
        let cell = moves.ground.map.grid.index_at(goal_m);
        let is_enclosed = cell.is_some_and(|index| !aim.reachable.contains(index));
        if bad.is_some() || is_enclosed { aim.elsewhere(bad) } else { aim }
    }

    /// The nearest other place, outside a pocket that encloses this one; `None` if there is none.
    pub(super) fn outside(&self, pocket: &HashSet<[i64; 2]>) -> Option<Self> {
        let mut other = self.clone();
        other.pockets.push(pocket.clone());
        let bad = self.bad_spot(self.goal_m);
        let other = other.elsewhere(bad);
        let is_new = other.blocked.is_some_and(|blocked| blocked.nearest_m.is_some());
        (is_new && other.pockets.len() <= POCKETS_MAX).then_some(other)
    }

    /// Replaces the place by the nearest one that a way leads to.
    pub(super) fn replaced_by(self, at_m: [f64; 2]) -> Self {
        let from_goal_m = (at_m[0] - self.goal_m[0]).hypot(at_m[1] - self.goal_m[1]);
        let ground = self.blocked.and_then(|blocked| blocked.ground);
        let blocked = BlockedGoal { ground, nearest_m: Some(at_m), nearest_from_goal_m: Some(from_goal_m) };
        Self { at_m, blocked: Some(blocked), ..self }
    }

    fn elsewhere(self, bad: Option<Spot>) -> Self {
        let grid = &self.moves.ground.map.grid;
        let distance = |at: [f64; 2]| (at[0] - self.goal_m[0]).hypot(at[1] - self.goal_m[1]);
        let is_enclosed = |at: [f64; 2]| self.pockets.iter().any(|pocket| pocket.contains(&square_of(at)));
        let mut places: Vec<[f64; 2]> = (0..grid.len())
            .filter(|index| self.reachable.contains(*index))
            .map(|index| grid.centre_m(index))
            .filter(|at| distance(*at) <= SEARCH_M && !is_enclosed(*at))
            .collect();
        places.sort_by(|a, b| distance(*a).total_cmp(&distance(*b)));
        let is_open = |at: &[f64; 2]| {
            self.bad_spot(*at).is_none() && pocket(self.moves, *at, &self.rover, STANCES_MIN).is_none()
        };
        let nearest_m = places.into_iter().find(is_open);
        let limits = &self.moves.ground.limits;
        let ground = bad.and_then(|spot| {
            let term = limits.exceeded(&spot.cell)?;
            Some(BadGround { term, value: spot.cell.value(term), limit: limits.of(term) })
        });
        let blocked = BlockedGoal { ground, nearest_m, nearest_from_goal_m: nearest_m.map(distance) };
        Self { at_m: nearest_m.unwrap_or(self.goal_m), blocked: Some(blocked), ..self }
    }

    /// The bad ground that prevents the rover from standing at a place; `None` if there is none.
    fn bad_spot(&self, at_m: [f64; 2]) -> Option<Spot> {
        let centre = self.moves.ground.spot(at_m, Part::Origin);
        if centre.is_bad() {
            return Some(centre);
        }
        let mut last = None;
        for number in 0..HEADINGS {
            let heading_rad = std::f64::consts::TAU * f64::from(number) / f64::from(HEADINGS);
            let ahead = self
                .moves
                .ground
                .spot(Stance { at_m, heading_rad }.place([self.moves.reach_m(), 0.0]), Part::End);
            if !ahead.is_bad() {
                return None;
            }
            last = Some(ahead);
        }
        last
    }
}

impl BlockedGoal {
    /// Why the goal cannot be reached.
    pub fn why(&self) -> String {
        match self.ground {
            Some(BadGround { term, value, limit }) => format!(
                "the rover cannot stand at its goal, where the {} is {}, limit {}",
                term.word(),
                term.text(value),
                term.text(limit)
            ),
            None => "bad ground encloses the goal".to_owned(),
        }
    }

    /// Whether a rover at this distance from the goal, m, is as near as possible.
    pub(super) fn is_near(&self, from_goal_m: f64) -> bool {
        self.nearest_from_goal_m.is_some_and(|nearest_m| from_goal_m <= nearest_m + NEAR_M)
    }

    /// Why the rover stays.
    pub fn sentence(&self) -> String {
        let why = self.why();
        match self.nearest_from_goal_m {
            Some(from_goal_m) => format!(
                "{why}; the nearest place that it can reach is {from_goal_m:.2} m from the goal, and it is at most {NEAR_M} m farther away"
            ),
            None => format!("{why}; no place within {SEARCH_M:.0} m of the goal is safe"),
        }
    }
}
