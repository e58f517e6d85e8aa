//! A patch of the strip: its title, its pixels and their statistics.

use egui::{Align2, Rect, Ui, pos2, vec2};

use crate::drawing::raster::Raster;
use crate::drawing::view2d;
use crate::panels::numbers::fixed;
use crate::theme;

/// Width of the arrow and its text between two patches, points.
pub(super) const BETWEEN: f32 = 68.0;

/// The title above a patch.
pub(super) fn paint_title(ui: &Ui, frame: Rect, title: &str) {
    let above = frame.center_top() - vec2(0.0, 3.0);
    ui.painter().text(above, Align2::CENTER_BOTTOM, title, theme::image_font(), theme::text());
}

/// A patch with its statistics below it.
pub(super) fn paint_patch(ui: &Ui, raster: &Raster, frame: Rect) {
    view2d::checker(ui.painter(), frame);
    let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
    ui.painter().image(raster.texture.id(), frame, whole, theme::UNTINTED);
    statistics(ui, raster, frame);
}

/// Mean and standard deviation below a patch.
fn statistics(ui: &Ui, raster: &Raster, frame: Rect) {
    let below = frame.center_bottom() + vec2(0.0, 4.0);
    let [mean, std] = [raster.mean, raster.sigma].map(|value| fixed(f64::from(value), 3));
    let words = match frame.width() + BETWEEN {
        room if room > 170.0 => format!("mean {mean} ± std {std}"),
        _ => format!("{mean} ± {std}"),
    };
    ui.painter().text(below, Align2::CENTER_TOP, words, theme::digit_font(), theme::text());
}
