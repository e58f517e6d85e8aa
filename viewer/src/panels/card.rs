//! The card of a problem: one sentence, a hint, its code, and details that help to find it in the server's log. It is
//! shown above the panels until it is closed, and remains among the messages.

use egui::{Align, Align2, Area, CollapsingHeader, Id, Label, Layout, Order, RichText, Ui, WidgetInfo, vec2};

use crate::command::Command;
use crate::state::State;
use crate::state::messages::{Message, Weight};
use crate::theme;

/// Width of the card, points.
const WIDTH: f32 = 380.0;
/// Offset from the page's lower right corner, points: above the timeline.
const AWAY: [f32; 2] = [-14.0, -130.0];

/// Shows the card of the latest problem, until it is closed.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let Some(message) = state.messages.card() else { return };
    let area = Area::new(Id::unique("card of a problem")).order(Order::Foreground);
    area.anchor(Align2::RIGHT_BOTTOM, AWAY).show(ui.ctx(), |ui| {
        let frame = egui::Frame::popup(ui.style()).inner_margin(10);
        let shown = frame.show(ui, |ui| {
            ui.set_width(WIDTH);
            ui.horizontal(|ui| {
                ui.label(theme::title("problem"));
                ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                    let close = egui::Button::new("Close").min_size(vec2(24.0, 24.0));
                    if ui.add(close).accessible_name("close the problem").clicked() {
                        out.push(Command::CloseCard);
                    }
                    copy(ui, message);
                });
            });
            body(ui, message);
        });
        let words = format!("problem: {}", message.text);
        shown.response.widget_info(|| WidgetInfo::labeled(egui::Role::Alert, true, &words));
    });
}

/// A button that copies a message with its hint, code and details.
pub(crate) fn copy(ui: &mut Ui, message: &Message) {
    let name = format!("copy message: {}", message.text);
    let button = egui::Button::new("Copy").min_size(vec2(24.0, 24.0));
    if ui.add(button).accessible_name(name).clicked() {
        ui.ctx().copy_text(message.words());
    }
}

/// The sentence, the hint, the code and the details.
pub(crate) fn body(ui: &mut Ui, message: &Message) {
    let is_problem = message.weight == Weight::Problem;
    let colour = if is_problem { theme::lost() } else { theme::text() };
    ui.add(Label::new(RichText::new(&message.text).color(colour)).wrap().selectable(true));
    if let Some(hint) = &message.hint {
        ui.add(Label::new(theme::note(hint).color(theme::text())).wrap());
    }
    let Some(about) = &message.about else { return };
    ui.label(theme::note(format!("code {}", about.code)));
    if about.details.is_empty() {
        return;
    }
    CollapsingHeader::new("Details").id_salt(("details", message.id)).show(ui, |ui| {
        for (name, value) in &about.details {
            ui.horizontal_wrapped(|ui| {
                ui.label(theme::label(*name));
                ui.add(Label::new(RichText::new(value).monospace().size(11.0)).wrap().selectable(true));
            });
        }
    });
}
