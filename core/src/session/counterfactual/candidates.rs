//! Which settings a change could help at a step: those that its tracker and the stages up to its verdict use.
//!
//! Left out is what has no say in this step's verdict: warnings about designations, how many retries follow, what is
//! renewed or remembered after an acceptance, what only widens a covariance; settings of methods that are switched off;
//! those of point stereo while the match itself fails, which comes before it; and seeds, since luck is no reason.

use super::Goal;
use crate::limits::SettingInfo;
use crate::locate::Evidence;
use crate::locate::features::settings::{MotionGate, MotionWeighting};
use crate::locate::template::settings::{FirstStage, Measure, Refine, Search, TemplateUpdate, Transform};
use crate::session::what_if::Base;
use crate::settings::Settings;
use crate::target::TrackingState;

/// What never has a say.
const NEVER: [&str; 22] = [
    "tracker",
    "warn_depth_range",
    "warn_contrast",
    "warn_shadow_share",
    "warn_boundary",
    "n_retry",
    "count_detecting_update",
    "subframe_px",
    "renew_scale",
    "renew_ncc",
    "match_correlation",
    "motion_seed",
    "bootstrap_sets",
    "bootstrap_cell_px",
    "feature_common_px",
    "feature_memory",
    "shape_common_m",
    "carried_ray",
    "hand_off_window_px",
    "sift_image_blur_px",
    "motion_adaptive",
    "features_max",
];

/// What point stereo and triangulation use.
const STEREO: [&str; 8] = [
    "epipolar_tolerance_px",
    "stereo_reference",
    "disparity_range_px",
    "disparity_interval",
    "range_min_m",
    "range_max_m",
    "noise_model",
    "slope_bend_px",
];

/// Criteria that a limit switches on: they can only reject.
const CRITERIA: [&str; 4] =
    ["left_right_max_px", "second_peak_ratio_max", "match_sigma_max_px", "edge_distance_min_px"];

/// The settings to look at, in the order of the table.
pub(super) fn candidates(base: &Base<'_>, goal: Goal) -> Vec<SettingInfo> {
    let uses = |info: &SettingInfo| !NEVER.contains(&info.key.as_str()) && is_used(info, base, goal);
    Settings::table().into_iter().filter(uses).collect()
}

fn is_used(info: &SettingInfo, base: &Base<'_>, goal: Goal) -> bool {
    let evidence = base.recorded.locate.as_ref().map(|located| &located.evidence);
    let (by_template, by_shape) = match evidence {
        Some(Evidence::Template(_)) => (true, false),
        Some(Evidence::Shape(evidence)) => (false, evidence.is_judged_by_shape),
        _ => (false, false),
    };
    let key = info.key.as_str();
    match info.group.as_str() {
        "limits" if by_template => limit_is_used(key, base, goal),
        "limits" => !by_shape && confidence_is_used(key, base),
        "template" => by_template && template_is_used(key, base),
        "features" => base.recorded.features().is_some() && features_are_used(key, base.settings),
        "shape" => base.recorded.shape().is_some() && shape_is_used(key, base),
        _ => false,
    }
}

fn limit_is_used(key: &str, base: &Base<'_>, goal: Goal) -> bool {
    let limits = &base.settings.limits;
    let is_on = match key {
        "left_right_max_px" => limits.left_right_max_px > 0.0,
        "second_peak_ratio_max" => limits.second_peak_ratio_max < 1.0,
        "match_sigma_max_px" => limits.match_sigma_max_px > 0.0,
        "edge_distance_min_px" => limits.edge_distance_min_px > 0.0,
        _ => true,
    };
    !key.starts_with("confidence") && (is_on || (goal == Goal::NotFalse && CRITERIA.contains(&key)))
}

/// Once lost, the target returns at another confidence.
fn confidence_is_used(key: &str, base: &Base<'_>) -> bool {
    let is_lost = base.recorded.judge.as_ref().is_some_and(|verdict| verdict.state_before.is_lost());
    key == if is_lost { "confidence_return" } else { "confidence_min" }
}

fn template_is_used(key: &str, base: &Base<'_>) -> bool {
    let own = &base.settings.template;
    let is_descent = own.first_stage != FirstStage::Correlation;
    let is_lost_before = base
        .recorded
        .judge
        .as_ref()
        .is_some_and(|verdict| matches!(verdict.state_before, TrackingState::Lost { .. }));
    match key {
        key if STEREO.contains(&key) => is_matched(base),
        "lost_search_growth" => is_lost_before,
        "warp_model" => own.surface_warp,
        "roll_reference" => own.roll,
        "search" | "measure" | "sub_pixel" => !is_descent,
        "klt_levels" => is_descent,
        "height_scale_m" => own.height_weight > 0.0,
        key if key.starts_with("sdog_") => own.measure == Measure::Sdog,
        key if key.starts_with("coarse_") => own.search == Search::CoarseToFine && !is_descent,
        key if key.starts_with("refine_") => own.refine == Refine::Affine,
        key if key.starts_with("descent_") => own.refine == Refine::Affine || is_descent,
        key if key.starts_with("search_scale_") || key.starts_with("search_roll_") => {
            own.transform == Transform::Search
        }
        key if key.starts_with("drift_") => own.template_update == TemplateUpdate::DriftCorrected,
        _ => true,
    }
}

/// Whether the match met its own criterion, so that what comes after it decides.
fn is_matched(base: &Base<'_>) -> bool {
    let gates = base.recorded.judge.iter().flat_map(|verdict| &verdict.gates);
    gates.into_iter().any(|gate| gate.name == "ncc" && gate.passed)
}

fn features_are_used(key: &str, settings: &Settings) -> bool {
    let own = &settings.features;
    let by_sigma = own.motion_gate == MotionGate::Mahalanobis;
    match key {
        "curve_tolerance_px" => own.stereo_along_curve,
        "motion_inlier_m" => !by_sigma,
        "motion_inlier_sigma" => by_sigma,
        "motion_loss" => own.motion_weighting == MotionWeighting::Range,
        "feature_sigma_px" | "feature_sigma_per_scale" => {
            by_sigma || own.motion_weighting == MotionWeighting::Range
        }
        _ => true,
    }
}

fn shape_is_used(key: &str, base: &Base<'_>) -> bool {
    let registered = base.recorded.shape().and_then(|evidence| evidence.registration.as_ref());
    let is_hand_off = registered.is_some_and(|found| found.is_hand_off);
    match key {
        "shape_use" => base.settings.tracker == crate::settings::TrackerKind::Combined,
        "shape_attitude_deg" => base.settings.shape.shape_prior,
        key if key.starts_with("hand_off_") => is_hand_off,
        _ => true,
    }
}
