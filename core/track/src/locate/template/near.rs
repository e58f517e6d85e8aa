//! Prefers a match near the prediction to one far from it if their scores are similar (ours).
//!
//! ```text
//! far    νᵀ (Σ_pred + Σ_match)⁻¹ ν > far_sigma²                     ν = pixel − predicted
//! near   instead of a far match if   s_near ≥ far_ncc_min   and   1 − s_near < far_miss_factor · (1 − s_far)
//! ```
//! Kim et al. take the highest score of the search window. If that match is far from the prediction, and the highest
//! maximum near the prediction fulfils both conditions, the latter is taken. Example: the edge of a shadow, 38 px (40
//! σ) from the prediction, scored 0.948; the target scored 0.940 and was lost without a failed gate.
//!
//! Why a factor of 2: for a window of N independent pixels, the likelihood ratio of the far position to the near one
//! is `((1 − s_near²) / (1 − s_far²))^(N/2)`. With N = 40 and a factor of 2 it is 10⁶, about the prior ratio of the
//! two positions if one prediction in a thousand is wrong. Why `far_ncc_min`: if the target is outside the search
//! window, the best match near the prediction scores less, and taking it would be false tracking.
//!
//! It applies to normalised correlation only, not to other measures or after a descent.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | Σ_pred | `predicted_covariance_px2` | px² |
//! | Σ_match | `covariance_px2` of the peak | px² |
//! | ν | offset of the match from the prediction | px |
//! | s | score | – |

use nalgebra::{Matrix2, Vector2};

use super::first_match::FirstMatch;
use super::settings::Measure;
use crate::locate::tracker::LocateInput;
use crate::stages::point_mast::Pointing;
use sightline_geometry::frames::Pixel;
use sightline_vision::correlate::peak::{self, Peak};

/// Whether a match with this covariance is more than `sigmas` standard deviations from the prediction; `false` without one.
pub(super) fn is_far(pointing: &Pointing, pixel: Pixel, covariance_px2: &Matrix2<f64>, sigmas: f64) -> bool {
    let (Some(predicted), Some(covariance)) = (pointing.predicted_left, pointing.predicted_covariance_px2)
    else {
        return false;
    };
    let innovation = Vector2::new(pixel.x - predicted.x, pixel.y - predicted.y);
    let inverse = (covariance + covariance_px2).try_inverse();
    inverse.is_some_and(|inverse| innovation.dot(&(inverse * innovation)) > sigmas * sigmas)
}

fn is_far_peak(peak: &Peak, input: &LocateInput<'_>) -> bool {
    is_far(input.pointing, peak.pixel, &peak.covariance_px2, input.settings.limits.far_sigma)
}

/// Whether a match near the prediction is preferred to one far from it, by their scores.
fn is_taken(near: f64, far: f64, input: &LocateInput<'_>) -> bool {
    let settings = input.settings;
    let is_nearly_alike = 1.0 - near < settings.template.far_miss_factor * (1.0 - far);
    near >= far || (near >= settings.limits.far_ncc_min && is_nearly_alike)
}

/// Whether a match is better than the best one so far.
pub(super) fn is_better(first: &FirstMatch, best: &FirstMatch, input: &LocateInput<'_>) -> bool {
    let (score, its_score) = (first.peak.score, best.peak.score);
    let far = |first: &FirstMatch| is_used(first, input) && is_far_peak(&first.peak, input);
    match (far(first), far(best)) {
        (false, true) => is_taken(score, its_score, input),
        (true, false) => !is_taken(its_score, score, input),
        _ => score > its_score,
    }
}

/// Moves a match that is far from the prediction to the highest maximum near it, if that is preferred.
pub(super) fn prefer_near(first: &mut FirstMatch, input: &LocateInput<'_>) {
    if !is_used(first, input) || !is_far_peak(&first.peak, input) {
        return;
    }
    let surface = &first.surface;
    let mut peaks = peak::highest_maxima(surface, usize::MAX).into_iter().filter_map(|([x, y], _)| {
        let (ix, iy) = surface.index_of(x, y)?;
        peak::peak_at(surface, ix, iy, input.settings.template.sub_pixel)
    });
    let near = peaks.find(|peak| !is_far_peak(peak, input));
    if let Some(near) = near.filter(|near| is_taken(near.score, first.peak.score, input)) {
        first.peak = near;
    }
}

fn is_used(first: &FirstMatch, input: &LocateInput<'_>) -> bool {
    let settings = &input.settings.template;
    settings.far_miss_factor > 1.0 && settings.measure == Measure::Ncc && first.descent.is_none()
}
