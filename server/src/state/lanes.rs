//! The lanes of requests: how many are processed concurrently, and how many may wait.

use super::AppState;
use crate::jobs::Lane;
use crate::limits::{Limit, SharedLimits};

/// Number of concurrent counterfactual questions: each tries many steps, and each step uses all processors.
const ANSWERS_AT_A_TIME: usize = 1;

/// The lanes of requests; runs, studies and trackability maps have their own.
pub(super) struct Lanes {
    designations: Lane,
    pictures: Lane,
    queries: Lane,
    exports: Lane,
    tries: Lane,
    answers: Lane,
}

/// A lane with these limits.
pub(super) fn lane(at_a_time: &Limit, waiting: &Limit) -> Lane {
    Lane::new(at_a_time.count(), waiting.count())
}

impl Lanes {
    pub(super) fn new(limits: &SharedLimits) -> Self {
        let interactive =
            || lane(&limits.designations_at_a_time, &limits.designations_waiting).with_time_limit(limits);
        Self {
            designations: interactive(),
            pictures: lane(&limits.images_at_a_time, &limits.images_waiting),
            queries: lane(&limits.queries_at_a_time, &limits.queries_waiting),
            exports: lane(&limits.exports_at_a_time, &limits.exports_waiting),
            tries: interactive(),
            answers: Lane::new(ANSWERS_AT_A_TIME, limits.runs_waiting.count()),
        }
    }
}

impl AppState {
    /// The lane for designations.
    pub(crate) fn designations(&self) -> &Lane {
        &self.0.lanes.designations
    }

    /// The lane for reading images.
    pub(crate) fn pictures(&self) -> &Lane {
        &self.0.lanes.pictures
    }

    /// The lane for queries over all steps.
    pub(crate) fn queries(&self) -> &Lane {
        &self.0.lanes.queries
    }

    /// The lane for exports.
    pub(crate) fn exports(&self) -> &Lane {
        &self.0.lanes.exports
    }

    /// The lane for trials of single steps.
    pub(crate) fn tries(&self) -> &Lane {
        &self.0.lanes.tries
    }

    /// The lane for counterfactual questions.
    pub(crate) fn answers(&self) -> &Lane {
        &self.0.lanes.answers
    }
}
