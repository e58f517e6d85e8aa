//! Covariance of a registration, from the shape and from the statistics of its residuals (R179).
//!
//! ```text
//! A = Σ w_i ½ (J_i^f J_i^mᵀ + J_i^m J_i^fᵀ)                    J with the normal of the fixed and of the moving surface
//! point to plane  w = 1/σ_i²                                    P = s² κ A⁻¹
//! L1 of depths    w = √(2/π) / (s σ_i) · slant⁻¹,  B = Σ κ₁ J Jᵀ / slant²           P = A⁻¹ B A⁻¹
//! κ  = Σ over lags of the autocorrelation of r_i / σ_i          κ₁ the same for their signs
//! P_target = [I, −[d]×] P [I, −[d]×]ᵀ + σ_common² I             d = target − c
//! ```
//! **Shape that is only noise.** Noise tilts normals at random, so that flat ground would seem to constrain a shift
//! along it. The noise of the two surfaces is independent: products of one's gradient with the other's have no such
//! bias. Their random part can make A indefinite; there is then not enough shape.
//!
//! **Effective number of residuals.** Errors of stereo are correlated within a correlation window, and the error of a
//! thinned mesh is correlated over a facet. κ is the number of pixels over which residuals are correlated: the
//! autocorrelation of the residuals is averaged over rings of equal distance and summed up to the first ring below 5 %,
//! at most 8 pixels out. The scale s is measured too (RMS of r/σ, clamped at 3 robust scales): noise that was claimed
//! too small grows.
//!
//! **Common error.** A window of stereo smooths the surface, more at longer range: a convex rock appears smaller in all
//! pixels at once. σ_common accounts for it ([`super::ShapeSettings::common_sigma_m`]).
//!
//! | symbol | our name | unit, frame |
//! |---|---|---|
//! | P | [`Precision::covariance`] | m², m rad, rad²; sensor, about c |
//! | s, κ | [`Precision::scale`], [`Precision::alike_px`] | –, px |
//!
//! Source: ours (R179 asks for a bootstrap of the depth residuals, which treats neighbours as independent); the L1 form
//! is that of a median: Koenker & Bassett 1978.

use nalgebra::{Matrix3, Matrix3x6, Matrix6, SymmetricEigen};
use serde::{Deserialize, Serialize};

use super::held::Held;
use super::pairs::{Pair, Template, robust_scale};
use super::range_sensor::RangeImage;
use super::settings::Method;
use super::slopes::Slopes;
use sightline_geometry::frames::{Point3, Vector3};

/// Largest lag of the autocorrelation, px.
const LAG_MAX: i32 = 8;
/// Autocorrelation below which residuals are taken as independent.
const ALIKE_MIN: f64 = 0.05;
/// Lower bound of the slant of a surface: the normal of one seen edge-on is too uncertain.
const SLANT_MIN: f64 = 0.2;
/// Residuals are clamped to this many robust scales.
const CUT: f64 = 3.0;

/// Precision of a registered motion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Precision {
    /// P of (t, ω), m², m rad, rad²: axes of the sensor, about the pivot; `None` if the shape does not constrain the
    /// motion.
    pub covariance: Option<Matrix6<f64>>,
    /// s: RMS of the residuals over their predicted σ; in metres without a noise model.
    pub scale: f64,
    /// κ: number of pixels over which residuals are correlated.
    pub alike_px: f64,
    /// Number of pixels where both surfaces have normals.
    pub pixels: usize,
}

/// Computes the precision of a motion from its rendered depth map `moving` and its residuals `pairs`.
pub(super) fn precision(
    template: &Template,
    moving: &RangeImage,
    pairs: &[Pair],
    method: Method,
    held: &Held,
) -> Precision {
    let slopes = Slopes::of(&template.sensor, moving, template.normal_radius_px);
    let cut = CUT * robust_scale(pairs);
    let cut_residual = |pair: &Pair| pair.distance().clamp(-cut, cut);
    let squares: f64 = pairs.iter().map(|pair| cut_residual(pair).powi(2)).sum();
    let scale = (squares / pairs.len().max(1) as f64).sqrt();
    let alike = |value: fn(&Pair, f64) -> f64| {
        let mut values = vec![f64::NAN; moving.depth_m.len()];
        for pair in pairs {
            values[pair.pixel] = value(pair, cut);
        }
        alike_px(&values, moving.width)
    };
    let (shape, scatter, pixels) = sums(pairs, &slopes, method, scale);
    let alike_px = match method {
        Method::SimplexL1 => alike(|pair, _| pair.residual_m.signum()),
        Method::PointToPlane => alike(|pair, cut| pair.distance().clamp(-cut, cut)),
    };
    if method == Method::PointToPlane && !held.is_free() {
        let covariance = with_prior(&(shape / (scale * scale * alike_px).max(1e-12)), held);
        return Precision { covariance, scale, alike_px, pixels };
    }
    let covariance = shape.cholesky().map(|factor| {
        let inverse = factor.inverse();
        let spread = match method {
            Method::SimplexL1 => inverse * scatter * inverse,
            Method::PointToPlane => inverse * (scale * scale),
        };
        spread * alike_px
    });
    Precision { covariance, scale, alike_px, pixels }
}

/// Combines the information of the surfaces with the prior. Negative eigenvalues, which occur by chance, are set to 0.
fn with_prior(shape: &Matrix6<f64>, held: &Held) -> Option<Matrix6<f64>> {
    // Metres and radians differ by the size of the rock; in units of the prior's σ all directions are comparable.
    let whitened = held.information.cholesky()?.l();
    let inverse = whitened.try_inverse()?;
    let mut eigen = SymmetricEigen::new(inverse * shape * inverse.transpose());
    eigen.eigenvalues.apply(|value| *value = 1.0 / (1.0 + value.max(0.0)));
    Some(inverse.transpose() * eigen.recompose() * inverse)
}

/// A, B without κ, and the number of pixels where both surfaces have normals.
fn sums(pairs: &[Pair], slopes: &Slopes, method: Method, scale: f64) -> (Matrix6<f64>, Matrix6<f64>, usize) {
    let (mut shape, mut scatter, mut pixels) = (Matrix6::zeros(), Matrix6::zeros(), 0);
    for pair in pairs {
        let Some(other) = slopes.normals[pair.pixel] else { continue };
        let (fixed, moving) = (pair.gradient(&pair.normal), pair.gradient(&other));
        let product = (fixed * moving.transpose() + moving * fixed.transpose()) * 0.5;
        pixels += 1;
        match method {
            Method::SimplexL1 => {
                let per_depth = 1.0 / pair.slant.max(SLANT_MIN);
                let density = (2.0 / std::f64::consts::PI).sqrt() / (scale.max(1e-9) * pair.sigma_m);
                shape += product * (density * per_depth);
                scatter += product * (per_depth * per_depth);
            }
            Method::PointToPlane => shape += product / (pair.sigma_m * pair.sigma_m),
        }
    }
    (shape, scatter, pixels)
}

/// κ of the values of an image; NaN where there are none.
fn alike_px(values: &[f64], width: usize) -> f64 {
    let height = (values.len() / width.max(1)) as i32;
    let width = width as i32;
    let at = |x: i32, y: i32| values[(y * width + x) as usize];
    let mut products = [0.0; LAG_MAX as usize + 1];
    let mut counts = [0u32; LAG_MAX as usize + 1];
    let mut lags = [0u32; LAG_MAX as usize + 1];
    for dy in 0..=LAG_MAX {
        for dx in -LAG_MAX..=LAG_MAX {
            let ring = f64::from(dx * dx + dy * dy).sqrt().round() as usize;
            if ring > LAG_MAX as usize || (dy == 0 && dx < 0) {
                continue;
            }
            // The autocorrelation is symmetric in the lag.
            lags[ring] += if dx == 0 && dy == 0 { 1 } else { 2 };
            for y in 0..height - dy {
                for x in (-dx).max(0)..(width - dx.max(0)) {
                    let product = at(x, y) * at(x + dx, y + dy);
                    if !product.is_nan() {
                        products[ring] += product;
                        counts[ring] += 1;
                    }
                }
            }
        }
    }
    let mean = |ring: usize| products[ring] / f64::from(counts[ring].max(1));
    let variance = mean(0);
    if variance <= 0.0 {
        return 1.0;
    }
    let rings = (1..=LAG_MAX as usize).map(|ring| (mean(ring) / variance, lags[ring]));
    1.0 + rings
        .take_while(|(alike, _)| *alike >= ALIKE_MIN)
        .map(|(alike, n)| alike * f64::from(n))
        .sum::<f64>()
}

/// The covariance of a point that moves with the surface, m²; `arm` is its offset from the pivot, m, sensor.
pub fn covariance_of_point(covariance: &Matrix6<f64>, arm: &Vector3) -> Matrix3<f64> {
    let mut by_offset = Matrix3x6::zeros();
    by_offset.fixed_view_mut::<3, 3>(0, 0).copy_from(&Matrix3::identity());
    by_offset.fixed_view_mut::<3, 3>(0, 3).copy_from(&-arm.cross_matrix());
    by_offset * covariance * by_offset.transpose()
}

/// Returns the largest 1σ of a covariance, m, and its direction.
pub fn weakest(covariance: &Matrix3<f64>) -> (f64, Vector3) {
    let eigen = SymmetricEigen::new(*covariance);
    let axis = eigen.eigenvalues.imax();
    (eigen.eigenvalues[axis].max(0.0).sqrt(), eigen.eigenvectors.column(axis).into())
}

/// Returns the offset of a point from the pivot.
pub(super) fn arm(point_in_sensor: &Point3, pivot: &Point3) -> Vector3 {
    point_in_sensor - pivot
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    #[test]
    fn pixels_that_err_together_are_counted() {
        let mut random = Pcg64::seed_from_u64(3);
        let side = 200;
        for block in [1, 2, 4] {
            let blocks: Vec<f64> = (0..side * side).map(|_| random.random::<f64>() - 0.5).collect();
            let values: Vec<f64> =
                (0..side * side).map(|i| blocks[i / side / block * side + i % side / block]).collect();
            let expected = (block * block) as f64;
            let found = alike_px(&values, side);
            assert!((found / expected - 1.0).abs() < 0.2, "{block}: {found}");
        }
    }

    #[test]
    fn a_turn_about_the_pivot_moves_a_point_by_its_arm() {
        let mut covariance = Matrix6::zeros();
        covariance[(5, 5)] = 1e-4;
        let point = covariance_of_point(&covariance, &Vector3::new(2.0, 0.0, 0.0));
        let (sigma_m, axis) = weakest(&point);
        assert!((sigma_m - 0.02).abs() < 1e-12 && axis.y.abs() > 0.999);
    }
}
