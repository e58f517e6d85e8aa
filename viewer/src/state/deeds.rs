//! The user's last changes (deeds), each with the data to undo it.
//!
//! It covers picks, removed and renamed targets, runs, breakpoints, derived plots and notes, branches, the draft of settings and what is
//! tried. Nothing that was computed is lost by taking a deed back: targets and runs are hidden, and shown again.

use sightline_session::what_if::WhatIf;
use sightline_track::settings::Changes;

use crate::cache::StepKey;
use crate::state::rows::run_letter;

/// A change by the user.
#[derive(Clone, Debug, PartialEq)]
pub enum Deed {
    /// Designated a target.
    Picked {
        /// Its number.
        target: usize,
    },
    /// Removed a target.
    RemovedTarget {
        /// Its number.
        target: usize,
    },
    /// Renamed a target.
    Renamed {
        /// Its number.
        target: usize,
        /// Its former name.
        before: String,
        /// Its new name.
        after: String,
    },
    /// Left a run.
    Branched {
        /// The target's number.
        target: usize,
        /// The new run's number.
        run: usize,
    },
    /// Removed a run.
    RemovedRun {
        /// The target's number.
        target: usize,
        /// The run's number.
        run: usize,
    },
    /// Removed a breakpoint.
    RemovedBreakpoint {
        /// Its condition.
        expression: String,
        /// Whether it was on.
        is_on: bool,
    },
    /// Removed a derived plot.
    RemovedPlot {
        /// Its expression.
        expression: String,
        /// Its place among the plots.
        place: usize,
    },
    /// Removed a note.
    RemovedNote {
        /// Its number.
        id: u64,
        /// The step to which it is pinned.
        step: usize,
    },
    /// Changed the draft of settings.
    Drafted {
        /// The draft before.
        before: Changes,
        /// The draft after.
        after: Changes,
    },
    /// Changed the trial at a step.
    Tried {
        /// The step.
        of: StepKey,
        /// The trial before.
        before: WhatIf,
        /// The trial after.
        after: WhatIf,
    },
}

/// The deeds that can be taken back, and those that were.
#[derive(Default)]
pub struct Undo {
    pub(super) done: Vec<Deed>,
    pub(super) undone: Vec<Deed>,
    /// Raised by every deed, and by taking one back.
    pub(super) changes: u64,
}

impl Undo {
    /// The last deed, and the last that was taken back.
    pub fn ends(&self) -> (Option<&Deed>, Option<&Deed>) {
        (self.done.last(), self.undone.last())
    }

    /// Whether the deed with this number is the one that would be taken back next.
    pub fn is_last(&self, deed: u64) -> bool {
        self.changes == deed && !self.done.is_empty()
    }

    /// Forgets the last deed, where it is this one: it was refused.
    pub(crate) fn forget_last(&mut self, is_it: impl Fn(&Deed) -> bool) {
        if self.done.last().is_some_and(is_it) {
            self.done.pop();
            self.changes += 1;
        }
    }
}

impl Deed {
    /// The deed in words.
    pub fn words(&self) -> String {
        match self {
            Self::Picked { target } => format!("the pick of target {}", target + 1),
            Self::RemovedTarget { target } => format!("the removal of target {}", target + 1),
            Self::Renamed { target, .. } => format!("the name of target {}", target + 1),
            Self::Branched { run, .. } => format!("the branch {}", run_letter(*run)),
            Self::RemovedRun { run, .. } => format!("the removal of run {}", run_letter(*run)),
            Self::RemovedBreakpoint { expression, .. } => {
                format!("the removal of the breakpoint `{expression}`")
            }
            Self::RemovedPlot { expression, .. } => format!("the removal of the plot `{expression}`"),
            Self::RemovedNote { step, .. } => format!("the removal of the note at step {step}"),
            Self::Drafted { .. } => "the change of the draft".to_owned(),
            Self::Tried { .. } => "the what-if".to_owned(),
        }
    }

    /// Whether `next` only goes on with this deed: the same setting dragged further, the same handle moved on.
    pub(super) fn goes_on_with(&self, next: &Self) -> bool {
        match (self, next) {
            (Self::Drafted { before, after }, Self::Drafted { after: later, .. }) => {
                keys_changed(before, after).is_some_and(|key| keys_changed(after, later) == Some(key))
            }
            (Self::Tried { of, before, after }, Self::Tried { of: same, after: later, .. }) => {
                let what = |a: &WhatIf, b: &WhatIf| {
                    (keys_changed(&a.settings, &b.settings).cloned(), a.prediction_px != b.prediction_px)
                };
                of == same && !later.is_empty() && what(before, after) == what(after, later)
            }
            _ => false,
        }
    }

    pub(super) fn merged(self, next: Self) -> Self {
        match (self, next) {
            (Self::Drafted { before, .. }, Self::Drafted { after, .. }) => Self::Drafted { before, after },
            (Self::Tried { of, before, .. }, Self::Tried { after, .. }) => Self::Tried { of, before, after },
            (_, next) => next,
        }
    }
}

/// The one key in which two sets of changes differ.
fn keys_changed<'a>(a: &'a Changes, b: &'a Changes) -> Option<&'a String> {
    let differs = |key: &&String| a.get(*key) != b.get(*key);
    let mut keys: Vec<&String> = a.keys().chain(b.keys()).filter(differs).collect();
    keys.dedup();
    keys.sort();
    keys.dedup();
    if keys.len() == 1 { keys.pop() } else { None }
}
