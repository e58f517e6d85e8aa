//! Why the drive stopped: a card with the cause and its evidence, and the changes with which it would have gone on.

use egui::{Frame, Label, Margin, RichText, Stroke, Ui};
use sightline_session::stop_cause::StopExplanation;

use crate::command::Command;
use crate::driving::Ask;
use crate::state::State;
use crate::theme;

/// Shows why the drive stopped, if it did so at the cursor's stop.
pub(crate) fn show_here(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let why = state.drive().and_then(|drive| drive.why.as_ref());
    if let Some(why) = why.filter(|why| why.step == state.cursor.step) {
        show(ui, why, out);
    }
}

/// Shows why a drive stopped.
pub(crate) fn show(ui: &mut Ui, why: &StopExplanation, out: &mut Vec<Command>) {
    let frame =
        Frame::new().stroke(Stroke::new(1.5, theme::failed())).corner_radius(4).inner_margin(Margin::same(6));
    frame.show(ui, |ui| {
        ui.set_min_width(ui.available_width());
        ui.spacing_mut().item_spacing.y = 3.0;
        ui.label(theme::title("why the drive stopped"));
        let headline = RichText::new(&why.sentence).size(14.0).strong().color(theme::strong());
        ui.add(Label::new(headline).wrap());
        for sentence in &why.evidence {
            ui.add(Label::new(RichText::new(format!("• {sentence}")).size(12.0).color(theme::text())).wrap());
        }
        if !why.changes.is_empty() {
            ui.label(theme::note("Other decisions on the images of this stop:"));
        }
        for change in &why.changes {
            ui.horizontal_wrapped(|ui| {
                if let Some(command) = &change.command {
                    let help = "Puts this command into the form; a branch at an earlier stop drives under it";
                    let name = format!("use {}", change.text);
                    let button = ui.small_button("Use").accessible_name(name).on_hover_text(help);
                    if button.clicked() {
                        out.push(Command::Drive(Ask::Form(command.clone())));
                    }
                }
                let words = format!("{}: {}", change.text, change.decision);
                ui.add(Label::new(RichText::new(words).size(12.0).color(theme::text())).wrap());
            });
        }
    });
}
