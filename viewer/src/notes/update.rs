//! Carries out what a person asks of notes, and takes in what the server answers.

use sightline_session::Cursor;
use sightline_session::notes::{EditNote, NewNote, Note, Pin};

use crate::net::request::Request;
use crate::notes::{Ask, Draft, Notes};
use crate::stage::Stage;
use crate::state::State;
use crate::state::deeds::Deed;

impl State {
    /// Carries out what was asked of notes.
    pub(crate) fn ask_of_notes(&mut self, ask: Ask) {
        match ask {
            Ask::Pin => self.pin(),
            Ask::Edit(id) => {
                let note = self.note(id).cloned();
                self.notes.draft = note.map(|note| Draft {
                    of: Some((note.id, note.revision)),
                    pin: note.pin,
                    text: note.text,
                });
            }
            Ask::Write(text) => {
                if let Some(draft) = &mut self.notes.draft {
                    draft.text = text;
                }
            }
            Ask::Save => self.save_note(),
            Ask::Close => {
                let draft = self.notes.draft.take().filter(|draft| draft.of.is_none());
                self.notes.kept = draft.map(|draft| draft.text).unwrap_or_default();
            }
            Ask::Remove(id) => {
                let request = self.removal_of_note(id);
                self.outbox.extend(request);
            }
            Ask::Restore(id) => self.restore_note(id),
            Ask::Move { id, place } => {
                let Some(revision) = self.note(id).map(|note| note.revision) else { return };
                let edit = EditNote { text: None, place: Some(place) };
                self.ask(|session| Request::EditNote { session, id, revision, edit });
            }
            Ask::GoTo(id) => self.go_to_note(id),
            Ask::Tour(by) => {
                if let Some(id) = self.next_of_tour(by) {
                    self.go_to_note(id);
                }
            }
        }
    }

    /// What removes a note; none where there is no such one. It can be brought back in the panel, too.
    pub(crate) fn removal_of_note(&mut self, id: u64) -> Option<Request> {
        let session = self.session.as_ref()?.id.clone();
        let note = self.note(id)?.clone();
        let revision = note.revision;
        self.notes.removed = Some(note);
        Some(Request::RemoveNote { session, id, revision })
    }

    /// Brings a removed note back; where its removal was the last deed, that is taking it back.
    fn restore_note(&mut self, id: u64) {
        if matches!(self.undo.ends().0, Some(Deed::RemovedNote { id: last, .. }) if *last == id) {
            self.undo_last();
            return;
        }
        self.notes.removed = None;
        self.ask(|session| Request::RestoreNote { session, id });
    }

    /// Takes in that a note was removed: a deed, unless it does one again.
    pub(crate) fn removed_note(&mut self, request: &Request) {
        let Request::RemoveNote { id, .. } = *request else { return };
        if self.take_silent(request) {
            return;
        }
        let removed = self.notes.removed.as_ref().filter(|note| note.id == id);
        let step = removed.map_or(self.cursor.step, |note| note.pin.step);
        self.did_remove(&format!("the note at step {step}"), Deed::RemovedNote { id, step });
    }

    /// The note of that number.
    pub fn note(&self, id: u64) -> Option<&Note> {
        self.notes.list.iter().flatten().find(|note| note.id == id)
    }

    /// The notes that are pinned to a stop: to the run that is looked at, or to the stop alone.
    pub fn notes_at(&self, step: usize) -> Vec<&Note> {
        let cursor = self.cursor;
        let is_here = |note: &&Note| {
            let is_ours = |target| Some(target) == cursor.target && note.pin.run == cursor.run;
            note.pin.step == step && note.pin.target.is_none_or(is_ours)
        };
        self.notes.list.iter().flatten().filter(is_here).collect()
    }

    /// Asks for the notes of a session that is being opened.
    pub(crate) fn open_notes(&mut self, session: &str) {
        self.notes = Notes { asked: Some(session.to_owned()), ..Notes::default() };
        self.outbox.push(Request::Notes(session.to_owned()));
    }

    /// Takes in that notes changed.
    pub(crate) fn notes_changed(&mut self, session: String) {
        if self.notes.asked.as_ref() == Some(&session) {
            self.outbox.push(Request::Notes(session));
        }
    }

    /// Takes in the notes of a session.
    pub(crate) fn took_notes(&mut self, session: &str, list: Vec<Note>) {
        if self.notes.asked.as_deref() == Some(session) {
            self.notes.list = Some(list);
        }
    }

    /// A note could not be kept: its words come back.
    pub(crate) fn note_refused(&mut self, request: &Request) {
        let draft = match request {
            Request::NewNote { new, .. } => Draft { of: None, pin: new.pin.clone(), text: new.text.clone() },
            Request::EditNote { session, id, revision, edit: EditNote { text: Some(text), .. } } => {
                self.outbox.push(Request::Notes(session.clone()));
                // The next attempt is one against what the server has by then.
                let revision = self.note(*id).map_or(*revision, |note| note.revision);
                Draft { of: Some((*id, revision)), pin: Pin::default(), text: text.clone() }
            }
            Request::EditNote { session, .. } | Request::RemoveNote { session, .. } => {
                self.notes.removed = None;
                self.forget_refused(request);
                self.outbox.push(Request::Notes(session.clone()));
                return;
            }
            _ => return,
        };
        if self.notes.draft.is_none() {
            self.notes.draft = Some(draft);
        }
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
        self.notes.draft = Some(Draft { of: None, pin, text: std::mem::take(&mut self.notes.kept) });
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
                self.ask(|session| Request::EditNote { session, id, revision, edit });
            }
            None => {
                let new = NewNote { pin, text };
                self.ask(|session| Request::NewNote { session, new });
            }
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

    /// The note after the one that was gone to last, or before it; the tour begins at its first.
    fn next_of_tour(&self, by: isize) -> Option<u64> {
        let list = self.notes.list.as_ref().filter(|list| !list.is_empty())?;
        let at = self.notes.at.and_then(|id| list.iter().position(|note| note.id == id));
        let next = at.map_or(0, |at| at.saturating_add_signed(by).min(list.len() - 1));
        Some(list[next].id)
    }
}
