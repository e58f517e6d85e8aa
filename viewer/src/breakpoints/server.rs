//! The calls about breakpoints and plotted expressions, and what their replies change.

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
use crate::state::deeds::Deed;

impl State {
    /// Sets a breakpoint; false if no session is open.
    pub(super) fn add_breakpoint(&mut self, new: NewBreakpoint) -> bool {
        let Some(session) = self.session_id() else { return false };
        self.ask.changes += 1;
        self.ask.adding += 1;
        let call = Call::with_body::<AddBreakpoint>(&AtSession { session }, &new);
        let take = |state: &mut Self, view: BreakpointView| {
            if !state.change_when_set(&view) && !state.replace_breakpoint(&view) {
                state.ask.breakpoints.push(view);
            }
        };
        self.call_or::<AddBreakpoint>(call, take, move |state, _| {
            state.take_when_set(new.expression.as_deref());
            state.ask.stale = true;
            Notice::Card
        });
        true
    }

    /// Changes a breakpoint; false if no session is open.
    pub(super) fn change_breakpoint(&mut self, breakpoint: usize, change: &BreakpointChange) -> bool {
        let Some(session) = self.session_id() else { return false };
        self.ask.changes += 1;
        let call = Call::with_body::<ChangeBreakpoint>(&AtBreakpoint { session, breakpoint }, change);
        let take = |state: &mut Self, view| {
            // It may have been removed after this change was sent.
            state.replace_breakpoint(&view);
        };
        self.call_or::<ChangeBreakpoint>(call, take, |state, _| {
            state.ask.stale = true;
            Notice::Card
        });
        true
    }

    /// Has the server remove a breakpoint; false if no session is open.
    pub(super) fn drop_breakpoint(&mut self, breakpoint: usize) -> bool {
        let Some(session) = self.session_id() else { return false };
        self.ask.changes += 1;
        let call = Call::to::<RemoveBreakpoint>(&AtBreakpoint { session, breakpoint });
        self.call_or::<RemoveBreakpoint>(
            call,
            |_, _| {},
            |state, _| {
                state.undo.forget_last(|deed| matches!(deed, Deed::RemovedBreakpoint { .. }));
                state.ask.stale = true;
                Notice::Card
            },
        );
        true
    }

    /// Replaces the known breakpoint of the same number; false if none has it.
    fn replace_breakpoint(&mut self, view: &BreakpointView) -> bool {
        let known = self.ask.breakpoints.iter_mut().find(|known| known.number == view.number);
        known.map(|known| known.clone_from(view)).is_some()
    }

    /// Reads the breakpoints and columns that may have changed.
    pub(crate) fn sync_ask(&mut self) {
        let Some(session) = &self.session else { return };
        if self.connection != Connection::Live {
            return;
        }
        let id = session.id.clone();
        if self.ask.stale && self.ask.asked.is_none() {
            self.ask.stale = false;
            // Without breakpoints there is nothing to read; a session read before a change of this page lacks it.
            if session.breakpoints.is_empty() && self.ask.changes == 0 {
                self.ask.breakpoints.clear();
            } else {
                self.read_breakpoints(id.clone());
            }
        }
        self.sync_derived(&id);
    }

    fn read_breakpoints(&mut self, session: String) {
        self.ask.asked = Some(self.ask.changes);
        let take = |state: &mut Self, list| {
            // A list that was read before a later change would bring a removed breakpoint back.
            if state.ask.asked.take().is_none_or(|changes| changes == state.ask.changes) {
                state.ask.breakpoints = list;
            } else {
                state.ask.stale = true;
            }
        };
        let call = Call::to::<ListBreakpoints>(&AtSession { session });
        self.call_or::<ListBreakpoints>(call, take, |state, _| {
            state.ask.asked = None;
            Notice::List
        });
    }

    /// Reads the values of a plotted expression.
    pub(super) fn read_column(&mut self, session: &str, query: Query) {
        let call = Call::with_body::<QuerySession>(&AtSession { session: session.to_owned() }, &query);
        let expression = query.expression.clone();
        let take = move |state: &mut Self, answer| state.took_column(&expression, Ok(answer));
        self.call_or::<QuerySession>(call, take, move |state, problem| {
            state.took_column(&query.expression, Err(problem.detail.clone()));
            Notice::List
        });
    }
}
