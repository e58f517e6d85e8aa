//! The virtual range sensor: the rendered depth map of the earlier surface, and the depth errors of the current one at the
//! start, after the coarse search and at the end (D-Fig 5; R202).

use egui::Ui;
use sightline_track::trace::ArrayName;

use crate::command::Command;
use crate::drawing::overlay::Mark;
use crate::drawing::raster;
use crate::drawing::raster::Raster;
use crate::panels;
use crate::panels::shape::array_image::{ArrayImage, DisplayUnit, side_by_side, square};
use crate::panels::shape::histogram;
use crate::panels::shape::histogram::Errors;
use crate::panels::shape::part_context::{PartContext, ready, why_not};
use crate::theme;

/// The purpose of the part.
const PURPOSE: &str = "The earlier surface in the virtual range sensor, and the errors of depth.";
/// Height of the text between the images and the histogram, points.
const WORDS: f32 = 100.0;
/// Minimum automatic limit of the colours, m.
const LEAST_LIMIT_M: f64 = 0.001;

/// Shows the part.
pub(super) fn show(ui: &mut Ui, context: &PartContext<'_>, out: &mut Vec<Command>) {
    let compared = context.evidence.registration.as_ref().is_some_and(|found| found.mean_m[2].is_some());
    if !compared {
        panels::missing(ui, PURPOSE, &why_not(context, "comparison of surfaces"));
        return;
    }
    let array = |ui: &mut Ui, name: ArrayName| ready(ui, context.state.array(name), "virtual sensor");
    let Some(sensor) = array(ui, ArrayName::SENSOR) else { return };
    let Some(before) = array(ui, ArrayName::ERROR_BEFORE) else { return };
    let Some(coarse) = array(ui, ArrayName::ERROR_COARSE) else { return };
    let Some(end) = array(ui, ArrayName::ERROR_FINE) else { return };
    let automatic_m = limit_m(before);
    let limit_m = context.state.shape_view.error_limit_m.unwrap_or(automatic_m);
    let cm = DisplayUnit { word: "cm", factor: 100.0 };
    let error = Some(raster::ColourMap::Signed(limit_m as f32));
    let depth = Some(raster::ColourMap::Values(sensor.levels));
    let pictures = [
        ArrayImage {
            title: "earlier surface, depth",
            raster: sensor,
            colour_map: depth,
            unit: DisplayUnit { word: "m", factor: 1.0 },
        },
        ArrayImage { title: "error at the start", raster: before, colour_map: error, unit: cm },
        ArrayImage { title: "after the coarse search", raster: coarse, colour_map: error, unit: cm },
        ArrayImage { title: "at the end", raster: end, colour_map: error, unit: cm },
    ];
    // In one row or in two, whichever makes the images larger.
    let height = ui.available_height() - histogram::HEIGHT - WORDS;
    let [one_row, two_rows] = [(4, height), (2, height / 2.0)].map(|(n, high)| side_by_side(ui, n, high));
    let (columns, size) = if square(two_rows) > square(one_row) { (2, two_rows) } else { (4, one_row) };
    for row in pictures.chunks(columns) {
        ui.horizontal_top(|ui| {
            for picture in row {
                let placed = picture.show(ui, size);
                let [width, height] = picture.raster.size().map(|side| (f64::from(side) - 1.0) / 2.0);
                // The target is at the centre of the sensor.
                placed.mark(width, height, Mark::Plus, theme::strong());
            }
        });
    }
    let words = "error: current minus earlier depth; red: the current surface is deeper. Cross: target. Checker: at most one surface is visible.";
    ui.add(egui::Label::new(theme::note(words)).wrap());
    let errors = Errors { before: before.values.as_raw(), end: end.values.as_raw() };
    histogram::show(ui, context.state, &errors, [limit_m, automatic_m], out);
}

/// Counts of depth errors by bin: lower and upper edge, m, and pixels at the start and at the end.
pub(crate) fn error_counts(before: &Raster, end: &Raster) -> Vec<(f64, f64, [usize; 2])> {
    let errors = Errors { before: before.values.as_raw(), end: end.values.as_raw() };
    histogram::counts(&errors, limit_m(before))
}

/// The automatic limit of the colours, from the 1st and 99th percentiles of the errors, m.
fn limit_m(errors: &Raster) -> f64 {
    let [low, high] = errors.levels.map(f64::from);
    low.abs().max(high.abs()).max(LEAST_LIMIT_M)
}
