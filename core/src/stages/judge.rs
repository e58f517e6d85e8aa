//! Stage 5, `judge`: the four loss criteria and the state machine (K§4.6, R81–R91).
//!
//! | criterion | value | limit |
//! |---|---|---|
//! | 1 `ncc` | score of the match | ≥ `ncc_min` |
//! | 2 `stereo_ncc` | score of point stereo | ≥ `stereo_ncc_min` |
//! | 3 `distance_correction_m` | `│ │p − C│ − │p_pred − C│ │` | ≤ tol_dist |
//! | 4 `position_correction_m` | `│p_site − p_initial,site│` | ≤ tol_pos |
//! | 5 `left_right_px` (ours, off unless its limit is set) | way from the left pixel to the right one and back | ≤ `left_right_max_px` |
//!
//! Three more of ours ask how good the peak of the match is; each is a criterion only where its limit switches it on:
//!
//! | criterion | value | limit |
//! |---|---|---|
//! | 6 `second_peak_ratio` | second peak over the best; 0 without one (R68) | ≤ `second_peak_ratio_max` |
//! | 7 `match_sigma_px` | largest 1σ axis of the match's own covariance | ≤ `match_sigma_max_px` |
//! | 8 `edge_distance_px` | from the best whole pixel to the rim of the positions compared | ≥ `edge_distance_min_px` |
//!
//! A match far from the prediction was found in a larger area, in which a wrong one is likelier: beyond `far_sigma`
//! standard deviations of `ν = pixel − predicted`, that is `νᵀ (Σ_pred + Σ_match)⁻¹ ν > far_sigma²`, it must score more
//! (ours, criterion 9 `far_ncc` ≥ `far_ncc_min`; −1: off).
//!
//! The feature tracker makes no use of scores or of the prediction, whose errors may be large (R156); it is judged by its
//! confidence alone (D§2, R185): criterion 10 `confidence` ≥ `confidence_min`, and ≥ `confidence_return` once it is lost.
//!
//! A registration of surfaces is judged by its own numbers, each against the limit of the shape tracker's settings:
//! criteria 11 to 16 (`locate/shape/failure.rs`; ours). Where the combined tracker's registration fails and its features are
//! sure, they decide.
//!
//! The tolerances are recomputed at every update (R86, R87, ours):
//! ```text
//! tol_dist = g √( ΔR(D_old)² + ΔR(D_new)² + (f L_step)² )
//! tol_pos  = g √( ΔR(D_0)²   + ΔR(D_new)² + (f L_total)² + (D_new/f_p · 0.5 · D_0/D_new)² )
//! ΔR(D)    = D² Δd / (f_p B)                                                     K-Eq 1
//! ```
//! | symbol | name | unit |
//! |---|---|---|
//! | g | `limits.tolerance_factor` | – |
//! | Δd | `limits.disparity_error_px` | px |
//! | f | `limits.navigation_error_fraction` | – |
//! | f_p, B | effective focal length at the target, distance of the camera centres | px, m |
//! | L_step, L_total | driven since the last accepted update, since designation | m |

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::frames::{Point3, Pose};
use crate::limits::Limits;
use crate::locate::shape_tracker::ShapeEvidence;
use crate::locate::template::match_template::TemplateMatch;
use crate::locate::{Evidence, Located};
use crate::stages::point_mast::Pointing;
use crate::stages::predict::Prediction;
use crate::target::{Target, TrackingState};

/// One criterion with its value and limit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Gate {
    /// The criterion's number: 1 to 4 as in K§4.6, from 5 on ours.
    pub criterion: u8,
    /// Its name.
    pub name: String,
    /// Its unit, empty for scores.
    pub unit: String,
    /// The value; null where nothing was found to judge.
    pub value: Option<f64>,
    /// The limit.
    pub limit: f64,
    /// Whether the value must be at least the limit; otherwise at most.
    pub at_least: bool,
    /// How far the value is on the good side of the limit, in its unit.
    pub margin: Option<f64>,
    /// Whether the criterion is met.
    pub passed: bool,
}

impl Gate {
    fn new(criterion: u8, name: &str, unit: &str, value: Option<f64>, limit: f64, at_least: bool) -> Self {
        let margin = value.map(|v| if at_least { v - limit } else { limit - v });
        Self {
            criterion,
            name: name.to_owned(),
            unit: unit.to_owned(),
            value,
            limit,
            at_least,
            margin,
            passed: margin.is_some_and(|m| m >= 0.0),
        }
    }
}

/// The verdict on one update.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Verdict {
    /// The criteria, in the paper's order.
    pub gates: Vec<Gate>,
    /// Whether all of them are met.
    pub good: bool,
    /// Whether the update is used: good, and the target had not failed before.
    pub accepted: bool,
    /// Why not, as one sentence.
    pub reason: Option<String>,
    /// The state before this update.
    pub state_before: TrackingState,
    /// The state after it.
    pub state: TrackingState,
}

/// Judges what was located against the prediction and the limits.
pub fn judge(
    target: &Target,
    prediction: &Prediction,
    pointing: &Pointing,
    located: &Located,
    site_from_rover: &Pose,
    state_before: TrackingState,
    limits: &Limits,
) -> Verdict {
    let gates = match &located.evidence {
        Evidence::Template(_) => {
            template_gates(target, prediction, pointing, located, site_from_rover, limits)
        }
        Evidence::Features(_) => feature_gates(located, state_before, limits),
        Evidence::Shape(evidence) if evidence.is_judged_by_shape => shape_gates(evidence),
        Evidence::Shape(evidence) if evidence.features.is_some() => {
            feature_gates(located, state_before, limits)
        }
        Evidence::Shape(_) => vec![Gate::new(11, "shape_overlap", "", None, 0.0, true)],
    };
    let good = gates.iter().all(|gate| gate.passed);
    let state = next_state(state_before, good, limits);
    Verdict {
        reason: (!good).then(|| reason(&gates, located)),
        accepted: good && state == TrackingState::Tracking,
        good,
        gates,
        state_before,
        state,
    }
}

/// The one criterion of the feature tracker: once lost, it must be surer to return (R185).
fn feature_gates(located: &Located, state_before: TrackingState, limits: &Limits) -> Vec<Gate> {
    let limit = if state_before.is_lost() { limits.confidence_return } else { limits.confidence_min };
    let confidence = located.position_in_rover.map(|_| located.confidence);
    vec![Gate::new(10, "confidence", "", confidence, limit, true)]
}

/// The criteria of a registration.
fn shape_gates(evidence: &ShapeEvidence) -> Vec<Gate> {
    let checks = evidence.registration.iter().flat_map(|registration| &registration.checks);
    (11..)
        .zip(checks)
        .map(|(criterion, check)| {
            Gate::new(criterion, &check.name, &check.unit, check.value, check.limit, check.at_least)
        })
        .collect()
}

fn template_gates(
    target: &Target,
    prediction: &Prediction,
    pointing: &Pointing,
    located: &Located,
    site_from_rover: &Pose,
    limits: &Limits,
) -> Vec<Gate> {
    let evidence = located.evidence.template();
    let ncc = evidence.and_then(|e| e.match_template.as_ref()).map(|m| m.score);
    let stereo = evidence.and_then(|e| e.point_stereo.as_ref()).map(|s| s.score);
    let centre = pointing.left.model.centre();
    let predicted_m = (prediction.position_in_rover - centre).norm();
    let found = located.position_in_rover;
    let distance = found.map(|p| ((p - centre).norm() - predicted_m).abs());
    let position = found.map(|p: Point3| (site_from_rover * p - target.initial_position_in_site).norm());
    let new_m = found.map_or(predicted_m, |p| (p - centre).norm());
    let tolerance = Tolerance::new(pointing, predicted_m, limits);
    let back = evidence.and_then(|e| e.point_stereo.as_ref()).and_then(|s| s.left_right_px);
    let back_max_px = Some(limits.left_right_max_px).filter(|limit| *limit > 0.0);
    let left_right = back_max_px.map(|limit| Gate::new(5, "left_right_px", "px", back, limit, false));
    let mut gates = vec![
        Gate::new(1, "ncc", "", ncc, limits.ncc_min, true),
        Gate::new(2, "stereo_ncc", "", stereo, limits.stereo_ncc_min, true),
        Gate::new(
            3,
            "distance_correction_m",
            "m",
            distance,
            tolerance.distance_m(target, prediction, new_m),
            false,
        ),
        Gate::new(
            4,
            "position_correction_m",
            "m",
            position,
            tolerance.position_m(target, prediction, new_m),
            false,
        ),
    ];
    gates.extend(left_right);
    if limits.far_ncc_min > -1.0 && is_far(pointing, located, limits.far_sigma) {
        gates.push(Gate::new(9, "far_ncc", "", ncc, limits.far_ncc_min, true));
    }
    gates.extend(peak_gates(evidence.and_then(|e| e.match_template.as_ref()), limits));
    gates
}

/// Whether the match lies beyond `sigmas` standard deviations of the prediction.
fn is_far(pointing: &Pointing, located: &Located, sigmas: f64) -> bool {
    let matched = located.evidence.template().and_then(|e| e.match_template.as_ref());
    let (Some(predicted), Some(covariance), Some(matched)) =
        (pointing.predicted_left, pointing.predicted_covariance_px2, matched)
    else {
        return false;
    };
    let innovation = Vector2::new(matched.pixel.x - predicted.x, matched.pixel.y - predicted.y);
    let inverse = (covariance + matched.covariance_px2).try_inverse();
    inverse.is_some_and(|inverse| innovation.dot(&(inverse * innovation)) > sigmas * sigmas)
}

/// The criteria of the peak that are switched on.
fn peak_gates(matched: Option<&TemplateMatch>, limits: &Limits) -> Vec<Gate> {
    let mut gates = Vec::new();
    let ratio = matched.map(|m| m.second_peak.as_ref().map_or(0.0, |second| second.ratio));
    if limits.second_peak_ratio_max < 1.0 {
        gates.push(Gate::new(6, "second_peak_ratio", "", ratio, limits.second_peak_ratio_max, false));
    }
    let sigma_px = matched.map(|m| m.covariance_px2.symmetric_eigenvalues().max().max(0.0).sqrt());
    if limits.match_sigma_max_px > 0.0 {
        gates.push(Gate::new(7, "match_sigma_px", "px", sigma_px, limits.match_sigma_max_px, false));
    }
    // A descent by gradient compares no window of positions, and has no rim.
    let is_searched = matched.is_none_or(|m| m.descent.is_none());
    if limits.edge_distance_min_px > 0.0 && is_searched {
        let edge_px = matched.and_then(TemplateMatch::edge_distance_px);
        gates.push(Gate::new(8, "edge_distance_px", "px", edge_px, limits.edge_distance_min_px, true));
    }
    gates
}

/// The two tolerances of R87.
struct Tolerance<'a> {
    limits: &'a Limits,
    focal_px: f64,
    baseline_m: f64,
}

impl<'a> Tolerance<'a> {
    fn new(pointing: &Pointing, predicted_m: f64, limits: &'a Limits) -> Self {
        let (left, right) = (&pointing.left, &pointing.right);
        let at = pointing.predicted_left.unwrap_or_else(|| left.centre_pixel());
        let focal_px = left.model.focal_length_px(at).unwrap_or(predicted_m.max(1.0));
        Self { limits, focal_px, baseline_m: (right.model.centre() - left.model.centre()).norm() }
    }

    /// K-Eq 1, m.
    fn stereo_m(&self, distance_m: f64) -> f64 {
        distance_m * distance_m * self.limits.disparity_error_px / (self.focal_px * self.baseline_m)
    }

    fn distance_m(&self, target: &Target, prediction: &Prediction, new_m: f64) -> f64 {
        let navigation = self.limits.navigation_error_fraction * prediction.travelled_since_update_m;
        let stereo = self.stereo_m(target.last_distance_m).hypot(self.stereo_m(new_m));
        self.limits.tolerance_factor * stereo.hypot(navigation)
    }

    fn position_m(&self, target: &Target, prediction: &Prediction, new_m: f64) -> f64 {
        let navigation = self.limits.navigation_error_fraction * prediction.travelled_m;
        let stereo = self.stereo_m(target.initial_distance_m).hypot(self.stereo_m(new_m));
        // Half a pixel of the first image, seen from where the rover is now (R40).
        let designation = 0.5 * target.initial_distance_m / self.focal_px;
        self.limits.tolerance_factor * stereo.hypot(navigation).hypot(designation)
    }
}

/// The next state (R90, R91): a loss, then up to `n_retry` further updates, then failure until cleared.
pub fn next_state(before: TrackingState, good: bool, limits: &Limits) -> TrackingState {
    let bad = match before {
        TrackingState::Cleared | TrackingState::Failed => return before,
        _ if good => return TrackingState::Tracking,
        TrackingState::Tracking => 1,
        TrackingState::Lost { count } => count + 1,
    };
    let allowed = limits.n_retry.saturating_sub(u32::from(limits.count_detecting_update));
    if bad > allowed { TrackingState::Failed } else { TrackingState::Lost { count: bad } }
}

fn reason(gates: &[Gate], located: &Located) -> String {
    let failed = gates.iter().filter(|gate| !gate.passed).filter_map(|gate| {
        let relation = if gate.at_least { "below" } else { "above" };
        let (value, limit) = (gate.value?, gate.limit);
        Some(
            format!("{} {value:.3} is {relation} its limit {limit:.3} {}", gate.name, gate.unit)
                .trim_end()
                .to_owned(),
        )
    });
    failed.chain(located.missing.clone()).collect::<Vec<_>>().join("; ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(pattern: &str, limits: &Limits) -> TrackingState {
        pattern.chars().fold(TrackingState::Tracking, |state, c| next_state(state, c == 'G', limits))
    }

    #[test]
    fn two_retries_follow_a_loss_and_a_good_one_resets_the_count() {
        let limits = Limits::default();
        assert_eq!(run("GBG", &limits), TrackingState::Tracking);
        assert_eq!(run("GBBG", &limits), TrackingState::Tracking);
        assert_eq!(run("GBB", &limits), TrackingState::Lost { count: 2 });
        assert_eq!(run("GBBGBB", &limits), TrackingState::Lost { count: 2 });
        assert_eq!(run("GBBB", &limits), TrackingState::Failed);
        assert_eq!(run("GBBBGGGG", &limits), TrackingState::Failed);
    }

    #[test]
    fn the_stricter_reading_counts_the_detecting_update() {
        let limits = Limits { count_detecting_update: true, ..Limits::default() };
        assert_eq!(run("GBG", &limits), TrackingState::Tracking);
        assert_eq!(run("GBB", &limits), TrackingState::Failed);
    }

    #[test]
    fn without_retries_the_first_loss_is_a_failure_and_cleared_stays_cleared() {
        let limits = Limits { n_retry: 0, ..Limits::default() };
        assert_eq!(run("GB", &limits), TrackingState::Failed);
        assert_eq!(next_state(TrackingState::Cleared, true, &limits), TrackingState::Cleared);
    }

    #[test]
    fn a_gate_knows_its_margin_and_fails_without_a_value() {
        let gate = Gate::new(1, "ncc", "", Some(0.75), 0.7, true);
        assert!(gate.passed && (gate.margin.unwrap() - 0.05).abs() < 1e-12);
        assert!(!Gate::new(3, "d", "m", Some(0.4), 0.3, false).passed);
        assert!(!Gate::new(1, "ncc", "", None, 0.7, true).passed);
    }
}
