//! The best match of a score map at sub-pixel precision, its covariance, and the second best (R63, R67, R68).
//!
//! **Sub-pixel fit (R67).** Around the highest score a quadratic is fitted to the 3 × 3 neighbours,
//! ```text
//! f(d) = f₀ + gᵀ d + ½ dᵀ H d,     d* = −H⁻¹ g,     score = f(d*)
//! ```
//! with g and H by central differences, so that f passes through the highest score and its four neighbours. The whole
//! pixel is returned if H is not negative definite, or if a neighbour is missing or excluded; each component of d* is
//! clamped to ±1 px.
//!
//! *Departure.* If the 5 × 5 neighbours exist, d* is then moved to the maximum of the polynomial of fourth degree in x
//! and in y that passes through all of them (Newton's method from d*). The score map is asymmetric, because the norm of
//! the window changes as it moves, and a quadratic cannot follow: with 21 × 21 pixels of noiseless texture of 5 to 20 px
//! its error is 0.03 px (RMS; up to 0.08), that of the quartic 0.01 (up to 0.03).
//!
//! **Covariance.** With patches of zero mean and unit norm a shift by δ lowers the score by ½ δᵀ(−H)δ, so −H is the
//! information of the squared difference per unit of its variance. The unexplained part of the match, 1 − ncc², is
//! divided by the N pixels of the window less the four fitted parameters (gain, bias, two shifts):
//! ```text
//! σ² = (1 − ncc²) / (N − 4),     Σ = σ² (−H)⁻¹ + floor² 1
//! ```
//! This is the Cramér–Rao bound for noise that is independent between pixels. It excludes the bias of the correlation
//! itself, which noise moves towards windows of more contrast (0.02 px at a score of 0.97 and 0.13 px at 0.84 in one
//! simulated texture). If the residual is correlated over an area of A px² (perspective, shadow), the effective count is
//! N/A and Σ is A times larger; A must be measured from the patches. The floor is the error of the fit itself. A peak at
//! a whole pixel adds the variance of rounding, 1/12 px²; without a fit the position is known to the neighbours only, 3
//! px wide: 3²/12.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | f₀ | `integer_score` | – |
//! | H | `Fit::hessian` | 1/px² |
//! | d* | `Fit::offset` | px |
//! | Σ | `covariance_px2` | px² |

use nalgebra::{Matrix2, Matrix5, SMatrix, Vector2, Vector5};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::surface::Surface;
use sightline_geometry::frames::Pixel;

/// 1σ error of the fit itself on textures with detail down to three pixels, px.
const FIT_FLOOR_PX: f64 = 0.02;

/// The best match of a score map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Peak {
    /// Position of the template's centre, px; sub-pixel if requested and if the fit succeeded.
    pub pixel: Pixel,
    /// Score at `pixel`: of the fitted function, or of the whole pixel.
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

/// The highest local maximum away from the best; measures the ambiguity of the match.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SecondPeak {
    /// Position of the template's centre, whole px.
    pub pixel: Pixel,
    /// Score at `pixel`.
    pub score: f64,
    /// Score over the best whole-pixel score, or the inverse if the best is not positive: near 1 the match is ambiguous.
    pub ratio: f64,
    /// Distance from the best match, px.
    pub distance_px: f64,
}

/// Finds the highest score of `surface`, with a sub-pixel fit if `sub_pixel` is set.
///
/// `None` if every position is excluded. Among equal scores the first in reading order is taken.
pub fn find_peak(surface: &Surface, sub_pixel: bool) -> Option<Peak> {
    let (ix, iy, _) = surface.maximum()?;
    peak_at(surface, ix, iy, sub_pixel)
}

/// The match at an index of the score map, with the same sub-pixel fit as the best one.
pub fn peak_at(surface: &Surface, ix: u32, iy: u32, sub_pixel: bool) -> Option<Peak> {
    let highest = surface.at(ix, iy)?;
    let whole = surface.pixel_of(ix, iy);
    let near = neighbours::<3>(surface, ix, iy);
    let fit = near
        .as_ref()
        .and_then(Fit::quadratic)
        .map(|fit| neighbours::<5>(surface, ix, iy).and_then(|wide| fit.refined(&wide)).unwrap_or(fit));
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
        at_edge: near.is_none(),
    })
}

/// The highest local maximum at least `min_distance_px` from the best match (R68); `None` without one.
pub fn second_peak(surface: &Surface, best: &Peak, min_distance_px: f64) -> Option<SecondPeak> {
    let mut second: Option<SecondPeak> = None;
    for (iy, ix) in (0..surface.height).flat_map(|iy| (0..surface.width).map(move |ix| (iy, ix))) {
        let Some(score) = surface.at(ix, iy).map(f64::from) else { continue };
        let pixel = surface.pixel_of(ix, iy);
        let distance_px = pixel.distance(best.pixel);
        let is_higher = second.as_ref().is_none_or(|second| score > second.score);
        if is_higher && distance_px >= min_distance_px && is_local_maximum(surface, ix, iy) {
            second = Some(SecondPeak { pixel, score, ratio: ratio(score, best.integer_score), distance_px });
        }
    }
    second
}

/// The highest local maxima: positions in px of the map's level, and scores.
pub fn highest_maxima(surface: &Surface, count: usize) -> Vec<([i32; 2], f32)> {
    let places = (0..surface.height).flat_map(|iy| (0..surface.width).map(move |ix| (ix, iy)));
    let mut maxima: Vec<([i32; 2], f32)> = places
        .filter(|(ix, iy)| is_local_maximum(surface, *ix, *iy))
        .filter_map(|(ix, iy)| {
            let place = [surface.origin[0] + ix as i32, surface.origin[1] + iy as i32];
            Some((place, surface.at(ix, iy)?))
        })
        .collect();
    // A stable sort: equal scores stay in reading order.
    maxima.sort_by(|a, b| b.1.total_cmp(&a.1));
    maxima.truncate(count);
    maxima
}

/// Ratio of the second score to the best, or its inverse if the best is not positive; 1 for equal scores.
fn ratio(second: f64, best: f64) -> f64 {
    if second == best {
        1.0
    } else if best > 0.0 {
        second / best
    } else {
        best / second
    }
}

/// Returns whether no neighbour is higher; of a plateau the first position in reading order counts.
fn is_local_maximum(surface: &Surface, ix: u32, iy: u32) -> bool {
    let Some(here) = surface.at(ix, iy) else { return false };
    let columns = || ix.saturating_sub(1)..=ix + 1;
    (iy.saturating_sub(1)..=iy + 1).flat_map(|v| columns().map(move |u| (v, u))).all(|(v, u)| {
        let there = surface.at(u, v).unwrap_or(f32::NEG_INFINITY);
        if (v, u) < (iy, ix) { there < here } else { there <= here }
    })
}

/// The N × N scores around an index, indexed by (row, column); `None` if one is missing or excluded.
fn neighbours<const N: usize>(surface: &Surface, ix: u32, iy: u32) -> Option<SMatrix<f64, N, N>> {
    let mut scores = SMatrix::zeros();
    for (row, column) in (0..N).flat_map(|row| (0..N).map(move |column| (row, column))) {
        let u = (ix + column as u32).checked_sub(N as u32 / 2)?;
        let v = (iy + row as u32).checked_sub(N as u32 / 2)?;
        scores[(row, column)] = f64::from(surface.at(u, v)?);
    }
    Some(scores)
}

/// A smooth function fitted to the neighbourhood of the highest score, at its maximum.
#[derive(Clone, Copy)]
pub struct Fit {
    /// From the whole pixel to the maximum, px.
    pub offset: Vector2<f64>,
    /// Value at the maximum.
    pub score: f64,
    /// Curvature at the maximum, 1/px²; negative definite.
    hessian: Matrix2<f64>,
}

impl Fit {
    /// The quadratic of R67; rows are y. `None` unless the curvature is negative in every direction.
    pub fn quadratic(f: &SMatrix<f64, 3, 3>) -> Option<Self> {
        let gradient = Vector2::new((f[(1, 2)] - f[(1, 0)]) / 2.0, (f[(2, 1)] - f[(0, 1)]) / 2.0);
        let middle = f[(1, 1)];
        let (xx, yy) = (f[(1, 2)] - 2.0 * middle + f[(1, 0)], f[(2, 1)] - 2.0 * middle + f[(0, 1)]);
        let xy = (f[(2, 2)] - f[(2, 0)] - f[(0, 2)] + f[(0, 0)]) / 4.0;
        let hessian = Matrix2::new(xx, xy, xy, yy);
        if !is_maximum(&hessian) {
            return None;
        }
        let offset = (-hessian.try_inverse()? * gradient).map(|d| d.clamp(-1.0, 1.0));
        let score = middle + gradient.dot(&offset) + 0.5 * offset.dot(&(hessian * offset));
        Some(Self { offset, score, hessian })
    }

    /// The maximum, nearest to this fit, of the polynomial through 5 × 5 scores; `None` if Newton's method does not
    /// converge within a pixel of the highest score.
    pub fn refined(&self, f: &SMatrix<f64, 5, 5>) -> Option<Self> {
        let coefficients = QUARTIC * f * QUARTIC.transpose();
        let mut offset = self.offset;
        for _ in 0..NEWTON_STEPS {
            let ([x, dx, ddx], [y, dy, ddy]) = (powers(offset.x), powers(offset.y));
            let value = |y: &Vector5<f64>, x: &Vector5<f64>| y.dot(&(coefficients * x));
            let gradient = Vector2::new(value(&y, &dx), value(&dy, &x));
            let cross = value(&dy, &dx);
            let hessian = Matrix2::new(value(&y, &ddx), cross, cross, value(&ddy, &x));
            if !is_maximum(&hessian) || offset.amax() > 1.0 {
                return None;
            }
            let step = -hessian.try_inverse()? * gradient;
            if step.amax() < 1e-9 {
                return Some(Self { offset, score: value(&y, &x), hessian });
            }
            offset += step;
        }
        None
    }

    /// Covariance of the maximum for a template of `samples` pixels with score `score`, px².
    fn covariance(&self, score: f64, samples: f64) -> Matrix2<f64> {
        let variance = (1.0 - score * score).max(0.0) / (samples - 4.0).max(1.0);
        let information = (-self.hessian).try_inverse().unwrap_or_else(Matrix2::identity);
        information * variance + Matrix2::identity() * FIT_FLOOR_PX.powi(2)
    }
}

/// Limit of Newton's method; its convergence is quadratic, and from a quadratic's maximum four steps suffice.
const NEWTON_STEPS: usize = 12;

/// Coefficients of 1, d, d², d³, d⁴ of the quartic through values at d = −2 … 2.
#[rustfmt::skip]
const QUARTIC: Matrix5<f64> = Matrix5::new(
    0.0, 0.0, 1.0, 0.0, 0.0,
    1.0 / 12.0, -8.0 / 12.0, 0.0, 8.0 / 12.0, -1.0 / 12.0,
    -1.0 / 24.0, 16.0 / 24.0, -30.0 / 24.0, 16.0 / 24.0, -1.0 / 24.0,
    -1.0 / 12.0, 2.0 / 12.0, 0.0, -2.0 / 12.0, 1.0 / 12.0,
    1.0 / 24.0, -4.0 / 24.0, 6.0 / 24.0, -4.0 / 24.0, 1.0 / 24.0,
);

/// Powers 0 to 4 of `d`, and their first and second derivatives.
fn powers(d: f64) -> [Vector5<f64>; 3] {
    let (d2, d3) = (d * d, d * d * d);
    [
        Vector5::new(1.0, d, d2, d3, d2 * d2),
        Vector5::new(0.0, 1.0, 2.0 * d, 3.0 * d2, 4.0 * d3),
        Vector5::new(0.0, 0.0, 2.0, 6.0 * d, 12.0 * d2),
    ]
}

/// Returns whether the curvature is negative in every direction, by more than the rounding of `f32` scores.
fn is_maximum(hessian: &Matrix2<f64>) -> bool {
    hessian.m11 < 0.0 && hessian.m22 < 0.0 && hessian.determinant() > 1e-12
}

#[cfg(test)]
#[path = "peak_tests.rs"]
mod tests;
