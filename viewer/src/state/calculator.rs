//! Inputs of the calculator of the error budget: a stereo pair and an approach.

use sightline_geometry::estimate::error_budget::{Approach, TABLE_ONE};

/// The stereo pair.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pair {
    /// The cameras of the cursor's stop.
    #[default]
    Current,
    /// A row of Table I, with the pixel size of the manufacturer.
    TableOne(usize),
    /// The MER navcam.
    MerNavcam,
}

impl Pair {
    /// All pairs, in the order of the list.
    pub fn all() -> impl Iterator<Item = Self> {
        let table = (0..TABLE_ONE.len()).map(Self::TableOne);
        std::iter::once(Self::Current).chain(table).chain([Self::MerNavcam])
    }

    /// The label in the list.
    pub fn name(self) -> &'static str {
        match self {
            Self::Current => "this traverse's cameras",
            Self::TableOne(row) => TABLE_ONE[row].name,
            Self::MerNavcam => "MER navcam",
        }
    }
}

/// Inputs of the calculator.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Calculator {
    /// The stereo pair.
    pub pair: Pair,
    /// The approach to the target, with its error sources.
    pub approach: Approach,
}
