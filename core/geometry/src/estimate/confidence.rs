//! Confidence in a motion, from its number of inliers (D§2, R182, R183).
//!
//! ```text
//! conf = 1 / (1 + exp(a (n_conf − |J_in|)))
//! ```
//!
//! The paper prints the exponent with the opposite sign, which would trust few matches and distrust many, contrary to
//! its own text (E23).
//!
//! | symbol | our name | unit |
//! |---|---|---|
//! | J_in | number `inliers` | – |
//! | n_conf | [`ConfidenceSettings::inliers_for_half`] | – |
//! | a | [`ConfidenceSettings::slope`] | 1 per match |

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Midpoint and slope of the confidence.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ConfidenceSettings {
    /// n_conf: number of inliers with a confidence of one half.
    pub inliers_for_half: f64,
    /// a: steepness of the confidence, per match.
    pub slope: f64,
}

impl Default for ConfidenceSettings {
    /// The paper's 30 and 0.1 (R182).
    fn default() -> Self {
        Self { inliers_for_half: 30.0, slope: 0.1 }
    }
}

/// The confidence, 0 to 1, in a motion with this number of inliers.
pub fn confidence(inliers: usize, settings: ConfidenceSettings) -> f64 {
    1.0 / (1.0 + (settings.slope * (settings.inliers_for_half - inliers as f64)).exp())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_matches_are_distrusted_and_many_trusted_by_the_numbers_of_the_reference() {
        // papers.md R182.
        for (inliers, expected) in
            [(0, 0.047_426), (10, 0.119_203), (30, 0.5), (50, 0.880_797), (100, 0.999_089)]
        {
            let confidence = confidence(inliers, ConfidenceSettings::default());
            assert!((confidence - expected).abs() < 5e-7, "{inliers}: {confidence}");
        }
    }

    #[test]
    fn the_settings_move_the_half_and_the_slope() {
        let settings = ConfidenceSettings { inliers_for_half: 80.0, slope: 0.5 };
        assert_eq!(confidence(80, settings), 0.5);
        assert!((confidence(82, settings) - 1.0 / (1.0 + (-1.0_f64).exp())).abs() < 1e-15);
        assert_eq!(confidence(100_000, settings), 1.0);
    }
}
