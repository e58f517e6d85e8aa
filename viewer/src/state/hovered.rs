//! The hovered location: queries of the panels, and its extraction from the commands of a frame.

use egui::{Context, Order};
use sightline_geometry::frames::Pixel;

use crate::command::Command;
use crate::hovered::Hovered;
use crate::state::State;

impl State {
    /// The hovered pixel of the left image, in any panel; `None` while marks are hidden.
    pub(crate) fn hovered_left(&self) -> Option<Pixel> {
        self.hovered.filter(|_| self.marks)?.left()
    }

    /// The hovered step, if it is not the cursor's.
    pub fn hovered_step(&self) -> Option<usize> {
        match self.hovered {
            Some(Hovered::Step(step)) if step != self.cursor.step && step < self.stop_count() => Some(step),
            _ => None,
        }
    }
}

/// Whether a window, a menu or a bubble covers the panels at the pointer.
fn is_covered(context: &Context) -> bool {
    let pointer = context.input(|input| input.pointer.hover_pos());
    let layer = pointer.and_then(|at| context.layer_id_at(at));
    layer.is_some_and(|layer| layer.order > Order::Background)
}

/// Removes the hovered location from the commands of a frame; `None` below a window, a menu or a bubble.
pub(crate) fn take_hovered(context: &Context, commands: &mut Vec<Command>) -> Option<Hovered> {
    remove_hovered(commands).filter(|_| !is_covered(context))
}

/// Removes all hovered locations from the commands and returns the last one.
pub(crate) fn remove_hovered(commands: &mut Vec<Command>) -> Option<Hovered> {
    let mut hovered = None;
    commands.retain(|command| match command {
        Command::Hover(at) => {
            hovered = Some(*at);
            false
        }
        _ => true,
    });
    hovered
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_hovered_location_is_removed_from_the_commands() {
        let (here, there) = (Hovered::Step(3), Hovered::Left(Pixel::new(1.0, 2.0)));
        let mut commands = vec![Command::Hover(here), Command::FitAll, Command::Hover(there)];
        assert_eq!(remove_hovered(&mut commands), Some(there));
        assert_eq!(commands, [Command::FitAll]);
        assert_eq!(remove_hovered(&mut commands), None);
    }
}
