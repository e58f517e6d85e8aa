//! Carries out the user's commands about breakpoints.

use sightline_session::breakpoints::{BreakpointChange, BreakpointView, NewBreakpoint};
use sightline_session::expression::Expression;

use crate::breakpoints::{BreakpointCommand, BreakpointState};
use crate::command::{Command, Go};
use crate::panels::pane::Pane;
use crate::state::State;
use crate::state::effect::Effect;
use crate::state::undoable::UndoableChange;

impl State {
    /// Applies a command about breakpoints.
    pub(crate) fn apply_breakpoint_command(&mut self, command: BreakpointCommand) {
        match command {
            BreakpointCommand::Type(text) => {
                (self.breakpoints.text, self.breakpoints.wants_focus) = (text, false);
            }
            BreakpointCommand::Focus => {
                self.breakpoints.wants_focus = true;
                self.outbox.add(Effect::reveal(Pane::Breakpoints));
            }
            BreakpointCommand::Propose(text) => {
                self.breakpoints.text = text;
                (self.breakpoints.wants_focus, self.breakpoints.edited) = (true, None);
                self.outbox.add(Effect::reveal(Pane::Breakpoints));
            }
            BreakpointCommand::Edit(number) => self.edit_breakpoint(number),
            BreakpointCommand::CancelEdit => {
                (self.breakpoints.edited, self.breakpoints.text) = (None, String::new());
            }
            BreakpointCommand::Set => self.set_breakpoint(),
            BreakpointCommand::BreakAt(step) => self.break_at(step),
            BreakpointCommand::Switch { number, on } => {
                let change = BreakpointChange { on: Some(on), expression: None };
                self.change_breakpoint(number, &change);
                if let Some(known) = self.breakpoints.list.iter_mut().find(|known| known.number == number) {
                    known.on = on;
                }
            }
            BreakpointCommand::Remove(number) => self.remove_breakpoint(number),
            BreakpointCommand::Plot(text) => self.plot_expression(text),
            BreakpointCommand::Unplot(place) => self.unplot(place),
            BreakpointCommand::NextHit => self.go_to_hit(true),
            BreakpointCommand::PreviousHit => self.go_to_hit(false),
            BreakpointCommand::Shuttle(shuttle) => self.shuttle(shuttle),
            BreakpointCommand::ShowOthers(shown) => self.breakpoints.shows_others = shown,
        }
    }

    fn edit_breakpoint(&mut self, number: usize) {
        let found = self.breakpoints.list.iter().find(|breakpoint| breakpoint.number == number);
        if let Some(text) = found.map(|breakpoint| breakpoint.expression.clone()) {
            self.breakpoints.text = text;
            (self.breakpoints.edited, self.breakpoints.wants_focus) = (Some(number), true);
        }
    }

    fn set_breakpoint(&mut self) {
        let text = self.breakpoints.text.trim().to_owned();
        // The box already shows the error.
        if Expression::condition(&text).is_err() {
            return;
        }
        let edited = self.breakpoints.edited;
        let is_sent = match edited {
            Some(number) => {
                self.change_breakpoint(number, &BreakpointChange { expression: Some(text), on: None })
            }
            None => self.add_breakpoint(NewBreakpoint { expression: Some(text), step: None }),
        };
        if is_sent {
            (self.breakpoints.text, self.breakpoints.edited) = (String::new(), None);
        }
    }

    fn break_at(&mut self, step: usize) {
        let is_here = |breakpoint: &&BreakpointView| {
            Expression::condition(&breakpoint.expression).is_ok_and(|read| read.step_named() == Some(step))
        };
        match self.breakpoints.list.iter().find(is_here).map(|breakpoint| breakpoint.number) {
            Some(number) => self.remove_breakpoint(number),
            None => {
                self.add_breakpoint(NewBreakpoint { expression: None, step: Some(step) });
            }
        }
    }

    fn remove_breakpoint(&mut self, number: usize) {
        if let Some(removed) = self.remove_from_list(number) {
            let (expression, is_on) = (removed.expression, removed.on);
            let what = format!("the breakpoint `{expression}`");
            self.record_removal(&what, UndoableChange::RemovedBreakpoint { expression, is_on });
        }
    }

    /// The next hit after a step, or the previous one before it, in the selected run.
    pub fn hit_from(&self, step: usize, is_forward: bool) -> Option<usize> {
        let (target, run) = (self.cursor.target?, self.cursor.run);
        let hits =
            self.breakpoints.watched().map(|(_, breakpoint)| BreakpointState::hits(breakpoint, target, run));
        if is_forward {
            hits.filter_map(|steps| steps.get(steps.partition_point(|hit| *hit <= step)).copied()).min()
        } else {
            let before = |steps: &[usize]| steps.partition_point(|hit| *hit < step).checked_sub(1);
            hits.filter_map(|steps| before(steps).map(|at| steps[at])).max()
        }
    }

    /// The conditions of the breakpoints that hit at a step of a run.
    pub(crate) fn hit_at(&self, target: usize, run: usize, step: usize) -> Vec<&str> {
        let is_hit = |breakpoint: &BreakpointView| {
            BreakpointState::hits(breakpoint, target, run).binary_search(&step).is_ok()
        };
        let hit = self.breakpoints.watched().filter(|(_, breakpoint)| is_hit(breakpoint));
        hit.map(|(_, breakpoint)| breakpoint.expression.as_str()).collect()
    }

    fn go_to_hit(&mut self, is_forward: bool) {
        match self.hit_from(self.cursor.step, is_forward) {
            Some(step) => self.perform(Command::Go(Go::Step(step))),
            None if self.breakpoints.watched().next().is_none() => {
                let hint = "B breaks at this step, Shift+B asks for a condition.".to_owned();
                self.messages.problem("There is no breakpoint that is on.", Some(hint));
            }
            None => {
                let side = if is_forward { "after" } else { "before" };
                self.messages.note(format!("No breakpoint is hit {side} this step in this run."));
            }
        }
    }
}
