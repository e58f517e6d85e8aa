//! What the calculator of the error budget is given: a pair of cameras and an approach.

use sightline_geometry::estimate::error_budget::{Approach, TABLE_ONE};

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
}

/// What the calculator is given.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Calculator {
    /// The cameras.
    pub pair: Pair,
    /// The drive and what goes wrong on it.
    pub approach: Approach,
}
