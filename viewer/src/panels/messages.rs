//! The list of messages, newest first: problems, then notes.

use egui::{Align, Color32, Layout, ScrollArea, Ui};

use crate::command::Command;
use crate::command::table::UNDO;
use crate::panels::card;
use crate::panels::panel::Panel;
use crate::state::State;
use crate::state::messages::{Message, Weight};
use crate::why::WhyCommand;
use crate::{panels, theme};

/// The panel “Messages”.
pub(crate) struct Messages;

impl Panel for Messages {
    fn show(&self, ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
        show(ui, state, out);
    }

    fn badge(&self, state: &State) -> Option<(usize, Color32)> {
        let problems = state.messages.all().iter().filter(|m| m.weight == Weight::Problem).count();
        (problems > 0).then(|| (problems, theme::lost()))
    }
}

/// Shows the list.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    if state.messages.all().is_empty() {
        panels::missing(
            ui,
            "",
            "No messages. Whatever is refused or fails is written here, with how to mend it.",
        );
        return;
    }
    let all = state.messages.all();
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        for (weight, title) in [(Weight::Problem, "Problems"), (Weight::Note, "Notes")] {
            let count = all.iter().filter(|message| message.weight == weight).count();
            if count == 0 {
                continue;
            }
            egui::CollapsingHeader::new(format!("{title} ({count})")).id_salt(title).default_open(true).show(
                ui,
                |ui| {
                    for message in all.iter().rev().filter(|message| message.weight == weight) {
                        show_message(ui, state, message, out);
                    }
                },
            );
        }
    });
}

fn show_message(ui: &mut Ui, state: &State, message: &Message, out: &mut Vec<Command>) {
    egui::Frame::new().fill(theme::bar()).corner_radius(4).inner_margin(6).show(ui, |ui| {
        ui.horizontal(|ui| {
            if message.count > 1 {
                ui.label(theme::note(format!("{} times", message.count)));
            }
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                if ui.small_button("Dismiss").clicked() {
                    out.push(Command::Dismiss(message.id));
                }
                card::copy(ui, message);
                undo(ui, state, message, out);
            });
        });
        card::body(ui, message);
        if let Some(link) = &message.link {
            ui.hyperlink_to(link, link);
        }
    });
}

/// A button that undoes the action of a message, as long as it was the last action.
pub(crate) fn undo(ui: &mut Ui, state: &State, message: &Message, out: &mut Vec<Command>) {
    if message.change.is_some_and(|change| state.undo.is_last(change)) {
        let button = egui::Button::new("Undo").min_size(egui::vec2(24.0, 22.0));
        if ui.add(button).on_hover_text(UNDO.with_keys("Undoes it")).clicked() {
            out.push(Command::Why(WhyCommand::Undo));
        }
    }
}
