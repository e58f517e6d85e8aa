//! The best match of a surface below the pixel, its covariance, and the second best (R63, R67, R68).
//!
//! **Sub-pixel fit (R67).** Around the highest score a quadratic is fitted to the 3 × 3 neighbours,
//! ```text
//! f(d) = f₀ + gᵀ d + ½ dᵀ H d,     d* = −H⁻¹ g,     score = f(d*)
//! ```
//! with g and H by central differences, so that f passes through the highest score and its four neighbours. The
//! whole pixel stands when H is not negative definite, or when a neighbour is missing or excluded; each
//! component of d* is held within ±1 px.
//!
//! **Covariance.** With patches of zero mean and unit norm a shift by δ lowers the score by ½ δᵀ(−H)δ, so −H is
//! the information of the squared difference per unit of its variance. What the match leaves unexplained,
//! 1 − ncc², is spread over the N pixels of the window less the four numbers fitted (gain, level, two shifts):
//! ```text
//! σ² = (1 − ncc²) / (N − 4),     Σ = σ² (−H)⁻¹ + floor² 1
//! ```
//! It is the Cramér–Rao bound for noise that is independent from pixel to pixel. Where the residual is correlated
//! over an area of A px² (perspective, shadow) the effective count is N/A and Σ is A times larger: who needs that
//! measures it from the patches. The floor is the error of the quadratic itself. A peak kept on whole pixels adds
//! the variance of rounding, 1/12 px²; without a fit the position is known to the neighbours, 3 px wide: 3²/12.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | f₀ | `integer_score` | – |
//! | g, H | `Fit::gradient`, `Fit::hessian` | 1/px, 1/px² |
//! | d* | `Fit::offset` | px |
//! | Σ | `covariance_px2` | px² |

use nalgebra::{Matrix2, Vector2};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::surface::Surface;
use crate::frames::Pixel;

/// 1σ error of the quadratic on textures with detail down to three pixels, px.
const FIT_FLOOR_PX: f64 = 0.02;

/// The best match of a surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Peak {
    /// Where the template's centre lies, px; below the pixel when that was asked for and could be fitted.
    pub pixel: Pixel,
    /// Score at `pixel`: of the fitted quadratic, or of the whole pixel.
    pub score: f64,
    /// The whole pixel with the highest score: column, row.
    pub integer: [i32; 2],
    /// The highest score.
    pub integer_score: f64,
    /// Covariance of `pixel` for independent noise (see the module), px².
    #[schema(value_type = Vec<f64>)]
    pub covariance_px2: Matrix2<f64>,
    /// Whether a neighbour of the highest score is missing or excluded: the true peak may lie beyond.
    pub at_edge: bool,
}

/// The highest local maximum away from the best (R68): how near the match was to another.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SecondPeak {
    /// Where the template's centre lies, whole px.
    pub pixel: Pixel,
    /// Its score.
    pub score: f64,
    /// Its score over the best whole-pixel score: near 1 the match is ambiguous.
    pub ratio: f64,
    /// Distance from the best match, px.
    pub distance_px: f64,
}

/// The highest score of `surface`, refined below the pixel when `sub_pixel` is set.
///
/// `None` when every position is excluded. Among equal scores the first in reading order is taken.
pub fn find_peak(surface: &Surface, sub_pixel: bool) -> Option<Peak> {
    let (ix, iy, highest) = surface.maximum()?;
    let whole = surface.pixel_of(ix, iy);
    let neighbours = neighbours(surface, ix, iy);
    let fit = neighbours.as_ref().and_then(Fit::new);
    let integer_score = f64::from(highest);
    let (offset, score) = match &fit {
        Some(fit) if sub_pixel => (fit.offset, fit.score.clamp(-1.0, 1.0)),
        _ => (Vector2::zeros(), integer_score),
    };
    let samples = f64::from(surface.template_size).powi(2);
    let covariance_px2 = match &fit {
        Some(fit) if sub_pixel => fit.covariance(score, samples),
        Some(fit) => fit.covariance(score, samples) + Matrix2::identity() / 12.0,
        None => Matrix2::identity() * (9.0 / 12.0),
    };
    Some(Peak {
        pixel: whole.offset(offset.x, offset.y),
        score,
        integer: [surface.origin[0] + ix as i32, surface.origin[1] + iy as i32],
        integer_score,
        covariance_px2,
        at_edge: neighbours.is_none(),
    })
}

/// The highest local maximum at least `min_distance_px` from the best match (R68); `None` when there is none.
pub fn second_peak(surface: &Surface, best: &Peak, min_distance_px: f64) -> Option<SecondPeak> {
    let mut second: Option<SecondPeak> = None;
    for (iy, ix) in (0..surface.height).flat_map(|iy| (0..surface.width).map(move |ix| (iy, ix))) {
        let Some(score) = surface.at(ix, iy).map(f64::from) else { continue };
        let pixel = surface.pixel_of(ix, iy);
        let distance_px = pixel.distance(best.pixel);
        let is_higher = second.as_ref().is_none_or(|second| score > second.score);
        if is_higher && distance_px >= min_distance_px && is_local_maximum(surface, ix, iy) {
            second = Some(SecondPeak { pixel, score, ratio: score / best.integer_score, distance_px });
        }
    }
    second
}

/// Whether no neighbour is higher; of a plateau of two or more the first in reading order counts.
fn is_local_maximum(surface: &Surface, ix: u32, iy: u32) -> bool {
    let Some(here) = surface.at(ix, iy) else { return false };
    let columns = || ix.saturating_sub(1)..=ix + 1;
    (iy.saturating_sub(1)..=iy + 1).flat_map(|v| columns().map(move |u| (v, u))).all(|(v, u)| {
        let there = surface.at(u, v).unwrap_or(f32::NEG_INFINITY);
        if (v, u) < (iy, ix) { there < here } else { there <= here }
    })
}

/// The 3 × 3 scores around an index, row by row; `None` when one is missing or excluded.
fn neighbours(surface: &Surface, ix: u32, iy: u32) -> Option<[f64; 9]> {
    let mut scores = [0.0; 9];
    for (i, score) in scores.iter_mut().enumerate() {
        let (u, v) = ((ix + i as u32 % 3).checked_sub(1)?, (iy + i as u32 / 3).checked_sub(1)?);
        *score = f64::from(surface.at(u, v)?);
    }
    Some(scores)
}

/// The quadratic through the neighbourhood of a maximum.
struct Fit {
    /// From the whole pixel to the maximum, px.
    offset: Vector2<f64>,
    /// Value of the quadratic there.
    score: f64,
    /// Curvature, 1/px²; negative definite.
    hessian: Matrix2<f64>,
}

impl Fit {
    /// `None` unless the curvature is negative in every direction.
    fn new(f: &[f64; 9]) -> Option<Self> {
        let gradient = Vector2::new((f[5] - f[3]) / 2.0, (f[7] - f[1]) / 2.0);
        let (xx, yy) = (f[5] - 2.0 * f[4] + f[3], f[7] - 2.0 * f[4] + f[1]);
        let xy = (f[8] - f[6] - f[2] + f[0]) / 4.0;
        let hessian = Matrix2::new(xx, xy, xy, yy);
        if !(xx < 0.0 && hessian.determinant() > 1e-12) {
            return None;
        }
        let offset = (-hessian.try_inverse()? * gradient).map(|d| d.clamp(-1.0, 1.0));
        let score = f[4] + gradient.dot(&offset) + 0.5 * offset.dot(&(hessian * offset));
        Some(Self { offset, score, hessian })
    }

    /// Covariance of the maximum of a template of `samples` pixels that scores `score`, px².
    fn covariance(&self, score: f64, samples: f64) -> Matrix2<f64> {
        let variance = (1.0 - score * score).max(0.0) / (samples - 4.0).max(1.0);
        let information = (-self.hessian).try_inverse().unwrap_or_else(Matrix2::identity);
        information * variance + Matrix2::identity() * FIT_FLOOR_PX.powi(2)
    }
}

#[cfg(test)]
#[path = "peak_tests.rs"]
mod tests;
