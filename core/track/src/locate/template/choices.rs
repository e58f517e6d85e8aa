//! The words that the choices among the template locator's settings take.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// What the roll of the template is measured against (Kim09 §4.3.1).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum RollReference {
    /// The horizontal of the old image, taken as exactly horizontal, as the paper does.
    #[default]
    Horizontal,
    /// The helper point's true direction in the old image, which distortion tilts a little.
    OldImage,
}

/// From where the vertical tolerance of point stereo is measured (Kim09 §4.4).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum StereoReference {
    /// The epipolar curve of the camera models.
    #[default]
    EpipolarCurve,
    /// The same image row, which fails on real unrectified pairs.
    ImageRow,
}

/// Where the interval of disparities lies (Kim09 §4.4, corrected).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum DisparityInterval {
    /// Around the disparity of the predicted range.
    #[default]
    Centred,
    /// From zero, the literal reading, which excludes near targets.
    FromZero,
}

/// When an accepted update renews the template (Kim09 §4.3.3).
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
    /// At every accepted update, and every match is then corrected against the designated window, where that is found
    /// near it.
    DriftCorrected,
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

/// What finds the template first (Kim09 §2).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum FirstStage {
    /// Comparison at the positions of the search window.
    #[default]
    Correlation,
    /// Pyramidal Lucas–Kanade from the prediction, by shift alone.
    KltTranslation,
    /// The same by affine map.
    KltAffine,
}

/// By what the template and the image are compared (Kim09 §2).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Measure {
    /// Normalised cross-correlation.
    #[default]
    Ncc,
    /// Sum of absolute differences.
    Sad,
    /// Sum of squared differences.
    Ssd,
    /// Sign of the difference of Gaussians.
    Sdog,
}

impl Measure {
    /// Its name, as in the settings.
    pub fn word(self) -> &'static str {
        match self {
            Self::Ncc => "ncc",
            Self::Sad => "sad",
            Self::Ssd => "ssd",
            Self::Sdog => "sdog",
        }
    }

    /// Between what its scores are shown, the same at every step: −1 and 1 where it has these bounds; negated differences
    /// of a fifth of full scale (squared: of a seventh) up to none.
    pub fn shown_limits(self) -> [f32; 2] {
        match self {
            Self::Ncc | Self::Sdog => [-1.0, 1.0],
            Self::Sad => [-0.2, 0.0],
            Self::Ssd => [-0.02, 0.0],
        }
    }
}

/// Which positions are compared (Kim09 §4.3.2).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Search {
    /// All of them.
    #[default]
    Exhaustive,
    /// All at a coarse level, and those near the best at finer ones.
    CoarseToFine,
}

/// The second stage (Kim09 §2).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Refine {
    /// None: the first stage's match stands.
    #[default]
    None,
    /// An affine map by gradient descent.
    Affine,
}

/// Where the template's scale and roll come from (Kim09 §2).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Transform {
    /// The geometry of the two views.
    #[default]
    Geometry,
    /// Brute force: every pair of a grid is compared, the best score wins.
    Search,
}

/// How the template is warped by the target's surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum WarpModel {
    /// The map of first order at the target.
    #[default]
    Slope,
    /// Pixel by pixel through the surface's plane and both camera models.
    Homography,
}
