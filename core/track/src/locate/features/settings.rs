//! The settings of the feature locator, with unit, default and source.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::limits::Domain;
use crate::settings_group;
use sightline_geometry::estimate::bootstrap::BootstrapSettings;
use sightline_geometry::estimate::confidence::ConfidenceSettings;
use sightline_geometry::estimate::ransac::{Gate, RansacSettings, Weighting};
use sightline_geometry::estimate::weighted_motion::Loss;
use sightline_vision::sift::SiftSettings;
use sightline_vision::sift::matching::MatchSettings;

/// The inlier test of a match (Deans05 Eq. 2).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum MotionGate {
    /// On the residual in metres, as in the paper.
    #[default]
    Distance,
    /// On the residual in standard deviations of the two points.
    Mahalanobis,
}

/// The weights of the inliers in the fit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum MotionWeighting {
    /// Equal weights, as in the paper.
    None,
    /// By the covariances of the points: stereo noise grows with the square of the range.
    #[default]
    Range,
}

settings_group! {
    /// How features are found, matched and turned into a motion (Deans et al. 2005).
    FeatureSettings as "features" {
        /// Doubles the image first, which finds about twice as many features, including the smallest ones.
        sift_double_image: bool = true, "", Domain::Switch, "Lowe04";
        /// Number of scales per octave.
        sift_scales_per_octave: u32 = 3, "", Domain::Between(1.0, 8.0), "Lowe04";
        /// Blur of the first image of every octave.
        sift_sigma: f64 = 1.6, "px", Domain::Between(0.8, 4.0), "Lowe04";
        /// Assumed blur of the camera images, 1σ.
        sift_image_blur_px: f64 = 0.5, "px", Domain::Between(0.0, 2.0), "Lowe04";
        /// Smallest contrast of a feature. Too high: too few features for a transform; too low: noise.
        sift_contrast_min: f64 = 0.03, "", Domain::Between(0.0, 1.0), "Lowe04";
        /// Largest ratio of the principal curvatures of a feature; rejects features on edges.
        sift_edge_ratio_max: f64 = 10.0, "", Domain::Between(1.0, 1000.0), "Lowe04";
        /// Height of a second orientation peak, relative to the highest, from which it makes a feature of its own.
        sift_orientation_peak: f64 = 0.8, "", Domain::Between(0.1, 1.0), "Lowe04";
        /// Maximum number of features per image, strongest first; 0: no limit.
        features_max: u32 = 0, "", Domain::Between(0.0, 100_000.0), "ours";
        /// Largest ratio of the nearest to the second-nearest descriptor distance (ratio test); 1: off.
        ratio_max: f64 = 0.8, "", Domain::Between(0.1, 1.0), "Lowe04";
        /// Keeps a match only if each feature is the nearest neighbour of the other.
        mutual_matches: bool = true, "", Domain::Switch, "ours";
        /// Restricts stereo matches of features to the epipolar curve.
        stereo_along_curve: bool = true, "", Domain::Switch, "ours";
        /// Largest distance of a stereo match from the epipolar curve.
        curve_tolerance_px: f64 = 2.0, "px", Domain::Between(0.1, 50.0), "ours", if stereo_along_curve = true;
        /// Smallest range of a feature.
        feature_range_min_m: f64 = 0.5, "m", Domain::Between(0.05, 1000.0), "ours";
        /// Largest range of a feature.
        feature_range_max_m: f64 = 100.0, "m", Domain::Between(0.1, 100_000.0), "ours";
        /// Radius around the position predicted by dead reckoning in which a feature of an earlier stop is searched for; 0:
        /// the whole image, which is also searched after too few inliers.
        prior_radius_px: f64 = 0.0, "px", Domain::Between(0.0, 2000.0), "ours; off";
        /// Noise of each coordinate of a feature, 1σ; determines the covariances of the points.
        feature_sigma_px: f64 = 0.5, "px", Domain::Between(0.01, 10.0), "Deans05 Eq. 4", if motion_gate = "mahalanobis", if motion_weighting = "range";
        /// Increase of that noise per pixel of the feature's scale.
        feature_sigma_per_scale: f64 = 0.0, "", Domain::Between(0.0, 10.0), "ours; off", if motion_gate = "mahalanobis", if motion_weighting = "range";
        /// Error that all features of a stop share in position and disparity, after a motion as long as their range (relief
        /// and shadows seen from elsewhere).
        feature_common_px: f64 = 0.0, "px", Domain::Between(0.0, 5.0), "ours; off";
        /// Number of RANSAC iterations; each fits a minimal sample of three matches.
        motion_draws: u32 = 100, "", Domain::Between(1.0, 100_000.0), "Deans05 §2";
        /// Continues RANSAC until an all-inlier sample is almost certain.
        motion_adaptive: bool = false, "", Domain::Switch, "ours; off";
        /// Distance measure of the inlier test.
        motion_gate: MotionGate = MotionGate::Distance, "", Domain::choice(&["distance", "mahalanobis"]), "Deans05 Eq. 2";
        /// Largest residual of an inlier.
        motion_inlier_m: f64 = 0.03, "m", Domain::Between(1e-4, 10.0), "Deans05 Eq. 2", if motion_gate = "distance";
        /// Largest residual of an inlier, in standard deviations of the two points.
        motion_inlier_sigma: f64 = 3.0, "", Domain::Between(0.1, 100.0), "ours", if motion_gate = "mahalanobis";
        /// Weighting of the inliers in the fit.
        motion_weighting: MotionWeighting = MotionWeighting::Range, "", Domain::choice(&["none", "range"]), "ours";
        /// Robust loss of the residuals, with weighting by range.
        motion_loss: Loss = Loss::Cauchy, "", Domain::choice(&["squares", "huber", "cauchy"]), "ours", if motion_weighting = "range";
        /// Seed of the RANSAC samples.
        motion_seed: u32 = 1, "", Domain::Between(0.0, 1e9), "ours";
        /// Number of bootstrap sets.
        bootstrap_sets: u32 = 200, "", Domain::Between(10.0, 10_000.0), "ours";
        /// Side of the square image cells that the bootstrap resamples as blocks, because errors within a cell are
        /// correlated; 0: single features, as in the paper.
        bootstrap_cell_px: f64 = 0.0, "px", Domain::Between(0.0, 1024.0), "ours; off";
        /// Number of inliers at which the confidence is 0.5.
        confidence_matches: f64 = 30.0, "", Domain::Between(1.0, 1000.0), "Deans05 Eq. 7";
        /// Slope of the confidence per inlier.
        confidence_slope: f64 = 0.1, "", Domain::Between(0.001, 10.0), "Deans05 Eq. 7";
        /// Number of earlier stops with remembered features; the transform with the smallest covariance of the target is
        /// used.
        feature_memory: u32 = 3, "stops", Domain::Between(1.0, 20.0), "ours";
    }
}

impl FeatureSettings {
    /// The settings of the feature detector.
    pub fn sift(&self) -> SiftSettings {
        SiftSettings {
            double_image: self.sift_double_image,
            scales_per_octave: self.sift_scales_per_octave,
            sigma: self.sift_sigma,
            image_blur_px: self.sift_image_blur_px,
            contrast_min: self.sift_contrast_min,
            edge_ratio_max: self.sift_edge_ratio_max,
            orientation_peak: self.sift_orientation_peak,
            features_max: self.features_max,
        }
    }

    /// The settings of the matching.
    pub fn matching(&self) -> MatchSettings {
        let ratio_max = Some(self.ratio_max).filter(|ratio| *ratio < 1.0);
        MatchSettings { ratio_max, mutual: self.mutual_matches }
    }

    /// The settings of the motion fit.
    pub fn ransac(&self) -> RansacSettings {
        RansacSettings {
            inlier_m: self.motion_inlier_m,
            draws: self.motion_draws,
            adaptive: self.motion_adaptive,
            gate: match self.motion_gate {
                MotionGate::Distance => Gate::Distance,
                MotionGate::Mahalanobis => Gate::Mahalanobis { limit: self.motion_inlier_sigma },
            },
            weighting: self.weighting(),
            loss: self.motion_loss,
            seed: u64::from(self.motion_seed),
            ..RansacSettings::default()
        }
    }

    /// The settings of the bootstrap.
    pub fn bootstrap(&self) -> BootstrapSettings {
        BootstrapSettings {
            sets: self.bootstrap_sets,
            weighting: self.weighting(),
            loss: self.motion_loss,
            seed: u64::from(self.motion_seed),
        }
    }

    /// The settings of the confidence.
    pub fn confidence(&self) -> ConfidenceSettings {
        ConfidenceSettings { inliers_for_half: self.confidence_matches, slope: self.confidence_slope }
    }

    fn weighting(&self) -> Weighting {
        match self.motion_weighting {
            MotionWeighting::None => Weighting::None,
            MotionWeighting::Range => Weighting::Range,
        }
    }

    /// Returns why these settings can find nothing, as one sentence that names the fields and the remedy.
    pub fn contradiction(&self) -> Option<String> {
        let (low, high) = (self.feature_range_min_m, self.feature_range_max_m);
        (low >= high)
            .then(|| format!("feature_range_min_m {low} must be less than feature_range_max_m {high}"))
    }
}
