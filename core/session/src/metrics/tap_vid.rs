//! Average Jaccard and occlusion accuracy as in TAP-Vid (Doersch et al. 2022, section 3).
//!
//! ```text
//! J(δ) = TP / (TP + FP + FN)      AJ = mean of J(δ) over δ = 1, 2, 4, 8, 16 px
//! TP   the truth is visible, the tracker reports it as visible, and they are closer than δ
//! FP   the tracker reports it as visible, and the truth is hidden or not closer than δ
//! FN   the truth is visible, and the tracker reports it as hidden, or they are not closer than δ
//! OA   the fraction of steps at which tracker and truth agree on visibility
//! ```
//! The state `tracking` reports the point as visible; `lost` and `failed` report it as hidden. If the truth is the first
//! estimate propagated by the true poses, occlusion is unknown, and the protocol does not apply.

use super::{Judged, Metric, THRESHOLDS_PX};
use sightline_world::target_truth::TruthKind;

const NAMES: [&str; 2] = ["average_jaccard", "occlusion_accuracy"];

/// Average Jaccard and occlusion accuracy.
pub(super) fn metrics(judged: &[Judged<'_>], truth: Option<TruthKind>) -> Vec<Metric> {
    let steps: Vec<&Judged<'_>> = judged.iter().filter(|step| step.truth.is_some()).collect();
    let why = match truth {
        None => "TAP-Vid needs the truth, which this traverse does not have.",
        Some(TruthKind::Carried) => {
            "TAP-Vid does not apply: the truth is the first estimate, propagated by the true poses, so that occlusion is unknown."
        }
        Some(TruthKind::Surface) if steps.is_empty() => "No step after the designation has a known truth.",
        Some(TruthKind::Surface) => {
            let jaccard = THRESHOLDS_PX.map(|threshold| jaccard(&steps, threshold));
            let average = jaccard.iter().sum::<f64>() / jaccard.len() as f64;
            let agrees = |step: &&&Judged<'_>| step.is_tracking == step.is_seen();
            let share = steps.iter().filter(agrees).count() as f64 / steps.len() as f64;
            let first = steps.iter().find(|step| !agrees(step)).map(|step| step.step());
            let values = [(average, worst(&steps)), (share, first)];
            return NAMES
                .iter()
                .zip(values)
                .map(|(name, (value, worst))| Metric::new(*name, "", Some(value), steps.len(), worst))
                .collect();
        }
    };
    NAMES.iter().map(|name| Metric::missing(*name, "", why)).collect()
}

/// J(δ); 1 if the point was always hidden and reported as hidden.
fn jaccard(steps: &[&Judged<'_>], threshold: f64) -> f64 {
    let (mut hit, mut wrong, mut missed) = (0.0, 0.0, 0.0);
    for step in steps {
        let is_close = step.is_seen() && step.err_px().is_some_and(|error| error < threshold);
        let is_hit = step.is_tracking && is_close;
        hit += f64::from(is_hit);
        wrong += f64::from(step.is_tracking && !is_hit);
        missed += f64::from(step.is_seen() && !is_hit);
    }
    let all = hit + wrong + missed;
    if all == 0.0 { 1.0 } else { hit / all }
}

/// The worst step: one of wrong visibility, else the one with the largest error beyond the smallest threshold.
fn worst(steps: &[&Judged<'_>]) -> Option<usize> {
    let cost = |step: &Judged<'_>| match (step.is_tracking, step.is_seen()) {
        (false, false) => 0.0,
        (true, true) => step.err_px().unwrap_or(f64::INFINITY),
        _ => f64::INFINITY,
    };
    let bad = steps.iter().rev().filter(|step| cost(step) >= THRESHOLDS_PX[0]);
    bad.max_by(|a, b| cost(a).total_cmp(&cost(b))).map(|step| step.step())
}
