//! Calibration of covariances: NEES with its chi-square band, and the fraction inside 3σ.
//!
//! For an estimate with error e and covariance P, `NEES = eᵀ P⁻¹ e` follows χ² with 3 degrees of freedom if P is
//! correct. The mean over N independent runs is in `[χ²₃N(2.5 %), χ²₃N(97.5 %)] / N` in 95 % of all cases: above it the
//! covariance is too small, below it too large. Targets of one world share its poses, light and noise, so the number of
//! independent runs is between those of worlds and of targets; both bands are reported. *Inside 3σ*: Mahalanobis
//! distance ≤ 3, true for 97.1 % of a Gaussian.

use serde::{Deserialize, Serialize};
use sightline_geometry::estimate::quantile::median;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Degrees of freedom of a position.
const DEGREES_OF_FREEDOM: f64 = 3.0;

/// Consistency of a set of covariances with its errors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// Number of errors.
    pub count: usize,
    /// Mean squared Mahalanobis distance; 3 for correct covariances.
    pub mean_nees: f64,
    /// Median squared Mahalanobis distance; 2.37 for correct covariances.
    pub median_nees: f64,
    /// 95 % band of the mean if all runs are independent.
    pub band: [f64; 2],
    /// 95 % band of the mean if only the worlds are independent.
    pub band_of_worlds: [f64; 2],
    /// Fraction with a Mahalanobis distance of at most 3.
    pub inside_3_sigma: f64,
}

impl Calibration {
    /// Evaluates squared Mahalanobis distances of runs in `worlds` worlds; `None` without any.
    pub fn of(nees: &[f64], worlds: usize) -> Option<Self> {
        let count = nees.len();
        if count == 0 || worlds == 0 {
            return None;
        }
        Some(Self {
            count,
            mean_nees: nees.iter().sum::<f64>() / count as f64,
            median_nees: median(nees)?,
            band: band(count)?,
            band_of_worlds: band(worlds)?,
            inside_3_sigma: nees.iter().filter(|&&d| d <= 9.0).count() as f64 / count as f64,
        })
    }
}

/// The two-sided 95 % band of the mean NEES of `runs` independent runs.
pub fn band(runs: usize) -> Option<[f64; 2]> {
    let chi_squared = ChiSquared::new(DEGREES_OF_FREEDOM * runs as f64).ok()?;
    Some([0.025, 0.975].map(|p| chi_squared.inverse_cdf(p) / runs as f64))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns whether the mean is inside the band for independent runs.
    fn is_calibrated(found: &Calibration) -> bool {
        (found.band[0]..=found.band[1]).contains(&found.mean_nees)
    }

    #[test]
    fn the_band_of_one_hundred_runs_is_the_tabulated_one() {
        // χ² with 300 degrees of freedom: 253.912 and 349.874 (any table of quantiles).
        let [low, high] = band(100).unwrap();
        assert!((low - 2.53912).abs() < 1e-4 && (high - 3.49874).abs() < 1e-4, "{low} {high}");
    }

    #[test]
    fn covariances_twice_too_small_in_sigma_fall_out_of_the_band() {
        let right: Vec<f64> = (0..200).map(|i| 6.0 * f64::from(i) / 199.0).collect();
        assert!(is_calibrated(&Calibration::of(&right, 10).unwrap()));
        let small: Vec<f64> = right.iter().map(|d| d * 4.0).collect();
        assert!(!is_calibrated(&Calibration::of(&small, 10).unwrap()));
    }
}
