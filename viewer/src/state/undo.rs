//! Undo and redo of the user's changes.

use sightline_api::endpoint::{Call, Endpoint, NoBody};
use sightline_api::endpoints::{RemoveRun, RemoveTarget, RestoreRun, RestoreTarget};
use sightline_api::location::{AtRun, AtTarget};
use sightline_session::view::SessionView;
use sightline_track::settings::Changes;

use crate::state::undoable::{Undo, UndoableChange};
use crate::state::{State, run_letter};

/// Maximum number of changes that can be undone.
const REMEMBERED: usize = 100;

impl State {
    /// Records a change and clears the changes that could be redone.
    pub(crate) fn record_change(&mut self, change: UndoableChange) {
        self.undo.undone.clear();
        self.undo.changes += 1;
        match self.undo.done.pop() {
            Some(last) if last.is_continued_by(&change) => self.undo.done.push(last.merged(change)),
            last => {
                self.undo.done.extend(last);
                self.undo.done.push(change);
            }
        }
        if self.undo.done.len() > REMEMBERED {
            self.undo.done.remove(0);
        }
    }

    /// Ends the trial and forgets the changes that led to it: the branch contains their result.
    pub(crate) fn end_trial(&mut self) {
        self.why.trial = None;
        while self.undo.done.pop_if(|change| matches!(change, UndoableChange::Tried { .. })).is_some() {}
    }

    /// Records a removal and shows a message that offers to undo it.
    pub(crate) fn record_removal(&mut self, what: &str, change: UndoableChange) {
        self.record_change(change);
        self.messages.note_with_undo(format!("Removed {what}."), self.undo.changes);
    }

    /// Records a change of the draft.
    pub(crate) fn drafted(&mut self, before: Changes) {
        if before != self.draft {
            let after = self.draft.clone();
            self.record_change(UndoableChange::Drafted { before, after });
        }
    }

    /// Forgets all changes: they belong to another session.
    pub(crate) fn forget_changes(&mut self) {
        self.undo = Undo::default();
    }

    /// Removes a target; can be undone.
    pub(crate) fn remove_target(&mut self, target: usize) {
        self.show_target(target, false, Some(UndoableChange::RemovedTarget { target }));
    }

    /// Removes a run; can be undone.
    pub(crate) fn remove_run(&mut self, target: usize, run: usize) {
        self.show_run(target, run, false, Some(UndoableChange::RemovedRun { target, run }));
    }

    /// Removes or restores a target; `change` is recorded once the server confirms.
    fn show_target(&mut self, target: usize, shown: bool, change: Option<UndoableChange>) {
        let Some(session) = self.session_id() else { return };
        let (at, what) = (AtTarget { session, target }, format!("target {}", target + 1));
        if shown {
            self.change_parts::<RestoreTarget>(&at, what, change);
        } else {
            self.change_parts::<RemoveTarget>(&at, what, change);
        }
    }

    /// Removes or restores a run; `change` is recorded once the server confirms.
    fn show_run(&mut self, target: usize, run: usize, shown: bool, change: Option<UndoableChange>) {
        let Some(session) = self.session_id() else { return };
        let (at, what) = (AtRun { session, target, run }, format!("run {}", run_letter(run)));
        if shown {
            self.change_parts::<RestoreRun>(&at, what, change);
        } else {
            self.change_parts::<RemoveRun>(&at, what, change);
        }
    }

    /// Calls `E`, which changes targets or runs of the open session, and adopts the session that it returns.
    fn change_parts<E: Endpoint<Body = NoBody, Reply = SessionView>>(
        &mut self,
        at: &E::At,
        what: String,
        change: Option<UndoableChange>,
    ) {
        self.call::<E>(Call::to::<E>(at), move |state, view| {
            if state.session.as_ref().is_none_or(|open| open.id != view.id) {
                // Another session was opened meanwhile.
                return;
            }
            if let Some(change) = change {
                state.record_removal(&what, change);
            }
            state.adopt(view, true);
            state.sync.session_stale = true;
        });
    }

    pub(crate) fn undo_last(&mut self) {
        match self.undo.done.pop() {
            Some(change) => {
                self.undo.changes += 1;
                self.replay(&change, false);
                self.messages.note(format!("Undid {}.  Ctrl+Y redoes it.", change.words()));
                self.undo.undone.push(change);
            }
            None => self.messages.note("There is nothing to undo."),
        }
    }

    pub(crate) fn redo_last(&mut self) {
        match self.undo.undone.pop() {
            Some(change) => {
                self.undo.changes += 1;
                self.replay(&change, true);
                self.messages.note(format!("Redid {}.", change.words()));
                self.undo.done.push(change);
            }
            None => self.messages.note("There is nothing to redo."),
        }
    }

    /// Redoes (`again`) or undoes a change.
    fn replay(&mut self, change: &UndoableChange, again: bool) {
        match change {
            UndoableChange::Picked { target } => self.show_target(*target, again, None),
            UndoableChange::RemovedTarget { target } => self.show_target(*target, !again, None),
            UndoableChange::Renamed { target, before, after } => {
                let label = if again { after } else { before }.clone();
                self.rename_target(*target, label, None);
            }
            UndoableChange::Branched { target, run } => {
                self.end_trial();
                self.show_run(*target, *run, again, None);
            }
            UndoableChange::RemovedRun { target, run } => self.show_run(*target, *run, !again, None),
            UndoableChange::RemovedBreakpoint { expression, .. } if again => {
                self.remove_by_condition(expression);
            }
            UndoableChange::RemovedBreakpoint { expression, is_on } => {
                self.restore_breakpoint(expression, *is_on);
            }
            UndoableChange::RemovedPlot { expression, .. } if again => self.remove_plot(expression),
            UndoableChange::RemovedPlot { expression, place } => self.restore_plot(expression, *place),
            UndoableChange::RemovedNote { id, .. } if again => self.remove_note(*id, false),
            UndoableChange::RemovedNote { id, .. } => self.restore_note(*id),
            UndoableChange::Drafted { before, after } => {
                self.draft = if again { after } else { before }.clone();
            }
            UndoableChange::Tried { of, before, after } => {
                let what_if = if again { after } else { before }.clone();
                self.set_trial(of.clone(), what_if);
            }
        }
    }
}
