//! The messages about counterfactuals that server and viewer exchange.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::Answer;

/// The state of the search for a counterfactual.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum QuestionState {
    /// It was not requested.
    Unasked,
    /// It waits for other searches.
    Waiting,
    /// It is in progress.
    Running,
    /// It is complete.
    Done,
    /// It was cancelled; the findings so far are kept.
    Cancelled,
    /// It failed.
    Failed,
}

impl QuestionState {
    /// Whether no search is waiting or in progress.
    pub const fn is_over(self) -> bool {
        !matches!(self, Self::Waiting | Self::Running)
    }
}

/// A counterfactual of a step: the state of the search and the answer so far.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Question {
    /// The session.
    pub session: String,
    /// The target's number.
    pub target: usize,
    /// The run's number.
    pub run: usize,
    /// The step.
    pub step: usize,
    /// The state of the search.
    pub state: QuestionState,
    /// The answer so far; null before the search begins.
    pub answer: Option<Answer>,
    /// Why it failed, as one sentence; null otherwise.
    pub problem: Option<String>,
}
