//! Verdict on a registration: compares its numbers with the limits.
//!
//! ```text
//! misfit = √( mean of min( (r_i/σ_i)², 5² ) )        1 if the noise of both surfaces explains the residuals
//! ```
//! The cut limits the effect of single outliers of stereo; a missing rock affects whole regions and is detected. The
//! mean is used instead of the median because the ground around a wrong rock fits. Six parameters can make a wrong rock
//! fit by rotating it; the start's attitude is the rover's own and bounds the rotation (R198: it is "about right").
//!
//! Source: ours; R196 for the overlap.

use super::failure::{Failure, Side};
use super::pairs::Pair;
use super::settings::CheckSettings;
use super::{Registration, RegistrationInput};

/// Residuals are clamped to this many standard deviations.
const CUT: f64 = 5.0;

/// Checks the input surfaces; returns the reason if one is unusable.
pub(super) fn surfaces(input: &RegistrationInput<'_>, limits: &CheckSettings) -> Option<Failure> {
    for (mesh, side) in [(input.fixed, Side::Fixed), (input.moving, Side::Moving)] {
        let triangles = mesh.triangles.len();
        if mesh.vertices.is_empty() {
            return Some(Failure::EmptySurface { side });
        }
        if triangles < limits.triangles_min {
            return Some(Failure::TooFewTriangles { side, triangles, least: limits.triangles_min });
        }
    }
    None
}

/// RMS residual over its predicted σ; `None` without a noise model.
pub(super) fn misfit(pairs: &[Pair]) -> Option<f64> {
    let known = pairs.iter().filter(|pair| pair.sigma_m < 1.0);
    let (mut squares, mut count) = (0.0, 0);
    for pair in known {
        squares += pair.distance().powi(2).min(CUT * CUT);
        count += 1;
    }
    (count > 0).then(|| (squares / f64::from(count)).sqrt())
}

/// Returns the first reason to reject a result.
pub(super) fn result(
    registration: &Registration,
    limits: &CheckSettings,
    overlap_min: f64,
) -> Option<Failure> {
    let share = registration.agreement[2].map_or(0.0, |agreement| agreement.overlap);
    if share < overlap_min {
        return Some(Failure::NoOverlap { share, least: overlap_min });
    }
    if let Some(misfit) = registration.misfit.filter(|&misfit| misfit > limits.misfit_max) {
        return Some(Failure::DoesNotFit { misfit, limit: limits.misfit_max });
    }
    let sigma_m = registration.sigma_m();
    if sigma_m.is_none_or(|sigma_m| sigma_m > limits.sigma_max_m) {
        return Some(Failure::NotEnoughShape { sigma_m, limit_m: limits.sigma_max_m });
    }
    let turn_rad = registration.turn_rad;
    if turn_rad > limits.turn_max_rad {
        return Some(Failure::TurnedAway { turn_rad, limit_rad: limits.turn_max_rad });
    }
    let coarse = &registration.coarse;
    let best = coarse.best?;
    if let Some(other) = coarse.other {
        let ratio = other.mean_m / best.mean_m;
        let away = |axis: usize| other.shift_m[axis] - best.shift_m[axis];
        if ratio < limits.other_min {
            let distance_m = away(0).hypot(away(1));
            return Some(Failure::NotIsolated { distance_m, ratio, least: limits.other_min });
        }
    }
    let range_m = coarse.steps as f64 * coarse.step_m;
    best.is_at_edge.then_some(Failure::AtSearchEdge { range_m })
}
