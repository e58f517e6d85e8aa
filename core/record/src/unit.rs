//! Units of quantities: their symbol for people, their word for files and expressions, and their dimension.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A unit of measurement.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Unit {
    /// A pure number: scores, ratios, shares, counts.
    #[default]
    One,
    /// m
    Metre,
    /// cm
    Centimetre,
    /// mm
    Millimetre,
    /// km
    Kilometre,
    /// px
    Pixel,
    /// deg
    Degree,
    /// rad
    Radian,
    /// s
    Second,
    /// Hundredths.
    Percent,
    /// m²
    SquareMetre,
    /// px²
    SquarePixel,
    /// m/px
    MetrePerPixel,
}

/// Unit, symbol, word, exponents of (m, px, rad, s), and the number of these units in one base unit.
type Row = (Unit, &'static str, &'static str, [i8; 4], f64);

const TABLE: [Row; 13] = [
    (Unit::One, "", "1", [0; 4], 1.0),
    (Unit::Metre, "m", "m", [1, 0, 0, 0], 1.0),
    (Unit::Centimetre, "cm", "cm", [1, 0, 0, 0], 100.0),
    (Unit::Millimetre, "mm", "mm", [1, 0, 0, 0], 1000.0),
    (Unit::Kilometre, "km", "km", [1, 0, 0, 0], 0.001),
    (Unit::Pixel, "px", "px", [0, 1, 0, 0], 1.0),
    (Unit::Degree, "°", "deg", [0, 0, 1, 0], 180.0 / std::f64::consts::PI),
    (Unit::Radian, "rad", "rad", [0, 0, 1, 0], 1.0),
    (Unit::Second, "s", "s", [0, 0, 0, 1], 1.0),
    (Unit::Percent, "%", "%", [0; 4], 100.0),
    (Unit::SquareMetre, "m²", "m2", [2, 0, 0, 0], 1.0),
    (Unit::SquarePixel, "px²", "px2", [0, 2, 0, 0], 1.0),
    (Unit::MetrePerPixel, "m/px", "m/px", [1, -1, 0, 0], 1.0),
];

impl Unit {
    /// Every unit.
    pub fn all() -> impl Iterator<Item = Self> {
        TABLE.into_iter().map(|(unit, ..)| unit)
    }

    /// The symbol shown to people; empty for a pure number.
    pub fn symbol(self) -> &'static str {
        self.row().1
    }

    /// The ASCII word used in files and expressions: `deg`, `px2`, `1`.
    pub fn word(self) -> &'static str {
        self.row().2
    }

    /// Exponents of metre, pixel, radian and second.
    pub fn dimension(self) -> [i8; 4] {
        self.row().3
    }

    /// The number of these units in one base unit (m, px, rad, s): 100 for cm.
    pub fn per_base(self) -> f64 {
        self.row().4
    }

    /// Whether the unit is one word that may follow a number in an expression (`5 cm`).
    pub fn is_typed(self) -> bool {
        !matches!(self, Self::One | Self::SquareMetre | Self::SquarePixel | Self::MetrePerPixel)
    }

    /// Finds a unit by its word or symbol.
    pub fn from_word(text: &str) -> Option<Self> {
        TABLE.into_iter().find(|row| row.2 == text || row.1 == text).map(|(unit, ..)| unit)
    }

    /// The unit of a field by the naming rules: from the suffix (`sigma_m`, `covariance_px2`), or from the frame
    /// (`position_in_rover`, `covariance_in_site`).
    pub fn of_name(name: &str) -> Option<Self> {
        if name.contains("covariance_in_") {
            return Some(Self::SquareMetre);
        }
        if name.contains("position_in_") {
            return Some(Self::Metre);
        }
        let (_, end) = name.rsplit_once('_')?;
        Self::from_word(end).filter(|unit| *unit != Self::Percent)
    }

    fn row(self) -> Row {
        // The rows of the table are in the order of the enum; a test compares them.
        TABLE[self as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_unit_is_in_its_own_row_and_read_back() {
        for (index, row) in TABLE.into_iter().enumerate() {
            assert_eq!(row.0 as usize, index);
            assert_eq!(row.0.symbol(), row.1);
            assert_eq!(Unit::from_word(row.1), Some(row.0));
            assert_eq!(Unit::from_word(row.2), Some(row.0));
        }
    }

    #[test]
    fn names_tell_their_unit() {
        assert_eq!(Unit::of_name("sigma_m"), Some(Unit::Metre));
        assert_eq!(Unit::of_name("covariance_px2"), Some(Unit::SquarePixel));
        assert_eq!(Unit::of_name("roll_deg"), Some(Unit::Degree));
        assert_eq!(Unit::of_name("ncc"), None);
        assert_eq!(Unit::of_name("initial_position_in_site"), Some(Unit::Metre));
        assert_eq!(Unit::of_name("covariance_in_rover"), Some(Unit::SquareMetre));
    }
}
