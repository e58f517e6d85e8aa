//! The user's commands about notes, their calls, and the replies.

use sightline_api::endpoint::Call;
use sightline_api::endpoints::{AddNote, ChangeNote, ListNotes, RemoveNote, RestoreNote};
use sightline_api::location::{AtNote, AtSession};
use sightline_session::Cursor;
use sightline_session::notes::{EditNote, NewNote, Note, Pin};

use crate::notes::{Draft, Notes, NotesCommand};
use crate::stage::Stage;
use crate::state::State;
use crate::state::calls::Notice;
use crate::state::undoable::UndoableChange;

impl State {
    /// Applies a command about notes.
    pub(crate) fn apply_notes_command(&mut self, command: NotesCommand) {
        match command {
            NotesCommand::Pin => self.pin(),
            NotesCommand::Edit(id) => {
                let note = self.note(id).cloned();
                self.notes.draft = note.map(|note| Draft {
                    of: Some((note.id, note.revision)),
                    pin: note.pin,
                    text: note.text,
                });
            }
            NotesCommand::Write(text) => {
                if let Some(draft) = &mut self.notes.draft {
                    draft.text = text;
                }
            }
            NotesCommand::Save => self.save_note(),
            NotesCommand::Close => {
                let draft = self.notes.draft.take().filter(|draft| draft.of.is_none());
                self.notes.unsaved_text = draft.map(|draft| draft.text).unwrap_or_default();
            }
            NotesCommand::Remove(id) => self.remove_note(id, true),
            // If the removal was the last change, restoring the note undoes that change.
            NotesCommand::Restore(id) => match self.undo.ends().0 {
                Some(UndoableChange::RemovedNote { id: last, .. }) if *last == id => self.undo_last(),
                _ => self.restore_note(id),
            },
            NotesCommand::Move { id, place } => {
                let Some(revision) = self.note(id).map(|note| note.revision) else { return };
                let edit = EditNote { text: None, place: Some(place) };
                self.change_note(id, revision, edit);
            }
            NotesCommand::GoTo(id) => self.go_to_note(id),
            NotesCommand::Tour(by) => {
                if let Some(id) = self.next_of_tour(by) {
                    self.go_to_note(id);
                }
            }
        }
    }

    /// Removes a note. `is_recorded`: records the removal as a change; false when a change is being redone.
    pub(crate) fn remove_note(&mut self, id: u64, is_recorded: bool) {
        let Some(session) = self.session.as_ref().map(|session| session.id.clone()) else { return };
        let Some(note) = self.note(id).cloned() else { return };
        let step = note.pin.step;
        let call = Call::to::<RemoveNote>(&AtNote { session: session.clone(), note: id });
        let take = move |state: &mut Self, _| {
            if is_recorded {
                state.record_removal(
                    &format!("the note at step {step}"),
                    UndoableChange::RemovedNote { id, step },
                );
            }
        };
        self.call_or::<RemoveNote>(call.at_revision(note.revision), take, move |state, _| {
            state.notes.removed = None;
            state.read_notes(session);
            Notice::Card
        });
        self.notes.removed = Some(note);
    }

    /// Restores a removed note.
    pub(crate) fn restore_note(&mut self, id: u64) {
        let Some(session) = self.session_id() else { return };
        self.notes.removed = None;
        self.call::<RestoreNote>(Call::to::<RestoreNote>(&AtNote { session, note: id }), |_, _| {});
    }

    /// The note with this number.
    pub fn note(&self, id: u64) -> Option<&Note> {
        self.notes.list.iter().flatten().find(|note| note.id == id)
    }

    /// The notes pinned to a stop: those of the selected run, and those of the stop only.
    pub fn notes_at(&self, step: usize) -> Vec<&Note> {
        let cursor = self.cursor;
        let is_here = |note: &&Note| {
            let is_ours = |target| Some(target) == cursor.target && note.pin.run == cursor.run;
            note.pin.step == step && note.pin.target.is_none_or(is_ours)
        };
        self.notes.list.iter().flatten().filter(is_here).collect()
    }

    /// Reads the notes of a session that is being opened.
    pub(crate) fn open_notes(&mut self, session: &str) {
        self.notes = Notes { requested_for: Some(session.to_owned()), ..Notes::default() };
        self.read_notes(session.to_owned());
    }

    /// Reads the notes of a session.
    pub(crate) fn read_notes(&mut self, session: String) {
        let call = Call::to::<ListNotes>(&AtSession { session: session.clone() });
        self.call::<ListNotes>(call, move |state, list| state.on_notes_reply(&session, list));
    }

    /// Reads the notes again after an event about them.
    pub(crate) fn notes_changed(&mut self, session: String) {
        if self.notes.requested_for.as_ref() == Some(&session) {
            self.read_notes(session);
        }
    }

    /// Replaces the list of notes, unless another session was opened meanwhile.
    fn on_notes_reply(&mut self, session: &str, list: Vec<Note>) {
        if self.notes.requested_for.as_deref() == Some(session) {
            self.notes.list = Some(list);
        }
    }

    /// Changes the note at the revision that was read; if the server refuses, reopens the text in the editor.
    fn change_note(&mut self, id: u64, revision: u64, edit: EditNote) {
        let Some(session) = self.session_id() else { return };
        let at = AtNote { session: session.clone(), note: id };
        let call = Call::with_body::<ChangeNote>(&at, &edit).at_revision(revision);
        self.call_or::<ChangeNote>(
            call,
            |_, _| {},
            move |state, _| {
                state.read_notes(session);
                if let Some(text) = edit.text {
                    // The next attempt changes the revision that was read by then.
                    let revision = state.note(id).map_or(revision, |note| note.revision);
                    state.reopen_draft(Draft { of: Some((id, revision)), pin: Pin::default(), text });
                }
                Notice::Card
            },
        );
    }

    /// Adds a note; if the server refuses, reopens the text in the editor.
    fn add_note(&mut self, new: NewNote) {
        let Some(session) = self.session_id() else { return };
        let call = Call::with_body::<AddNote>(&AtSession { session }, &new);
        let take = |state: &mut Self, _| {
            state.messages.note("The note is pinned; the panel Notes lists them.");
        };
        self.call_or::<AddNote>(call, take, move |state, _| {
            state.reopen_draft(Draft { of: None, pin: new.pin, text: new.text });
            Notice::Card
        });
    }

    /// Opens a draft in the editor unless another one is being written.
    fn reopen_draft(&mut self, draft: Draft) {
        self.notes.draft.get_or_insert(draft);
    }

    fn pin(&mut self) {
        if self.session.is_none() {
            self.messages.problem("There is nothing to pin a note to yet: no session is open.", None);
            return;
        }
        let Cursor { target, run, step } = self.cursor;
        let target = target.filter(|_| self.run().is_some());
        let located = self.trace().and_then(|trace| trace.located()).and_then(|located| located.left_pixel);
        let pin = Pin {
            target,
            run: if target.is_some() { run } else { 0 },
            step,
            stage: target.map(|_| self.stage().word().to_owned()),
            pixel: located.filter(|_| target.is_some()),
        };
        self.notes.draft = Some(Draft { of: None, pin, text: std::mem::take(&mut self.notes.unsaved_text) });
    }

    fn save_note(&mut self) {
        let Some(draft) = self.notes.draft.take() else { return };
        if draft.text.trim().is_empty() {
            self.messages.problem("A note must say something.", None);
            self.notes.draft = Some(draft);
            return;
        }
        let Draft { of, pin, text } = draft;
        match of {
            Some((id, revision)) => {
                let edit = EditNote { text: Some(text), place: None };
                self.change_note(id, revision, edit);
            }
            None => self.add_note(NewNote { pin, text }),
        }
    }

    fn go_to_note(&mut self, id: u64) {
        let Some(note) = self.note(id).cloned() else { return };
        let pin = &note.pin;
        let has_run = |target: usize| {
            let targets = self.session.iter().flat_map(|session| &session.targets);
            targets
                .filter(|known| known.number == target)
                .any(|known| known.runs.iter().any(|run| run.number == pin.run))
        };
        match pin.target {
            Some(target) if has_run(target) => {
                self.cursor = Cursor { target: Some(target), run: pin.run, step: pin.step };
            }
            Some(_) => {
                self.messages.note("The target of this note was removed; this is its stop.");
                self.cursor.step = pin.step;
            }
            None => self.cursor.step = pin.step,
        }
        if let Some(stage) = pin.stage.as_deref().and_then(Stage::named) {
            self.stage = stage;
        }
        self.notes.at = Some(id);
    }

    /// The note `by` positions after the last visited one; the tour starts at the first note.
    fn next_of_tour(&self, by: isize) -> Option<u64> {
        let list = self.notes.list.as_ref().filter(|list| !list.is_empty())?;
        let at = self.notes.at.and_then(|id| list.iter().position(|note| note.id == id));
        let next = at.map_or(0, |at| at.saturating_add_signed(by).min(list.len() - 1));
        Some(list[next].id)
    }
}
