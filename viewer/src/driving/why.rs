//! Why the drive stopped: a card with the cause and its evidence, and the changes with which it would have continued.

use egui::{Frame, Label, Margin, RichText, Stroke, Ui};
use sightline_session::stop_cause::{DecisionChange, StopExplanation};

use crate::command::{Command, Go};
use crate::driving::{DrivingCommand, trial_drives};
use crate::layout::command::LayoutCommand;
use crate::panels::pane::Pane;
use crate::state::State;
use crate::theme;

/// Shows the cause in one sentence, with a button to its evidence.
pub(crate) fn headline(ui: &mut Ui, why: &StopExplanation, out: &mut Vec<Command>) {
    card(ui, |ui| {
        sentence(ui, why);
        if ui.button("Evidence and changes").on_hover_text("The panel Why at the last stop").clicked() {
            out.push(Command::Go(Go::Step(why.step)));
            out.push(Command::Layout(LayoutCommand::Show(Pane::Why)));
        }
    });
}

/// Shows why the drive stopped, if it did so at the cursor's stop: the cause, its evidence, and changes of the command.
pub(crate) fn show_here(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let why = state.drive().and_then(|drive| drive.why.as_ref());
    let Some(why) = why.filter(|why| why.step == state.cursor.step) else { return };
    card(ui, |ui| {
        sentence(ui, why);
        for sentence in &why.evidence {
            ui.add(Label::new(RichText::new(format!("• {sentence}")).size(12.0).color(theme::text())).wrap());
        }
        if !why.changes.is_empty() {
            ui.label(theme::note("Other decisions on the images of this stop:"));
        }
        for change in &why.changes {
            changed(ui, state, change, out);
        }
    });
}

/// Shows a change with its decision, the button that puts it into the form, and the trial drive with it.
fn changed(ui: &mut Ui, state: &State, change: &DecisionChange, out: &mut Vec<Command>) {
    ui.horizontal_wrapped(|ui| {
        if let Some(command) = &change.command {
            let help = "Puts this command into the form of the panel Drive; a branch at an earlier stop drives under it";
            let name = format!("use {}", change.text);
            if ui.small_button("Use").accessible_name(name).on_hover_text(help).clicked() {
                out.push(Command::Drive(DrivingCommand::Form(command.clone())));
                out.push(Command::Layout(LayoutCommand::Show(Pane::Drive)));
            }
        }
        let words = format!("{}: {}", change.text, change.decision);
        ui.add(Label::new(RichText::new(words).size(12.0).color(theme::text())).wrap());
    });
    ui.horizontal_wrapped(|ui| trial_drives::show(ui, state, change, out));
}

fn sentence(ui: &mut Ui, why: &StopExplanation) {
    ui.label(theme::title("why the drive stopped"));
    let sentence = RichText::new(&why.sentence).size(14.0).strong().color(theme::strong());
    ui.add(Label::new(sentence).wrap());
}

fn card(ui: &mut Ui, show: impl FnOnce(&mut Ui)) {
    let frame =
        Frame::new().stroke(Stroke::new(1.5, theme::failed())).corner_radius(4).inner_margin(Margin::same(6));
    frame.show(ui, |ui| {
        ui.set_min_width(ui.available_width());
        ui.spacing_mut().item_spacing.y = 3.0;
        show(ui);
    });
}
