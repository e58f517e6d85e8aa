//! The numbers of the feature tracker.

use sightline_track::locate::features::FeatureEvidence;
use sightline_track::locate::features::anchor::Carried;
use sightline_track::locate::features::evidence::{
    AnchorTried, Bootstrapped, Detected, FittedMotion, MatchedFeatures,
};

use super::sheet::{Sheet, Value};

/// Writes the evidence of the feature tracker.
pub(crate) fn evidence(sheet: &mut Sheet, evidence: &FeatureEvidence) {
    sheet.optional("detected", evidence.detect.as_ref(), detected);
    sheet.each("anchor", &evidence.anchors, anchor);
    sheet.optional("matched", evidence.match_features.as_ref(), matched);
    sheet.optional("motion", evidence.fit_motion.as_ref(), motion);
    sheet.optional("bootstrap", evidence.bootstrap.as_ref(), bootstrap);
    sheet.optional("carried", evidence.carried.as_ref(), carried);
}

fn detected(sheet: &mut Sheet, detected: &Detected) {
    sheet.put("left", detected.left);
    sheet.put("right", detected.right);
    sheet.put("stereo_matches", detected.stereo_matches);
    sheet.put("points", detected.points);
    sheet.put("median_range_m", detected.median_range_m);
}

fn anchor(sheet: &mut Sheet, anchor: &AnchorTried) {
    sheet.put("stop", anchor.step);
    sheet.put("matches", anchor.matches);
    sheet.put("inliers", anchor.inliers);
    sheet.put("confidence", anchor.confidence);
    sheet.put("sigma_m", anchor.sigma_m);
    sheet.put("reason", anchor.missing.as_deref());
    sheet.put("chosen", anchor.chosen);
}

fn matched(sheet: &mut Sheet, matched: &MatchedFeatures) {
    sheet.put("from_stop", matched.from_step);
    sheet.put("points_then", matched.then);
    sheet.put("points_now", matched.now);
    sheet.put("matches", matched.matches);
    sheet.put("without_prior", matched.prior_given_up);
}

fn motion(sheet: &mut Sheet, motion: &FittedMotion) {
    sheet.put("translation_m", motion.translation_m);
    sheet.put("rotation_deg", motion.roll_pitch_yaw_deg);
    sheet.put("inliers", motion.inliers);
    sheet.put("rms_m", motion.rms_m);
    sheet.put("median_m", motion.median_m);
    sheet.array("consensus", &[motion.consensus_by_draw.len()], &motion.consensus_by_draw);
    sheet.put("refit_inliers", Value::integers(motion.refits.iter().map(|refit| refit.inliers)));
    sheet.put("refit_rms_m", Value::reals(motion.refits.iter().map(|refit| refit.rms_m)));
    sheet.put("correction_m", motion.correction_m);
}

fn bootstrap(sheet: &mut Sheet, bootstrap: &Bootstrapped) {
    sheet.put("sets", bootstrap.sets);
    sheet.put("covariance", bootstrap.covariance);
    sheet.put("sigma_translation_m", bootstrap.sigma_translation_m);
    sheet.put("sigma_rotation_deg", bootstrap.sigma_rotation_deg);
}

fn carried(sheet: &mut Sheet, carried: &Carried) {
    let turn = carried.now_from_first.quaternion();
    sheet.put("position_rover", carried.position_in_rover);
    sheet.put("scattered_m2", carried.scattered);
    sheet.put("shared_m", carried.shared_m);
    sheet.put("quaternion_sxyz", [turn.w, turn.i, turn.j, turn.k]);
}
