//! A number that can be asked about: a click leads to where it came from, the menu copies it too.

use egui::{Response, RichText, Ui};
use sightline_core::trace::StepTrace;

use crate::command::{Command, Stage};
use crate::state::why::Ask;

/// Shows a number as a link to where it came from; `name` is what it is called there.
pub(super) fn show(ui: &mut Ui, text: RichText, step: usize, name: &str, out: &mut Vec<Command>) {
    let words = text.text().to_owned();
    let response = ui.link(text).on_hover_text(format!("Why? Where {name} comes from"));
    ask(&response, step, name, &words, out);
}

/// Lets a click on something lead to where a value came from.
pub(super) fn ask(response: &Response, step: usize, name: &str, copied: &str, out: &mut Vec<Command>) {
    let why = || Command::Why(Ask::Value { step, value: name.to_owned() });
    if response.clicked() {
        out.push(why());
    }
    response.context_menu(|ui| {
        if ui.button("Why").clicked() {
            out.push(why());
            ui.close();
        }
        if ui.button("Copy value").clicked() {
            ui.ctx().copy_text(copied.to_owned());
            ui.close();
        }
    });
}

/// The name under which a field of a stage's record can be asked about; none where it cannot.
pub(super) fn name_of(trace: &StepTrace, stage: Stage, field: &str) -> Option<&'static str> {
    let is_template = matches!(
        trace.locate.as_ref().map(|located| &located.evidence),
        Some(sightline_core::locate::Evidence::Template(_))
    );
    Some(match (stage, field) {
        (Stage::Predict, "position_in_rover") => "predicted_position",
        (Stage::Predict, "covariance_in_rover") => "predicted_covariance_m2",
        (Stage::Predict, "travelled_m") => "travelled_m",
        (Stage::Predict, "travelled_since_update_m") => "travelled_since_update_m",
        (Stage::PointMast, "predicted_left") => "predicted_left",
        (Stage::PointMast, "predicted_covariance_px2") => "predicted_covariance_px2",
        (Stage::ScaleRoll, "scale") => "scale",
        (Stage::ScaleRoll, "roll_rad") => "roll_deg",
        (Stage::ScaleRoll, "old_distance_m") => "old_distance_m",
        (Stage::ScaleRoll, "new_distance_m") => "new_distance_m",
        (Stage::MatchTemplate, "score") => "ncc",
        (Stage::MatchTemplate, "pixel") => "match_px",
        (Stage::MatchTemplate, "covariance_px2") => "match_covariance_px2",
        (Stage::MatchTemplate, "search_window") => "search_window",
        (Stage::PointStereo, "score") => "stereo_score",
        (Stage::PointStereo, "right_pixel") => "right_px",
        (Stage::PointStereo, "disparity_px") => "disparity_px",
        (Stage::PointStereo, "left_right_px") => "left_right_px",
        (Stage::Triangulate, "gap_px") if is_template => "gap_px",
        (Stage::Locate, "left_pixel") => "left_px",
        (Stage::Locate, "position_in_rover") => "located_position",
        (Stage::Locate, "confidence") => "confidence",
        (Stage::MatchFeatures, "matches") => "matches",
        (Stage::FitMotion, "inliers") => "inliers",
        (Stage::Bootstrap, "covariance") => "feature_covariance",
        (Stage::Judge, "state") => "state",
        (Stage::Update, "correction_m") => "correction_m",
        (Stage::Update, "correction_px") => "correction_px",
        _ => return None,
    })
}
