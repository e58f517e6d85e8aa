//! Removing breakpoints and derived plots, and setting them again.

use sightline_session::breakpoints::{BreakpointChange, BreakpointView, NewBreakpoint};

use crate::breakpoints::AskRequest;
use crate::breakpoints::derived::Derived;
use crate::state::State;
use crate::state::deeds::Deed;

impl State {
    /// Takes a breakpoint out of the list and tells the server; none where there is no such one, or no session.
    pub(crate) fn take_breakpoint_out(&mut self, number: usize) -> Option<BreakpointView> {
        let at = self.ask.breakpoints.iter().position(|breakpoint| breakpoint.number == number)?;
        if !self.ask_server(|session| AskRequest::Remove { session, number }) {
            return None;
        }
        if self.ask.edited == Some(number) {
            self.ask.edited = None;
        }
        Some(self.ask.breakpoints.remove(at))
    }

    /// Removes the breakpoint with a condition again; it may have another number by now.
    pub(crate) fn unset(&mut self, expression: &str) {
        let found = self.ask.breakpoints.iter().find(|known| known.expression == expression);
        if let Some(number) = found.map(|known| known.number) {
            self.take_breakpoint_out(number);
        }
    }

    /// Sets a breakpoint that was removed, as it was.
    pub(crate) fn set_again(&mut self, expression: &str, is_on: bool) {
        if !is_on {
            self.undo.switch_off(expression);
        }
        let new = NewBreakpoint { expression: Some(expression.to_owned()), step: None };
        self.ask_server(|session| AskRequest::Add { session, new });
    }

    /// Switches a breakpoint off that was off before it was removed, or is off in the file that lists it.
    pub(crate) fn switch_off_again(&mut self, view: &BreakpointView) {
        if view.on && self.undo.take_switch_off(&view.expression) {
            let (number, change) = (view.number, BreakpointChange { on: Some(false), expression: None });
            self.ask_server(|session| AskRequest::Change { session, number, change });
        }
    }

    pub(crate) fn unplot(&mut self, place: usize) {
        if place < self.ask.derived.len() {
            let expression = self.ask.derived.remove(place).expression;
            let what = format!("the plot `{expression}`");
            self.did_remove(&what, Deed::RemovedPlot { expression, place });
        }
    }

    /// Removes the plot of an expression again.
    pub(crate) fn take_plot_out(&mut self, expression: &str) {
        self.ask.derived.retain(|derived| derived.expression != expression);
    }

    /// Plots an expression again at its place; its values are asked for anew.
    pub(crate) fn plot_again(&mut self, expression: &str, place: usize) {
        if self.ask.derived.iter().all(|derived| derived.expression != expression) {
            let place = place.min(self.ask.derived.len());
            self.ask.derived.insert(place, Derived::new(expression.to_owned()));
        }
    }
}
