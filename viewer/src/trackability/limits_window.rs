//! The window of the limits of trackability: every limit with its unit, its default and its effect.

use egui::{Grid, Id, Label, Modal, RichText, ScrollArea, TextEdit, Ui};
use sightline_rover::trackability::TrackabilityLimits;
use sightline_track::limits::{Domain, SettingInfo};

use crate::command::Command;
use crate::state::State;
use crate::theme;
use crate::trackability::limits::{LimitsCommand, LimitsForm};

/// Shows the window, while it is open.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let Some(form) = &state.trackability.form else { return };
    let modal = Modal::new(Id::unique("limits")).backdrop_color(theme::shade()).show(ui.ctx(), |ui| {
        ui.set_width(560.0);
        ui.label(RichText::new("Limits of trackability").size(16.0).strong().color(theme::strong()));
        ui.add(
            Label::new(theme::note(
                "A place is good, risky or poor by these limits. Apply computes the map again.",
            ))
            .wrap(),
        );
        let height = (ui.ctx().content_rect().height() - 220.0).max(120.0);
        ScrollArea::vertical().max_height(height).auto_shrink([false, true]).show(ui, |ui| {
            Grid::new("limits").num_columns(4).spacing([10.0, 4.0]).striped(true).show(ui, |ui| {
                for info in TrackabilityLimits::table() {
                    field(ui, form, &info, out);
                    ui.end_row();
                }
            });
        });
        if let Some(sentence) = &form.refused {
            ui.add(Label::new(RichText::new(sentence).color(theme::lost())).wrap());
        }
        ui.horizontal(|ui| {
            for (words, command) in [("Apply", LimitsCommand::Use), ("Reset", LimitsCommand::Defaults)] {
                if ui.button(words).clicked() {
                    out.push(Command::Limits(command));
                }
            }
            ui.button("Close").clicked()
        })
        .inner
    });
    if modal.inner || modal.should_close() {
        out.push(Command::Limits(LimitsCommand::Close));
    }
}

fn field(ui: &mut Ui, form: &LimitsForm, info: &SettingInfo, out: &mut Vec<Command>) {
    let mut text = form.texts.get(&info.key).cloned().unwrap_or_default();
    let default = info.default.to_string();
    let is_changed = text.trim() != default;
    let colour = if is_changed { theme::accent() } else { theme::text() };
    let range = match &info.domain {
        Domain::Between(low, high) => format!("from {low} to {high}"),
        _ => String::new(),
    };
    let help = format!("{}\n\nvalues: {range}\nsource: {}", info.help, info.source);
    ui.label(RichText::new(&info.key).size(12.0).color(colour)).on_hover_text(help);
    let field = ui.add_sized([80.0, 22.0], TextEdit::singleline(&mut text)).accessible_name(&info.key);
    if field.changed() {
        out.push(Command::Limits(LimitsCommand::Type { key: info.key.clone(), text }));
    }
    ui.label(theme::note(&info.unit));
    ui.label(theme::note(format!("default {default}")));
}
