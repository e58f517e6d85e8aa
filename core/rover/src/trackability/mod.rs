//! Trackability: rates each pixel of a left image as a target before one is designated (R20, R21).
//!
//! ```text
//! pair ─► dense stereo ─► ranges, depth edges ┐      point stereo on a grid where the pair is convergent
//! left image ─► noise, light, texture         ├─► criteria of a window ─► good │ risky │ bad, with one reason
//! cameras ─► rim, range error, longest step   ┘
//! ```
//! | criterion | value | unit | risky | bad | source |
//! |---|---|---|---|---|---|
//! | `rim` | distance to the image's border | px | half a window + its motion in a step of 10 % | half a window | ours |
//! | `data` | pixels of the window without data | share | – | any | R66 |
//! | `range` | outcome of dense stereo | – | – | a hole | R19, R187 |
//! | `stereo_score` | correlation of point stereo, on convergent pairs | – | – | `stereo_ncc_min` | R82 |
//! | `range_error` | 3σ of the range over the range: `R Δd/(f B)` | share | `range_error_risky` | `range_error_bad` | K-Eq 1, R35 |
//! | `depth_edge` | to the nearest jump of the disparity | px | `edge_risky_focus` · `focus_px` | `edge_bad_px` | R119, ours |
//! | `relief` | largest departure of the ranges from a plane, over the range | share | `warn_boundary` + `range_error` | – | R119 |
//! | `depth_range` | (farthest − nearest)/range in the window | share | `warn_depth_range` + `range_error` | – | R21 |
//! | `slant` | between the surface's normal and the line of sight | deg | `slant_risky_deg` | – | R20, ours |
//! | `saturation` | pixels at full scale | share | `saturated_risky` | `saturated_bad` | ours |
//! | `dark` | pixels much darker than the ground | share | `warn_shadow_share` | – | R21 |
//! | `contrast` | standard deviation over full scale | share | `warn_contrast` | none at all | R21 |
//! | `texture` | expected 1σ of a match, worst direction | px | `match_sigma_risky_px` | `match_sigma_bad_px` | ours |
//! | `likeness` | best score of the window at another position of the search area | – | `far_ncc_min` | `renew_ncc` | R68 |
//! | `refused` | result of the designation itself | – | a warning | a refusal | R16, R21 |
//!
//! All criteria are computed from the images; a simulation's ground truth is not used. Therefore `dark` is not called
//! shadow: a dark stone is dark too.
//!
//! A map is computed on a grid of cells, row by row, from one dense stereo result of the pair (`map`). A single pixel is
//! rated by designating it (`pixel`), so that *good* there means that the designation succeeds.
//!
//! The experiment `trackability` compares the verdicts with the ground truth (docs/trackability.md).

pub mod aspect;
pub mod depth;
pub mod ground;
pub mod limits;
pub mod map;
pub mod pixel;
mod point_ranges;
pub mod texture;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

pub use aspect::{Aspect, Criterion};
pub use ground::Ground;
pub use limits::TrackabilityLimits;
pub use map::{MapProgress, TrackabilityMap};
pub use pixel::PixelVerdict;

/// Rating of a point as a target.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, ToSchema,
)]
#[serde(rename_all = "snake_case")]
#[schema(as = Trackability)]
pub enum Verdict {
    /// No criterion is risky or bad.
    #[default]
    Good,
    /// It may be lost.
    Risky,
    /// It cannot be designated, or will be lost.
    Bad,
}

impl Verdict {
    /// All verdicts, the best first.
    pub const ALL: [Self; 3] = [Self::Good, Self::Risky, Self::Bad];

    /// Name in sentences and tables; records use `bad` instead of `poor`.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Risky => "risky",
            Self::Bad => "poor",
        }
    }

    /// Name at the beginning of a sentence.
    pub const fn title(self) -> &'static str {
        match self {
            Self::Good => "Good",
            Self::Risky => "Risky",
            Self::Bad => "Poor",
        }
    }

    /// Letter in a map.
    pub const fn letter(self) -> char {
        match self {
            Self::Good => 'g',
            Self::Risky => 'r',
            Self::Bad => 'b',
        }
    }

    /// The verdict of a letter.
    pub fn of_letter(letter: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|verdict| verdict.letter() as u8 == letter)
    }
}
