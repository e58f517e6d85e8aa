//! Removing breakpoints and derived plots, and setting them again.

use sightline_session::breakpoints::{BreakpointChange, BreakpointView, NewBreakpoint};

use crate::breakpoints::WhenSet;
use crate::breakpoints::derived::Derived;
use crate::state::State;
use crate::state::deeds::Deed;

impl State {
    /// Removes a breakpoint from the list and from the server; `None` without such a breakpoint or without a session.
    pub(crate) fn take_breakpoint_out(&mut self, number: usize) -> Option<BreakpointView> {
        let at = self.ask.breakpoints.iter().position(|breakpoint| breakpoint.number == number)?;
        if !self.drop_breakpoint(number) {
            return None;
        }
        if self.ask.edited == Some(number) {
            self.ask.edited = None;
        }
        Some(self.ask.breakpoints.remove(at))
    }

    /// Removes the breakpoint with a condition again; it may have another number by now, or none yet.
    pub(crate) fn unset(&mut self, expression: &str) {
        let found = self.ask.breakpoints.iter().find(|known| known.expression == expression);
        match found.map(|known| known.number) {
            Some(number) => {
                self.take_breakpoint_out(number);
            }
            None if self.ask.adding > 0 => {
                self.ask.when_set.push((expression.to_owned(), WhenSet::Remove));
            }
            None => {}
        }
    }

    /// Sets a breakpoint that was removed, or that a file lists, as it was.
    pub(crate) fn set_again(&mut self, expression: &str, is_on: bool) {
        self.ask.when_set.retain(|(waiting, _)| waiting != expression);
        if !is_on {
            self.ask.when_set.push((expression.to_owned(), WhenSet::SwitchOff));
        }
        self.add_breakpoint(NewBreakpoint { expression: Some(expression.to_owned()), step: None });
    }

    /// Takes out the changes that wait until a breakpoint is set: it is set now, or was refused.
    pub(super) fn take_when_set(&mut self, expression: Option<&str>) -> Vec<WhenSet> {
        self.ask.adding = self.ask.adding.saturating_sub(1);
        let is_meant = |waiting: &mut (String, WhenSet)| Some(waiting.0.as_str()) == expression;
        self.ask.when_set.extract_if(.., is_meant).map(|(_, what)| what).collect()
    }

    /// Applies the changes that waited until a breakpoint is set; returns whether it is removed.
    pub(super) fn change_when_set(&mut self, view: &BreakpointView) -> bool {
        let number = view.number;
        let waiting = self.take_when_set(Some(&view.expression));
        let is_removed = waiting.contains(&WhenSet::Remove);
        if is_removed {
            self.ask.breakpoints.retain(|known| known.number != number);
            self.drop_breakpoint(number);
        } else if waiting.contains(&WhenSet::SwitchOff) {
            self.change_breakpoint(number, &BreakpointChange { on: Some(false), expression: None });
        }
        is_removed
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

    /// Plots an expression again at its place and reads its values again.
    pub(crate) fn plot_again(&mut self, expression: &str, place: usize) {
        if self.ask.derived.iter().all(|derived| derived.expression != expression) {
            let place = place.min(self.ask.derived.len());
            self.ask.derived.insert(place, Derived::new(expression.to_owned()));
        }
    }
}
