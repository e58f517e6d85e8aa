//! Undo and redo of the user's changes.

use sightline_api::endpoint::{Call, Endpoint, NoBody};
use sightline_api::endpoints::{RemoveRun, RemoveTarget, RestoreRun, RestoreTarget};
use sightline_api::location::{AtRun, AtTarget};
use sightline_session::view::SessionView;
use sightline_track::settings::Changes;

use crate::state::deeds::{Deed, Undo};
use crate::state::{State, run_letter};

/// How many deeds are remembered.
const REMEMBERED: usize = 100;

impl State {
    /// Remembers a deed and clears the deeds that could be redone.
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

    /// Ends the trial, and forgets the deeds that led to it: the branch has what was tried.
    pub(crate) fn end_trial(&mut self) {
        self.why.trial = None;
        while self.undo.done.pop_if(|deed| matches!(deed, Deed::Tried { .. })).is_some() {}
    }

    /// Remembers a removal and shows a message that offers to undo it.
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

    /// Removes a target: a deed that can be taken back.
    pub(crate) fn remove_target(&mut self, target: usize) {
        self.show_target(target, false, Some(Deed::RemovedTarget { target }));
    }

    /// Removes a run: a deed that can be taken back.
    pub(crate) fn remove_run(&mut self, target: usize, run: usize) {
        self.show_run(target, run, false, Some(Deed::RemovedRun { target, run }));
    }

    /// Removes a target or restores it; `deed` is remembered once the server has done it.
    fn show_target(&mut self, target: usize, shown: bool, deed: Option<Deed>) {
        let Some(session) = self.session_id() else { return };
        let (at, what) = (AtTarget { session, target }, format!("target {}", target + 1));
        if shown {
            self.change_parts::<RestoreTarget>(&at, what, deed);
        } else {
            self.change_parts::<RemoveTarget>(&at, what, deed);
        }
    }

    /// The same for a run.
    fn show_run(&mut self, target: usize, run: usize, shown: bool, deed: Option<Deed>) {
        let Some(session) = self.session_id() else { return };
        let (at, what) = (AtRun { session, target, run }, format!("run {}", run_letter(run)));
        if shown {
            self.change_parts::<RestoreRun>(&at, what, deed);
        } else {
            self.change_parts::<RemoveRun>(&at, what, deed);
        }
    }

    /// Calls `E`, which changes the parts of the open session, and takes over the session that it replies.
    fn change_parts<E: Endpoint<Body = NoBody, Reply = SessionView>>(
        &mut self,
        at: &E::At,
        what: String,
        deed: Option<Deed>,
    ) {
        self.call::<E>(Call::to::<E>(at), move |state, view| {
            if state.session.as_ref().is_none_or(|open| open.id != view.id) {
                // Another session was opened meanwhile.
                return;
            }
            if let Some(deed) = deed {
                state.did_remove(&what, deed);
            }
            state.adopt(view, true);
            state.sync.session_stale = true;
        });
    }

    pub(crate) fn undo_last(&mut self) {
        match self.undo.done.pop() {
            Some(deed) => {
                self.undo.changes += 1;
                self.carry_over(&deed, false);
                self.messages.note(format!("Undid {}.  Ctrl+Y redoes it.", deed.words()));
                self.undo.undone.push(deed);
            }
            None => self.messages.note("There is nothing to undo."),
        }
    }

    pub(crate) fn redo_last(&mut self) {
        match self.undo.undone.pop() {
            Some(deed) => {
                self.undo.changes += 1;
                self.carry_over(&deed, true);
                self.messages.note(format!("Redid {}.", deed.words()));
                self.undo.done.push(deed);
            }
            None => self.messages.note("There is nothing to redo."),
        }
    }

    /// Redoes a deed, or undoes it.
    fn carry_over(&mut self, deed: &Deed, again: bool) {
        match deed {
            Deed::Picked { target } => self.show_target(*target, again, None),
            Deed::RemovedTarget { target } => self.show_target(*target, !again, None),
            Deed::Renamed { target, before, after } => {
                let label = if again { after } else { before }.clone();
                self.rename_target(*target, label, None);
            }
            Deed::Branched { target, run } => {
                self.end_trial();
                self.show_run(*target, *run, again, None);
            }
            Deed::RemovedRun { target, run } => self.show_run(*target, *run, !again, None),
            Deed::RemovedBreakpoint { expression, .. } if again => self.unset(expression),
            Deed::RemovedBreakpoint { expression, is_on } => self.set_again(expression, *is_on),
            Deed::RemovedPlot { expression, .. } if again => self.take_plot_out(expression),
            Deed::RemovedPlot { expression, place } => self.plot_again(expression, *place),
            Deed::RemovedNote { id, .. } if again => self.remove_note(*id, false),
            Deed::RemovedNote { id, .. } => self.restore_note(*id),
            Deed::Drafted { before, after } => self.draft = if again { after } else { before }.clone(),
            Deed::Tried { of, before, after } => {
                let what_if = if again { after } else { before }.clone();
                self.set_trial(of.clone(), what_if);
            }
        }
    }
}
