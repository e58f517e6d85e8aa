//! Synchronises the page with the session on the server. A changed session is read as a whole. A moved cursor and new rows
//! of a run are read separately, because the session of a long drive is megabytes.

use sightline_api::endpoint::Call;
use sightline_api::endpoints::{MoveCursor, ShowCursor, ShowRun, ShowSession};
use sightline_api::location::{AtRun, AtSession};
use sightline_api::query::FirstRow;
use sightline_session::Cursor;
use sightline_session::compare::RunName;
use sightline_session::view::RunView;

use crate::net::events::Connection;
use crate::state::State;
use crate::state::calls::Notice;

impl State {
    /// Requests stale data: session, rows, cursor.
    pub(crate) fn sync_session(&mut self) {
        let Some(id) = self.session.as_ref().map(|session| session.id.clone()) else { return };
        self.sync_compare(&id);
        if self.sync.session_stale && self.sync.session_read.is_none() {
            self.sync.session_stale = false;
            // The session contains cursor and rows.
            self.sync.cursor_stale = false;
            self.sync.runs_ahead.clear();
            self.sync.session_read = Some(self.sync.cursor_messages);
            self.read_session(id.clone());
        }
        self.sync_rows(&id);
        if self.cursor != self.sync.server_cursor
            && self.sync.cursor_sent.is_none()
            && self.connection == Connection::Live
        {
            self.sync.cursor_sent = Some(self.cursor);
            self.sync.cursor_messages += 1;
            self.move_cursor(id, self.cursor);
        } else if self.sync.cursor_stale && self.sync.cursor_sent.is_none() && self.sync.cursor_read.is_none()
        {
            self.sync.cursor_stale = false;
            self.sync.cursor_read = Some(self.sync.cursor_messages);
            self.read_cursor(id);
        }
    }

    /// Reads a session as a whole.
    pub(crate) fn read_session(&mut self, id: String) {
        let call = Call::to::<ShowSession>(&AtSession { session: id });
        let take = |state: &mut Self, view| {
            let requested_at = state.sync.session_read.take();
            state.adopt(view, requested_at.is_some_and(|count| count != state.sync.cursor_messages));
        };
        self.call_or::<ShowSession>(call, take, |state, problem| {
            state.sync.session_read = None;
            if state.session.is_none() && problem.status != 0 {
                // The link names a session that was removed: open another one.
                state.sync.linked = None;
                state.open_first();
            }
            Notice::Card
        });
    }

    /// Sends the cursor to the server. If it is refused, the page keeps its cursor and sends the next one.
    fn move_cursor(&mut self, session: String, cursor: Cursor) {
        let call = Call::with_body::<MoveCursor>(&AtSession { session }, &cursor);
        self.call_with_problem::<MoveCursor>(call, move |state, _| state.put_cursor(cursor));
    }

    /// Reads the cursor of a session.
    fn read_cursor(&mut self, session: String) {
        let call = Call::to::<ShowCursor>(&AtSession { session: session.clone() });
        let take = move |state: &mut Self, cursor| state.on_cursor_reply(&session, cursor);
        self.call_or::<ShowCursor>(call, take, |state, _| {
            state.sync.cursor_read = None;
            Notice::Card
        });
    }

    /// Reads the rows of a run from index `from_row` on.
    pub(crate) fn read_rows(&mut self, session: String, RunName { target, run }: RunName, from_row: usize) {
        let at = AtRun { session: session.clone(), target, run };
        let call = Call::with_query::<ShowRun>(&at, &FirstRow { from_row });
        self.call_with_problem::<ShowRun>(call, move |state, outcome| match outcome {
            Ok(tail) => state.on_rows_reply(&session, target, from_row, tail),
            // The run may have been removed: read the whole session.
            Err(_) => (state.sync.is_reading_rows, state.sync.session_stale) = (false, true),
        });
    }

    /// Requests the missing rows of a run, unless the session is being read, which may contain them.
    fn sync_rows(&mut self, session: &str) {
        if self.sync.is_reading_rows || self.sync.session_read.is_some() {
            return;
        }
        let Some((target, run)) = self.sync.runs_ahead.pop_first() else { return };
        match self.run_named(RunName { target, run }).map(|(_, known)| whole_rows(known)) {
            Some(from_row) => {
                self.sync.is_reading_rows = true;
                self.read_rows(session.to_owned(), RunName { target, run }, from_row);
            }
            // Another page began this run.
            None => self.sync.session_stale = true,
        }
    }

    /// Records that a run has new rows or has ended.
    pub(crate) fn on_run_progress(&mut self, target: usize, run: usize) {
        self.sync.runs_ahead.insert((target, run));
    }

    /// Appends rows to a run, unless another session was opened meanwhile.
    pub(crate) fn on_rows_reply(&mut self, session: &str, target: usize, from_row: usize, tail: RunView) {
        self.sync.is_reading_rows = false;
        let open = self.session.iter_mut().filter(|open| open.id == session);
        let targets = open.flat_map(|session| &mut session.targets);
        let runs = targets.filter(|known| known.number == target).flat_map(|known| &mut known.runs);
        let Some(run) = runs.into_iter().find(|run| run.number == tail.number) else { return };
        if whole_rows(run) != from_row {
            // The session was read meanwhile.
            self.sync.runs_ahead.insert((target, tail.number));
            return;
        }
        let mut rows = std::mem::take(&mut run.rows);
        rows.truncate(from_row);
        rows.extend(tail.rows);
        *run = RunView { rows, ..tail };
        self.breakpoints.make_stale();
        self.forget_begun_steps();
    }

    /// Handles the event that a cursor moved: of this page if it is the one that was sent, otherwise of another page. An
    /// event may be older than a reply, so that only a read gives the current cursor.
    pub(crate) fn on_cursor_moved(&mut self, to: Cursor) {
        let is_own = to == self.sync.server_cursor || Some(to) == self.sync.cursor_sent;
        self.sync.cursor_stale |= !is_own;
    }

    /// Adopts a cursor that was read, if another page moved it.
    pub(crate) fn on_cursor_reply(&mut self, session: &str, read: Cursor) {
        let requested_at = self.sync.cursor_read.take();
        let is_open = self.session.as_ref().is_some_and(|open| open.id == session);
        if is_open && requested_at == Some(self.sync.cursor_messages) && self.is_moved_elsewhere(read) {
            self.adopt_server_cursor(read);
            self.keep_cursor_valid();
        }
    }

    /// Whether another page moved the server's cursor. Valid only if this page sent no cursor while the read was pending.
    pub(crate) fn is_moved_elsewhere(&self, read: Cursor) -> bool {
        self.sync.cursor_sent.is_none() && read != self.sync.server_cursor
    }

    pub(crate) fn adopt_server_cursor(&mut self, to: Cursor) {
        (self.cursor, self.sync.server_cursor) = (to, to);
    }

    /// Records that a sent cursor was acknowledged.
    pub(crate) fn put_cursor(&mut self, cursor: Cursor) {
        self.sync.cursor_sent = None;
        self.sync.cursor_messages += 1;
        self.sync.server_cursor = cursor;
    }
}

/// Number of complete rows. The row of a step at which the drive is paused is incomplete and will be replaced.
fn whole_rows(run: &RunView) -> usize {
    run.rows.len() - usize::from(run.rows.last().is_some_and(|last| last.paused_before.is_some()))
}
