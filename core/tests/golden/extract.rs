//! The numbers of a step, with names that only the golden lists use.
//!
//! The extractor reads the typed results of the stages field by field. Its names are independent of the record's field names
//! and of its serialised form, so that they remain valid when the record changes.

use sightline_geometry::camera::Camera;
use sightline_geometry::estimate::drift::Drift;
use sightline_session::step::RunStep;
use sightline_track::locate::Located;
use sightline_track::stages::capture::Capture;
use sightline_track::stages::judge::Verdict;
use sightline_track::stages::point_mast::Pointing;
use sightline_track::stages::predict::Prediction;
use sightline_track::stages::update::Updated;
use sightline_track::target::{Target, TrackingState};
use sightline_world::target_truth::{StepTruth, TruthKind};

use super::sheet::{Sheet, Value};
use super::{arrays, extract_features, extract_shape, extract_template};

/// Writes all results of one step; `folder` is the drive's folder, which messages may contain.
pub(crate) fn step(sheet: &mut Sheet, trace: &RunStep, folder: &str) {
    sheet.within(&format!("stop{}", trace.step), |sheet| {
        let fault = trace.fault().map(|fault| fault.replace(folder, "DRIVE"));
        sheet.put("time_s", trace.time_s);
        sheet.put("fault", fault);
        sheet.optional("predicted", trace.prediction(), predicted);
        sheet.optional("mast", Some(&trace.point_mast), mast);
        sheet.optional("images", trace.capture(), images);
        sheet.optional("located", trace.located(), located);
        sheet.optional("verdict", trace.verdict(), verdict);
        sheet.within("next", |sheet| next(sheet, &trace.update));
        sheet.optional("truth", trace.truth.as_ref(), truth);
        arrays::all(sheet, trace);
    });
}

fn predicted(sheet: &mut Sheet, prediction: &Prediction) {
    sheet.put("position_rover", prediction.position_in_rover);
    sheet.put("position_site", prediction.position_in_site);
    sheet.put("covariance", prediction.covariance_in_rover);
    sheet.put("step_m", prediction.step_length_m);
    sheet.put("since_update_m", prediction.travelled_since_update_m);
    sheet.put("since_designation_m", prediction.travelled_m);
}

fn mast(sheet: &mut Sheet, pointing: &Pointing) {
    sheet.put("wanted_rad", pointing.wanted);
    sheet.put("used_rad", pointing.used);
    sheet.put("left_px", pointing.predicted_left);
    sheet.put("right_px", pointing.predicted_right);
    sheet.put("left_covariance_px2", pointing.predicted_covariance_px2);
    sheet.within("left_camera", |sheet| camera(sheet, &pointing.left));
    sheet.within("right_camera", |sheet| camera(sheet, &pointing.right));
}

fn camera(sheet: &mut Sheet, camera: &Camera) {
    sheet.put("size", Value::integers(camera.size));
    sheet.put("centre_m", camera.model.centre());
    sheet.put("axis", camera.model.axis());
}

fn images(sheet: &mut Sheet, capture: &Capture) {
    sheet.put("left_size", Value::integers(capture.left_size));
    sheet.put("right_size", Value::integers(capture.right_size));
    let subframe = capture.subframe.map(|rect| {
        let corner = [i64::from(rect.x), i64::from(rect.y)];
        Value::integers(corner.into_iter().chain([rect.width, rect.height].map(i64::from)))
    });
    sheet.put("subframe", subframe);
    sheet.put("subframe_mean", capture.subframe_mean);
    sheet.put("subframe_saturated", capture.subframe_saturated);
    for (eye, image) in [("left", &capture.pair.left), ("right", &capture.pair.right)] {
        let (width, height) = image.dimensions();
        sheet.array(eye, &[width as usize, height as usize], image.as_raw());
    }
}

fn located(sheet: &mut Sheet, located: &Located) {
    sheet.put("left_px", located.left_pixel);
    sheet.put("right_px", located.right_pixel);
    sheet.within("left_error", |sheet| drift(sheet, &located.left_error));
    sheet.put("position_rover", located.position_in_rover);
    sheet.put("covariance", located.covariance_in_rover);
    sheet.put("surface_by_pixel", located.surface_by_pixel);
    sheet.put("confidence", located.confidence);
    sheet.put("missing", located.missing.as_deref());
    sheet.optional("template", located.evidence.template(), extract_template::evidence);
    sheet.optional("scene", located.evidence.features(), extract_features::evidence);
    sheet.optional("shape", located.evidence.shape(), extract_shape::evidence);
}

fn drift(sheet: &mut Sheet, drift: &Drift) {
    sheet.put("covariance_px2", drift.covariance_px2);
    sheet.put("bias_px", drift.bias_px);
    sheet.put("with_last_match_px", drift.with_last_match_px);
}

fn verdict(sheet: &mut Sheet, verdict: &Verdict) {
    for gate in &verdict.gates {
        sheet.within(&format!("gate.{}", gate.name), |sheet| {
            sheet.put("number", gate.criterion);
            sheet.put("unit", gate.unit.as_str());
            sheet.put("value", gate.value);
            sheet.put("limit", gate.limit);
            sheet.put("side", if gate.at_least { "at least" } else { "at most" });
            sheet.put("margin", gate.margin);
            sheet.put("passed", gate.passed);
        });
    }
    sheet.put("good", verdict.good);
    sheet.put("accepted", verdict.accepted);
    sheet.put("reason", verdict.reason.as_deref());
    sheet.put("state_before", state(verdict.state_before));
    sheet.put("state", state(verdict.state));
}

fn state(state: TrackingState) -> String {
    match state {
        TrackingState::Cleared => "cleared".into(),
        TrackingState::Tracking => "tracking".into(),
        TrackingState::Lost { count } => format!("lost {count}"),
        TrackingState::Failed => "failed".into(),
    }
}

fn next(sheet: &mut Sheet, updated: &Updated) {
    sheet.put("state", state(updated.state));
    sheet.put("renewed", updated.template_renewed);
    sheet.put("correction_m", updated.correction_m);
    sheet.put("correction_px", updated.correction_px);
    target(sheet, &updated.target);
}

fn target(sheet: &mut Sheet, target: &Target) {
    sheet.put("designated_at", target.designation.step);
    sheet.put("designated_px", target.designation.pixel);
    sheet.put("stop", target.step);
    sheet.put("position_rover", target.position_in_rover);
    sheet.put("covariance", target.covariance_in_rover);
    sheet.put("first_position_site", target.initial_position_in_site);
    sheet.put("first_distance_m", target.initial_distance_m);
    sheet.put("travelled_m", target.travelled_m);
    sheet.put("update_distance_m", target.last_distance_m);
    sheet.put("since_update_m", target.travelled_since_update_m);
    // The other trackers have no template.
    let Some(memory) = target.memory.template() else { return };
    sheet.within("drift", |sheet| drift(sheet, &memory.drift));
    sheet.within("appearance", |sheet| {
        sheet.put("stop", memory.appearance.step);
        sheet.put("px", memory.appearance.pixel);
        sheet.put("position_rover", memory.appearance.position_in_rover);
        sheet.put("surface_by_pixel", memory.appearance.surface_by_pixel);
    });
}

fn truth(sheet: &mut Sheet, truth: &StepTruth) {
    let kind = match truth.kind {
        TruthKind::Surface => "surface",
        TruthKind::Carried => "carried",
    };
    sheet.put("kind", kind);
    sheet.put("position_rover", truth.position_in_rover);
    sheet.put("left_px", truth.left_pixel);
    sheet.put("err_m", truth.err_m);
    sheet.put("err_px", truth.err_px);
    sheet.put("nees", truth.nees);
    sheet.put("magnification", truth.magnification);
    sheet.put("tolerance_px", truth.tolerance_px);
    sheet.put("tracked", truth.tracked);
}
