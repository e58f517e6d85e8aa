//! The virtual range sensor: the earlier surface as it sees it, and how far the present one is from it before, after the
//! coarse search and at the end (D-Fig 5; R202).

use egui::Ui;
use sightline_track::trace::ArrayName;

use crate::command::Command;
use crate::drawing::overlay::Mark;
use crate::drawing::raster;
use crate::drawing::raster::Raster;
use crate::panels;
use crate::panels::shape::histogram;
use crate::panels::shape::histogram::Errors;
use crate::panels::shape::look::{Look, ready, why_not};
use crate::panels::shape::picture::{Picture, Unit, side_by_side, square};
use crate::theme;

/// The sensor is asked for where both surfaces were compared.
const PURPOSE: &str = "The earlier surface in the virtual range sensor, and the errors of depth.";
/// Height of the words between the pictures and the histogram, points.
const WORDS: f32 = 100.0;
/// The least limit of the colours, m.
const LEAST_LIMIT_M: f64 = 0.001;

/// Shows the part.
pub(super) fn show(ui: &mut Ui, look: &Look<'_>, out: &mut Vec<Command>) {
    let compared = look.evidence.registration.as_ref().is_some_and(|found| found.mean_m[2].is_some());
    if !compared {
        panels::missing(ui, PURPOSE, &why_not(look, "comparison of surfaces"));
        return;
    }
    let array = |ui: &mut Ui, name: ArrayName| ready(ui, look.state.array(name), "virtual sensor");
    let Some(sensor) = array(ui, ArrayName::SENSOR) else { return };
    let Some(before) = array(ui, ArrayName::ERROR_BEFORE) else { return };
    let Some(coarse) = array(ui, ArrayName::ERROR_COARSE) else { return };
    let Some(end) = array(ui, ArrayName::ERROR_FINE) else { return };
    let automatic_m = limit_m(before);
    let limit_m = look.state.shape_view.error_limit_m.unwrap_or(automatic_m);
    let cm = Unit { word: "cm", factor: 100.0 };
    let error = Some(raster::Look::Signed(limit_m as f32));
    let depth = Some(raster::Look::Values(sensor.levels));
    let pictures = [
        Picture {
            title: "earlier surface, depth",
            raster: sensor,
            look: depth,
            unit: Unit { word: "m", factor: 1.0 },
        },
        Picture { title: "error at the start", raster: before, look: error, unit: cm },
        Picture { title: "after the coarse search", raster: coarse, look: error, unit: cm },
        Picture { title: "at the end", raster: end, look: error, unit: cm },
    ];
    // In one row or in two, whichever makes them larger.
    let height = ui.available_height() - histogram::HEIGHT - WORDS;
    let [one_row, two_rows] = [(4, height), (2, height / 2.0)].map(|(n, high)| side_by_side(ui, n, high));
    let (columns, size) = if square(two_rows) > square(one_row) { (2, two_rows) } else { (4, one_row) };
    for row in pictures.chunks(columns) {
        ui.horizontal_top(|ui| {
            for picture in row {
                let placed = picture.show(ui, size);
                let [width, height] = picture.raster.size().map(|side| (f64::from(side) - 1.0) / 2.0);
                // The sensor looks at the target.
                placed.mark(width, height, Mark::Plus, theme::strong());
            }
        });
    }
    let words = "error: current minus earlier depth; red: the current surface is deeper. Cross: target. Checker: at most one surface is visible.";
    ui.add(egui::Label::new(theme::note(words)).wrap());
    let errors = Errors { before: before.values.as_raw(), end: end.values.as_raw() };
    histogram::show(ui, look.state, &errors, [limit_m, automatic_m], out);
}

/// How many pixels have which error of depth: from, to, m, at the start and at the end.
pub(crate) fn error_counts(before: &Raster, end: &Raster) -> Vec<(f64, f64, [usize; 2])> {
    let errors = Errors { before: before.values.as_raw(), end: end.values.as_raw() };
    histogram::counts(&errors, limit_m(before))
}

/// What nearly all errors of a picture keep to, m.
fn limit_m(errors: &Raster) -> f64 {
    let [low, high] = errors.levels.map(f64::from);
    low.abs().max(high.abs()).max(LEAST_LIMIT_M)
}
