//! The menu of what the page looks like: arrangements, closed panels, colours, and where everything else is found.

use egui::Ui;

use crate::actions;
use crate::command::{Command, Mode};
use crate::layout::presets::Preset;
use crate::layout::workspace::LayoutCommand;
use crate::state::State;
use crate::theme::{self, Looks};
use crate::tour::Turn;

/// Shows the menu's button, and the menu while it is open.
pub fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let button = egui::Button::new("View").min_size(egui::vec2(26.0, 24.0));
    let (response, _) = egui::containers::menu::MenuButton::from_button(button).ui(ui, |ui| {
        ui.set_min_width(230.0);
        if ui.button("Everything by name (Ctrl+K)").clicked() {
            out.push(actions::palette());
        }
        ui.separator();
        ui.label(theme::title("Arrangement"));
        for (number, preset) in (1..).zip(Preset::ALL) {
            let words = format!("{} (Shift+{number})", preset.title());
            if ui.button(words).on_hover_text(preset.purpose()).clicked() {
                out.push(Command::Layout(LayoutCommand::Use(preset)));
            }
        }
        ui.separator();
        ui.label(theme::title("Colours"));
        for looks in Looks::ALL {
            if ui.radio(state.looks == looks, looks.title()).clicked() {
                out.push(Command::SetLooks(looks));
            }
        }
        ui.separator();
        let mut are_on = state.single_keys;
        let check = ui.checkbox(&mut are_on, "Keys act without Ctrl");
        let help = "Off: letters, digits and Space do nothing by themselves. The palette (Ctrl+K) has everything they do.";
        if check.on_hover_text(help).changed() {
            out.push(Command::SetSingleKeys(are_on));
        }
        ui.separator();
        if ui.button("Copy a link to this place (Y)").clicked() {
            out.push(Command::CopyLink);
        }
        if ui.button("Tour").clicked() {
            out.push(Command::Tour(Turn::Begin));
        }
        if ui.button("Keys and conventions (?)").clicked() {
            out.push(Command::SetMode(Mode::Help));
        }
    });
    response.on_hover_text("Arrangements, colours, and where everything else is found");
}
