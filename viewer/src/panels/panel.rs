//! The trait of a panel: [`Panel`], implemented once per panel, in the panel's own file.
//!
//! A panel reads the [`State`] and pushes [`Command`]s; it changes nothing itself. Each panel has one entry in the table
//! of [`super`], from which tabs, menus, arrangements, the palette, tables and figures are generated.

use egui::{Color32, Margin, Ui};

use crate::command::Command;
use crate::panels::pane::Need;
use crate::panels::sheets::Sheet;
use crate::state::State;
use crate::theme;

/// A panel that can be moved, closed, shown as a table and saved as a figure.
pub trait Panel: Sync {
    /// Paints the panel into `ui` and pushes the user's commands.
    fn show(&self, ui: &mut Ui, state: &State, out: &mut Vec<Command>);

    /// Why the panel has nothing to show, and how to fill it; `None` if it can be shown.
    ///
    /// The page shows this sentence instead of calling [`Panel::show`].
    fn missing(&self, _state: &State) -> Option<String> {
        None
    }

    /// The function that returns the panel's values as tables; `None` if the panel has no table.
    fn table(&self) -> Option<TableOf> {
        None
    }

    /// A count in the title of the tab, with its colour.
    fn badge(&self, _state: &State) -> Option<(usize, Color32)> {
        None
    }

    /// Data that is fetched only while the panel is visible.
    fn needs(&self) -> &'static [Need] {
        &[]
    }

    /// Space between the panel's border and its contents.
    fn margin(&self) -> Margin {
        Margin::same(theme::MARGIN)
    }
}

/// Returns the values of a panel as tables, or a sentence that explains why there are none.
pub(crate) type TableOf = fn(&State) -> Result<Vec<Sheet>, String>;
