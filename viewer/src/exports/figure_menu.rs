//! Saving a panel as a figure, from its menu: as vectors, or as pixels at a scale; with a line that says of what.

use egui::{Button, Ui, vec2};

use crate::command::Command;
use crate::exports::Ask;
use crate::figure::wish::{Kind, Sheet, Wish};
use crate::panels::pane::Pane;
use crate::state::State;
use crate::theme;

/// The entries for one panel.
pub(crate) fn entries(ui: &mut Ui, state: &State, pane: Pane, out: &mut Vec<Command>) {
    ui.label(theme::title("Save as a figure"));
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 3.0;
        for kind in Kind::ALL {
            let button = ui.add(Button::new(kind.word()).min_size(vec2(24.0, 24.0)));
            let button = button.accessible_name(format!("save {} as {}", pane.title(), kind.word()));
            if button.clicked() {
                out.push(Command::Exports(Ask::Figure(Wish { pane, kind })));
                ui.close();
            }
        }
    });
    sheets(ui, state, out);
    burn_in(ui, state, out);
}

/// Ground and width of figures.
pub(crate) fn sheets(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    for sheet in Sheet::ALL {
        let button = Button::selectable(state.exports.sheet == sheet, sheet.words());
        if ui.add(button.min_size(vec2(24.0, 24.0))).clicked() {
            out.push(Command::Exports(Ask::Sheet(sheet)));
        }
    }
}

/// Whether a line above the figure says what it is of.
pub(crate) fn burn_in(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let mut is_on = state.exports.burns_in;
    let words = "with a line above: panel, drive, run, step";
    if ui.checkbox(&mut is_on, words).changed() {
        out.push(Command::Exports(Ask::BurnIn(is_on)));
    }
}
