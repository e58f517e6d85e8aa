//! What the page asks about single steps, and about taking removals back.

use sightline_session::counterfactual::wire::Question;
use sightline_session::view::SessionView;
use sightline_session::what_if::{Ghost, WhatIf};
use sightline_session::why::Explanation;

use crate::cache::StepKey;

/// What is asked.
#[derive(Clone, Debug, PartialEq)]
pub enum WhyRequest {
    /// Where a value came from.
    Explain {
        /// The step.
        of: StepKey,
        /// The value's name.
        value: String,
    },
    /// To try a change.
    WhatIf {
        /// The step.
        of: StepKey,
        /// The change.
        what_if: WhatIf,
    },
    /// What would have saved a step, as far as it is known.
    Question(StepKey),
    /// To look for what would have saved it.
    AskQuestion(StepKey),
    /// To stop looking.
    CancelQuestion(StepKey),
    /// To remove a run.
    RemoveRun {
        /// The session.
        session: String,
        /// The target's number.
        target: usize,
        /// The run's number.
        run: usize,
    },
    /// To take the removal of a run back.
    RestoreRun {
        /// The session.
        session: String,
        /// The target's number.
        target: usize,
        /// The run's number.
        run: usize,
    },
    /// To take the removal of a target back.
    RestoreTarget {
        /// The session.
        session: String,
        /// The target's number.
        target: usize,
    },
}

/// What the server answered.
pub enum WhyReply {
    /// Where a value came from.
    Explanation(Box<Explanation>),
    /// What came of a change.
    Ghost(Box<Ghost>),
    /// What would have saved a step.
    Question(Box<Question>),
    /// The session after a removal or its undoing.
    Session(Box<SessionView>),
}
