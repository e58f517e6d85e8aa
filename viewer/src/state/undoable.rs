//! The user's undoable changes, each with the data to undo it.
//!
//! A change is a pick, a removed or renamed target, a run, breakpoint, derived plot or note, a branch, or a change of the
//! draft settings or of the trial. Undo loses no computed result: it hides targets and runs, and redo shows them again.

use sightline_session::what_if::WhatIf;
use sightline_track::settings::Changes;

use crate::cache::StepKey;
use crate::state::rows::run_letter;

/// An undoable change by the user.
#[derive(Clone, Debug, PartialEq)]
pub enum UndoableChange {
    /// Designated a target.
    Picked {
        /// The target's number.
        target: usize,
    },
    /// Removed a target.
    RemovedTarget {
        /// The target's number.
        target: usize,
    },
    /// Renamed a target.
    Renamed {
        /// The target's number.
        target: usize,
        /// The former name.
        before: String,
        /// The new name.
        after: String,
    },
    /// Forked a run.
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
        /// Its condition, as an expression.
        expression: String,
        /// Whether it was enabled.
        is_on: bool,
    },
    /// Removed a derived plot.
    RemovedPlot {
        /// The plotted expression.
        expression: String,
        /// Its index among the plots.
        place: usize,
    },
    /// Removed a note.
    RemovedNote {
        /// The note's number.
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

/// The changes that can be undone, and those that can be redone.
#[derive(Default)]
pub struct Undo {
    pub(super) done: Vec<UndoableChange>,
    pub(super) undone: Vec<UndoableChange>,
    /// Incremented by every change, undo and redo.
    pub(super) changes: u64,
}

impl Undo {
    /// The change that undo reverts next, and the one that redo repeats next.
    pub fn ends(&self) -> (Option<&UndoableChange>, Option<&UndoableChange>) {
        (self.done.last(), self.undone.last())
    }

    /// Whether undo would revert the change with this number next.
    pub fn is_last(&self, change: u64) -> bool {
        self.changes == change && !self.done.is_empty()
    }

    /// Forgets the last change if `is_it` matches it, because the server refused it.
    pub(crate) fn forget_last(&mut self, is_it: impl Fn(&UndoableChange) -> bool) {
        if self.done.last().is_some_and(is_it) {
            self.done.pop();
            self.changes += 1;
        }
    }
}

impl UndoableChange {
    /// The change as a noun phrase.
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

    /// Whether `next` continues this change: the same setting or the same handle, dragged further.
    pub(super) fn is_continued_by(&self, next: &Self) -> bool {
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

/// The only key in which two sets of changes differ; `None` if they differ in none or several.
fn keys_changed<'a>(a: &'a Changes, b: &'a Changes) -> Option<&'a String> {
    let differs = |key: &&String| a.get(*key) != b.get(*key);
    let mut keys: Vec<&String> = a.keys().chain(b.keys()).filter(differs).collect();
    keys.sort();
    keys.dedup();
    if keys.len() == 1 { keys.pop() } else { None }
}
