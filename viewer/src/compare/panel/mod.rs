//! Comparing runs: the choosers in the top bar, the views of the left image, and the differences in every readout.
//!
//! Each other panel makes one call into this module, so that all show the compared runs in the same way.

pub(crate) mod bar;
pub(crate) mod choosers;
pub(crate) mod difference;
pub(crate) mod marks;
pub(crate) mod modes;
pub(crate) mod readouts;
pub(crate) mod side_by_side;
pub(crate) mod surfaces;

use egui::{RichText, Sense, Ui, vec2};

use crate::compare::state::RunStyle;
use crate::drawing::overlay::paint_mark;
use crate::theme;

/// A run's mark with its name.
pub(crate) fn chip(ui: &mut Ui, style: RunStyle, words: &str) -> egui::Response {
    mark(ui, style);
    ui.label(RichText::new(words).size(12.0).color(theme::text()))
}

/// A run's mark alone.
pub(crate) fn mark(ui: &mut Ui, style: RunStyle) {
    let (frame, _) = ui.allocate_exact_size(vec2(13.0, 13.0), Sense::hover());
    paint_mark(ui.painter(), frame.center(), style.mark, style.colour, 5.5);
}
