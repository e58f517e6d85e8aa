//! The unscented transform: mean and covariance of a function of an uncertain vector.
//!
//! n inputs with mean m and covariance P (domain.md 13.4; Julier & Uhlmann 1997; van der Merwe 2004):
//!
//! ```text
//! λ = α²(n + κ) − n      L Lᵀ = (n + λ) P      points m, m ± L_i
//! W0_mean = λ/(n + λ)    W0_cov = W0_mean + 1 − α² + β    W_i = 1/(2(n + λ))
//! y = Σ W f(x)           P_y = Σ W_cov (f − y)(f − y)ᵀ
//! ```
//!
//! | symbol | our name | unit |
//! |---|---|---|
//! | m, P | `mean`, `covariance` | units of the input and their products |
//! | α, β, κ | [`UnscentedParameters`] | – |
//! | y, P_y | the result | units of the function's value and their products |
//!
//! L is the Cholesky factor, computed so that a semidefinite P works: if an input has no variance given the inputs
//! before it, its column is zero. Nothing is random and the points are summed in order, so the same input gives the
//! same bits.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Share of an input's variance below which the remaining variance is rounding.
const ROUNDING: f64 = 1e-13;
/// Largest correlation that may be lost with such a remainder.
const LOST: f64 = 1e-6;

/// Position and weights of the points of the unscented transform.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct UnscentedParameters {
    /// α: spread of the points.
    pub alpha: f64,
    /// β: extra weight of the middle point in the covariance; 2 is best for Gaussian inputs and small α.
    pub beta: f64,
    /// κ: secondary spread.
    pub kappa: f64,
}

impl Default for UnscentedParameters {
    /// α = 1, β = 0, κ = 0: 2n points at ±√n σ, and the middle point has no weight (domain.md 13.4).
    fn default() -> Self {
        Self { alpha: 1.0, beta: 0.0, kappa: 0.0 }
    }
}

/// Mean and covariance of `f` of a vector with the given mean and covariance.
///
/// `None` if `f` has no value at one of the points, if the covariance is not positive semidefinite or not finite, or
/// if the parameters leave no spread (n + λ ≤ 0).
pub fn unscented<const N: usize, const M: usize>(
    mean: &SVector<f64, N>,
    covariance: &SMatrix<f64, N, N>,
    parameters: UnscentedParameters,
    f: impl Fn(&SVector<f64, N>) -> Option<SVector<f64, M>>,
) -> Option<(SVector<f64, M>, SMatrix<f64, M, M>)> {
    let UnscentedParameters { alpha, beta, kappa } = parameters;
    let n = N as f64;
    let spread = alpha * alpha * (n + kappa);
    if spread.is_nan() || spread <= 0.0 {
        return None;
    }
    let weight = 1.0 / (2.0 * spread);
    let middle_mean = (spread - n) / spread;
    let middle_covariance = middle_mean + 1.0 - alpha * alpha + beta;

    let offsets = factor_of_semidefinite(covariance)? * spread.sqrt();
    let middle = f(mean)?;
    let mut values = Vec::with_capacity(2 * N);
    for offset in offsets.column_iter() {
        values.push(f(&(mean + offset))?);
        values.push(f(&(mean - offset))?);
    }

    let result = values.iter().fold(middle * middle_mean, |sum, value| sum + value * weight);
    let square = |value: &SVector<f64, M>| (value - result) * (value - result).transpose();
    let spread_of_result =
        values.iter().fold(square(&middle) * middle_covariance, |sum, value| sum + square(value) * weight);
    Some((result, spread_of_result))
}

/// The lower triangular L with L Lᵀ = `matrix`, for positive semidefinite matrices.
fn factor_of_semidefinite<const N: usize>(matrix: &SMatrix<f64, N, N>) -> Option<SMatrix<f64, N, N>> {
    let mut factor = SMatrix::<f64, N, N>::zeros();
    for j in 0..N {
        let variance = matrix[(j, j)];
        let left = variance - (0..j).map(|k| factor[(j, k)] * factor[(j, k)]).sum::<f64>();
        let rounding = ROUNDING * variance.abs();
        if !left.is_finite() || left < -rounding {
            return None;
        }
        if left <= rounding {
            continue;
        }
        factor[(j, j)] = left.sqrt();
        for i in j + 1..N {
            let common: f64 = (0..j).map(|k| factor[(i, k)] * factor[(j, k)]).sum();
            factor[(i, j)] = (matrix[(i, j)] - common) / factor[(j, j)];
        }
    }
    // The loop would drop the covariance with an input that has no variance: such a matrix is not semidefinite.
    let difference = factor * factor.transpose() - matrix;
    let scale = |i: usize| matrix[(i, i)].abs().sqrt();
    let kept = |i: usize, j: usize| difference[(i, j)].abs() <= LOST * scale(i) * scale(j);
    (0..N).all(|i| (0..=i).all(|j| kept(i, j))).then_some(factor)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix2, Matrix3, Matrix4, Vector2, Vector3, Vector4};

    const FOCAL_PX: f64 = 1223.28;
    const BASELINE_M: f64 = 0.2;
    const CENTRE_PX: f64 = 511.5;

    /// The point of an aligned pair's pixels (u_l, v_l, u_r, v_r), m.
    fn stereo_point(pixels: &Vector4<f64>) -> Option<Vector3<f64>> {
        let depth = FOCAL_PX * BASELINE_M / (pixels[0] - pixels[2]);
        let row = (pixels[1] + pixels[3]) / 2.0;
        let point =
            Vector3::new((pixels[0] - CENTRE_PX) / FOCAL_PX, (row - CENTRE_PX) / FOCAL_PX, 1.0) * depth;
        (depth > 0.0).then_some(point)
    }

    /// The pixels of the point X = 0.5, Y = 0.3 at depth `z`.
    fn pixels_at(z: f64) -> Vector4<f64> {
        let (x, y) = (CENTRE_PX + FOCAL_PX * 0.5 / z, CENTRE_PX + FOCAL_PX * 0.3 / z);
        Vector4::new(x, y, x - FOCAL_PX * BASELINE_M / z, y)
    }

    #[test]
    fn the_stereo_point_of_half_a_pixel_noise_agrees_with_the_reference() {
        // domain.md 15, TV8.
        let cases = [
            (2.0, [0.50001337, 0.30001002, 2.00006683], [0.00238353, 0.00182807, 0.01156180]),
            (5.0, [0.50008357, 0.30006268, 5.00104460], [0.00596147, 0.00457197, 0.07229294]),
            (10.0, [0.50033469, 0.30025102, 10.00836728], [0.01194185, 0.00915685, 0.28962538]),
        ];
        for (z, expected_mean, expected_sigma) in cases {
            let noise = Matrix4::identity() * 0.25;
            let (mean, covariance) =
                unscented(&pixels_at(z), &noise, UnscentedParameters::default(), stereo_point).unwrap();
            for axis in 0..3 {
                assert!((mean[axis] - expected_mean[axis]).abs() < 1e-8, "{mean}");
                assert!(
                    (covariance[(axis, axis)].sqrt() - expected_sigma[axis]).abs() < 1e-8,
                    "{covariance}"
                );
            }
        }
    }

    #[test]
    fn a_linear_function_is_transformed_exactly_whatever_the_parameters() {
        let mean = Vector3::new(1.0, -2.0, 3.0);
        let covariance = Matrix3::new(4.0, 1.0, 0.5, 1.0, 2.0, -0.3, 0.5, -0.3, 1.0);
        let by = nalgebra::Matrix2x3::new(1.0, 2.0, -1.0, 0.5, 0.0, 3.0);
        for (alpha, beta, kappa) in [(1.0, 0.0, 0.0), (0.1, 2.0, 0.0), (1.0, 0.0, 1.5), (1.0, 2.0, -1.0)] {
            let parameters = UnscentedParameters { alpha, beta, kappa };
            let (y, p) = unscented(&mean, &covariance, parameters, |x| Some(by * x)).unwrap();
            assert!((y - by * mean).norm() < 1e-12);
            assert!((p - by * covariance * by.transpose()).norm() < 1e-11, "{p}");
        }
    }

    #[test]
    fn singular_covariances_are_transformed_exactly() {
        let identity = |x: &Vector3<f64>| Some(*x);
        let along = Vector3::new(1e-3, 0.3, -0.7);
        let flat = Matrix3::new(0.0, 0.0, 0.0, 0.0, 2.0, 1.0, 0.0, 1.0, 3.0);
        for covariance in [Matrix3::zeros(), along * along.transpose(), flat] {
            let (mean, result) =
                unscented(&along, &covariance, UnscentedParameters::default(), identity).unwrap();
            assert!((mean - along).norm() < 1e-15);
            assert!((result - covariance).norm() < 1e-13, "{result}");
        }
    }

    #[test]
    fn covariances_of_rank_one_are_transformed_without_noise_of_rounding() {
        for case in 0..2000 {
            let direction =
                SVector::<f64, 6>::from_fn(|row, _| (1.7 * f64::from(case) + 2.3 * row as f64).sin());
            let covariance = direction * direction.transpose();
            let (_, result) =
                unscented(&direction, &covariance, UnscentedParameters::default(), |x| Some(*x)).unwrap();
            assert!((result - covariance).norm() < 1e-12, "case {case}: {result}");
        }
    }

    #[test]
    fn beta_two_gives_the_exact_variance_of_a_squared_gaussian() {
        let (mean, variance) = (SVector::<f64, 1>::zeros(), SMatrix::<f64, 1, 1>::new(0.09));
        for alpha in [1.0, 0.5, 0.1] {
            let parameters = UnscentedParameters { alpha, beta: 2.0, kappa: 0.0 };
            let (y, p) = unscented(&mean, &variance, parameters, |x| Some(x.component_mul(x))).unwrap();
            assert!((y[0] - 0.09).abs() < 1e-15);
            assert!((p[(0, 0)] - 2.0 * 0.09 * 0.09).abs() < 1e-14, "{p}");
        }
    }

    #[test]
    fn what_has_no_answer_gives_none() {
        let mean = Vector2::new(1.0, 1.0);
        let ask =
            |covariance: Matrix2<f64>, parameters| unscented(&mean, &covariance, parameters, |x| Some(*x));
        let usual = UnscentedParameters::default();
        assert!(ask(Matrix2::identity(), usual).is_some());
        assert!(ask(Matrix2::new(1.0, 2.0, 2.0, 1.0), usual).is_none());
        assert!(ask(Matrix2::new(0.0, 1.0, 1.0, 1.0), usual).is_none());
        assert!(ask(Matrix2::identity() * f64::NAN, usual).is_none());
        assert!(ask(Matrix2::identity(), UnscentedParameters { kappa: -2.0, ..usual }).is_none());
        let positive = |x: &Vector2<f64>| (x[0] > 0.0).then_some(*x);
        assert!(unscented(&mean, &Matrix2::identity(), usual, positive).is_none());
    }
}
