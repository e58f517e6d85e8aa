//! Settings of dense stereo.
//!
//! Sources: domain.md 7 (JPL's correlator); Hirschmüller, *Stereo Processing by Semiglobal Matching and Mutual
//! Information*, PAMI 2008 (P1, P2, paths, post-processing). Values marked *ours* were chosen on the pairs of
//! docs/stereo.md.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::align::AlignSettings;
use sightline_geometry::error::{Error, Result};

/// Method of matching the pixels of the two images.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum StereoMethod {
    /// Each pixel by its own window: fast; needs texture in every window, and widens foreground objects.
    BlockMatching,
    /// Each pixel by its neighbourhood along several paths: closes gaps of weak texture and keeps outlines.
    #[default]
    SemiGlobal,
}

/// Number of paths over which semi-global matching sums.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum StereoPaths {
    /// From both sides along the row and from the row above: one pass, some rows of memory.
    #[default]
    Five,
    /// Also from the row below: two passes, and the sums of the whole image in memory, two bytes per cell.
    Eight,
}

/// The settings of dense stereo.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct StereoSettings {
    /// Method of matching.
    pub method: StereoMethod,
    /// Settings of the epipolar alignment.
    pub align: AlignSettings,
    /// Nearest depth, m, 0.05 to 1000 (0.5: ours); used if `disparity_count` is 0.
    pub range_min_m: f64,
    /// Largest distance of a point from the left camera, m, 0.1 to 100 000 (100: ours).
    pub range_max_m: f64,
    /// The smallest disparity, px, −1024 to 1024 (0: infinity in an aligned pair). Above 0, distant points have no
    /// disparity or a wrong one.
    pub disparity_first_px: i32,
    /// Number of disparities, 8 to 512, or 0: as many as `range_min_m` requires (0). Too few: near points have no
    /// disparity; too many: slower, and more false matches.
    pub disparity_count: u32,
    /// Side of the window of block matching, odd, 5 to 31 px (11: ours). Too small: noise; too large: outlines grow and
    /// thin objects vanish.
    pub window_px: u32,
    /// P1: penalty of a disparity step of one between neighbouring pixels, 0 to 60 bits of the census (16: ours). Too
    /// high: slopes become stairs.
    pub small_step: u32,
    /// P2: penalty of a larger step where the image has no edge, up to 180 bits (100: ours). Too high: foreground
    /// objects merge with the background; too low: noise.
    pub large_step: u32,
    /// Lower bound of P2, at image edges, where depth discontinuities are likely, bits (30: ours).
    pub large_step_least: u32,
    /// Decrease of P2 with the difference of the two pixels: bits per full scale (300: ours).
    pub large_step_slope: f64,
    /// Number of paths.
    pub paths: StereoPaths,
    /// Least mean absolute gradient of the image along the row within a window of 9 × 9 px, fraction of full scale per
    /// px (0.001; 0: off). With less, a match is not reliable.
    pub texture_min: f64,
    /// Fraction by which the best sum must be below that of any other disparity except its neighbours, 0 to 1 (0.05:
    /// ours; 0: off).
    pub uniqueness_min: f64,
    /// Largest difference between the disparities of the left pixel and of its partner in the right image, px (1:
    /// domain.md 7; negative: off).
    pub left_right_max_px: f64,
    /// Patches of fewer pixels are removed (100: as usual in OpenCV; JPL 64; 0: off).
    pub speckle_px: u32,
    /// Largest difference of neighbouring disparities within a patch, px (1: ours).
    pub speckle_step_px: f64,
}

impl Default for StereoSettings {
    fn default() -> Self {
        Self {
            method: StereoMethod::SemiGlobal,
            disparity_first_px: 0,
            align: AlignSettings::default(),
            range_min_m: 0.5,
            range_max_m: 100.0,
            disparity_count: 0,
            window_px: 11,
            small_step: 16,
            large_step: 100,
            large_step_least: 30,
            large_step_slope: 300.0,
            paths: StereoPaths::Five,
            texture_min: 0.001,
            uniqueness_min: 0.05,
            left_right_max_px: 1.0,
            speckle_px: 100,
            speckle_step_px: 1.0,
        }
    }
}

impl StereoSettings {
    /// Checks the ranges of all settings.
    ///
    /// # Errors
    /// [`Error::Setting`] with the name of the first invalid one.
    pub fn check(&self) -> Result<()> {
        let within = |key: &str, value: f64, low: f64, high: f64| {
            if (low..=high).contains(&value) {
                return Ok(());
            }
            Err(Error::setting(key, format!("must be a number from {low} to {high}, not {value}")))
        };
        within("range_min_m", self.range_min_m, 0.05, 1000.0)?;
        within("range_max_m", self.range_max_m, 0.1, 100_000.0)?;
        within("disparity_first_px", self.disparity_first_px.into(), -1024.0, 1024.0)?;
        within("disparity_count", self.disparity_count.into(), 8.0, 512.0)?;
        within("window_px", self.window_px.into(), 5.0, 31.0)?;
        if self.window_px.is_multiple_of(2) {
            return Err(Error::setting("window_px", format!("must be odd, not {}", self.window_px)));
        }
        within("small_step", self.small_step.into(), 0.0, 60.0)?;
        within("large_step", self.large_step.into(), self.small_step.into(), 180.0)?;
        within(
            "large_step_least",
            self.large_step_least.into(),
            self.small_step.into(),
            self.large_step.into(),
        )?;
        within("large_step_slope", self.large_step_slope, 0.0, 1e6)?;
        within("texture_min", self.texture_min, 0.0, 1.0)?;
        within("uniqueness_min", self.uniqueness_min, 0.0, 1.0)?;
        within("left_right_max_px", self.left_right_max_px, -1.0, 1024.0)?;
        within("speckle_step_px", self.speckle_step_px, 0.0, 1024.0)
    }
}
