//! The gates of a registration: its own numbers, each against a limit of the shape tracker's settings (ours).
//!
//! | gate | value | limit |
//! |---|---|---|
//! | 11 `shape_overlap` | share of the target's pixels that both surfaces cover | ≥ `shape_overlap_min` |
//! | 12 `shape_misfit` | RMS residual over its predicted σ | ≤ `shape_misfit_max` |
//! | 13 `shape_sigma_m` | largest 1σ axis of the target by the registration | ≤ `shape_sigma_max_m` |
//! | 14 `shape_turn_deg` | rotation of the refinement | ≤ `shape_turn_max_deg` |
//! | 15 `shape_other_minimum` | mean distance at the next minimum over that at the best | ≥ `shape_other_min` |
//! | 16 `shape_edge_distance_m` | distance of the best shift from the border of the coarse search | ≥ half a search step |
//! | 17 `picture_ncc` | score of the draped image at a hand-off; replaces 15 and 16 | ≥ `hand_off_score_min` |

use nalgebra::Matrix3;

use crate::gate::{Gate, GateKind, Side, Unit};
use crate::locate::features::gates::CONFIDENCE;
use sightline_vision::registration::{Registration, ShapeSettings};

const OVERLAP: GateKind = GateKind {
    number: 11,
    name: "shape_overlap",
    label: "shape overlap",
    unit: Unit::One,
    side: Side::AtLeast,
    setting: Some("shape_overlap_min"),
};
const MISFIT: GateKind = GateKind {
    number: 12,
    name: "shape_misfit",
    label: "shape misfit",
    unit: Unit::One,
    side: Side::AtMost,
    setting: Some("shape_misfit_max"),
};
const SIGMA: GateKind = GateKind {
    number: 13,
    name: "shape_sigma_m",
    label: "shape σ",
    unit: Unit::Metre,
    side: Side::AtMost,
    setting: Some("shape_sigma_max_m"),
};
const TURN: GateKind = GateKind {
    number: 14,
    name: "shape_turn_deg",
    label: "shape turn",
    unit: Unit::Degree,
    side: Side::AtMost,
    setting: Some("shape_turn_max_deg"),
};
const OTHER_MINIMUM: GateKind = GateKind {
    number: 15,
    name: "shape_other_minimum",
    label: "next minimum ×",
    unit: Unit::One,
    side: Side::AtLeast,
    setting: Some("shape_other_min"),
};
const EDGE_DISTANCE: GateKind = GateKind {
    number: 16,
    name: "shape_edge_distance_m",
    label: "from the edge",
    unit: Unit::Metre,
    side: Side::AtLeast,
    setting: None,
};
const PICTURE_NCC: GateKind = GateKind {
    number: 17,
    name: "picture_ncc",
    label: "draped picture",
    unit: Unit::One,
    side: Side::AtLeast,
    setting: Some("hand_off_score_min"),
};

/// The gates of the shape tracker, by number.
pub(super) const GATES: [GateKind; 7] =
    [OVERLAP, MISFIT, SIGMA, TURN, OTHER_MINIMUM, EDGE_DISTANCE, PICTURE_NCC];

/// The gates of the combined tracker, by number.
pub(super) const WITH_CONFIDENCE: [GateKind; 8] =
    [CONFIDENCE, OVERLAP, MISFIT, SIGMA, TURN, OTHER_MINIMUM, EDGE_DISTANCE, PICTURE_NCC];

/// The gates of an update judged by a registration: its checks. Without a registration the first gate fails.
pub(super) fn of_registration(checks: Option<&[Gate]>) -> Vec<Gate> {
    checks.map_or_else(|| vec![OVERLAP.judge(None, 0.0)], <[Gate]>::to_vec)
}

/// The gates that `failure` applies to a registration, in its order.
pub(super) fn checks(found: &Registration, half_width_m: f64, settings: &ShapeSettings) -> Vec<Gate> {
    let limits = &settings.checks;
    let agreement = found.agreement[2];
    let best = found.coarse.best;
    // 99 if there is no other minimum.
    let ratio =
        best.map(|best| found.coarse.other.map_or(99.0, |other| (other.mean_m / best.mean_m).min(99.0)));
    let range_m = settings.search_half_range_m.unwrap_or(half_width_m);
    let from_edge_m = best.map(|best| {
        let [x, y, _] = best.shift_m;
        if best.is_at_edge { 0.0 } else { range_m - x.abs().max(y.abs()) }
    });
    let turn_deg = agreement.map(|_| found.turn_rad.to_degrees());
    vec![
        OVERLAP.judge(agreement.map(|a| a.overlap), settings.overlap_min),
        MISFIT.judge(found.misfit, limits.misfit_max),
        SIGMA.judge(found.sigma_m(), limits.sigma_max_m),
        TURN.judge(turn_deg, limits.turn_max_rad.to_degrees()),
        OTHER_MINIMUM.judge(ratio, limits.other_min),
        EDGE_DISTANCE.judge(from_edge_m, 0.5 * found.coarse.step_m),
    ]
}

/// Judges a draped image by the score of its match. It constrains the target where the surfaces let it slide, so that
/// the gates on another minimum and on the border of the search do not apply.
pub(super) fn add_picture(gates: &mut Vec<Gate>, score: f64, covariance: &Matrix3<f64>, score_min: f64) {
    let sigma_m = covariance.symmetric_eigenvalues().max().max(0.0).sqrt();
    gates.retain(|gate| ![OTHER_MINIMUM.name, EDGE_DISTANCE.name].contains(&gate.name.as_str()));
    for gate in gates.iter_mut().filter(|gate| gate.name == SIGMA.name) {
        *gate = SIGMA.judge(Some(sigma_m), gate.limit);
    }
    gates.push(PICTURE_NCC.judge(Some(score), score_min));
}
