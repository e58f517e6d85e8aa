//! Undo and redo: takes deeds back, and does them again.

use sightline_track::settings::Changes;

use crate::net::request::Request;
use crate::net::why::WhyRequest;
use crate::state::deeds::{Deed, Undo};
use crate::state::{State, run_letter};

/// How many deeds are remembered.
const REMEMBERED: usize = 100;

impl State {
    /// Remembers a deed; what was taken back before cannot be done again after it.
    pub(crate) fn did(&mut self, deed: Deed) {
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
    pub(crate) fn did_remove(&mut self, what: &str, deed: Deed) {
        self.did(deed);
        self.messages.deed(format!("Removed {what}."), self.undo.changes);
    }

    /// Remembers a change of the draft.
    pub(crate) fn drafted(&mut self, before: Changes) {
        if before != self.draft {
            let after = self.draft.clone();
            self.did(Deed::Drafted { before, after });
        }
    }

    /// Forgets all deeds: they belong to another session.
    pub(crate) fn forget_deeds(&mut self) {
        self.undo = Undo::default();
    }

    /// Remembers a removal that was carried out, unless it takes something back.
    pub(crate) fn removed(&mut self, request: &WhyRequest) {
        if self.forget_silent(request) {
            return;
        }
        if let WhyRequest::RemoveRun { target, run, .. } = *request {
            self.did_remove(&format!("run {}", run_letter(run)), Deed::RemovedRun { target, run });
        }
    }

    /// The same for a target.
    pub(crate) fn removed_target(&mut self, request: &Request) {
        if let Request::RemoveTarget { target, .. } = *request
            && !self.take_silent(request)
        {
            self.did_remove(&format!("target {}", target + 1), Deed::RemovedTarget { target });
        }
    }

    pub(crate) fn forget_silent(&mut self, request: &WhyRequest) -> bool {
        self.take_silent(&Request::Why(request.clone()))
    }

    /// Forgets that a request was to take something back: it was refused.
    pub(crate) fn forget_refused(&mut self, request: &Request) {
        self.take_silent(request);
    }

    pub(crate) fn take_silent(&mut self, request: &Request) -> bool {
        let place = self.undo.silent.iter().position(|silent| silent == request);
        place.map(|place| self.undo.silent.remove(place)).is_some()
    }

    pub(crate) fn undo_last(&mut self) {
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

    pub(crate) fn redo_last(&mut self) {
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
