//! The gates of the template tracker (K§4.6, R81–R83; from 5 on ours).
//!
//! | gate | value | limit |
//! |---|---|---|
//! | 1 `ncc` | score of the match | ≥ `ncc_min` |
//! | 2 `stereo_ncc` | score of point stereo | ≥ `stereo_ncc_min` |
//! | 3, 4 | corrections of distance and position, see `judge` | ≤ their tolerances |
//! | 5 `left_right_px` | distance between the left pixel and the match of its right pixel in the left image | ≤ `left_right_max_px` |
//! | 6 `second_peak_ratio` | second peak over the best; 0 without one (R68) | ≤ `second_peak_ratio_max` |
//! | 7 `match_sigma_px` | largest 1σ axis of the match's own covariance | ≤ `match_sigma_max_px` |
//! | 8 `edge_distance_px` | distance of the best whole pixel from the border of the compared positions | ≥ `edge_distance_min_px` |
//! | 9 `far_ncc` | score of a match far from the prediction | ≥ `far_ncc_min` |
//!
//! Gates 5 to 8 exist only if their limit enables them.
//!
//! A match far from the prediction (`near`) comes from a larger area, where a wrong one is more likely: it needs a
//! higher score.

use super::evidence::TemplateEvidence;
use super::match_template::TemplateMatch;
use super::near::is_far;
use crate::gate::{DISTANCE_CORRECTION, Gate, GateKind, POSITION_CORRECTION, Side, Unit};
use crate::limits::Limits;
use crate::locate::tracker::GateInput;

const NCC: GateKind = GateKind {
    number: 1,
    name: "ncc",
    label: "match score",
    unit: Unit::One,
    side: Side::AtLeast,
    setting: Some("ncc_min"),
};
const STEREO_NCC: GateKind = GateKind {
    number: 2,
    name: "stereo_ncc",
    label: "stereo score",
    unit: Unit::One,
    side: Side::AtLeast,
    setting: Some("stereo_ncc_min"),
};
const LEFT_RIGHT: GateKind = GateKind {
    number: 5,
    name: "left_right_px",
    label: "left–right check",
    unit: Unit::Pixel,
    side: Side::AtMost,
    setting: Some("left_right_max_px"),
};
const SECOND_PEAK: GateKind = GateKind {
    number: 6,
    name: "second_peak_ratio",
    label: "second peak",
    unit: Unit::One,
    side: Side::AtMost,
    setting: Some("second_peak_ratio_max"),
};
const MATCH_SIGMA: GateKind = GateKind {
    number: 7,
    name: "match_sigma_px",
    label: "match σ",
    unit: Unit::Pixel,
    side: Side::AtMost,
    setting: Some("match_sigma_max_px"),
};
const EDGE_DISTANCE: GateKind = GateKind {
    number: 8,
    name: "edge_distance_px",
    label: "from the rim",
    unit: Unit::Pixel,
    side: Side::AtLeast,
    setting: Some("edge_distance_min_px"),
};
const FAR_NCC: GateKind = GateKind {
    number: 9,
    name: "far_ncc",
    label: "far match score",
    unit: Unit::One,
    side: Side::AtLeast,
    setting: Some("far_ncc_min"),
};

/// The gates of the template tracker, by number.
pub(super) const GATES: [GateKind; 9] = [
    NCC,
    STEREO_NCC,
    DISTANCE_CORRECTION,
    POSITION_CORRECTION,
    LEFT_RIGHT,
    SECOND_PEAK,
    MATCH_SIGMA,
    EDGE_DISTANCE,
    FAR_NCC,
];

/// The gates of one update.
pub(super) fn gates(evidence: &TemplateEvidence, input: &GateInput<'_>) -> Vec<Gate> {
    let limits = input.limits;
    let (matched, stereo) = (evidence.match_template.as_ref(), evidence.point_stereo.as_ref());
    let ncc = matched.map(|m| m.score);
    let mut gates = vec![
        NCC.judge(ncc, limits.ncc_min),
        STEREO_NCC.judge(stereo.map(|s| s.score), limits.stereo_ncc_min),
    ];
    gates.extend(input.corrections.iter().cloned());
    if limits.left_right_max_px > 0.0 {
        gates.push(LEFT_RIGHT.judge(stereo.and_then(|s| s.left_right_px), limits.left_right_max_px));
    }
    let is_far =
        || matched.is_some_and(|m| is_far(input.pointing, m.pixel, &m.covariance_px2, limits.far_sigma));
    if limits.far_ncc_min > -1.0 && is_far() {
        gates.push(FAR_NCC.judge(ncc, limits.far_ncc_min));
    }
    gates.extend(peak_gates(matched, limits));
    gates
}

/// The enabled gates of the peak.
fn peak_gates(matched: Option<&TemplateMatch>, limits: &Limits) -> Vec<Gate> {
    let mut gates = Vec::new();
    let ratio = matched.map(|m| m.second_peak.as_ref().map_or(0.0, |second| second.ratio));
    if limits.second_peak_ratio_max < 1.0 {
        gates.push(SECOND_PEAK.judge(ratio, limits.second_peak_ratio_max));
    }
    let sigma_px = matched.map(|m| m.covariance_px2.symmetric_eigenvalues().max().max(0.0).sqrt());
    if limits.match_sigma_max_px > 0.0 {
        gates.push(MATCH_SIGMA.judge(sigma_px, limits.match_sigma_max_px));
    }
    // A gradient descent compares no window of positions, and so has no border.
    let is_searched = matched.is_none_or(|m| m.descent.is_none());
    if limits.edge_distance_min_px > 0.0 && is_searched {
        let edge_px = matched.and_then(|m| m.edge_distance_px);
        gates.push(EDGE_DISTANCE.judge(edge_px, limits.edge_distance_min_px));
    }
    gates
}
