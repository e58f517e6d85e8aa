//! What a person may change about dense stereo.
//!
//! Sources: domain.md 7 (JPL's correlator); Hirschmüller, *Stereo Processing by Semiglobal Matching and Mutual
//! Information*, PAMI 2008 (P1, P2, paths, the checks after it). Those marked *ours* were chosen on the
//! pairs of docs/stereo.md.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::align::AlignSettings;
use sightline_geometry::error::{Error, Result};

/// How pixels of the two images are compared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum StereoMethod {
    /// Each pixel by its own window: quick; needs texture in every window, and widens what stands in front.
    BlockMatching,
    /// Each pixel by its neighbourhood along several paths: closes gaps of weak texture and keeps outlines.
    #[default]
    SemiGlobal,
}

/// Along how many paths semi-global matching sums.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum StereoPaths {
    /// From both sides along the row and from the row above: one pass, some rows of memory.
    #[default]
    Five,
    /// From the row below as well: two passes and the costs of the whole image in memory, two bytes a cell.
    Eight,
}

/// The settings of dense stereo.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct StereoSettings {
    /// How pixels are compared.
    pub method: StereoMethod,
    /// How the pair is aligned.
    pub align: AlignSettings,
    /// Nearest depth, m, 0.05 to 1000 (0.5: ours); it counts where `disparity_count` is 0.
    pub range_min_m: f64,
    /// Points farther than this from the left camera are left out, m, 0.1 to 100 000 (100: ours).
    pub range_max_m: f64,
    /// The smallest disparity, px, −1024 to 1024 (0: what lies at infinity in an aligned pair). Above 0, what is far has no
    /// answer or a wrong one.
    pub disparity_first_px: i32,
    /// How many disparities follow, 8 to 512, or 0: as many as `range_min_m` asks for (0). Too few: what is near has no
    /// answer; too many: time, and more places to be wrong.
    pub disparity_count: u32,
    /// Side of the window of block matching, odd, 5 to 31 px (11: ours). Too small: noise; too large: outlines
    /// grow and thin things go.
    pub window_px: u32,
    /// P1: the price of a step of one disparity from pixel to pixel, 0 to 60 bits of the census (16: ours). Too
    /// high: slopes become stairs.
    pub small_step: u32,
    /// P2: the price of a larger step where the image is even, up to 180 bits (100: ours). Too high: things in front
    /// are lost in what is behind them; too low: noise.
    pub large_step: u32,
    /// P2 where the image itself has an edge, which is where depth may jump, bits (30: ours).
    pub large_step_least: u32,
    /// How quickly P2 falls with the difference of the two pixels: bits per full scale (300: ours).
    pub large_step_slope: f64,
    /// Along how many paths.
    pub paths: StereoPaths,
    /// Least mean absolute slope of the image along the row within a window of 9 × 9 px, fraction of full scale per px
    /// (0.001; 0: off). Below it a pixel says nothing about where it is.
    pub texture_min: f64,
    /// The best disparity must be better than any that is no neighbour by this share, 0 to 1 (0.05: ours; 0: off).
    pub uniqueness_min: f64,
    /// How far the disparity that the right image finds for the partner may lie from the left one's, px (1: domain.md 7;
    /// negative: off).
    pub left_right_max_px: f64,
    /// Patches of fewer pixels are left out (100, OpenCV's custom; JPL 64; 0: off).
    pub speckle_px: u32,
    /// Neighbours that differ by at most this belong to one patch, px (1: ours).
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
    /// Whether the numbers can be used.
    ///
    /// # Errors
    /// [`Error::Setting`] that names the first one that cannot.
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
