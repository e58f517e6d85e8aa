//! Stage 5, `judge`: compares gates with their limits and runs the state machine (K§4.6, R81–R91).
//!
//! The tracker lists its gates (`locate/*/gates.rs`); an update is good if all of them are passed. Two gates are
//! computed here, for every tracker that uses them:
//!
//! | gate | value | limit |
//! |---|---|---|
//! | 3 `distance_correction_m` | `│ │p − C│ − │p_pred − C│ │` | ≤ tol_dist |
//! | 4 `position_correction_m` | `│p_site − p_initial,site│` | ≤ tol_pos |
//!
//! The tolerances are recomputed at every update (R86, R87, ours):
//! ```text
//! tol_dist = g √( ΔR(D_old)² + ΔR(D_new)² + (f L_step)² )
//! tol_pos  = g √( ΔR(D_0)²   + ΔR(D_new)² + (f L_total)² + (D_new/f_p · 0.5 · D_0/D_new)² + (3 σ_m)² (1 + (D_0/D_new)²) )
//! ΔR(D)    = D² Δd / (f_p B)                                                     K-Eq 1
//! ```
//! | symbol | name | unit |
//! |---|---|---|
//! | g | `limits.tolerance_factor` | – |
//! | Δd | `limits.disparity_error_px` | px |
//! | f | `limits.navigation_error_fraction` | – |
//! | f_p, B | effective focal length at the target, distance of the camera centres | px, m |
//! | σ_m | largest 1σ of `Pointing::error_covariance_in_rover`: the mast's error at D_new, 0 without a known one (ours) | m |
//! | L_step, L_total | distance driven since the last accepted update, since the designation | m |

use crate::gate::{DISTANCE_CORRECTION, POSITION_CORRECTION};
use crate::limits::Limits;
use crate::locate::{GateInput, Located, gate_kinds};
use crate::stages::point_mast::Pointing;
use crate::stages::prediction::Prediction;
use crate::target::{Target, TrackingState};
use sightline_geometry::frames::{Point3, Pose};
use sightline_record::{Declaration, GateRecord, Record, Unit};

pub use crate::gate::Gate;
pub use crate::verdict::Verdict;

/// Judges a located target against the prediction and the limits.
pub fn judge(
    target: &Target,
    prediction: &Prediction,
    pointing: &Pointing,
    located: &Located,
    site_from_rover: &Pose,
    state_before: TrackingState,
    limits: &Limits,
) -> Verdict {
    let gates = located.evidence.gates(&GateInput {
        is_located: located.position_in_rover.is_some(),
        confidence: located.confidence,
        corrections: corrections(target, prediction, pointing, located, site_from_rover, limits),
        pointing,
        was_lost: state_before.is_lost(),
        limits,
    });
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

/// The gates on the corrections of distance and position.
fn corrections(
    target: &Target,
    prediction: &Prediction,
    pointing: &Pointing,
    located: &Located,
    site_from_rover: &Pose,
    limits: &Limits,
) -> [Gate; 2] {
    let centre = pointing.left.model.centre();
    let predicted_m = (prediction.position_in_rover - centre).norm();
    let found = located.position_in_rover;
    let distance = found.map(|p| ((p - centre).norm() - predicted_m).abs());
    let position = found.map(|p: Point3| (site_from_rover * p - target.initial_position_in_site).norm());
    let new_m = found.map_or(predicted_m, |p| (p - centre).norm());
    let tolerance = Tolerance::new(pointing, predicted_m, limits);
    [
        DISTANCE_CORRECTION.judge(distance, tolerance.distance_m(target, prediction, new_m)),
        POSITION_CORRECTION.judge(position, tolerance.position_m(target, prediction, new_m)),
    ]
}

/// The two tolerances of R87.
struct Tolerance<'a> {
    limits: &'a Limits,
    focal_px: f64,
    baseline_m: f64,
    /// 1σ error across the line of sight from the mast angles, m at the distance of the prediction.
    pointing_m: f64,
    predicted_m: f64,
}

impl<'a> Tolerance<'a> {
    fn new(pointing: &Pointing, predicted_m: f64, limits: &'a Limits) -> Self {
        let (left, right) = (&pointing.left, &pointing.right);
        let at = pointing.predicted_left.unwrap_or_else(|| left.centre_pixel());
        let focal_px = left.model.focal_length_px(at).unwrap_or(predicted_m.max(1.0));
        let variance_m2 =
            pointing.error_covariance_in_rover.map_or(0.0, |error| error.symmetric_eigenvalues().max());
        Self {
            limits,
            focal_px,
            baseline_m: (right.model.centre() - left.model.centre()).norm(),
            pointing_m: variance_m2.max(0.0).sqrt(),
            predicted_m,
        }
    }

    /// The stereo range error ΔR of K-Eq 1, m.
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
        // Half a pixel of the first image, at the current distance (R40).
        let designation = 0.5 * target.initial_distance_m / self.focal_px;
        // ΔR is a 3σ error. Both positions, of the designation and of this stop, have an error of the mast.
        let pointing = 3.0 * self.pointing_m * 1f64.hypot(target.initial_distance_m / self.predicted_m);
        self.limits.tolerance_factor * stereo.hypot(navigation).hypot(designation).hypot(pointing)
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

impl Record for Verdict {
    fn declare(r: &mut Declaration<Self>) {
        r.quantity("good", Unit::One, |v| v.good).describe("Whether every gate is passed.");
        r.quantity("accepted", Unit::One, |v| v.accepted).describe("Whether the update is used.");
        r.quantity("state_before", Unit::One, |v| v.state_before.word())
            .describe("The state before this update.");
        r.quantity("state", Unit::One, |v| v.state.word()).describe("The state after this update.");
        for kind in gate_kinds() {
            r.gate(kind.name, kind.unit, kind.side, kind.setting.unwrap_or_default());
        }
        r.gates(|v| v.gates.iter().map(GateRecord::from).collect());
        r.reason(|v| v.reason.clone());
    }
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
}
