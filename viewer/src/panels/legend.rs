//! The legend of an image: each mark with its shape and label; a click hides or shows its layer.
//!
//! Over an image the legend is behind a button, so that the image keeps the space; in a panel it is in rows.

use egui::{Rect, Sense, Ui, vec2};

use crate::command::{Command, Layer};
use crate::drawing::overlay::{Mark, paint_legend_row};
use crate::state::State;
use crate::theme;

/// One entry of a legend.
#[derive(Clone, Debug)]
pub(crate) struct Entry {
    /// The layer that a click hides or shows.
    pub layer: Layer,
    /// The mark before the label.
    pub mark: Mark,
    /// The colour of the mark.
    pub colour: egui::Color32,
    /// The label.
    pub word: String,
}

impl Entry {
    /// Creates an entry.
    pub(crate) fn new(layer: Layer, mark: Mark, colour: egui::Color32, word: impl Into<String>) -> Self {
        Self { layer, mark, colour, word: word.into() }
    }
}

/// Height of a row, points.
const ROW: f32 = 15.0;

/// Width of a row beside its label, for mark and margins, points.
const MARK: f32 = 32.0;

/// The legend of an image as a button: it opens a list of the marks, in which a click hides or shows one.
pub(crate) fn button(ui: &mut Ui, entries: &[Entry], state: &State, out: &mut Vec<Command>) {
    if entries.is_empty() || !state.marks {
        return;
    }
    let hidden = entries.iter().filter(|entry| state.hidden.contains(&entry.layer)).count();
    let colour = if hidden == 0 { theme::text() } else { theme::accent() };
    let button = ui.add(egui::Button::new(egui::RichText::new("legend").size(11.0).color(colour)).small());
    let help = format!(
        "The meaning of the marks; a click on one hides or shows it. Hidden: {hidden} of {}",
        entries.len()
    );
    let button = button.on_hover_text(help);
    let ground = theme::on_image(theme::panel);
    let popup = egui::Popup::menu(&button).close_behavior(egui::PopupCloseBehavior::CloseOnClickOutside);
    popup.frame(egui::Frame::popup(ui.style()).fill(ground)).show(|ui| {
        let pass = ui.ctx().cumulative_pass_nr();
        ui.ctx().data_mut(|data| data.insert_temp(shown_id(), pass));
        theme::on_image(|| {
            for entry in entries {
                let width = width_of(ui, entry);
                let (place, _) = ui.allocate_exact_size(vec2(width, ROW), Sense::hover());
                row(ui, place, entry, state, out);
            }
        });
    });
}

fn shown_id() -> egui::Id {
    egui::Id::unique("pass in which a legend was shown")
}

/// Whether a legend is open. Unlike a list or a menu, a legend does not take the keyboard from the page.
pub(crate) fn is_open(context: &egui::Context) -> bool {
    let shown = context.data(|data| data.get_temp::<u64>(shown_id()));
    shown.is_some_and(|pass| pass + 1 >= context.cumulative_pass_nr())
}

/// Width of an entry in a row, points.
pub(crate) fn width_of(ui: &Ui, entry: &Entry) -> f32 {
    let galley = ui.painter().layout_no_wrap(entry.word.clone(), theme::image_font(), theme::text());
    galley.size().x + MARK
}

/// The legend of an image in rows above it, on the dark background on which its marks are painted.
///
/// Make the entries inside [`theme::on_image`], so that they have the colours of the marks.
pub(crate) fn above_image(ui: &mut Ui, entries: &[Entry], state: &State, out: &mut Vec<Command>) {
    if entries.is_empty() || !state.marks {
        return;
    }
    theme::on_image(|| {
        let frame = egui::Frame::new().fill(theme::panel()).inner_margin(3.0);
        frame.show(ui, |ui| {
            ui.set_width(ui.available_width());
            let shown = entries.iter().filter(|entry| !state.hidden.contains(&entry.layer));
            above(ui, &shown.cloned().collect::<Vec<_>>(), state, out);
        });
    });
}

/// The legend in rows.
pub(crate) fn above(ui: &mut Ui, entries: &[Entry], state: &State, out: &mut Vec<Command>) {
    let widths: Vec<f32> = entries.iter().map(|entry| width_of(ui, entry)).collect();
    rows(ui, entries, &widths, state, out);
}

/// The entries in sequence, wrapped to as many rows as needed.
fn rows(ui: &mut Ui, entries: &[Entry], widths: &[f32], state: &State, out: &mut Vec<Command>) {
    let area = ui.available_rect_before_wrap();
    let mut at = area.left_top();
    for (entry, width) in entries.iter().zip(widths) {
        if at.x > area.left() && at.x + width > area.right() {
            at = egui::pos2(area.left(), at.y + ROW);
        }
        row(ui, Rect::from_min_size(at, vec2(*width, ROW)), entry, state, out);
        at.x += width;
    }
    ui.add_space(at.y + ROW - area.top());
}

/// One entry in its own area; a click hides or shows its layer.
pub(crate) fn row(ui: &Ui, row: Rect, entry: &Entry, state: &State, out: &mut Vec<Command>) {
    let shown = !state.hidden.contains(&entry.layer);
    paint_legend_row(ui.painter(), row.min, entry.mark, entry.colour, &entry.word, shown);
    let response = ui.interact(row, ui.scope_id().with(("legend", entry.layer)), Sense::click());
    let action = if shown { "hide" } else { "show" };
    response.widget_info(|| {
        egui::WidgetInfo::selected(egui::Role::CheckBox, true, shown, format!("{} (legend)", entry.word))
    });
    if response.on_hover_text(format!("Click to {action} “{}”", entry.word)).clicked() {
        out.push(Command::ToggleLayer(entry.layer));
    }
}
