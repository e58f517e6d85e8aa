//! The criteria by which a point is rated as a target, with their name, unit and explanation.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::Verdict;
use sightline_vision::stereo::Outcome;

/// A criterion of trackability, in the order in which reasons are given; the table is in the header of the parent module.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Aspect {
    /// The designation's own result.
    Refused,
    /// Distance from the image's border.
    Rim,
    /// Pixels without data.
    Data,
    /// Whether a range is available.
    Range,
    /// Score of point stereo, if the ranges are from point stereo.
    StereoScore,
    /// The nearest depth edge.
    DepthEdge,
    /// Pixels at full scale.
    Saturation,
    /// Whether there is any contrast.
    Contrast,
    /// The expected error of a match.
    Texture,
    /// Another point with a similar window.
    Likeness,
    /// Departure of the ranges from a plane.
    Relief,
    /// Pixels that are much darker than the ground.
    Dark,
    /// The error of the range.
    RangeError,
    /// The spread of the ranges.
    DepthRange,
    /// Incidence angle of the surface.
    Slant,
}

/// The result of one criterion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Criterion {
    /// The criterion.
    pub aspect: Aspect,
    /// The measured value; null if it could not be measured.
    pub value: Option<f64>,
    /// Unit of the value; empty for fractions and scores.
    pub unit: String,
    /// Limit beyond which it is risky; null without one.
    pub risky: Option<f64>,
    /// Limit beyond which it is bad; null without one.
    pub bad: Option<f64>,
    /// Whether larger values are better.
    pub at_least: bool,
    /// Verdict of this criterion alone.
    pub verdict: Verdict,
    /// Source of the limit.
    pub source: String,
}

impl Aspect {
    /// All criteria.
    pub const ALL: [Self; 15] = [
        Self::Refused,
        Self::Rim,
        Self::Data,
        Self::Range,
        Self::StereoScore,
        Self::DepthEdge,
        Self::Saturation,
        Self::Contrast,
        Self::Texture,
        Self::Likeness,
        Self::Relief,
        Self::Dark,
        Self::RangeError,
        Self::DepthRange,
        Self::Slant,
    ];

    /// Name of the criterion.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Refused => "designation",
            Self::Rim => "distance from the rim",
            Self::Data => "pixels without data",
            Self::Range => "range",
            Self::StereoScore => "stereo score",
            Self::DepthEdge => "distance from a depth edge",
            Self::Saturation => "overexposed share",
            Self::Contrast => "contrast",
            Self::Texture => "expected match 1σ",
            Self::Likeness => "likeness of another place",
            Self::Relief => "relief",
            Self::Dark => "dark share",
            Self::RangeError => "range error, 3σ",
            Self::DepthRange => "spread of ranges",
            Self::Slant => "slant",
        }
    }

    /// Letter of the criterion in a map.
    pub fn letter(self) -> char {
        let place = Self::ALL.iter().position(|aspect| *aspect == self).unwrap_or(0);
        char::from(b'A' + place as u8)
    }

    /// The criterion of a letter.
    pub fn of_letter(letter: u8) -> Option<Self> {
        Self::ALL.get(usize::from(letter.checked_sub(b'A')?)).copied()
    }

    /// Unit of the value; empty for fractions and scores.
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Rim | Self::DepthEdge | Self::Texture => "px",
            Self::Slant => "deg",
            _ => "",
        }
    }

    /// Whether larger values are better.
    pub const fn at_least(self) -> bool {
        matches!(self, Self::Rim | Self::StereoScore | Self::DepthEdge | Self::Contrast)
    }

    /// Source of the limit.
    pub const fn source(self) -> &'static str {
        match self {
            Self::Refused => "Kim09 §3",
            Self::Rim
            | Self::Data
            | Self::DepthRange
            | Self::Dark
            | Self::Contrast
            | Self::Saturation
            | Self::Texture
            | Self::Likeness => "ours",
            Self::Range => "Kim09 §3, Deans05 §2",
            Self::StereoScore => "Kim09 §4.6",
            Self::RangeError => "Kim09 Eq. 1",
            Self::DepthEdge | Self::Relief => "Kim09 §5.2",
            Self::Slant => "ours; Kim09 §3",
        }
    }

    /// Explains a verdict on a measured value in one sentence.
    pub fn sentence(self, value: Option<f64>, verdict: Verdict) -> String {
        let v = value.unwrap_or(0.0);
        let percent = 100.0 * v;
        match self {
            Self::Refused => "the designation is refused".to_owned(),
            Self::Rim if verdict == Verdict::Bad => {
                format!("the window reaches over the image’s rim, {v:.0} px away")
            }
            Self::Rim => format!("{v:.0} px from the image’s rim: a step may carry it out"),
            Self::Data => "pixels without data in the window".to_owned(),
            Self::Range => format!("no range: stereo hole ({})", hole(v)),
            Self::StereoScore => {
                format!("stereo score {v:.2} is below the tracker’s limit: it would be lost")
            }
            Self::RangeError => format!("far off: the range is known to {percent:.0} % only"),
            Self::DepthEdge => format!("depth edge {v:.0} px away"),
            Self::Relief => format!("deep relief in the window: {percent:.0} % of the distance"),
            Self::DepthRange => format!("the ranges in the window differ by {percent:.0} %"),
            Self::Slant => {
                format!("the surface is turned away by {v:.0}°: it will look different from nearby")
            }
            Self::Saturation => format!("{percent:.0} % of the window is overexposed"),
            Self::Dark => format!("{percent:.0} % of the window is dark, perhaps shadow"),
            Self::Contrast => format!("hardly any contrast: {percent:.1} % of full scale"),
            Self::Texture => format!("weak texture: expected match σ {v:.2} px"),
            Self::Likeness => format!("another place nearby looks the same: {v:.2}"),
        }
    }
}

/// Why dense stereo has no range, by the number of its outcome.
fn hole(outcome: f64) -> &'static str {
    match outcome {
        v if v == f64::from(Outcome::Outside as u8) => "the right image does not show it",
        v if v == f64::from(Outcome::NoTexture as u8) => "no texture along the row",
        v if v == f64::from(Outcome::NotUnique as u8) => "several places fit",
        v if v == f64::from(Outcome::LeftRight as u8) => "the eyes disagree",
        v if v == f64::from(Outcome::Speckle as u8) => "too small a patch",
        v if v == f64::from(Outcome::OutOfRange as u8) => "too far away",
        _ => "not measured",
    }
}
