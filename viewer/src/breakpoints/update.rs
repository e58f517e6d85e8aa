//! Carries out the user's commands about breakpoints.

use sightline_session::breakpoints::{BreakpointChange, BreakpointView, NewBreakpoint};
use sightline_session::expression::Expression;

use crate::breakpoints::{Ask, Asking};
use crate::command::{Command, Go};
use crate::panels::pane::Pane;
use crate::state::State;
use crate::state::deeds::Deed;
use crate::state::effect::Effect;

impl State {
    /// Applies a command about breakpoints.
    pub(crate) fn apply_ask(&mut self, ask: Ask) {
        match ask {
            Ask::Type(text) => (self.ask.text, self.ask.wants_focus) = (text, false),
            Ask::Focus => {
                self.ask.wants_focus = true;
                self.outbox.add(Effect::reveal(Pane::Breakpoints));
            }
            Ask::Propose(text) => {
                self.ask.text = text;
                (self.ask.wants_focus, self.ask.edited) = (true, None);
                self.outbox.add(Effect::reveal(Pane::Breakpoints));
            }
            Ask::Edit(number) => self.edit_breakpoint(number),
            Ask::CancelEdit => {
                (self.ask.edited, self.ask.text) = (None, String::new());
            }
            Ask::Set => self.set_breakpoint(),
            Ask::BreakAt(step) => self.break_at(step),
            Ask::Switch { number, on } => {
                let change = BreakpointChange { on: Some(on), expression: None };
                self.change_breakpoint(number, &change);
                if let Some(known) = self.ask.breakpoints.iter_mut().find(|known| known.number == number) {
                    known.on = on;
                }
            }
            Ask::Remove(number) => self.remove_breakpoint(number),
            Ask::Plot(text) => self.plot_expression(text),
            Ask::Unplot(place) => self.unplot(place),
            Ask::NextHit => self.go_to_hit(true),
            Ask::PreviousHit => self.go_to_hit(false),
            Ask::Shuttle(shuttle) => self.shuttle(shuttle),
            Ask::ShowOthers(shown) => self.ask.shows_others = shown,
        }
    }

    fn edit_breakpoint(&mut self, number: usize) {
        let found = self.ask.breakpoints.iter().find(|breakpoint| breakpoint.number == number);
        if let Some(text) = found.map(|breakpoint| breakpoint.expression.clone()) {
            self.ask.text = text;
            (self.ask.edited, self.ask.wants_focus) = (Some(number), true);
        }
    }

    fn set_breakpoint(&mut self) {
        let text = self.ask.text.trim().to_owned();
        // The box shows the error already.
        if Expression::condition(&text).is_err() {
            return;
        }
        let edited = self.ask.edited;
        let asked = match edited {
            Some(number) => {
                self.change_breakpoint(number, &BreakpointChange { expression: Some(text), on: None })
            }
            None => self.add_breakpoint(NewBreakpoint { expression: Some(text), step: None }),
        };
        if asked {
            (self.ask.text, self.ask.edited) = (String::new(), None);
        }
    }

    fn break_at(&mut self, step: usize) {
        let is_here = |breakpoint: &&BreakpointView| {
            Expression::condition(&breakpoint.expression).is_ok_and(|read| read.step_named() == Some(step))
        };
        match self.ask.breakpoints.iter().find(is_here).map(|breakpoint| breakpoint.number) {
            Some(number) => self.remove_breakpoint(number),
            None => {
                self.add_breakpoint(NewBreakpoint { expression: None, step: Some(step) });
            }
        }
    }

    fn remove_breakpoint(&mut self, number: usize) {
        if let Some(removed) = self.take_breakpoint_out(number) {
            let (expression, is_on) = (removed.expression, removed.on);
            let what = format!("the breakpoint `{expression}`");
            self.did_remove(&what, Deed::RemovedBreakpoint { expression, is_on });
        }
    }

    /// The next hit after a step, or the last one before it, in the run at the cursor.
    pub fn hit_from(&self, step: usize, is_forward: bool) -> Option<usize> {
        let (target, run) = (self.cursor.target?, self.cursor.run);
        let hits = self.ask.watched().map(|(_, breakpoint)| Asking::hits(breakpoint, target, run));
        if is_forward {
            hits.filter_map(|steps| steps.get(steps.partition_point(|hit| *hit <= step)).copied()).min()
        } else {
            let before = |steps: &[usize]| steps.partition_point(|hit| *hit < step).checked_sub(1);
            hits.filter_map(|steps| before(steps).map(|at| steps[at])).max()
        }
    }

    /// The conditions of the breakpoints that a step hits in a run of a target.
    pub(crate) fn hit_at(&self, target: usize, run: usize, step: usize) -> Vec<&str> {
        let is_hit =
            |breakpoint: &BreakpointView| Asking::hits(breakpoint, target, run).binary_search(&step).is_ok();
        let hit = self.ask.watched().filter(|(_, breakpoint)| is_hit(breakpoint));
        hit.map(|(_, breakpoint)| breakpoint.expression.as_str()).collect()
    }

    fn go_to_hit(&mut self, is_forward: bool) {
        match self.hit_from(self.cursor.step, is_forward) {
            Some(step) => self.perform(Command::Go(Go::Step(step))),
            None if self.ask.watched().next().is_none() => {
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
