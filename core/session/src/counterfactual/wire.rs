//! What page and server say to each other about counterfactuals.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::Answer;

/// How a question stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum QuestionState {
    /// Nobody has asked.
    Unasked,
    /// Others come first.
    Waiting,
    /// It is being answered.
    Running,
    /// It is answered.
    Done,
    /// It was cancelled; what was found is kept.
    Cancelled,
    /// It could not go on.
    Failed,
}

impl QuestionState {
    /// Whether nothing more comes.
    pub const fn is_over(self) -> bool {
        !matches!(self, Self::Waiting | Self::Running)
    }
}

/// What would have saved a step: the question with its answer so far.
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
    /// How it stands.
    pub state: QuestionState,
    /// What was found so far; null before it was begun.
    pub answer: Option<Answer>,
    /// Why it failed, as one sentence.
    pub problem: Option<String>,
}
