//! The calls about breakpoints and plotted expressions, and their replies.

use sightline_api::endpoint::Call;
use sightline_api::endpoints::{
    AddBreakpoint, ChangeBreakpoint, ListBreakpoints, QuerySession, RemoveBreakpoint,
};
use sightline_api::location::{AtBreakpoint, AtSession};
use sightline_session::breakpoints::{BreakpointChange, BreakpointView, NewBreakpoint};
use sightline_session::query::Query;

use crate::net::events::Connection;
use crate::state::State;
use crate::state::calls::Notice;
use crate::state::undoable::UndoableChange;

impl State {
    /// Sets a breakpoint; `false` if no session is open.
    pub(super) fn add_breakpoint(&mut self, new: NewBreakpoint) -> bool {
        let Some(session) = self.session_id() else { return false };
        self.breakpoints.changes += 1;
        self.breakpoints.adding += 1;
        let call = Call::with_body::<AddBreakpoint>(&AtSession { session }, &new);
        let take = |state: &mut Self, view: BreakpointView| {
            if !state.change_when_set(&view) && !state.replace_breakpoint(&view) {
                state.breakpoints.list.push(view);
            }
        };
        self.call_or::<AddBreakpoint>(call, take, move |state, _| {
            state.take_when_set(new.expression.as_deref());
            state.breakpoints.stale = true;
            Notice::Card
        });
        true
    }

    /// Changes a breakpoint; `false` if no session is open.
    pub(super) fn change_breakpoint(&mut self, breakpoint: usize, change: &BreakpointChange) -> bool {
        let Some(session) = self.session_id() else { return false };
        self.breakpoints.changes += 1;
        let call = Call::with_body::<ChangeBreakpoint>(&AtBreakpoint { session, breakpoint }, change);
        let take = |state: &mut Self, view| {
            // It may have been removed after this change was sent.
            state.replace_breakpoint(&view);
        };
        self.call_or::<ChangeBreakpoint>(call, take, |state, _| {
            state.breakpoints.stale = true;
            Notice::Card
        });
        true
    }

    /// Requests the removal of a breakpoint; `false` if no session is open.
    pub(super) fn drop_breakpoint(&mut self, breakpoint: usize) -> bool {
        let Some(session) = self.session_id() else { return false };
        self.breakpoints.changes += 1;
        let call = Call::to::<RemoveBreakpoint>(&AtBreakpoint { session, breakpoint });
        self.call_or::<RemoveBreakpoint>(
            call,
            |_, _| {},
            |state, _| {
                state.undo.forget_last(|change| matches!(change, UndoableChange::RemovedBreakpoint { .. }));
                state.breakpoints.stale = true;
                Notice::Card
            },
        );
        true
    }

    /// Replaces the breakpoint with the same number; `false` if there is none.
    fn replace_breakpoint(&mut self, view: &BreakpointView) -> bool {
        let known = self.breakpoints.list.iter_mut().find(|known| known.number == view.number);
        known.map(|known| known.clone_from(view)).is_some()
    }

    /// Reads the breakpoints and columns that may have changed.
    pub(crate) fn sync_breakpoints(&mut self) {
        let Some(session) = &self.session else { return };
        if self.connection != Connection::Live {
            return;
        }
        let id = session.id.clone();
        if self.breakpoints.stale && self.breakpoints.pending_read.is_none() {
            self.breakpoints.stale = false;
            // Without breakpoints there is nothing to read, unless this page changed the list after the session was read.
            if session.breakpoints.is_empty() && self.breakpoints.changes == 0 {
                self.breakpoints.list.clear();
            } else {
                self.read_breakpoints(id.clone());
            }
        }
        self.sync_derived(&id);
    }

    fn read_breakpoints(&mut self, session: String) {
        self.breakpoints.pending_read = Some(self.breakpoints.changes);
        let take = |state: &mut Self, list| {
            // A list that was read before a later change could restore a removed breakpoint.
            if state
                .breakpoints
                .pending_read
                .take()
                .is_none_or(|changes| changes == state.breakpoints.changes)
            {
                state.breakpoints.list = list;
            } else {
                state.breakpoints.stale = true;
            }
        };
        let call = Call::to::<ListBreakpoints>(&AtSession { session });
        self.call_or::<ListBreakpoints>(call, take, |state, _| {
            state.breakpoints.pending_read = None;
            Notice::List
        });
    }

    /// Reads the values of a plotted expression.
    pub(super) fn read_column(&mut self, session: &str, query: Query) {
        let call = Call::with_body::<QuerySession>(&AtSession { session: session.to_owned() }, &query);
        let expression = query.expression.clone();
        let take = move |state: &mut Self, answer| state.on_column_reply(&expression, Ok(answer));
        self.call_or::<QuerySession>(call, take, move |state, problem| {
            state.on_column_reply(&query.expression, Err(problem.detail.clone()));
            Notice::List
        });
    }
}
