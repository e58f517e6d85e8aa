//! The settings whose change could alter the verdict of a step: those that its tracker and the stages up to `judge` use.
//!
//! Excluded are settings without influence on this verdict: warnings about designations, the number of retries, renewal and
//! storage after an acceptance, inflation of a covariance, methods that are switched off, point stereo while the match
//! itself fails (it runs before), and random seeds, because chance explains nothing.

use super::Goal;
use crate::what_if::Base;
use sightline_track::limits::SettingInfo;
use sightline_track::locate::Evidence;
use sightline_track::settings::Settings;
use sightline_track::target::TrackingState;

/// Settings that never influence the verdict.
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

/// Settings of point stereo and triangulation.
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

/// Gates that a non-default limit switches on: they can only reject.
const CRITERIA: [&str; 4] =
    ["left_right_max_px", "second_peak_ratio_max", "match_sigma_max_px", "edge_distance_min_px"];

/// The settings to try, in the order of the table.
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

/// Whether the setting is the limit of a gate of this step: a lost target has another confidence limit.
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

/// Whether the match passed the gate `ncc`, so that the later stages decide.
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
