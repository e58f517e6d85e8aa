//! Keys while runs are compared: X shows the other run, the arrows move the divider of the wipe.

use egui::{Context, Id, Key};

use crate::command::Command;
use crate::compare::CompareCommand;
use crate::state::State;

/// The id of the wipe divider, which can have the keyboard focus.
pub(crate) fn wipe_id() -> Id {
    Id::unique("wipe divider")
}

/// Whether the divider has the focus, so that the keys that move it have no other effect.
pub(crate) fn is_divider_focused(context: &Context) -> bool {
    context.memory(|memory| memory.has_focus(wipe_id()))
}

/// Whether a key moves the divider.
pub(crate) const fn is_of_divider(key: Key) -> bool {
    matches!(key, Key::ArrowLeft | Key::ArrowRight | Key::Home | Key::End)
}

/// The command of pressing or releasing X.
pub(crate) fn blink_command(context: &Context, state: &State) -> Option<Command> {
    let is_held = context.input(|input| input.key_down(Key::X) && input.modifiers.is_none() && input.focused);
    let is_meant = is_held && !context.text_edit_focused() && state.is_comparing();
    (is_meant != state.compare.is_blinking).then_some(Command::Compare(CompareCommand::Blink(is_meant)))
}
