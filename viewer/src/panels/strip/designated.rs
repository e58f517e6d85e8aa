//! The template of the designation: the left image about the designated pixel, shown before the patch of the right image.
//!
//! It consists of whole pixels of the image; the tracker resamples the template about the sub-pixel.

use egui::{Rect, Sense, Ui};
use sightline_geometry::frames::Pixel;
use sightline_session::step::RunStep;

use crate::panels::strip::hovered::{Cut, cut};
use crate::panels::strip::patch::{paint_patch, paint_title};
use crate::state::State;
use crate::theme;

/// The title of the patch.
const TITLE: &str = "template";

/// The designated pixel; `None` if the step is not a designation.
pub(super) fn pixel(trace: &RunStep) -> Option<Pixel> {
    trace.located().filter(|_| trace.prediction().is_none())?.left_pixel
}

/// Shows the template about `pixel`.
pub(super) fn show(ui: &mut Ui, state: &State, pixel: Pixel, frame: Rect) {
    paint_title(ui, frame, TITLE);
    match cut(ui, state, pixel, Cut::Template) {
        Some(raster) => paint_patch(ui, &raster, frame),
        None => {
            ui.painter().rect_filled(frame, 0.0, theme::well());
        }
    }
    let stroke = egui::Stroke::new(1.0, theme::line());
    ui.painter().rect_stroke(frame, 0.0, stroke, egui::StrokeKind::Outside);
    let response = ui.interact(frame, ui.scope_id().with("template patch"), Sense::hover());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, format!("{TITLE} patch")));
    response.on_hover_text("The left image about the designated pixel, which later stops are matched with.");
}
