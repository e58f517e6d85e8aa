//! Comparing runs: the choosers in the top bar, the ways of the left image, and the differences in every readout.
//!
//! Other panels call into here, one call a place, so that what is compared looks alike everywhere.

pub(crate) mod bar;
pub(crate) mod choosers;
pub(crate) mod difference;
pub(crate) mod marks;
pub(crate) mod modes;
pub(crate) mod readouts;
pub(crate) mod side_by_side;
pub(crate) mod surfaces;

use egui::{RichText, Sense, Ui, vec2};

use crate::compare::state::Look;
use crate::drawing::overlay::paint_mark;
use crate::theme;

/// A run's mark with its name.
pub(crate) fn chip(ui: &mut Ui, look: Look, words: &str) -> egui::Response {
    mark(ui, look);
    ui.label(RichText::new(words).size(12.0).color(theme::text()))
}

/// A run's mark alone.
pub(crate) fn mark(ui: &mut Ui, look: Look) {
    let (frame, _) = ui.allocate_exact_size(vec2(13.0, 13.0), Sense::hover());
    paint_mark(ui.painter(), frame.center(), look.mark, look.colour, 5.5);
}
