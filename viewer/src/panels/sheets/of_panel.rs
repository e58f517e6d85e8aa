//! The tables of a panel, and the switch between panel and tables.

use egui::{Button, Ui, vec2};

use crate::command::Command;
use crate::panels;
use crate::panels::pane::Pane;
use crate::panels::sheets::{Sheet, grid};
use crate::state::State;

/// The panels that can be shown as tables.
pub(crate) fn panes() -> impl Iterator<Item = Pane> {
    Pane::ALL.into_iter().filter(|pane| pane.has_table())
}

/// The contents of a panel as tables.
///
/// # Errors
/// A sentence that explains why there is no data, and how to obtain it.
pub(crate) fn of(state: &State, pane: Pane) -> Result<Vec<Sheet>, String> {
    match pane.panel().table() {
        Some(table) => table(state),
        None => Err("This panel is made of words and numbers already.".to_owned()),
    }
}

/// Shows a panel as tables.
pub(crate) fn show(ui: &mut Ui, state: &State, pane: Pane, out: &mut Vec<Command>) {
    match of(state, pane) {
        Ok(sheets) => grid::show(ui, &sheets, out),
        Err(sentence) => panels::missing(ui, "The values of this panel as a table.", &sentence),
    }
}

/// The switch between a panel and its table; nothing for a panel without tables.
pub(crate) fn switch(ui: &mut Ui, state: &State, pane: Pane, out: &mut Vec<Command>) {
    if !pane.has_table() {
        return;
    }
    let is_table = state.is_table(pane);
    let words = egui::RichText::new("table").size(11.0);
    let button = ui.add(Button::selectable(is_table, words).min_size(vec2(24.0, 20.0)));
    let button = button.on_hover_text("The values as a table, to be read and copied");
    let name = format!("{} as table", pane.title());
    button.widget_info(|| egui::WidgetInfo::selected(egui::Role::Button, true, is_table, &name));
    if button.clicked() {
        out.push(Command::Table(pane));
    }
}
