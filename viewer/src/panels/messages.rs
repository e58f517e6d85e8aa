//! The list of messages: what was said to the person, the newest first.

use egui::{Align, Layout, RichText, ScrollArea, Ui};

use crate::command::Command;
use crate::state::State;
use crate::state::messages::{Message, Weight};
use crate::{panels, theme};

/// Shows the list.
pub fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    if state.messages.all().is_empty() {
        panels::missing(
            ui,
            "",
            "No messages. Whatever is refused or fails is written here, with how to mend it.",
        );
        return;
    }
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        for message in state.messages.all().iter().rev() {
            show_message(ui, message, out);
        }
    });
}

fn show_message(ui: &mut Ui, message: &Message, out: &mut Vec<Command>) {
    let is_problem = message.weight == Weight::Problem;
    let colour = if is_problem { theme::lost() } else { theme::text() };
    egui::Frame::new().fill(theme::bar()).corner_radius(4).inner_margin(6).show(ui, |ui| {
        ui.horizontal(|ui| {
            ui.label(theme::title(if is_problem { "problem" } else { "note" }));
            if message.count > 1 {
                ui.label(theme::note(format!("{} times", message.count)));
            }
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                if ui.small_button("Dismiss").clicked() {
                    out.push(Command::Dismiss(message.id));
                }
                if ui.small_button("Copy").clicked() {
                    ui.ctx().copy_text(message.text.clone());
                }
            });
        });
        ui.add(egui::Label::new(RichText::new(&message.text).color(colour)).wrap().selectable(true));
        if let Some(hint) = &message.hint {
            ui.add(egui::Label::new(theme::note(hint)).wrap());
        }
        if let Some(link) = &message.link {
            ui.hyperlink_to(link, link);
        }
    });
}
