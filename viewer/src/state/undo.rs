//! Undo and redo: a short memory of deeds, each with what takes it back.
//!
//! It covers picks, removed targets, runs, breakpoints, derived plots and notes, branches, the draft of settings and what is
//! tried. Nothing that was computed is lost by taking a deed back: targets and runs are hidden, and shown again.

use sightline_core::session::what_if::WhatIf;
use sightline_core::settings::Changes;

use super::{State, run_letter};
use crate::cache::StepKey;
use crate::net::Request;
use crate::net::why::WhyRequest;

/// How many deeds are remembered.
const REMEMBERED: usize = 100;

/// What a person did.
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
    /// Changed what is tried at a step.
    Tried {
        /// The step.
        of: StepKey,
        /// What was tried before.
        before: WhatIf,
        /// What is tried.
        after: WhatIf,
    },
}

/// The deeds that can be taken back, and those that were.
#[derive(Default)]
pub struct Undo {
    done: Vec<Deed>,
    undone: Vec<Deed>,
    /// Requests that take a deed back or do it again, and are no deeds themselves.
    silent: Vec<Request>,
    /// Conditions of breakpoints that are to be switched off when they are set.
    to_switch_off: Vec<String>,
    /// Raised by every deed, and by taking one back.
    changes: u64,
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

    /// A breakpoint with this condition is to be switched off when it is set.
    pub(super) fn switch_off(&mut self, expression: &str) {
        self.to_switch_off.push(expression.to_owned());
    }

    /// Whether a breakpoint that was set is to be switched off, which is asked once.
    pub(super) fn take_switch_off(&mut self, expression: &str) -> bool {
        let place = self.to_switch_off.iter().position(|waiting| waiting == expression);
        place.map(|place| self.to_switch_off.remove(place)).is_some()
    }

    /// Forgets the last deed, where it is this one: it was refused.
    pub(super) fn forget_last(&mut self, is_it: impl Fn(&Deed) -> bool) {
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
    fn goes_on_with(&self, next: &Self) -> bool {
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

    fn merged(self, next: Self) -> Self {
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

impl State {
    /// Remembers a deed; what was taken back before cannot be done again after it.
    pub(super) fn did(&mut self, deed: Deed) {
        self.undo.undone.clear();
        self.undo.changes += 1;
        match self.undo.done.pop() {
            Some(last) if last.goes_on_with(&deed) => self.undo.done.push(last.merged(deed)),
            last => {
                self.undo.done.extend(last);
                self.undo.done.push(deed);
            }
        }
        if self.undo.done.len() > REMEMBERED {
            self.undo.done.remove(0);
        }
    }

    /// Remembers a removal, and says so with a way to take it back.
    pub(super) fn did_remove(&mut self, what: &str, deed: Deed) {
        self.did(deed);
        self.messages.deed(format!("Removed {what}."), self.undo.changes);
    }

    /// Remembers a change of the draft.
    pub(super) fn drafted(&mut self, before: Changes) {
        if before != self.draft {
            let after = self.draft.clone();
            self.did(Deed::Drafted { before, after });
        }
    }

    /// Forgets all deeds: they belong to another session.
    pub(super) fn forget_deeds(&mut self) {
        self.undo = Undo::default();
    }

    /// Remembers a removal that was carried out, unless it takes something back.
    pub(super) fn removed(&mut self, request: &WhyRequest) {
        if self.forget_silent(request) {
            return;
        }
        if let WhyRequest::RemoveRun { target, run, .. } = *request {
            self.did_remove(&format!("run {}", run_letter(run)), Deed::RemovedRun { target, run });
        }
    }

    /// The same for a target.
    pub(super) fn removed_target(&mut self, request: &Request) {
        if let Request::RemoveTarget { target, .. } = *request
            && !self.take_silent(request)
        {
            self.did_remove(&format!("target {}", target + 1), Deed::RemovedTarget { target });
        }
    }

    pub(super) fn forget_silent(&mut self, request: &WhyRequest) -> bool {
        self.take_silent(&Request::Why(request.clone()))
    }

    /// Forgets that a request was to take something back: it was refused.
    pub(super) fn forget_refused(&mut self, request: &Request) {
        self.take_silent(request);
    }

    pub(super) fn take_silent(&mut self, request: &Request) -> bool {
        let place = self.undo.silent.iter().position(|silent| silent == request);
        place.map(|place| self.undo.silent.remove(place)).is_some()
    }

    pub(super) fn undo_last(&mut self) {
        match self.undo.done.pop() {
            Some(deed) => {
                self.undo.changes += 1;
                self.carry_over(&deed, false);
                self.messages.note(format!("Took {} back.  Ctrl+Y does it again.", deed.words()));
                self.undo.undone.push(deed);
            }
            None => self.messages.note("There is nothing to take back."),
        }
    }

    pub(super) fn redo_last(&mut self) {
        match self.undo.undone.pop() {
            Some(deed) => {
                self.undo.changes += 1;
                self.carry_over(&deed, true);
                self.messages.note(format!("Did {} again.", deed.words()));
                self.undo.done.push(deed);
            }
            None => self.messages.note("There is nothing to do again."),
        }
    }

    /// Does a deed again, or takes it back.
    fn carry_over(&mut self, deed: &Deed, again: bool) {
        let Some(session) = self.session.as_ref().map(|session| session.id.clone()) else { return };
        let target_request = |target: usize, shown: bool, session: String| {
            if shown {
                Request::Why(WhyRequest::RestoreTarget { session, target })
            } else {
                Request::RemoveTarget { session, target }
            }
        };
        let run_request = |target: usize, run: usize, shown: bool, session: String| {
            Request::Why(if shown {
                WhyRequest::RestoreRun { session, target, run }
            } else {
                WhyRequest::RemoveRun { session, target, run }
            })
        };
        let request = match deed {
            Deed::Picked { target } => target_request(*target, again, session),
            Deed::RemovedTarget { target } => target_request(*target, !again, session),
            Deed::Branched { target, run } => run_request(*target, *run, again, session),
            Deed::RemovedRun { target, run } => run_request(*target, *run, !again, session),
            Deed::RemovedBreakpoint { expression, is_on } => {
                if again {
                    self.unset(expression);
                } else {
                    self.set_again(expression, *is_on);
                }
                return;
            }
            Deed::RemovedPlot { expression, place } => {
                if again {
                    self.take_plot_out(expression);
                } else {
                    self.plot_again(expression, *place);
                }
                return;
            }
            Deed::RemovedNote { id, .. } if again => match self.removal_of_note(*id) {
                Some(request) => request,
                None => return,
            },
            Deed::RemovedNote { id, .. } => {
                // What brings a note back is no removal, so that nothing has to be kept silent.
                self.notes.removed = None;
                self.outbox.push(Request::RestoreNote { session, id: *id });
                return;
            }
            Deed::Drafted { before, after } => {
                self.draft = if again { after } else { before }.clone();
                return;
            }
            Deed::Tried { of, before, after } => {
                let what_if = if again { after } else { before }.clone();
                self.set_trial(of.clone(), what_if);
                return;
            }
        };
        self.undo.silent.push(request.clone());
        self.outbox.push(request);
    }
}
