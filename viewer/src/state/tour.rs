//! The tour: begun by itself on the first drive, where it was never seen.

use sightline_core::sim::library;

use super::State;
use crate::command::Mode;
use crate::tour::Turn;

impl State {
    /// Goes on in the tour as asked.
    pub(super) fn turn_tour(&mut self, turn: Turn) {
        self.tour.turn(turn);
    }

    /// Begins the tour on the first drive as soon as its target is there, unless it was seen before.
    pub(super) fn sync_tour(&mut self) {
        let is_first = self.traverse.as_ref().is_some_and(|open| open.name == library::FIRST_NAME);
        let is_new = !self.tour.is_seen && self.tour.at.is_none();
        if is_first && is_new && self.target().is_some() && self.mode == Mode::Look {
            self.turn_tour(Turn::Begin);
        }
    }
}
