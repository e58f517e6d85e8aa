//! The shape tracker at one step: the dense stereo surface, the virtual range sensor, the search, both meshes, and the
//! hand-off to other cameras (R155, R187–R203, R205).
//!
//! One part at a time, selected by its name; a part without data explains why.

mod hand_off;
mod histogram;
mod part_context;
mod meshes;
mod array_image;
pub(crate) mod search;
pub(crate) mod sensor;
mod scene;
mod surface;

use egui::{RichText, ScrollArea, Ui};
use sightline_track::locate::shape_tracker::ShapeEvidence;
use sightline_track::locate::shape_tracker::evidence::Registered;
use sightline_track::trace::StepTrace;

use crate::command::Command;
use crate::panels::panel::{Panel, TableOf};
use crate::panels::shape::part_context::PartContext;
use crate::panels::sheets;
use crate::shape_view::{ShapePart, ShapeView};
use crate::state::State;
use crate::theme;

/// The panel “Shape”.
pub(crate) struct Shape;

impl Panel for Shape {
    fn show(&self, ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
        show(ui, state, out);
    }

    fn missing(&self, state: &State) -> Option<String> {
        (state.trace().is_none() || state.shape_evidence().is_none()).then(|| state.missing_shape())
    }

    fn table(&self) -> Option<TableOf> {
        Some(sheets::shape::shape)
    }
}

/// Shows the panel.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let (Some(trace), Some(evidence)) = (state.trace(), state.shape_evidence()) else { return };
    let context = PartContext { state, trace, evidence };
    parts(ui, state, out);
    if let Some(words) = warning(trace, evidence) {
        ui.add(egui::Label::new(RichText::new(words).small().color(theme::lost())).wrap());
    }
    if let Some(found) = &evidence.registration {
        summary(ui, found);
    }
    ui.separator();
    // A low panel scrolls instead of shrinking its images.
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| match state.shape_view.part {
        ShapePart::Surface => surface::show(ui, &context),
        ShapePart::Sensor => sensor::show(ui, &context, out),
        ShapePart::Search => search::show(ui, &context),
        ShapePart::Meshes => meshes::show(ui, &context, out),
        ShapePart::HandOff => hand_off::show(ui, &context),
    });
}

/// The names of the parts.
fn parts(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 3.0;
        for part in ShapePart::ALL {
            let is_present = state.shape_view.part == part;
            if ui.selectable_label(is_present, part.title()).clicked() && !is_present {
                out.push(Command::SetShapeView(ShapeView { part, ..state.shape_view }));
            }
        }
    });
}

/// Warns if the prediction's 1σ exceeds the basin of convergence of the registration (R155).
fn warning(trace: &StepTrace, evidence: &ShapeEvidence) -> Option<String> {
    let half_width_m = evidence.registration.as_ref()?.half_width_m;
    let covariance = &trace.prediction()?.covariance_in_rover;
    let sigma_m = covariance.symmetric_eigenvalues().max().max(0.0).sqrt();
    (sigma_m > half_width_m).then(|| {
        format!(
            "The prediction is known to {:.0} cm (1σ), which is more than the half width of the rock, {:.0} cm: \
             a registration that starts from it may settle on another place.",
            sigma_m * 100.0,
            half_width_m * 100.0
        )
    })
}

/// A registration in one line, and the reason if it is not used.
fn summary(ui: &mut Ui, found: &Registered) {
    let mm = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |m| format!("{:.1}", m * 1000.0));
    let [before, coarse, end] = found.mean_m.map(mm);
    let seen = if found.is_hand_off { "handed over from" } else { "registered to" };
    let mut words = format!("{seen} step {}; mean distance {before} → {coarse} → {end} mm", found.to_step);
    if let Some(correction_m) = found.correction_m {
        words += &format!("; moved the target by {:.1} cm", correction_m * 100.0);
    }
    if let Some(sigmas) = found.sigmas_m {
        let [a, b, c] = sigmas.map(|sigma| sigma * 1000.0);
        words += &format!("; σ {a:.1}, {b:.1}, {c:.1} mm");
    }
    ui.add(egui::Label::new(theme::note(words).color(theme::text())).wrap());
    if let Some(reason) = &found.reason {
        let reason = format!("Not used: {reason}.");
        ui.add(egui::Label::new(RichText::new(reason).small().color(theme::failed())).wrap());
    }
}
