//! The decision of a navigator: every considered path, the reasons of the vetoes, and the chosen path.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::motion::Motion;
use crate::hazards::goodness::HazardTerm;
use crate::navigation::stand::BlockedGoal;

/// Terms of a path's vote, each from 0 (worst) to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PathTerms {
    /// Goodness of the ground under the path.
    pub hazard: f64,
    /// Agreement of the heading at its end with the route to the goal.
    pub goal: f64,
    /// Agreement of its curvature with that of the previous motion.
    pub steer: f64,
}

/// Why a path must not be driven: its first failing cell.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = PathVeto)]
pub struct Veto {
    /// Centre of the cell, x and y of the site frame, m.
    pub in_site_m: [f64; 2],
    /// Distance of the rover's origin along the path at which the footprint meets the cell, m; 0 for a turn.
    pub along_m: f64,
    /// The failing term.
    pub term: HazardTerm,
    /// Value of the term: deg, m, m; for `unknown` the fraction of unknown cells under the path.
    pub value: f64,
    /// The exceeded limit, in the same unit.
    pub limit: f64,
}

/// A considered path.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = PathCandidate)]
pub struct Candidate {
    /// The motion, as it would be driven.
    pub motion: Motion,
    /// Length over which the hazard was evaluated, m.
    pub evaluated_m: f64,
    /// The terms of its vote.
    pub terms: PathTerms,
    /// Weighted sum of the terms.
    pub vote: f64,
    /// Fraction of unknown cells under the driven part, 0 to 1.
    pub unknown_share: f64,
    /// Why the path must not be driven; null if it may be driven.
    pub veto: Option<Veto>,
}

/// The decision at a stop.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PathChoice {
    /// Every considered path.
    pub candidates: Vec<Candidate>,
    /// Index of the chosen one; null if no path is safe.
    pub chosen: Option<usize>,
    /// Route to the goal over the map, x and y of the site frame, m; empty without a map.
    pub route_m: Vec<[f64; 2]>,
    /// Why the rover cannot reach its goal and drives to the nearest reachable place; null if it can reach the goal.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub blocked_goal: Option<BlockedGoal>,
}

impl Candidate {
    /// A path without hazard evaluation.
    pub(super) fn unjudged(motion: Motion) -> Self {
        let evaluated_m = match motion {
            Motion::Arc { length_m, .. } => length_m.abs(),
            Motion::Turn { .. } => 0.0,
        };
        let terms = PathTerms { hazard: 1.0, goal: 1.0, steer: 1.0 };
        Self { motion, evaluated_m, terms, vote: 1.0, unknown_share: 0.0, veto: None }
    }
}

impl PathChoice {
    /// The choice of a single path.
    pub(crate) fn only(candidate: Candidate) -> Self {
        Self { candidates: vec![candidate], chosen: Some(0), ..Self::default() }
    }

    /// The chosen motion; `None` if no path is safe.
    pub fn motion(&self) -> Option<Motion> {
        Some(self.candidates.get(self.chosen?)?.motion)
    }

    /// Why the rover stays in spite of safe paths: it cannot reach its goal, and is as near as possible.
    pub fn stays_for(&self) -> Option<&BlockedGoal> {
        let is_free = self.candidates.iter().any(|candidate| candidate.veto.is_none());
        self.blocked_goal.as_ref().filter(|_| self.chosen.is_none() && is_free)
    }

    /// Number of vetoed paths.
    pub fn vetoed_count(&self) -> usize {
        self.candidates.iter().filter(|candidate| candidate.veto.is_some()).count()
    }
}
