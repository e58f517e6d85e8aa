//! Synchronises the page with the session of the server. A changed session is read as a whole; a moved cursor and the new
//! rows of a run are read by themselves, because the session of a long drive is megabytes.

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
    /// Requests what is stale: session, rows, cursor.
    pub(crate) fn sync_session(&mut self) {
        let Some(id) = self.session.as_ref().map(|session| session.id.clone()) else { return };
        self.sync_compare(&id);
        if self.sync.session_stale && self.sync.session_asked.is_none() {
            self.sync.session_stale = false;
            // The session contains cursor and rows.
            self.sync.cursor_stale = false;
            self.sync.runs_ahead.clear();
            self.sync.session_asked = Some(self.sync.cursor_messages);
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
            let asked = state.sync.session_asked.take();
            state.adopt(view, asked.is_some_and(|count| count != state.sync.cursor_messages));
        };
        self.call_or::<ShowSession>(call, take, |state, problem| {
            state.sync.session_asked = None;
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
        let take = move |state: &mut Self, cursor| state.took_cursor(&session, cursor);
        self.call_or::<ShowCursor>(call, take, |state, _| {
            state.sync.cursor_read = None;
            Notice::Card
        });
    }

    /// Reads the rows of a run from one on, counted from 0.
    pub(crate) fn read_rows(&mut self, session: String, RunName { target, run }: RunName, from_row: usize) {
        let at = AtRun { session: session.clone(), target, run };
        let call = Call::with_query::<ShowRun>(&at, &FirstRow { from_row });
        self.call_with_problem::<ShowRun>(call, move |state, outcome| match outcome {
            Ok(tail) => state.took_rows(&session, target, from_row, tail),
            // The run may have been removed: read the whole session.
            Err(_) => (state.sync.rows_asked, state.sync.session_stale) = (false, true),
        });
    }

    /// Requests the missing rows of a run, unless the session is being read, which may contain them.
    fn sync_rows(&mut self, session: &str) {
        if self.sync.rows_asked || self.sync.session_asked.is_some() {
            return;
        }
        let Some((target, run)) = self.sync.runs_ahead.pop_first() else { return };
        match self.run_named(RunName { target, run }).map(|(_, known)| whole_rows(known)) {
            Some(from_row) => {
                self.sync.rows_asked = true;
                self.read_rows(session.to_owned(), RunName { target, run }, from_row);
            }
            // Another page began this run.
            None => self.sync.session_stale = true,
        }
    }

    /// Notes that a run has new rows or has ended.
    pub(crate) fn run_went_on(&mut self, target: usize, run: usize) {
        self.sync.runs_ahead.insert((target, run));
    }

    /// Appends rows to a run, unless another session was opened meanwhile.
    pub(crate) fn took_rows(&mut self, session: &str, target: usize, from_row: usize, tail: RunView) {
        self.sync.rows_asked = false;
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
        self.ask.make_stale();
        self.forget_begun_steps();
    }

    /// Handles the event that a cursor moved: of this page if it is the one that was sent, else of another page. An event may
    /// be older than an answer, so that only a read gives the cursor's location.
    pub(crate) fn cursor_went(&mut self, to: Cursor) {
        let is_own = to == self.sync.server_cursor || Some(to) == self.sync.cursor_sent;
        self.sync.cursor_stale |= !is_own;
    }

    /// Follows a cursor that was read, if another page moved it.
    pub(crate) fn took_cursor(&mut self, session: &str, read: Cursor) {
        let asked = self.sync.cursor_read.take();
        let is_open = self.session.as_ref().is_some_and(|open| open.id == session);
        if is_open && asked == Some(self.sync.cursor_messages) && self.is_moved_elsewhere(read) {
            self.go_where_the_server_is(read);
            self.keep_cursor_valid();
        }
    }

    /// Whether another page moved the server's cursor. Valid only for an answer that no cursor of this page has crossed.
    pub(crate) fn is_moved_elsewhere(&self, read: Cursor) -> bool {
        self.sync.cursor_sent.is_none() && read != self.sync.server_cursor
    }

    pub(crate) fn go_where_the_server_is(&mut self, to: Cursor) {
        (self.cursor, self.sync.server_cursor) = (to, to);
    }

    /// Notes that a sent cursor was answered.
    pub(crate) fn put_cursor(&mut self, cursor: Cursor) {
        self.sync.cursor_sent = None;
        self.sync.cursor_messages += 1;
        self.sync.server_cursor = cursor;
    }
}

/// The rows of a run without that of a step at which a drive is paused, which will be replaced.
fn whole_rows(run: &RunView) -> usize {
    run.rows.len() - usize::from(run.rows.last().is_some_and(|last| last.paused_before.is_some()))
}
