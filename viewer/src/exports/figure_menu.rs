//! The menu entries that save a panel as a figure: as vectors, or as pixels at a scale, with an optional caption.

use egui::{Button, Ui, vec2};

use crate::command::Command;
use crate::exports::ExportsCommand;
use crate::figure::request::{FigureFormat, FigurePage, FigureRequest};
use crate::panels::pane::Pane;
use crate::state::State;
use crate::theme;

/// Shows the entries of one panel.
pub(crate) fn entries(ui: &mut Ui, state: &State, pane: Pane, out: &mut Vec<Command>) {
    ui.label(theme::title("Save as a figure"));
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 3.0;
        for kind in FigureFormat::ALL {
            let button = ui.add(Button::new(kind.word()).min_size(vec2(24.0, 24.0)));
            let button = button.accessible_name(format!("save {} as {}", pane.title(), kind.word()));
            if button.clicked() {
                out.push(Command::Exports(ExportsCommand::Figure(FigureRequest { pane, kind })));
                ui.close();
            }
        }
    });
    sheets(ui, state, out);
    burn_in(ui, state, out);
}

/// Shows the choices of background and width.
pub(crate) fn sheets(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    for sheet in FigurePage::ALL {
        let button = Button::selectable(state.exports.sheet == sheet, sheet.words());
        if ui.add(button.min_size(vec2(24.0, 24.0))).clicked() {
            out.push(Command::Exports(ExportsCommand::Sheet(sheet)));
        }
    }
}

/// Shows the choice of a caption above the figure.
pub(crate) fn burn_in(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let mut is_on = state.exports.burns_in;
    let words = "with a line above: panel, drive, run, step";
    if ui.checkbox(&mut is_on, words).changed() {
        out.push(Command::Exports(ExportsCommand::BurnIn(is_on)));
    }
}
