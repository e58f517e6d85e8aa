//! What the calculator of the error budget is given: a pair of cameras and an approach.

use sightline_core::estimate::error_budget::{Approach, MAKER_PIXEL_UM, StereoPair, TABLE_ONE};

use super::State;

/// The MER navcam: its effective focal length, px, and baseline, m (R226).
const MER_NAVCAM: StereoPair = StereoPair { focal_px: 1223.28, baseline_m: 0.20 };

/// Which pair of cameras is calculated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pair {
    /// The cameras of the stop that is looked at.
    #[default]
    Present,
    /// A row of Table I, with the maker's pixel.
    TableOne(usize),
    /// The MER navcam.
    MerNavcam,
}

impl Pair {
    /// All of them, in the order of the list.
    pub fn all() -> impl Iterator<Item = Self> {
        let table = (0..TABLE_ONE.len()).map(Self::TableOne);
        std::iter::once(Self::Present).chain(table).chain([Self::MerNavcam])
    }

    /// Its name in the list.
    pub fn name(self) -> &'static str {
        match self {
            Self::Present => "this traverse's cameras",
            Self::TableOne(row) => TABLE_ONE[row].name,
            Self::MerNavcam => "MER navcam",
        }
    }

    /// Focal length and baseline; none for the present cameras where no step is loaded.
    pub fn stereo(self, state: &State) -> Option<StereoPair> {
        match self {
            Self::Present => {
                let pointing = state.trace()?.point_mast.as_ref()?;
                let pixel = pointing.predicted_left.unwrap_or_else(|| pointing.left.centre_pixel());
                StereoPair::from_cameras(&pointing.left, &pointing.right, pixel)
            }
            Self::TableOne(row) => Some(TABLE_ONE[row].pair(MAKER_PIXEL_UM)),
            Self::MerNavcam => Some(MER_NAVCAM),
        }
    }
}

/// What the calculator is given.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Calculator {
    /// The cameras.
    pub pair: Pair,
    /// The drive and what goes wrong on it.
    pub approach: Approach,
}
