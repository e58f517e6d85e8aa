//! The position error of one match, measured from the match itself (ours).
//!
//! Least squares of the normalised patches: with the residual r = Ĵ − ncc·Î and the gradients g of the matched patch
//! (per px), a displacement error is `δ = A⁻¹ Σ w g r`, `A = Σ w g gᵀ`, with the weights w of the refinement of the
//! match (`correlate::focus`). Residuals of neighbouring pixels are correlated (both patches are resampled, and the
//! effect of perspective is smooth), so their covariance is estimated with its spatial correlation (White 1980; Newey
//! & West 1987, with Bartlett weights in two dimensions):
//! ```text
//! Σ_δ = n/(n − 4) A⁻¹ B A⁻¹,   B = Σ_ij c(i − j) w_i w_j r_i r_j g_i g_jᵀ,   c = (1 − |Δx|/(L+1)) (1 − |Δy|/(L+1))
//! ```
//! so no noise level is assumed. The fit removes four parameters (two shifts, gain, offset; with an affine map eight)
//! from a residual with only `n = (Σw)² / Σw² / Σc` independent samples, which makes it smaller than the actual
//! disturbance: hence the factor (as HC1 of MacKinnon & White 1985). A floor is added for the sub-pixel fit itself,
//! whose error does not appear in the residual.
//!
//! If the template was prepared by scale and roll alone, the surface's slope stretches the image by another map, F =
//! I + E. The best shift of a patch that is stretched by E but compared unstretched is not zero:
//! ```text
//! b = A⁻¹ Σ w g gᵀ E o      o: offset of a pixel from the patch's middle
//! ```
//! This bias depends on where the patch has texture, has the same direction step after step, and is therefore
//! returned separately from the covariance.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | n | independent residuals in the window, at least 5 | – |
//! | L | `CORRELATION_REACH_PX` | px |
//! | Σ_δ | `covariance_px2` | px² |
//! | E | `misfit` | px per px |
//! | b | `bias_px` | px |

use nalgebra::{Matrix2, Vector2};

use sightline_vision::correlate::Focus;
use sightline_vision::image::gradient;
use sightline_vision::image::patch::Patch;

/// Distance over which residuals are taken as correlated, px.
const CORRELATION_REACH_PX: i64 = 4;

/// Number of parameters of a match: two shifts, gain and offset.
const FITTED: f64 = 4.0;

/// Number of further parameters of an affine map.
const FITTED_BY_MAP: f64 = 4.0;

/// 1σ error of the quadratic fit of a peak and of resampling, px.
const FIT_FLOOR_PX: f64 = 0.03;

/// 1σ given to a direction in which the patch has no gradient at all, px.
const UNDETERMINED_PX: f64 = 10.0;

/// The error of one match.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MatchNoise {
    /// Covariance of the position, px².
    pub covariance_px2: Matrix2<f64>,
    /// Shift of the position by the misfit of the prepared template, px.
    pub bias_px: Vector2<f64>,
}

/// The error of the position of `matched` against `template`, patches of the size of `focus`, if the true map between
/// them is `I + misfit`.
pub fn match_noise(template: &Patch, matched: &Patch, misfit: &Matrix2<f64>, focus: &Focus) -> MatchNoise {
    noise(template, matched, misfit, focus, FITTED)
}

/// The error of the position of `matched`, sampled through an affine map fitted to `template`, with equal weights.
pub fn affine_noise(template: &Patch, matched: &Patch) -> MatchNoise {
    let focus = Focus::new(template.width(), 0.0);
    noise(template, matched, &Matrix2::zeros(), &focus, FITTED + FITTED_BY_MAP)
}

fn noise(template: &Patch, matched: &Patch, misfit: &Matrix2<f64>, focus: &Focus, fitted: f64) -> MatchNoise {
    let undetermined = MatchNoise {
        covariance_px2: Matrix2::identity() * UNDETERMINED_PX.powi(2),
        bias_px: Vector2::zeros(),
    };
    let (Some(template), Some(image)) = (focus.normalise(template), focus.normalise(matched)) else {
        return undetermined;
    };
    let (gx, gy) = gradient::central(&image);
    let (width, height) = image.dimensions();
    let middle = Vector2::new(f64::from(width - 1), f64::from(height - 1)) / 2.0;
    let score = weighted_product(&template, &image, focus);
    let mut influence = vec![Vector2::zeros(); (width * height) as usize];
    let (mut information, mut stretched) = (Matrix2::zeros(), Vector2::zeros());
    for y in 1..height - 1 {
        for x in 1..width - 1 {
            let g = Vector2::new(f64::from(gx.get_pixel(x, y)[0]), f64::from(gy.get_pixel(x, y)[0]));
            let residual =
                f64::from(image.get_pixel(x, y)[0]) - score * f64::from(template.get_pixel(x, y)[0]);
            if residual.is_finite() && g.iter().all(|v| v.is_finite()) {
                let offset = Vector2::new(f64::from(x), f64::from(y)) - middle;
                let index = (y * width + x) as usize;
                let weight = focus.weights()[index];
                information += g * g.transpose() * weight;
                stretched += g * g.dot(&(misfit * offset)) * weight;
                influence[index] = g * residual * weight;
            }
        }
    }
    let meat = correlated_sum(&influence, i64::from(width), i64::from(height));
    information.try_inverse().map_or(undetermined, |inverse| MatchNoise {
        covariance_px2: inverse * meat * inverse * freedom(focus, fitted)
            + Matrix2::identity() * FIT_FLOOR_PX.powi(2),
        bias_px: inverse * stretched,
    })
}

/// `n / (n − fitted)`.
fn freedom(focus: &Focus, fitted: f64) -> f64 {
    let squares: f64 = focus.weights().iter().map(|w| w * w).sum();
    let alike = ((CORRELATION_REACH_PX + 1) as f64).powi(2);
    let independent = (1.0 / (squares * alike)).max(fitted + 1.0);
    independent / (independent - fitted)
}

/// `Σ_ij c(i − j) v_i v_jᵀ` over a grid of vectors: c is a product of one factor per direction, so the sum over the
/// neighbours is taken along rows first, then along columns.
fn correlated_sum(vectors: &[Vector2<f64>], width: i64, height: i64) -> Matrix2<f64> {
    let reach = CORRELATION_REACH_PX;
    let around = |from: &[Vector2<f64>], [x, y]: [i64; 2], [dx, dy]: [i64; 2]| {
        let mut sum = Vector2::zeros();
        for d in -reach..=reach {
            let (u, v) = (x + d * dx, y + d * dy);
            if (0..width).contains(&u) && (0..height).contains(&v) {
                sum += from[(v * width + u) as usize] * (1.0 - d.abs() as f64 / (reach + 1) as f64);
            }
        }
        sum
    };
    let places = || (0..height).flat_map(|y| (0..width).map(move |x| [x, y]));
    let rows: Vec<_> = places().map(|place| around(vectors, place, [1, 0])).collect();
    let sums = places().map(|place| around(&rows, place, [0, 1]));
    let sum = vectors.iter().zip(sums).fold(Matrix2::zeros(), |sum, (v, near)| sum + v * near.transpose());
    (sum + sum.transpose()) * 0.5
}

fn weighted_product(a: &Patch, b: &Patch, focus: &Focus) -> f64 {
    let products = a.iter().zip(b.iter()).zip(focus.weights());
    let valid = products.filter(|((a, b), _)| a.is_finite() && b.is_finite());
    let (sum, total) = valid
        .fold((0.0, 0.0), |(sum, total), ((a, b), w)| (sum + w * f64::from(*a) * f64::from(*b), total + w));
    if total > 0.0 { sum / total } else { 0.0 }
}
