//! The enumerated values of the template locator's settings.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Reference direction of the template's roll (Kim09 §4.3.1).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum RollReference {
    /// The horizontal of the old image, taken as exactly horizontal, as the paper does.
    #[default]
    Horizontal,
    /// The helper point's true direction in the old image, slightly tilted by distortion.
    OldImage,
}

/// Reference of the vertical tolerance of point stereo (Kim09 §4.4).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum StereoReference {
    /// The epipolar curve of the camera models.
    #[default]
    EpipolarCurve,
    /// The same image row, which fails on real unrectified pairs.
    ImageRow,
}

/// Position of the interval of disparities (Kim09 §4.4, corrected).
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
    /// If its magnification is too large or its score too low, so that fewer match errors accumulate.
    #[default]
    OnCondition,
    /// Never: the designated window is matched at every stop.
    Never,
    /// At every accepted update; every match is then corrected against the designated window, if that is found near it.
    DriftCorrected,
}

/// Source of the pixel noise in the position covariance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum NoiseModel {
    /// Measured from each match: residual, gradients and template drift.
    #[default]
    Measured,
    /// Half a pixel in each coordinate of each camera, as the papers assume.
    HalfPixel,
}

/// Method of the first stage (Kim09 §2).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum FirstStage {
    /// Comparison at the positions of the search window.
    #[default]
    Correlation,
    /// Pyramidal Lucas–Kanade from the prediction, by translation alone.
    KltTranslation,
    /// Pyramidal Lucas–Kanade from the prediction, by an affine map.
    KltAffine,
}

/// Similarity measure of template and image (Kim09 §2).
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
    /// The name, as in the settings.
    pub fn word(self) -> &'static str {
        match self {
            Self::Ncc => "ncc",
            Self::Sad => "sad",
            Self::Ssd => "ssd",
            Self::Sdog => "sdog",
        }
    }

    /// Limits between which its scores are shown, the same at every step: −1 and 1 if it has these bounds; otherwise
    /// negated differences from a fifth of full scale (squared: a seventh) to zero.
    pub fn shown_limits(self) -> [f32; 2] {
        match self {
            Self::Ncc | Self::Sdog => [-1.0, 1.0],
            Self::Sad => [-0.2, 0.0],
            Self::Ssd => [-0.02, 0.0],
        }
    }
}

/// Positions that are compared (Kim09 §4.3.2).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Search {
    /// All positions.
    #[default]
    Exhaustive,
    /// All positions at a coarse level, and those near the best at finer levels.
    CoarseToFine,
}

/// The second stage (Kim09 §2).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Refine {
    /// None: the first stage's match is final.
    #[default]
    None,
    /// An affine map by gradient descent.
    Affine,
}

/// Source of the template's scale and roll (Kim09 §2).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Transform {
    /// The geometry of the two views.
    #[default]
    Geometry,
    /// Brute force: every pair of a grid is compared; the best score wins.
    Search,
}

/// How the template is warped by the target's surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum WarpModel {
    /// The first-order map at the target.
    #[default]
    Slope,
    /// Pixel by pixel through the surface's plane and both camera models.
    Homography,
}
