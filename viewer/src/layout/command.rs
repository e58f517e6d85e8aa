//! Commands that change the arrangement of the panels.

use crate::layout::presets::Preset;
use crate::panels::pane::Pane;

/// A command that changes the arrangement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LayoutCommand {
    /// Restores a predefined arrangement.
    Use(Preset),
    /// Brings a panel to the front; reopens a closed one.
    Show(Pane),
    /// Closes a panel.
    Close(Pane),
    /// Moves the keyboard focus by a number of panels.
    Panel(isize),
    /// Maximises a panel (`None`: the current one), or restores the others if one is maximised.
    Maximise(Option<Pane>),
}
