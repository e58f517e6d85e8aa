//! The legend of an image: each mark with its shape and its word; a click hides or shows it.

use egui::{Rect, Sense, pos2, vec2};

use crate::command::{Command, Layer};
use crate::overlay::{Mark, paint_legend_row};
use crate::state::State;
use crate::theme;
use crate::view2d::Canvas;

/// One entry of a legend.
#[derive(Clone, Debug)]
pub struct Entry {
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
    pub fn new(layer: Layer, mark: Mark, colour: egui::Color32, word: impl Into<String>) -> Self {
        Self { layer, mark, colour, word: word.into() }
    }
}

/// Height of a row, points.
const ROW: f32 = 15.0;

/// Paints the legend in the upper left corner of the canvas, where there is room for it.
pub fn show(ui: &mut egui::Ui, canvas: &Canvas, entries: &[Entry], state: &State, out: &mut Vec<Command>) {
    let area = canvas.transform.rect;
    if entries.is_empty()
        || !state.marks
        || area.height() < ROW * entries.len() as f32 + 60.0
        || area.width() < 240.0
    {
        return;
    }
    let galleys = entries.iter().map(|entry| {
        canvas.painter.layout_no_wrap(entry.word.clone(), theme::image_font(), theme::TEXT).size().x
    });
    let width = galleys.fold(0.0_f32, f32::max) + 32.0;
    let size = vec2(width, ROW * entries.len() as f32 + 6.0);
    let frame = Rect::from_min_size(area.left_top() + vec2(6.0, 6.0), size);
    canvas.painter.rect_filled(frame, 4.0, theme::SCRIM);
    for (i, entry) in entries.iter().enumerate() {
        let at = pos2(frame.left() + 5.0, frame.top() + 3.0 + ROW * i as f32);
        let row = Rect::from_min_size(at, vec2(width - 8.0, ROW));
        let shown = !state.hidden.contains(&entry.layer);
        paint_legend_row(&canvas.painter, at, entry.mark, entry.colour, &entry.word, shown);
        let response = ui.interact(row, ui.scope_id().with(("legend", entry.layer)), Sense::click());
        let action = if shown { "hide" } else { "show" };
        response.widget_info(|| {
            egui::WidgetInfo::selected(egui::Role::CheckBox, true, shown, format!("{} (legend)", entry.word))
        });
        if response.on_hover_text(format!("Click to {action} “{}”", entry.word)).clicked() {
            out.push(Command::ToggleLayer(entry.layer));
        }
    }
}
