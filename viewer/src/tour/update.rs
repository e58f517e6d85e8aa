//! The tour: begun by itself on the first drive, where it was never seen; and what the keys ask of it.

use egui::Key;
use sightline_world::library;

use crate::command::Mode;
use crate::state::State;
use crate::tour::Turn;

impl State {
    /// Goes on in the tour as asked.
    pub(crate) fn turn_tour(&mut self, turn: Turn) {
        self.tour.turn(turn);
    }

    /// Begins the tour on the first drive as soon as its target is there, unless it was seen before.
    pub(crate) fn sync_tour(&mut self) {
        let is_first = self.traverse.as_ref().is_some_and(|open| open.name == library::FIRST_NAME);
        let is_new = !self.tour.is_seen && self.tour.at.is_none();
        if is_first && is_new && self.target().is_some() && self.mode == Mode::Look {
            self.turn_tour(Turn::Begin);
        }
    }
}

/// What a key asks of the open tour; keys that mean something else to a panel with the focus are left to it.
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
