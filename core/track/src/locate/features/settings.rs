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

/// What decides whether a match agrees with a motion (R165, R167).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum MotionGate {
    /// A distance in metres, as the paper has it.
    #[default]
    Distance,
    /// A distance in standard deviations of the two points.
    Mahalanobis,
}

/// How the matches that agree count in the motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum MotionWeighting {
    /// Alike, as the paper has it.
    None,
    /// By the covariances of the points: stereo noise grows with the square of the range.
    #[default]
    Range,
}

settings_group! {
    /// How features are found, matched and turned into a motion (Deans et al. 2005).
    FeatureSettings as "features" {
        /// Double the image first: twice as many features, the smallest ones among them.
        sift_double_image: bool = true, "", Domain::Switch, "Lowe 2004";
        /// Scales a feature may have within an octave.
        sift_scales_per_octave: u32 = 3, "", Domain::Between(1.0, 8.0), "Lowe 2004";
        /// Blur of the first image of every octave.
        sift_sigma: f64 = 1.6, "px", Domain::Between(0.8, 4.0), "Lowe 2004";
        /// Blur that the camera's images have already.
        sift_image_blur_px: f64 = 0.5, "px", Domain::Between(0.0, 2.0), "Lowe 2004";
        /// Features of less contrast are left out. Too high: too few for a motion; too low: noise.
        sift_contrast_min: f64 = 0.03, "", Domain::Between(0.0, 1.0), "Lowe 2004";
        /// Features on edges are left out: the largest ratio of the two curvatures.
        sift_edge_ratio_max: f64 = 10.0, "", Domain::Between(1.0, 1000.0), "Lowe 2004";
        /// A second orientation makes a second feature from this share of the first one's height.
        sift_orientation_peak: f64 = 0.8, "", Domain::Between(0.1, 1.0), "Lowe 2004";
        /// The strongest so many features of an image are kept; 0: all.
        features_max: u32 = 0, "", Domain::Between(0.0, 100_000.0), "ours";
        /// A match whose second neighbour is nearly as near is left out: the largest ratio of the two distances; 1: off.
        ratio_max: f64 = 0.8, "", Domain::Between(0.1, 1.0), "Lowe 2004, R162";
        /// Keep a match only if it is the nearest one seen from both sides.
        mutual_matches: bool = true, "", Domain::Switch, "ours, R162";
        /// Look for a feature's partner in the other eye along its epipolar curve only.
        stereo_along_curve: bool = true, "", Domain::Switch, "ours, R162";
        /// How far from that curve the partner may lie.
        curve_tolerance_px: f64 = 2.0, "px", Domain::Between(0.1, 50.0), "ours, R162", if stereo_along_curve = true;
        /// Nearest range of a feature.
        feature_range_min_m: f64 = 0.5, "m", Domain::Between(0.05, 1000.0), "ours";
        /// Farthest range of a feature.
        feature_range_max_m: f64 = 100.0, "m", Domain::Between(0.1, 100_000.0), "ours";
        /// Look for a feature of an earlier stop only so far from where the pose estimate expects it; 0: everywhere, as where
        /// too few agree then.
        prior_radius_px: f64 = 0.0, "px", Domain::Between(0.0, 2000.0), "ours; off";
        /// Noise of each coordinate of a feature, from which the covariances of the points follow.
        feature_sigma_px: f64 = 0.5, "px", Domain::Between(0.01, 10.0), "D§2, R172", if motion_gate = "mahalanobis", if motion_weighting = "range";
        /// What that grows by for every pixel of a feature's scale: large features lie on no surface point in particular.
        feature_sigma_per_scale: f64 = 0.0, "", Domain::Between(0.0, 10.0), "ours; off", if motion_gate = "mahalanobis", if motion_weighting = "range";
        /// Error that the pixels of all features of a stop share, and their disparities, after a way as long as their range:
        /// relief and shadows that are seen from elsewhere shift many features alike.
        feature_common_px: f64 = 0.0, "px", Domain::Between(0.0, 5.0), "ours; off";
        /// Random draws of three matches.
        motion_draws: u32 = 100, "", Domain::Between(1.0, 100_000.0), "D§2, R164";
        /// Draw on until a good draw is nearly sure.
        motion_adaptive: bool = false, "", Domain::Switch, "ours; off";
        /// What decides whether a match agrees with a motion.
        motion_gate: MotionGate = MotionGate::Distance, "", Domain::choice(&["distance", "mahalanobis"]), "D-Eq 2, R167";
        /// Farthest distance of a match that agrees.
        motion_inlier_m: f64 = 0.03, "m", Domain::Between(1e-4, 10.0), "D-Eq 2, R165", if motion_gate = "distance";
        /// The same in standard deviations of the two points.
        motion_inlier_sigma: f64 = 3.0, "", Domain::Between(0.1, 100.0), "ours, R167", if motion_gate = "mahalanobis";
        /// How matches that agree count.
        motion_weighting: MotionWeighting = MotionWeighting::Range, "", Domain::choice(&["none", "range"]), "ours, R167";
        /// How the weight of a match falls off with its residual, where they count by range.
        motion_loss: Loss = Loss::Cauchy, "", Domain::choice(&["squares", "huber", "cauchy"]), "ours", if motion_weighting = "range";
        /// Seed of the draws.
        motion_seed: u32 = 1, "", Domain::Between(0.0, 1e9), "ours";
        /// Sets that the bootstrap draws.
        bootstrap_sets: u32 = 200, "", Domain::Between(10.0, 10_000.0), "ours, R173";
        /// Side of the squares of the image within which features err alike, so that the bootstrap draws them together; 0:
        /// each by itself, as the paper has it.
        bootstrap_cell_px: f64 = 0.0, "px", Domain::Between(0.0, 1024.0), "ours; off";
        /// Matches that agree with the motion at which the confidence is one half.
        confidence_matches: f64 = 30.0, "", Domain::Between(1.0, 1000.0), "D-Eq 7, R182";
        /// How steeply it rises.
        confidence_slope: f64 = 0.1, "", Domain::Between(0.001, 10.0), "D-Eq 7, R182";
        /// Good stops whose features are remembered; the motion is taken from the one that leaves the target most certain.
        feature_memory: u32 = 3, "stops", Domain::Between(1.0, 20.0), "ours, R186";
    }
}

impl FeatureSettings {
    /// How features are found.
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

    /// How they are matched.
    pub fn matching(&self) -> MatchSettings {
        let ratio_max = Some(self.ratio_max).filter(|ratio| *ratio < 1.0);
        MatchSettings { ratio_max, mutual: self.mutual_matches }
    }

    /// How a motion is fitted.
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

    /// How its scatter is found.
    pub fn bootstrap(&self) -> BootstrapSettings {
        BootstrapSettings {
            sets: self.bootstrap_sets,
            weighting: self.weighting(),
            loss: self.motion_loss,
            seed: u64::from(self.motion_seed),
        }
    }

    /// What the number of matches that agree is worth.
    pub fn confidence(&self) -> ConfidenceSettings {
        ConfidenceSettings { inliers_for_half: self.confidence_matches, slope: self.confidence_slope }
    }

    fn weighting(&self) -> Weighting {
        match self.motion_weighting {
            MotionWeighting::None => Weighting::None,
            MotionWeighting::Range => Weighting::Range,
        }
    }

    /// Why these settings cannot find anything, as one sentence that names the fields and the way out.
    pub fn contradiction(&self) -> Option<String> {
        let (low, high) = (self.feature_range_min_m, self.feature_range_max_m);
        (low >= high)
            .then(|| format!("feature_range_min_m {low} must be less than feature_range_max_m {high}"))
    }
}
