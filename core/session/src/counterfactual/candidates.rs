//! Which settings a change could help at a step: those that its tracker and the stages up to its verdict use.
//!
//! Left out is what has no say in this step's verdict: warnings about designations, how many retries follow, what is
//! renewed or remembered after an acceptance, what only widens a covariance; settings of methods that are switched off;
//! those of point stereo while the match itself fails, which comes before it; and seeds, since luck is no reason.

use super::Goal;
use crate::what_if::Base;
use sightline_track::limits::SettingInfo;
use sightline_track::locate::Evidence;
use sightline_track::settings::Settings;
use sightline_track::target::TrackingState;

/// What never has a say.
const NEVER: [&str; 24] = [
    "tracker",
    "warn_depth_range",
    "warn_contrast",
    "warn_left_right_px",
    "warn_shadow_share",
    "warn_boundary",
    "n_retry",
    "count_detecting_update",
    "same_camera_focal_share",
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
    let table = Settings::table();
    let settings = serde_json::to_value(base.settings).unwrap_or_default();
    let value = |info: &SettingInfo| info.value_in(&settings).cloned().unwrap_or_default();
    let uses = |info: &&SettingInfo| {
        !NEVER.contains(&info.key.as_str()) && info.has_effect(&table, &value) && is_used(info, base, goal)
    };
    table.iter().filter(uses).cloned().collect()
}

fn is_used(info: &SettingInfo, base: &Base<'_>, goal: Goal) -> bool {
    let evidence = base.recorded.located().map(|located| &located.evidence);
    let (by_template, by_shape) = match evidence {
        Some(Evidence::Template(_)) => (true, false),
        Some(Evidence::Shape(evidence) | Evidence::Combined(evidence)) => {
            (false, evidence.is_judged_by_shape)
        }
        _ => (false, false),
    };
    let key = info.key.as_str();
    match info.group.as_str() {
        "limits" if by_template => limit_is_used(key, base, goal),
        "limits" => !by_shape && confidence_is_used(key, base),
        "template" => by_template && template_is_used(key, base),
        "features" => base.recorded.features().is_some(),
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

/// The limit of a gate of this step: once lost, the target returns at another confidence.
fn confidence_is_used(key: &str, base: &Base<'_>) -> bool {
    let gates = base.recorded.verdict().into_iter().flat_map(|verdict| &verdict.gates);
    gates.into_iter().any(|gate| gate.setting.as_deref() == Some(key))
}

fn template_is_used(key: &str, base: &Base<'_>) -> bool {
    let is_lost_before = base
        .recorded
        .verdict()
        .is_some_and(|verdict| matches!(verdict.state_before, TrackingState::Lost { .. }));
    match key {
        key if STEREO.contains(&key) => is_matched(base),
        "lost_search_growth" => is_lost_before,
        _ => true,
    }
}

/// Whether the match met its own criterion, so that what comes after it decides.
fn is_matched(base: &Base<'_>) -> bool {
    let gates = base.recorded.verdict().into_iter().flat_map(|verdict| &verdict.gates);
    gates.into_iter().any(|gate| gate.name == "ncc" && gate.passed)
}

fn shape_is_used(key: &str, base: &Base<'_>) -> bool {
    let registered = base.recorded.shape().and_then(|evidence| evidence.registration.as_ref());
    let is_hand_off = registered.is_some_and(|found| found.is_hand_off);
    match key {
        key if key.starts_with("hand_off_") => is_hand_off,
        _ => true,
    }
}
