//! What the pointer rests on, as the panels ask for it and as the page takes it out of the commands of a frame.

use egui::{Context, Order};
use sightline_geometry::frames::Pixel;

use crate::command::Command;
use crate::pointed::Pointed;
use crate::state::State;

impl State {
    /// The pixel of the left image that is pointed at, in whatever panel.
    pub(crate) fn pointed_left(&self) -> Option<Pixel> {
        self.pointed.filter(|_| self.marks)?.left()
    }

    /// The step that is pointed at, where that is another one than the cursor's.
    pub fn pointed_step(&self) -> Option<usize> {
        match self.pointed {
            Some(Pointed::Step(step)) if step != self.cursor.step && step < self.stop_count() => Some(step),
            _ => None,
        }
    }
}

/// Whether the pointer is on a window, a menu or a bubble above the panels.
fn is_covered(context: &Context) -> bool {
    let pointer = context.input(|input| input.pointer.hover_pos());
    let layer = pointer.and_then(|at| context.layer_id_at(at));
    layer.is_some_and(|layer| layer.order > Order::Background)
}

/// Takes the place under the pointer out of the commands of a frame; `None` below a window, a menu or a bubble.
pub(crate) fn taken(context: &Context, commands: &mut Vec<Command>) -> Option<Pointed> {
    taken_out(commands).filter(|_| !is_covered(context))
}

/// Takes what was pointed at out of the commands of a frame.
pub(crate) fn taken_out(commands: &mut Vec<Command>) -> Option<Pointed> {
    let mut pointed = None;
    commands.retain(|command| match command {
        Command::Point(at) => {
            pointed = Some(*at);
            false
        }
        _ => true,
    });
    pointed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_thing_pointed_at_is_taken_and_the_other_commands_stay() {
        let (here, there) = (Pointed::Step(3), Pointed::Left(Pixel::new(1.0, 2.0)));
        let mut commands = vec![Command::Point(here), Command::FitAll, Command::Point(there)];
        assert_eq!(taken_out(&mut commands), Some(there));
        assert_eq!(commands, [Command::FitAll]);
        assert_eq!(taken_out(&mut commands), None);
    }
}
