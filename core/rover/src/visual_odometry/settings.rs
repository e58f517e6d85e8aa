//! The settings of visual odometry and their two presets.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use sightline_geometry::error::{Error, Result};

/// Similarity measure of windows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum OdometryScore {
    /// Normalised cross-correlation: invariant to gain and offset.
    #[default]
    Normalised,
    /// Pseudo-normalised correlation, as flown: a change of contrast lowers the score.
    PseudoNormalised,
}

/// How the matches of one rigid motion are separated from the others.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ConsistentSet {
    /// The largest set of matches whose mutual distances are the same before and after (Hirschmüller 2002, Howard 2008).
    #[default]
    Rigidity,
    /// RANSAC with minimal samples of three matches.
    Ransac,
}

/// A named set of settings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum OdometryPreset {
    /// Ours: unreduced images, the translation searched before the matches.
    #[default]
    Sightline,
    /// As flown on the Mars Exploration Rovers (Maimone, Cheng & Matthies 2007): 256 × 256 px, pseudo-normalised correlation,
    /// matches searched for around the prediction by the wheels, RANSAC.
    Mer2007,
}

/// The settings of visual odometry; pixels are those of the reduced images.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct OdometrySettings {
    /// Images wider than this are reduced by averaging blocks of 2 × 2, 3 × 3, … pixels, px (4096; 64 to 4096). `mer2007`: 256.
    pub width_max_px: u32,
    /// Largest number of corners (240; 20 to 2000). Too few: the covariance grows; too many: slow.
    pub corners_max: u32,
    /// Smallest distance of two corners, px (8; 2 to 100).
    pub corner_spacing_px: f64,
    /// Smallest contrast of a corner: RMS gradient along its weakest direction, fraction of full scale per px (0.002; 0 to
    /// 1).
    pub corner_contrast_min: f64,
    /// Side of the compared windows, px (11; 5 to 41, odd).
    pub window_px: u32,
    /// Similarity measure of windows (`normalised`).
    pub score: OdometryScore,
    /// Smallest range of a point from the left camera, m (0.6; 0.1 to 10).
    pub range_min_m: f64,
    /// Largest range, m (15; 1 to 100).
    pub range_max_m: f64,
    /// Smallest score of a stereo match (0.75; 0 to 1).
    pub stereo_score_min: f64,
    /// Smallest score of a match between the two stops (0.7; 0 to 1).
    pub match_score_min: f64,
    /// Whether the translation is searched in coarse images first, which makes the result robust to slip (true).
    pub coarse_search: bool,
    /// Half the side of the search window around the prediction, px (12; 2 to 100).
    pub search_px: u32,
    /// How the matches of one rigid motion are found (`rigidity`).
    pub consistent_set: ConsistentSet,
    /// Largest residual of an inlier, in standard deviations (3.4; 1 to 10).
    pub outlier_sigma: f64,
    /// 1σ error of a match between the two stops, in addition to that from its scores, px (0.05; 0 to 2).
    pub match_sigma_px: f64,
    /// The same for a stereo match, px (0.05; 0 to 2).
    pub stereo_sigma_px: f64,
    /// 1σ error of a match between the stops due to the relief in its window, px per unit of change of the view, which is
    /// 0.1 if the window grows by a tenth (0.5; 0 to 10).
    pub relief_px: f64,
    /// 1σ error common to all matches, px, and its growth per unit of change (0.016, 0.46; 0 to 10 each).
    pub common_px: [f64; 2],
    /// Gate: smallest number of inliers (25; 4 to 1000).
    pub inliers_min: u32,
    /// Gate: smallest fraction of inliers among the matches (0.35; 0 to 1).
    pub inlier_share_min: f64,
    /// Gate: largest χ² per degree of freedom (3; 1 to 100).
    pub chi2_max: f64,
    /// Gate: largest 1σ error of the translation in its worst direction, m (0.015; 0.001 to 1).
    pub sigma_max_m: f64,
    /// Gate: largest slip along the motion of the wheels in either direction, relative to it (1.4; 0 to 5).
    pub slip_max: f64,
    /// Gate: largest angle between the rotation of vision and that of gyro and accelerometers, deg (2; 0.1 to 45).
    pub attitude_max_deg: f64,
    /// Gate: largest number of inliers of another motion relative to those of the best (0.7; 0.1 to 1).
    pub ambiguity_max: f64,
    /// Gate: largest score of another displacement along the motion relative to that of the motion (0.96; 0.1 to 2).
    pub repetition_max: f64,
}

impl Default for OdometrySettings {
    fn default() -> Self {
        Self {
            width_max_px: 4096,
            corners_max: 240,
            corner_spacing_px: 8.0,
            corner_contrast_min: 0.002,
            window_px: 11,
            score: OdometryScore::Normalised,
            range_min_m: 0.6,
            range_max_m: 15.0,
            stereo_score_min: 0.75,
            match_score_min: 0.7,
            coarse_search: true,
            search_px: 12,
            consistent_set: ConsistentSet::Rigidity,
            outlier_sigma: 3.4,
            match_sigma_px: 0.05,
            stereo_sigma_px: 0.05,
            relief_px: 0.5,
            common_px: [0.016, 0.46],
            inliers_min: 25,
            inlier_share_min: 0.35,
            chi2_max: 3.0,
            sigma_max_m: 0.015,
            slip_max: 1.4,
            attitude_max_deg: 2.0,
            ambiguity_max: 0.7,
            repetition_max: 0.96,
        }
    }
}

impl OdometryPreset {
    /// The settings of the preset.
    pub fn settings(self) -> OdometrySettings {
        let ours = OdometrySettings::default();
        match self {
            Self::Sightline => ours,
            Self::Mer2007 => OdometrySettings {
                width_max_px: 256,
                corners_max: 200,
                corner_spacing_px: 6.0,
                score: OdometryScore::PseudoNormalised,
                stereo_score_min: 0.7,
                match_score_min: 0.7,
                coarse_search: false,
                search_px: 15,
                consistent_set: ConsistentSet::Ransac,
                match_sigma_px: 0.2,
                stereo_sigma_px: 0.2,
                inliers_min: 10,
                inlier_share_min: 0.0,
                chi2_max: 4.0,
                sigma_max_m: 1.0,
                slip_max: 1.3,
                attitude_max_deg: 3.0,
                ambiguity_max: 1.0,
                repetition_max: 2.0,
                ..ours
            },
        }
    }
}

impl OdometrySettings {
    /// Rejects values out of range.
    ///
    /// # Errors
    /// [`Error::Setting`] with the field and its range.
    pub fn validate(&self) -> Result<()> {
        let within = |key: &str, value: f64, low: f64, high: f64| {
            if (low..=high).contains(&value) {
                return Ok(());
            }
            Err(Error::setting(key, format!("{value} is outside {low} to {high}")))
        };
        within("width_max_px", f64::from(self.width_max_px), 64.0, 4096.0)?;
        within("corners_max", f64::from(self.corners_max), 20.0, 2000.0)?;
        within("corner_spacing_px", self.corner_spacing_px, 2.0, 100.0)?;
        within("corner_contrast_min", self.corner_contrast_min, 0.0, 1.0)?;
        within("window_px", f64::from(self.window_px), 5.0, 41.0)?;
        if self.window_px.is_multiple_of(2) {
            return Err(Error::setting("window_px", format!("{} is not odd", self.window_px)));
        }
        within("range_min_m", self.range_min_m, 0.1, 10.0)?;
        within("range_max_m", self.range_max_m, 1.0, 100.0)?;
        if self.range_min_m >= self.range_max_m {
            let problem = format!("{} m is not less than range_max_m", self.range_min_m);
            return Err(Error::setting("range_min_m", problem));
        }
        within("stereo_score_min", self.stereo_score_min, 0.0, 1.0)?;
        within("match_score_min", self.match_score_min, 0.0, 1.0)?;
        within("search_px", f64::from(self.search_px), 2.0, 100.0)?;
        within("outlier_sigma", self.outlier_sigma, 1.0, 10.0)?;
        within("match_sigma_px", self.match_sigma_px, 0.0, 2.0)?;
        within("stereo_sigma_px", self.stereo_sigma_px, 0.0, 2.0)?;
        within("relief_px", self.relief_px, 0.0, 10.0)?;
        within("common_px[0]", self.common_px[0], 0.0, 10.0)?;
        within("common_px[1]", self.common_px[1], 0.0, 10.0)?;
        within("inliers_min", f64::from(self.inliers_min), 4.0, 1000.0)?;
        within("inlier_share_min", self.inlier_share_min, 0.0, 1.0)?;
        within("chi2_max", self.chi2_max, 1.0, 100.0)?;
        within("sigma_max_m", self.sigma_max_m, 0.001, 1.0)?;
        within("slip_max", self.slip_max, 0.0, 5.0)?;
        within("attitude_max_deg", self.attitude_max_deg, 0.1, 45.0)?;
        within("ambiguity_max", self.ambiguity_max, 0.1, 1.0)?;
        within("repetition_max", self.repetition_max, 0.1, 2.0)
    }
}
