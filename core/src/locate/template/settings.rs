//! The settings of the template locator, with unit, default and source.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::image::sample::Kernel;
use crate::limits::Domain;
use crate::settings_group;

/// What the roll of the template is measured against (R57).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum RollReference {
    /// The horizontal of the old image, taken as exactly horizontal, as the paper does.
    #[default]
    Horizontal,
    /// The helper point's true direction in the old image, which distortion tilts a little.
    OldImage,
}

/// From where the vertical tolerance of point stereo is measured (R73, E38).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum StereoReference {
    /// The epipolar curve of the camera models.
    #[default]
    EpipolarCurve,
    /// The same image row, which fails on real unrectified pairs.
    ImageRow,
}

/// Where the interval of disparities lies (R75, E13).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum DisparityInterval {
    /// Around the disparity of the predicted range.
    #[default]
    Centred,
    /// From zero, the literal reading, which excludes near targets.
    FromZero,
}

/// When an accepted update renews the template (R70, R71).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum TemplateUpdate {
    /// At every accepted update, as in flight.
    EveryUpdate,
    /// Once it must be magnified too much, or matches badly: errors of matches are chained more seldom.
    #[default]
    OnCondition,
    /// Never: the designated window is looked for at every stop.
    Never,
}

/// Where the pixel noise comes from that the position covariance propagates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum NoiseModel {
    /// Measured from each match: residual, gradients and template drift.
    #[default]
    Measured,
    /// Half a pixel in each coordinate of each eye, as the papers assume.
    HalfPixel,
}

settings_group! {
    /// The settings of the template locator (Kim et al. 2009).
    TemplateSettings as "template" {
        /// Side of the square template. Small: ambiguous; large: foreshortening and depth edges spoil it.
        template_size_px: u32 = 21, "px", Domain::OddBetween(5, 101), "K§4.1, R23";
        /// Side of the square subframe shown and exposed for.
        subframe_px: u32 = 161, "px", Domain::OddBetween(33, 1023), "K-Fig 3, R31";
        /// Side of the square region in which the whole template must lie: 143 searches ±61 positions.
        search_window_px: u32 = 143, "px", Domain::OddBetween(21, 1023), "K§7.2, R33, E7";
        /// Growth of the search window at each update while lost.
        lost_search_growth: f64 = 1.0, "", Domain::Between(1.0, 4.0), "ours, R92";
        /// Scale the template by the ratio of distances.
        scale: bool = true, "", Domain::Switch, "K§4.3.1, R49";
        /// Roll the template by the camera geometry.
        roll: bool = true, "", Domain::Switch, "K§4.3.1, R52";
        /// Warp the template by the slope of the target's surface, as stereo measured it, instead of scale and roll
        /// alone; where both of these are on.
        surface_warp: bool = true, "", Domain::Switch, "ours; beyond R60";
        /// 1σ of the Gaussian through which a match is refined; 0: all of the window counts alike, as in the paper.
        focus_px: f64 = 4.0, "px", Domain::Between(0.0, 100.0), "ours; correlate/focus.rs";
        /// When an accepted update renews the template.
        template_update: TemplateUpdate = TemplateUpdate::OnCondition, "", Domain::choice(&["every_update", "on_condition", "never"]), "K§4.3.3, R70; ours";
        /// On condition: renewed once it must be magnified by this, or shrunk by its inverse.
        renew_scale: f64 = 1.3, "", Domain::Between(1.0, 100.0), "ours";
        /// On condition: renewed once its match scores less.
        renew_ncc: f64 = 0.95, "", Domain::Between(-1.0, 1.0), "ours";
        /// What the roll is measured against.
        roll_reference: RollReference = RollReference::Horizontal, "", Domain::choice(&["horizontal", "old_image"]), "R57";
        /// Interpolation kernel of the template.
        kernel: Kernel = Kernel::Bicubic, "", Domain::choice(&["bilinear", "bicubic"]), "ours, R58";
        /// Keep the match below the pixel; off shows the random walk of whole pixels.
        sub_pixel: bool = true, "", Domain::Switch, "ours, R67";
        /// Tolerance across the epipolar curve.
        epipolar_tolerance_px: f64 = 2.0, "px", Domain::Between(0.0, 30.0), "K§4.4, R73";
        /// From where that tolerance is measured.
        stereo_reference: StereoReference = StereoReference::EpipolarCurve, "", Domain::choice(&["epipolar_curve", "image_row"]), "E38, R73";
        /// Width of the disparity interval.
        disparity_range_px: f64 = 80.0, "px", Domain::Between(2.0, 1024.0), "K§4.4, R74";
        /// Where the disparity interval lies.
        disparity_interval: DisparityInterval = DisparityInterval::Centred, "", Domain::choice(&["centred", "from_zero"]), "E13, R75";
        /// Nearest range searched by point stereo.
        range_min_m: f64 = 0.5, "m", Domain::Between(0.05, 1000.0), "ours";
        /// Farthest range searched by point stereo.
        range_max_m: f64 = 200.0, "m", Domain::Between(0.1, 100_000.0), "ours";
        /// Where the pixel noise of the covariance comes from.
        noise_model: NoiseModel = NoiseModel::Measured, "", Domain::choice(&["measured", "half_pixel"]), "ours; papers: R170";
        /// How alike the errors of two matches in a row are, where they are measured.
        match_correlation: f64 = 0.4, "", Domain::Between(0.0, 0.99), "ours; ARCHITECTURE.md";
    }
}
