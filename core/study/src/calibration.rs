//! Whether a covariance can be trusted: NEES with its chi-square band, and the share inside 3σ.
//!
//! For an estimate with error e and covariance P, `NEES = eᵀ P⁻¹ e` follows χ² with 3 degrees of freedom where P
//! is right. The mean over N independent runs lies in `[χ²₃N(2.5 %), χ²₃N(97.5 %)] / N` 95 times in 100: above it
//! the covariance is too small, below it too large. Targets of one world share its poses, its light and its
//! noise, so the number of independent runs lies between that of the worlds and that of the targets; both bands
//! are given. *Inside 3σ*: Mahalanobis distance ≤ 3, which a perfect Gaussian is in 97.1 % of all cases.

use serde::{Deserialize, Serialize};
use sightline_geometry::estimate::quantile::median;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Degrees of freedom of a position.
const DEGREES_OF_FREEDOM: f64 = 3.0;

/// The verdict on a set of covariances.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// How many errors were compared.
    pub count: usize,
    /// Mean squared Mahalanobis distance; 3 where the covariances are right.
    pub mean_nees: f64,
    /// Its median; 2.37 where the covariances are right.
    pub median_nees: f64,
    /// The 95 % band of the mean if all runs were independent.
    pub band: [f64; 2],
    /// The 95 % band of the mean if only the worlds were independent.
    pub band_of_worlds: [f64; 2],
    /// Share with a Mahalanobis distance of at most 3.
    pub inside_3_sigma: f64,
}

impl Calibration {
    /// Compares squared Mahalanobis distances of runs in `worlds` worlds; none without any.
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

    /// Whether the mean lies in the narrower band.
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
