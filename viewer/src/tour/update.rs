//! The tour: its start on the first drive if the user has not seen it, its actions, and its keys.

use egui::Key;
use sightline_world::library;

use crate::command::{Command, Go, Mode};
use crate::state::{State, events};
use crate::tour::{Bubble, Turn};
use crate::why::WhyCommand;

impl State {
    /// Carries out a command of the tour and the action of its bubble.
    pub(crate) fn turn_tour(&mut self, turn: Turn) {
        self.tour.turn(turn);
        if turn != Turn::End {
            self.do_bubble();
        }
    }

    /// Performs the action that the open bubble explains.
    fn do_bubble(&mut self) {
        let Some(bubble) = self.tour.bubble() else { return };
        if let Some(step) = self.lost_step().filter(|_| bubble != Bubble::Share) {
            // The first bubble starts just before the loss, the others at it.
            let step = if bubble == Bubble::Step { step.saturating_sub(1) } else { step };
            self.perform(Command::Go(Go::Step(step)));
        }
        match bubble {
            Bubble::Why if self.row().is_some() => self.perform(Command::Why(WhyCommand::Selected)),
            Bubble::WhatIf if self.row().is_some() => self.perform(Command::Why(WhyCommand::Saved)),
            _ => {}
        }
    }

    /// The first step at which the target is lost in the run at the cursor.
    pub(super) fn lost_step(&self) -> Option<usize> {
        let is_lost = |step: &usize| self.row_at(*step).is_some_and(|row| row.state == "lost");
        events(self.run()?).into_iter().find(is_lost)
    }

    /// Starts the tour on the first drive once its target is loaded. If it was seen before, the cursor goes to the loss
    /// once, unless a link or an earlier visit put it elsewhere.
    pub(crate) fn sync_tour(&mut self) {
        let is_first = self.traverse.as_ref().is_some_and(|open| open.name == library::FIRST_NAME);
        if !is_first || self.tour.at.is_some() || self.target().is_none() || self.mode != Mode::Look {
            return;
        }
        if !self.tour.is_seen {
            self.tour.has_shown_loss = true;
            self.turn_tour(Turn::Begin);
        } else if !self.tour.has_shown_loss {
            let lost = self.lost_step().filter(|_| self.cursor.step == 0);
            self.tour.has_shown_loss = lost.is_some() || self.cursor.step != 0;
            if let Some(step) = lost {
                self.perform(Command::Go(Go::Step(step)));
            }
        }
    }
}

/// The tour command of a key while the tour is open.
pub(crate) fn of_key(key: Key, state: &State) -> Option<Turn> {
    if state.tour.at.is_none() || state.mode != Mode::Look {
        return None;
    }
    match key {
        Key::Enter => Some(Turn::Next),
        Key::Backspace => Some(Turn::Back),
        Key::Escape => Some(Turn::End),
        _ => None,
    }
}
