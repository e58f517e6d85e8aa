//! The error of a target's pixel, which grows as matches are chained: each template is cut at the position of the
//! last match (ours).
//!
//! A match k adds an error `e_k = S_k u_k + b_k`: S_k is the symmetric square root of the match's covariance, u_k has
//! unit covariance, and b_k is the bias explained by the surface's slope. The cause of an error (relief in the
//! window, a facet at its border) is still present at the next stop and looks almost the same. So consecutive u_k are
//! correlated: a first-order Gauss–Markov sequence with `E[u_k u_{k−1}ᵀ] = ρ I`. With A_k, the image's magnification
//! and roll since the last stop, the drift `d_k = A_k d_{k−1} + S_k u_k` has
//! ```text
//! G_k = ρ A_k G_{k−1} + S_k                                          G = E[d uᵀ]
//! D_k = A_k D_{k−1} A_kᵀ + S_k S_kᵀ + ρ (A_k G_{k−1} S_kᵀ + S_k G_{k−1}ᵀ A_kᵀ)
//! b_k ← A_k b_{k−1} + b_k
//! ```
//! With ρ = 0 the matches' covariances add up, as if the errors of all stops were independent.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | D | `covariance_px2` | px² |
//! | G | `with_last_match_px` | px |
//! | b | `bias_px` | px |
//! | ρ | `correlation` | 1 |
//!
//! Source: Gauss–Markov errors as in Gelb, Applied Optimal Estimation (1974), 3.8.

use nalgebra::{Matrix2, SymmetricEigen, Vector2};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// The error of a pixel relative to the designated point, in the image in which it was found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Drift {
    /// Covariance, px².
    #[schema(value_type = Vec<f64>)]
    pub covariance_px2: Matrix2<f64>,
    /// The part with the same direction step after step, px.
    #[schema(value_type = [f64; 2])]
    pub bias_px: Vector2<f64>,
    /// Cross-covariance with the normalised error of the last match, px.
    #[schema(value_type = Vec<f64>)]
    pub with_last_match_px: Matrix2<f64>,
}

impl Drift {
    /// The error of a pixel that was chosen or assumed, not matched.
    pub fn of_pixel(covariance_px2: Matrix2<f64>) -> Self {
        Self { covariance_px2, ..Self::default() }
    }

    /// The error after one more match, whose own error is `covariance_px2` and `bias_px`; `map` maps pixel
    /// differences in the last image to this one.
    pub fn after_match(
        &self,
        map: &Matrix2<f64>,
        covariance_px2: &Matrix2<f64>,
        bias_px: Vector2<f64>,
        correlation: f64,
    ) -> Self {
        let root = square_root(covariance_px2);
        let shared = correlation * map * self.with_last_match_px * root.transpose();
        Self {
            covariance_px2: map * self.covariance_px2 * map.transpose()
                + covariance_px2
                + shared
                + shared.transpose(),
            bias_px: map * self.bias_px + bias_px,
            with_last_match_px: correlation * map * self.with_last_match_px + root,
        }
    }

    /// Mean square of the error, bias included, px².
    pub fn mean_square_px2(&self) -> Matrix2<f64> {
        self.covariance_px2 + self.bias_px * self.bias_px.transpose()
    }
}

/// The symmetric square root of a covariance; negative eigenvalues, which result from rounding, count as zero.
fn square_root(covariance: &Matrix2<f64>) -> Matrix2<f64> {
    let mut eigen = SymmetricEigen::new(*covariance);
    eigen.eigenvalues.apply(|value| *value = value.max(0.0).sqrt());
    eigen.recompose()
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    use super::*;

    const CORRELATION: f64 = 0.6;
    const STEPS: usize = 8;

    fn map() -> Matrix2<f64> {
        Matrix2::new(1.1, -0.02, 0.02, 1.1)
    }

    fn covariance(step: usize) -> Matrix2<f64> {
        let turn = nalgebra::Rotation2::new(0.3 * step as f64);
        turn * Matrix2::new(0.04, 0.0, 0.0, 0.01) * turn.inverse()
    }

    /// A normal deviate (Box & Muller).
    fn normal(random: &mut Pcg64) -> f64 {
        let radius: f64 = (-2.0 * (1.0 - random.random::<f64>()).ln()).sqrt();
        radius * (std::f64::consts::TAU * random.random::<f64>()).cos()
    }

    #[test]
    fn the_covariance_is_that_of_many_simulated_chains() {
        let mut predicted = Drift::default();
        for step in 0..STEPS {
            predicted = predicted.after_match(&map(), &covariance(step), Vector2::zeros(), CORRELATION);
        }
        let mut random = Pcg64::seed_from_u64(7);
        let fresh = (1.0 - CORRELATION * CORRELATION).sqrt();
        let chains = 40_000;
        let mut sum = Matrix2::zeros();
        for _ in 0..chains {
            let mut deviate = || Vector2::new(normal(&mut random), normal(&mut random));
            let (mut drift, mut error) = (Vector2::zeros(), deviate());
            for step in 0..STEPS {
                drift = map() * drift + square_root(&covariance(step)) * error;
                error = CORRELATION * error + fresh * deviate();
            }
            sum += drift * drift.transpose();
        }
        let measured = sum / f64::from(chains);
        let relative = (measured - predicted.covariance_px2).norm() / predicted.covariance_px2.norm();
        // 1σ of a sample variance over 40 000 chains is 0.7 %.
        assert!(relative < 0.025, "measured {measured}, predicted {}", predicted.covariance_px2);
    }

    #[test]
    fn without_correlation_covariances_add_up() {
        let drift = Drift::of_pixel(Matrix2::identity() * 0.25);
        let after = drift.after_match(&map(), &covariance(1), Vector2::new(0.1, 0.0), 0.0);
        let expected = map() * drift.covariance_px2 * map().transpose() + covariance(1);
        assert!((after.covariance_px2 - expected).norm() < 1e-15);
        assert_eq!(after.bias_px, Vector2::new(0.1, 0.0));
    }
}
