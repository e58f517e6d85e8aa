//! What can be asked of the arrangement of the panels.

use crate::layout::presets::Preset;
use crate::panels::pane::Pane;

/// What can be asked of the arrangement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LayoutCommand {
    /// Arranges the panels as they came with the page.
    Use(Preset),
    /// Brings a panel to the front; one that was closed comes back.
    Show(Pane),
    /// Closes a panel.
    Close(Pane),
    /// Moves the keyboard by so many panels.
    Panel(isize),
    /// Lets the panel with the keyboard fill the page, or gives the others their place back.
    Maximise(Option<Pane>),
}
