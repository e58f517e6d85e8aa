//! Explanations of a step, its counterfactuals, and trials (what-if): requested from the server and stored by step.
//!
//! A trial belongs to one step. At most one of its requests is pending; when the reply arrives, the newest change is
//! requested next, so that a drag never fills a queue.

mod step_context;
mod follow;
pub(crate) mod panel;
mod update;

use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;
use sightline_geometry::frames::Pixel;
use sightline_session::counterfactual::wire::Question;
use sightline_session::what_if::WhatIf;
use sightline_session::why::Explanation;

use crate::cache::StepKey;
use crate::what_if;
use crate::what_if::{Scores, Trial};

/// A command about a step.
#[derive(Clone, Debug, PartialEq)]
pub enum WhyCommand {
    /// Explains a value.
    Value {
        /// The step.
        step: usize,
        /// The value's name.
        value: String,
    },
    /// Returns to the previously explained value.
    Back,
    /// Explains the last requested value, otherwise the gate with the smallest margin.
    Selected,
    /// Searches for counterfactuals: changes that would have saved the step.
    Saved,
    /// Cancels that search.
    CancelSaved,
    /// Replaces the trial.
    Try(WhatIf),
    /// Tries another value of a setting; `None` reverts it.
    Change {
        /// The setting's name.
        key: String,
        /// The value.
        value: Option<Value>,
    },
    /// Tries another position of the prediction; `None` reverts it.
    Displace(Option<Pixel>),
    /// Selects the scores that are shown during a trial.
    Scores(Scores),
    /// Discards the trial.
    Discard,
    /// Forks the run at this step with the changes of the trial.
    Branch,
    /// Forks the run at this step with these changes.
    BranchWith(WhatIf),
    /// Removes a run.
    RemoveRun {
        /// The target's number.
        target: usize,
        /// The run's number.
        run: usize,
    },
    /// Undoes the last change.
    Undo,
    /// Redoes the change undone last.
    Redo,
}

/// A value requested from the server.
#[derive(Clone, Debug, PartialEq)]
pub enum Remote<T> {
    /// The request is pending.
    Pending,
    /// The value was received.
    Received(T),
    /// The request was refused; the server's sentence.
    Refused(String),
}

/// The part of the panel that the user requested last and that is scrolled into view.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct ScrollRequest {
    /// Number of requests so far; 0 before the first.
    pub count: usize,
    /// The requested part.
    pub part: WhySection,
}

/// A part of the panel that a request scrolls into view.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum WhySection {
    /// The headline with its bullets.
    #[default]
    Card,
    /// The explanation of a value.
    Tree,
    /// The counterfactuals of the step.
    Saved,
}

impl ScrollRequest {
    /// Requests another part.
    fn request(&mut self, part: WhySection) {
        *self = Self { count: self.count + 1, part };
    }
}

/// State of the explanations, counterfactuals and the trial.
#[derive(Default)]
pub struct Why {
    /// The explained values, newest last; the newest is shown.
    pub history: Vec<(StepKey, String)>,
    /// The explanations by step and value.
    pub trees: BTreeMap<(StepKey, String), Remote<Explanation>>,
    /// The current trial.
    pub trial: Option<Trial>,
    /// The counterfactuals by step.
    pub questions: BTreeMap<StepKey, Remote<Question>>,
    /// The scores that are shown during a trial.
    pub scores_shown: Scores,
    /// The texture of the trial's scores.
    pub scores: what_if::ScoresTexture,
    /// Whether the trial's scores are visible.
    pub(crate) wants_scores: bool,
    /// The change that the server is computing.
    pub(crate) trying: Option<(StepKey, WhatIf)>,
    /// The cursor's step when it was last followed, or when a value was requested.
    pub(crate) followed: Option<StepKey>,
    /// The part of the panel that was requested last.
    pub(crate) scroll_request: ScrollRequest,
    /// The steps for which the server was asked for existing counterfactuals.
    checked_questions: BTreeSet<StepKey>,
}

impl Why {
    /// Clears the explanations and the trial of the previous session.
    pub(crate) fn leave_session(&mut self) {
        self.history.clear();
        (self.trial, self.trying, self.followed) = (None, None, None);
    }
}
