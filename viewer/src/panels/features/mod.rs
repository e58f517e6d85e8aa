//! The feature tracker at one step: detected and matched features, the motion that most matches support, and its
//! uncertainty (R169, R170, R184).
//!
//! The filters at the top also apply to the images.

pub(crate) mod charts;
mod counts;
mod filters;
pub(crate) mod marks;

use egui::{ScrollArea, Ui};
use sightline_track::locate::features::FeatureEvidence;
use sightline_track::locate::features::rows::Feature;

use crate::cache::Slot;
use crate::command::Command;
use crate::panels::panel::{Panel, TableOf};
use crate::panels::sheets;
use crate::state::State;
use crate::tables::MatchOutcome;
use crate::theme;

/// Minimum width at which tables and plots are side by side, points.
const TWO_COLUMNS: f32 = 620.0;

/// The panel “Features”.
pub(crate) struct Features;

impl Panel for Features {
    fn show(&self, ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
        show(ui, state, out);
    }

    fn missing(&self, state: &State) -> Option<String> {
        detected(state).is_none().then(|| state.missing_features())
    }

    fn table(&self) -> Option<TableOf> {
        Some(sheets::features::features)
    }
}

/// The feature tracker's evidence at the current step; `None` until features were detected.
fn detected(state: &State) -> Option<&FeatureEvidence> {
    state.feature_evidence().filter(|evidence| evidence.detect.is_some())
}

/// Shows the panel.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let Some(evidence) = detected(state) else { return };
    filters::show(ui, state, out);
    let features = match state.features() {
        Slot::Ready(features) => Ok(features.as_slice()),
        Slot::Failed(problem) => Err(format!("The features cannot be shown: {}", problem.detail)),
        Slot::Absent | Slot::Loading => Err("Loading the features …".to_owned()),
    };
    let sentence = features.as_ref().map_or_else(Clone::clone, |features| shown(state, features));
    ui.add(egui::Label::new(theme::note(sentence)).truncate());
    ui.separator();
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        let plots = |ui: &mut Ui| draw_charts(ui, state, evidence, features.as_deref().unwrap_or_default());
        if ui.available_width() < TWO_COLUMNS {
            tables(ui, state, evidence, out);
            plots(ui);
        } else {
            ui.columns(2, |columns| {
                tables(&mut columns[0], state, evidence, out);
                plots(&mut columns[1]);
            });
        }
    });
}

fn tables(ui: &mut Ui, state: &State, evidence: &FeatureEvidence, out: &mut Vec<Command>) {
    counts::show(ui, state, evidence, out);
    ui.add_space(4.0);
    counts::anchors(ui, evidence);
    ui.add_space(4.0);
    counts::motion(ui, evidence);
    ui.add_space(4.0);
}

fn draw_charts(ui: &mut Ui, state: &State, evidence: &FeatureEvidence, features: &[Feature]) {
    let Some(motion) = &evidence.fit_motion else { return };
    charts::residuals(ui, state, features);
    charts::consensus(ui, motion);
}

/// The number of features of each kind that pass the filters.
fn shown(state: &State, features: &[Feature]) -> String {
    let words = |kind: MatchOutcome| state.feature_view.count(features, kind).words();
    format!(
        "shown: {} inliers, {} outliers, {} features without a match",
        words(MatchOutcome::Inlier),
        words(MatchOutcome::Outlier),
        words(MatchOutcome::Unmatched)
    )
}
