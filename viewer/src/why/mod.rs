//! Why a step came out as it did, what would have saved it, and what if: asked of the server and kept by step.
//!
//! A what-if belongs to one step. While it changes, at most one of its requests is under way; when the answer comes, the
//! newest change is asked for next, so that dragging never queues.

mod book;
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

/// What a person asks about a step.
#[derive(Clone, Debug, PartialEq)]
pub enum Ask {
    /// Where a value came from.
    Value {
        /// The step.
        step: usize,
        /// The value's name.
        value: String,
    },
    /// Where the value came from that was asked for before.
    Back,
    /// Where the selected value came from: the last one asked for, else the worst criterion.
    Selected,
    /// What would have saved the step.
    Saved,
    /// To stop looking for that.
    CancelSaved,
    /// To try a change in place of what is tried.
    Try(WhatIf),
    /// To try another value of a setting; none takes the change back.
    Change {
        /// The setting's name.
        key: String,
        /// The value.
        value: Option<Value>,
    },
    /// To try another place of the prediction.
    Displace(Option<Pixel>),
    /// Which scores are shown while a change is tried.
    Scores(Scores),
    /// To stop trying.
    Discard,
    /// To run from here as a branch with what is tried.
    Branch,
    /// To run from here as a branch with a change.
    BranchWith(WhatIf),
    /// To remove a run.
    RemoveRun {
        /// The target's number.
        target: usize,
        /// The run's number.
        run: usize,
    },
    /// To take the last deed back.
    Undo,
    /// To do it again.
    Redo,
}

/// Something that was asked of the server.
#[derive(Clone, Debug, PartialEq)]
pub enum Told<T> {
    /// It was asked.
    Waiting,
    /// It is here.
    Here(T),
    /// It was refused, with the server's sentence.
    Refused(String),
}

/// The part of the panel that a person asked for, which scrolls into view.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct InView {
    /// How often something was asked for; 0 before the first time.
    pub count: usize,
    /// Which one.
    pub part: Part,
}

/// A part of the panel that scrolls into view when a person asks for it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Part {
    /// The headline with its bullets.
    #[default]
    Card,
    /// The tree of a value.
    Tree,
    /// What would have saved the step.
    Saved,
}

impl InView {
    /// Something else was asked for.
    fn ask(&mut self, part: Part) {
        *self = Self { count: self.count + 1, part };
    }
}

/// What is asked and known.
#[derive(Default)]
pub struct Why {
    /// The values that were asked for, the last one shown.
    pub asked: Vec<(StepKey, String)>,
    /// Where they came from.
    pub trees: BTreeMap<(StepKey, String), Told<Explanation>>,
    /// What is tried.
    pub trial: Option<Trial>,
    /// What would have saved steps.
    pub questions: BTreeMap<StepKey, Told<Question>>,
    /// Which scores are shown while a change is tried.
    pub scores_shown: Scores,
    /// The texture of those of the change.
    pub scores: what_if::Shown,
    /// Whether they are looked at.
    pub(crate) wants_scores: bool,
    /// The change that the server tries now.
    pub(crate) trying: Option<(StepKey, WhatIf)>,
    /// Where the cursor was when it was followed last, or when a value was asked for.
    pub(crate) followed: Option<StepKey>,
    /// The part of the panel that was asked for last.
    pub(crate) in_view: InView,
    /// The steps whose question was looked for.
    looked_for: BTreeSet<StepKey>,
}

impl Why {
    /// Another session was opened: nothing of the last one is shown or followed any more.
    pub(crate) fn leave_session(&mut self) {
        self.asked.clear();
        (self.trial, self.trying, self.followed) = (None, None, None);
    }
}
