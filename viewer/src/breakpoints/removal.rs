//! Removes breakpoints and derived plots, and restores them.

use sightline_session::breakpoints::{BreakpointChange, BreakpointView, NewBreakpoint};

use crate::breakpoints::WhenSet;
use crate::breakpoints::derived::Derived;
use crate::state::State;
use crate::state::undoable::UndoableChange;

impl State {
    /// Removes a breakpoint from the list and from the server; `None` without such a breakpoint or without a session.
    pub(crate) fn remove_from_list(&mut self, number: usize) -> Option<BreakpointView> {
        let at = self.breakpoints.list.iter().position(|breakpoint| breakpoint.number == number)?;
        if !self.drop_breakpoint(number) {
            return None;
        }
        if self.breakpoints.edited == Some(number) {
            self.breakpoints.edited = None;
        }
        Some(self.breakpoints.list.remove(at))
    }

    /// Removes the breakpoint with a condition; its number may have changed, or may not be known yet.
    pub(crate) fn remove_by_condition(&mut self, expression: &str) {
        let found = self.breakpoints.list.iter().find(|known| known.expression == expression);
        match found.map(|known| known.number) {
            Some(number) => {
                self.remove_from_list(number);
            }
            None if self.breakpoints.adding > 0 => {
                self.breakpoints.when_set.push((expression.to_owned(), WhenSet::Remove));
            }
            None => {}
        }
    }

    /// Sets a breakpoint that was removed, or that a file lists, with its former state.
    pub(crate) fn restore_breakpoint(&mut self, expression: &str, is_on: bool) {
        self.breakpoints.when_set.retain(|(waiting, _)| waiting != expression);
        if !is_on {
            self.breakpoints.when_set.push((expression.to_owned(), WhenSet::SwitchOff));
        }
        self.add_breakpoint(NewBreakpoint { expression: Some(expression.to_owned()), step: None });
    }

    /// Removes and returns the changes that waited for a breakpoint: it was set, or refused.
    pub(super) fn take_when_set(&mut self, expression: Option<&str>) -> Vec<WhenSet> {
        self.breakpoints.adding = self.breakpoints.adding.saturating_sub(1);
        let is_meant = |waiting: &mut (String, WhenSet)| Some(waiting.0.as_str()) == expression;
        self.breakpoints.when_set.extract_if(.., is_meant).map(|(_, what)| what).collect()
    }

    /// Applies the changes that waited for a breakpoint; returns whether it was removed.
    pub(super) fn change_when_set(&mut self, view: &BreakpointView) -> bool {
        let number = view.number;
        let waiting = self.take_when_set(Some(&view.expression));
        let is_removed = waiting.contains(&WhenSet::Remove);
        if is_removed {
            self.breakpoints.list.retain(|known| known.number != number);
            self.drop_breakpoint(number);
        } else if waiting.contains(&WhenSet::SwitchOff) {
            self.change_breakpoint(number, &BreakpointChange { on: Some(false), expression: None });
        }
        is_removed
    }

    pub(crate) fn unplot(&mut self, place: usize) {
        if place < self.breakpoints.derived.len() {
            let expression = self.breakpoints.derived.remove(place).expression;
            let what = format!("the plot `{expression}`");
            self.record_removal(&what, UndoableChange::RemovedPlot { expression, place });
        }
    }

    /// Removes the plot of an expression.
    pub(crate) fn remove_plot(&mut self, expression: &str) {
        self.breakpoints.derived.retain(|derived| derived.expression != expression);
    }

    /// Restores the plot of an expression at its index and reads its values again.
    pub(crate) fn restore_plot(&mut self, expression: &str, place: usize) {
        if self.breakpoints.derived.iter().all(|derived| derived.expression != expression) {
            let place = place.min(self.breakpoints.derived.len());
            self.breakpoints.derived.insert(place, Derived::new(expression.to_owned()));
        }
    }
}
