//! The legend of an image: each mark with its shape and its word; a click hides or shows it.
//!
//! It never covers the image: it stands beside it where the image's shape leaves room there, else in rows above it.

use egui::{Rect, Sense, Ui, UiBuilder, vec2};

use crate::command::{Command, Layer};
use crate::drawing::overlay::{Mark, paint_legend_row};
use crate::state::State;
use crate::theme;

/// One entry of a legend.
#[derive(Clone, Debug)]
pub(crate) struct Entry {
    /// What it switches.
    pub layer: Layer,
    /// Its shape.
    pub mark: Mark,
    /// Its colour.
    pub colour: egui::Color32,
    /// Its word.
    pub word: String,
}

impl Entry {
    /// An entry.
    pub(crate) fn new(layer: Layer, mark: Mark, colour: egui::Color32, word: impl Into<String>) -> Self {
        Self { layer, mark, colour, word: word.into() }
    }
}

/// Height of a row, points.
const ROW: f32 = 15.0;

/// What a row's mark and margins take beside its word, points.
const MARK: f32 = 32.0;

/// Lays the legend out and gives the rest of the room to `show`: the image, `width_by_height` in shape, with
/// `below` points under it.
pub(crate) fn beside<R>(
    ui: &mut Ui,
    entries: &[Entry],
    (width_by_height, below): (f32, f32),
    state: &State,
    out: &mut Vec<Command>,
    show: impl FnOnce(&mut Ui, &mut Vec<Command>) -> R,
) -> R {
    if entries.is_empty() || !state.marks {
        return show(ui, out);
    }
    let widths: Vec<f32> = entries.iter().map(|entry| width_of(ui, entry)).collect();
    let widest = widths.iter().copied().fold(0.0_f32, f32::max);
    let area = ui.available_rect_before_wrap();
    let legend_height = ROW * entries.len() as f32;
    if !has_column(area, widest, legend_height, width_by_height, below) {
        rows(ui, entries, &widths, state, out);
        return show(ui, out);
    }
    let (left, rest) = area.split_left_right_at_x(area.left() + widest);
    for (i, entry) in entries.iter().enumerate() {
        let top = left.left_top() + vec2(0.0, 3.0 + ROW * i as f32);
        row(ui, Rect::from_min_size(top, vec2(widest, ROW)), entry, state, out);
    }
    let shown = show(&mut ui.new_child(UiBuilder::new().max_rect(rest).id_salt("beside")), out);
    ui.advance_cursor_after_rect(area);
    shown
}

/// Whether a column for the legend takes nothing from the image.
fn has_column(area: Rect, widest: f32, height: f32, width_by_height: f32, below: f32) -> bool {
    let room = area.height() - below;
    room >= height && area.width() - widest >= room * width_by_height
}

/// What an entry takes beside others, points.
pub(crate) fn width_of(ui: &Ui, entry: &Entry) -> f32 {
    let galley = ui.painter().layout_no_wrap(entry.word.clone(), theme::image_font(), theme::text());
    galley.size().x + MARK
}

/// The legend in rows above what follows.
pub(crate) fn above(ui: &mut Ui, entries: &[Entry], state: &State, out: &mut Vec<Command>) {
    let widths: Vec<f32> = entries.iter().map(|entry| width_of(ui, entry)).collect();
    rows(ui, entries, &widths, state, out);
}

/// The entries one after the other, in as many rows as they need.
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

/// One entry in an area of its own; a click hides or shows its layer.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_legend_stands_beside_the_image_only_where_that_makes_it_no_smaller() {
        let area = |width: f32| Rect::from_min_size(egui::Pos2::ZERO, vec2(width, 324.0));
        // A square image of 300 points and a legend of 150.
        assert!(has_column(area(450.0), 150.0, 100.0, 1.0, 24.0));
        assert!(!has_column(area(449.0), 150.0, 100.0, 1.0, 24.0));
        assert!(!has_column(area(450.0), 150.0, 301.0, 1.0, 24.0), "the legend itself must fit");
    }
}
