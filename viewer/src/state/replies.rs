//! Applies replies and events of the server to the state.

use std::collections::BTreeSet;

use sightline_api::endpoint::{Call, Method};
use sightline_api::endpoints::{BeginSession, ListSessions, ListSettings, ListTraverses, ShowTraverse};
use sightline_api::event::Event;
use sightline_api::location::{Anywhere, AtTraverse};
use sightline_api::wire::{NewSession, Problem, RerunStream, SessionEntry, TraverseEntry};
use sightline_session::Cursor;
use sightline_session::view::{RunView, SessionView};

use crate::cache::{Key, StepKey};
use crate::command::Mode;
use crate::exports::as_text;
use crate::net::events::Connection;
use crate::net::request::{CompletedRequest, Reply, Request};
use crate::state::effect::Effect;
use crate::state::undoable::UndoableChange;
use crate::state::{Progress, State, run_letter};
use crate::tour::Turn;

impl State {
    /// Requests the lists and the session that a new page needs.
    pub fn begin(&mut self) {
        self.read_settings();
        self.read_traverses();
        if let Some(session) = self.sync.linked.clone() {
            self.read_session(session);
        }
    }

    /// Applies an answer.
    pub fn apply_reply(&mut self, completed: CompletedRequest, now: f64) {
        match (completed.request, completed.outcome) {
            (Request::Item(key), Ok(Reply::Item(item))) => {
                self.cache.store(key, Ok(item), now);
                self.forget_begun_steps();
            }
            (Request::Item(key), Err(problem)) => self.cache.store(key, Err(problem), now),
            (Request::Call { ticket, .. }, outcome) => self.finish_call(ticket, outcome),
            (Request::Item(_) | Request::Reconnect, _) => {}
        }
    }

    /// Applies an event. The server sends every event to every page.
    pub fn apply_event(&mut self, event: Event) {
        let is_ours = |session: &str| self.session.as_ref().is_some_and(|open| open.id == session);
        match event {
            Event::SessionChanged { session } => {
                self.sync.session_stale |= is_ours(&session);
                self.follow_questions();
            }
            Event::RunProgress { session, target, run, k, n, ended, doing } if is_ours(&session) => {
                if ended {
                    self.progress.remove(&(target, run));
                    if self.progress.is_empty() {
                        self.messages.runs_ended();
                    }
                } else {
                    self.progress.insert((target, run), Progress { k, n, doing });
                }
                self.on_run_progress(target, run);
                self.mark_drive_stale();
            }
            Event::RunProgress { session, .. } => self.mark_trial_drive_stale(&session),
            Event::CursorMoved { session, cursor } if is_ours(&session) => self.on_cursor_moved(cursor),
            Event::CursorMoved { .. } => {}
            Event::RenderProgress { traverse, k, n, ready } => self.rendered(&traverse, k, n, ready),
            Event::StudyProgress { job } => self.update_study(job),
            Event::TrackabilityProgress { traverse, step, .. } => {
                self.on_trackability_progress(&traverse, step);
            }
            Event::QuestionProgress { session, target, run, step, .. } => {
                self.on_question_progress(StepKey { session, target, run, step });
            }
            Event::NotesChanged { session } => self.notes_changed(session),
            Event::SessionRemoved { session } => {
                self.trial_drive_removed(&session);
                self.session_removed(&session);
            }
            Event::ImportProgress { job } => self.update_import(job),
            Event::TraverseRemoved { traverse } => self.drive_removed(&traverse),
        }
    }

    /// Applies a change of the event connection.
    pub fn connected(&mut self, connection: Connection) {
        let was = std::mem::replace(&mut self.connection, connection);
        if was == connection {
            return;
        }
        match (was, connection) {
            (Connection::Gone { .. }, Connection::Live) => {
                if let Some(session) = self.session.as_ref().map(|session| session.id.clone()) {
                    self.read_notes(session);
                }
                self.messages.note("The server answers again.");
                self.follow_import();
                self.catch_up();
            }
            // Events may have been missed between the first replies and the first connection.
            (_, Connection::Live) => self.sync.session_stale = true,
            (Connection::Live | Connection::Connecting, Connection::Gone { .. }) => {
                let hint = "Start it with `sightline serve`; the steps that are loaded stay browsable.";
                self.messages.problem("The server does not answer.", Some(hint.to_owned()));
            }
            _ => {}
        }
    }

    /// Requests everything that may have changed while the server was unreachable.
    fn catch_up(&mut self) {
        self.cache.retry(|_| true);
        self.request_explanation_again();
        self.sync.keeps_cursor = true;
        self.forget_comparisons(false);
        self.progress.clear();
        self.sync.session_stale = true;
        self.trackability_stale();
        self.mark_trial_drives_stale();
        self.studies.make_stale();
        if self.settings.is_empty() {
            self.read_settings();
        }
        if self.traverses.is_none() {
            self.read_traverses();
        }
        match (&self.session, &self.traverse, &self.sync.linked) {
            (Some(session), None, _) => self.read_traverse(session.traverse.clone()),
            (None, _, Some(linked)) => self.read_session(linked.clone()),
            _ => {}
        }
    }

    fn rendered(&mut self, traverse: &str, k: usize, n: usize, ready: Option<usize>) {
        let Some(open) = self.traverse.as_mut().filter(|open| open.id == traverse) else { return };
        self.rendering = (k < n).then_some((k, n));
        if let Some(stop) = ready.and_then(|step| open.stops.get_mut(step)) {
            stop.ready = true;
        }
        self.cache.retry(|key| matches!(key, Key::Image { step, .. } if Some(*step) == ready));
    }

    pub(crate) fn rerun_opened(&mut self, stream: RerunStream) {
        let read = as_text::stream(&self.origin, &stream.stream_path);
        let words = format!(
            "Rerun shows this session. A viewer of your own takes `{read} | rerun -`. \u{201c}Close the Rerun stream\u{201d} ends it."
        );
        let url = format!("{}/api/v1/{}", self.origin, stream.viewer_path);
        self.messages.note_with_link(words, url.clone());
        self.outbox.add(Effect::OpenUrl(url));
    }

    /// Shows a refusal. If `is_shown_in_place`, the panel shows it already, and only the list of messages gets it.
    pub(crate) fn show_refusal(&mut self, call: &Call, problem: &Problem, is_shown_in_place: bool) {
        if problem.status != 0 {
            self.messages.refused(problem, format!("{} {}", call.method, call.path), !is_shown_in_place);
        } else if call.method != Method::Get {
            // The banner shows that the server is unreachable, but not that a change was lost.
            let hint = "Do it again when the banner has gone.".to_owned();
            self.messages.problem("The server does not answer, so that nothing was changed.", Some(hint));
        }
    }

    fn on_traverses_reply(&mut self, list: Vec<TraverseEntry>) {
        self.traverses = Some(list);
        if self.session.is_none() && self.sync.linked.is_none() {
            self.open_first();
        }
    }

    pub(super) fn open_first(&mut self) {
        let first = self.traverses.as_ref().and_then(|list| list.first());
        if let Some(id) = first.map(|entry| entry.id.clone()) {
            self.open(id);
        }
    }

    /// Opens the latest session of a traverse, or starts one.
    pub(crate) fn open(&mut self, traverse: String) {
        self.sync.opening = Some(traverse);
        let sessions = Call::to::<ListSessions>(&Anywhere {});
        self.call::<ListSessions>(sessions, |state, list| state.on_sessions_reply(&list));
    }

    fn on_sessions_reply(&mut self, list: &[SessionEntry]) {
        let Some(traverse) = self.sync.opening.take() else { return };
        let latest = list.iter().rev().find(|entry| entry.traverse == traverse);
        match latest {
            Some(entry) => self.read_session(entry.id.clone()),
            None => self.begin_session(traverse),
        }
    }

    /// Starts a session on a traverse.
    pub(crate) fn begin_session(&mut self, traverse: String) {
        let begin = Call::with_body::<BeginSession>(&Anywhere {}, &NewSession { traverse });
        self.call::<BeginSession>(begin, |state, view| {
            state.sync.session_read = None;
            state.adopt(view, false);
        });
    }

    fn read_settings(&mut self) {
        let settings = Call::to::<ListSettings>(&Anywhere {});
        self.call::<ListSettings>(settings, |state, table| state.settings = table);
    }

    /// Reads the list of traverses.
    pub(crate) fn read_traverses(&mut self) {
        let traverses = Call::to::<ListTraverses>(&Anywhere {});
        self.call::<ListTraverses>(traverses, Self::on_traverses_reply);
    }

    fn read_traverse(&mut self, id: String) {
        let traverse = Call::to::<ShowTraverse>(&AtTraverse { id });
        self.call::<ShowTraverse>(traverse, |state, view| state.traverse = Some(view));
    }

    /// Replaces the open session. The cursor is kept unless another page moved it.
    pub(crate) fn adopt(&mut self, view: SessionView, moved_meanwhile: bool) {
        let is_other = self.session.as_ref().is_none_or(|open| open.id != view.id);
        self.breakpoints.make_stale();
        if is_other {
            // Messages shown before the first session was open are about opening it.
            if self.session.is_some() {
                self.messages.leave_session();
                // The tour refers to the previous drive.
                if self.tour.at.is_some() {
                    self.tour.turn(Turn::End);
                }
            }
            self.open_notes(&view.id);
            self.breakpoints.forget();
            self.messages.forget_session();
            self.progress.clear();
            (self.sync.cursor_stale, self.sync.runs_ahead) = (false, BTreeSet::new());
            self.draft.clear();
            self.forget_comparisons(true);
            (self.mode, self.renaming, self.repicks) = (Mode::Look, None, None);
            self.hidden_targets.clear();
            self.target_colours.clear();
            (self.designating, self.refusal, self.rendering) = (None, None, None);
            self.forget_changes();
            self.why.leave_session();
        }
        self.mark_drive_stale();
        match &self.traverse {
            Some(open) if open.id == view.traverse => {
                // A commanded drive has reached another stop.
                if open.stops.len() < view.stop_count {
                    self.read_traverse(view.traverse.clone());
                }
            }
            _ => {
                self.traverse = None;
                self.read_traverse(view.traverse.clone());
            }
        }
        self.note_waiting_runs(&view);
        let keeps_cursor = std::mem::take(&mut self.sync.keeps_cursor) && !is_other;
        if keeps_cursor {
            // A restarted server may have lost the last move of the cursor: send it again.
            self.sync.server_cursor = view.cursor;
        }
        if is_other || (!moved_meanwhile && self.is_moved_elsewhere(view.cursor)) {
            self.adopt_server_cursor(view.cursor);
        }
        self.sync.linked = Some(view.id.clone());
        self.session = Some(view);
        self.forget_begun_steps();
        self.follow_link();
        self.keep_cursor_valid();
    }

    /// Moves the cursor off a target or run that no longer exists.
    pub(crate) fn keep_cursor_valid(&mut self) {
        let Some(session) = &self.session else { return };
        if self.target().is_none() {
            let newest = session.targets.last();
            self.cursor = Cursor { target: newest.map(|target| target.number), run: 0, ..self.cursor };
        }
        if self.run().is_none() {
            self.cursor.run =
                self.target().and_then(|target| target.runs.first()).map_or(0, |run| run.number);
        }
        self.cursor.step = self.cursor.step.min(session.stop_count.saturating_sub(1));
    }

    pub(super) fn designated(&mut self, target: usize, session: SessionView) {
        (self.designating, self.refusal, self.mode) = (None, None, Mode::Look);
        self.repicks = None;
        self.adopt(session, true);
        self.cursor.target = Some(target);
        self.cursor.run = 0;
        self.draft.clear();
        self.record_change(UndoableChange::Picked { target });
        self.keep_cursor_valid();
        if let Some(target) = self.target() {
            let step = target.designation.step;
            let label = with_capital(&target.label);
            if step + 1 < self.stop_count() {
                let text = format!("{label} set; tracking all stops … Use ← →.");
                self.messages.note_while_running(text);
            } else {
                self.messages.note_of_session(format!("{label} set at the last stop of the drive."));
            }
        }
    }

    pub(super) fn on_run_reply(&mut self, target: usize, run: RunView) {
        self.sync.session_stale = true;
        let number = run.number;
        let of_target = self.session.as_mut().and_then(|s| s.targets.iter_mut().find(|t| t.number == target));
        let Some(record) = of_target else { return };
        if record.runs.iter().all(|known| known.number != number) {
            record.runs.push(run);
        }
        self.cursor = Cursor { target: Some(target), run: number, ..self.cursor };
        self.draft.clear();
        self.end_trial();
        self.record_change(UndoableChange::Branched { target, run: number });
        self.messages.note_of_session(format!("Run {} goes on from here.", run_letter(number)));
    }
}

/// The text with its first letter capitalised.
fn with_capital(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().map(|letter| letter.to_uppercase().to_string()).unwrap_or_default();
    format!("{first}{}", letters.as_str())
}
