//! The menu “View”: arrangements, colours, the tour, and access to palette and help.

use egui::Ui;

use crate::command::Command;
use crate::command::table;
use crate::command::table::{COPY_LINK, HELP, PALETTE, UserCommand};
use crate::layout::command::LayoutCommand;
use crate::layout::presets::Preset;
use crate::state::State;
use crate::theme;
use crate::theme::ColourTheme;
use crate::tour::Turn;

/// Shows the menu's button, and the menu while it is open.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let button = egui::Button::new("View").min_size(egui::vec2(26.0, 24.0));
    let (response, _) = egui::containers::menu::MenuButton::from_button(button).ui(ui, |ui| {
        ui.set_min_width(230.0);
        entry(ui, &PALETTE, state, out);
        ui.separator();
        ui.label(theme::title("Arrangement"));
        for preset in Preset::ALL {
            let command = Command::Layout(LayoutCommand::Use(preset));
            let words = format!("{} ({})", preset.title(), table::keys_of(state, &command));
            if ui.button(words).on_hover_text(preset.purpose()).clicked() {
                out.push(command);
            }
        }
        ui.separator();
        ui.label(theme::title("Colours"));
        for colour_theme in ColourTheme::ALL {
            if ui.radio(state.colour_theme == colour_theme, colour_theme.title()).clicked() {
                out.push(Command::SetColourTheme(colour_theme));
            }
        }
        ui.separator();
        let mut are_on = state.single_keys;
        let check = ui.checkbox(&mut are_on, "Keys act without Ctrl");
        let help = format!(
            "Off: letters, digits and Space do nothing by themselves. The palette ({}) has everything they do.",
            PALETTE.keys()
        );
        if check.on_hover_text(help).changed() {
            out.push(Command::SetSingleKeys(are_on));
        }
        ui.separator();
        entry(ui, &COPY_LINK, state, out);
        if ui.button("Tour").clicked() {
            out.push(Command::Tour(Turn::Begin));
        }
        entry(ui, &HELP, state, out);
    });
    response.on_hover_text("Arrangements, colours, and where everything else is found");
}

/// An entry of the menu: the name of a command with its keys.
fn entry(ui: &mut Ui, command: &UserCommand, state: &State, out: &mut Vec<Command>) {
    if ui.button(command.with_keys(command.name)).clicked() {
        out.push((command.command)(state));
    }
}
