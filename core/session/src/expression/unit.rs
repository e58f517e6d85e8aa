//! Units of the expression language: their dimensions, their conversion, and their words.
//!
//! Values are computed in base units (m, px, rad, s). A unit stores the number of its units in one base unit; numbers are
//! divided by it, so that `35 cm` and `0.35 m` have the same bits.

use std::borrow::Cow;

use sightline_record::Unit as Recorded;

/// Exponents of metre, pixel, radian and second.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dimension([i8; 4]);

/// The words of the base units, in the order of [`Dimension`].
const BASES: [&str; 4] = ["m", "px", "rad", "s"];

/// A unit.
#[derive(Clone, Debug, PartialEq)]
pub struct Unit {
    dimension: Dimension,
    per_base: f64,
    symbol: Cow<'static, str>,
}

impl Unit {
    /// No unit: scores, ratios and counts.
    pub const NONE: Self = Self { dimension: Dimension([0; 4]), per_base: 1.0, symbol: Cow::Borrowed("") };

    /// The unit of a word that may follow a number; `None` for other words.
    pub fn of_word(word: &str) -> Option<Self> {
        Recorded::all().find(|unit| unit.is_typed() && unit.word() == word).map(Self::from)
    }

    /// The unit of a symbol; `None` if it is not a symbol.
    pub(super) fn of_symbol(symbol: &str) -> Option<Self> {
        Recorded::from_word(symbol).map(Self::from)
    }

    /// The words that may follow a number.
    pub fn words() -> impl Iterator<Item = &'static str> {
        Recorded::all().filter(|unit| unit.is_typed()).map(Recorded::word)
    }

    /// The unit of a name by its suffix (`sigma_m`, `covariance_px2`) or its frame.
    pub fn of_name(name: &str) -> Option<Self> {
        Recorded::of_name(name).map(Self::from)
    }

    /// The base unit of a dimension.
    fn of_dimension(dimension: Dimension) -> Self {
        if dimension == Dimension::default() {
            return Self::NONE;
        }
        let part = |sign: i8| {
            let bases = BASES.iter().zip(dimension.0).filter(move |(_, power)| power.signum() == sign);
            let words = bases.map(|(word, power)| match power.abs() {
                1 => (*word).to_owned(),
                2 => format!("{word}²"),
                3 => format!("{word}³"),
                power => format!("{word}^{power}"),
            });
            words.collect::<Vec<_>>().join("·")
        };
        let symbol = match (part(1), part(-1)) {
            (above, below) if below.is_empty() => above,
            (above, below) if above.is_empty() => format!("1/{below}"),
            (above, below) => format!("{above}/{below}"),
        };
        Self { dimension, per_base: 1.0, symbol: symbol.into() }
    }

    /// Its symbol; empty without a unit.
    pub fn symbol(&self) -> &str {
        &self.symbol
    }

    /// Whether both have the same dimension.
    pub fn is_alike(&self, other: &Self) -> bool {
        self.dimension == other.dimension
    }

    /// Whether it is dimensionless: a plain number or a percentage.
    pub fn is_none(&self) -> bool {
        self.dimension == Dimension::default()
    }

    /// The number of these units in one base unit.
    pub fn per_base(&self) -> f64 {
        self.per_base
    }

    /// Converts a number in this unit to base units.
    pub(crate) fn to_base(&self, value: f64) -> f64 {
        value / self.per_base
    }

    /// Converts a number in base units to this unit.
    pub fn from_base(&self, value: f64) -> f64 {
        value * self.per_base
    }

    /// The unit of a product (`power` 1) or a quotient (−1); `None` if an exponent overflows.
    pub fn times(&self, other: &Self, power: i8) -> Option<Self> {
        if other.is_none() {
            return Some(self.clone());
        }
        if self.is_none() && power > 0 {
            return Some(other.clone());
        }
        let mut exponents = self.dimension.0;
        for (mine, theirs) in exponents.iter_mut().zip(other.dimension.0) {
            *mine = mine.checked_add(theirs.checked_mul(power)?)?;
        }
        Some(Self::of_dimension(Dimension(exponents)))
    }

    /// The unit of a square root; `None` if an exponent is odd.
    pub fn root(&self) -> Option<Self> {
        let is_even = self.dimension.0.iter().all(|power| power % 2 == 0);
        is_even.then(|| Self::of_dimension(Dimension(self.dimension.0.map(|power| power / 2))))
    }

    /// The unit as a part of a sentence: “in m” or “without a unit”.
    pub fn in_words(&self) -> String {
        match self.symbol.as_ref() {
            "" => "without a unit".to_owned(),
            "%" => "a share in %".to_owned(),
            symbol => format!("in {symbol}"),
        }
    }
}

impl From<Recorded> for Unit {
    fn from(unit: Recorded) -> Self {
        let dimension = Dimension(unit.dimension());
        if unit.is_typed() {
            return Self { dimension, per_base: unit.per_base(), symbol: unit.word().into() };
        }
        Self::of_dimension(dimension)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_ends_with_its_unit() {
        let symbol = |unit: Option<Unit>| unit.map(|unit| unit.symbol().to_owned());
        assert_eq!(symbol(Unit::of_name("sigma_m")).as_deref(), Some("m"));
        assert_eq!(symbol(Unit::of_name("covariance_px2")).as_deref(), Some("px²"));
        assert_eq!(symbol(Unit::of_name("roll_deg")).as_deref(), Some("deg"));
        assert_eq!(symbol(Unit::of_name("ncc")), None);
        assert_eq!(symbol(Unit::of_name("position_in_rover")).as_deref(), Some("m"));
    }

    #[test]
    fn every_unit_of_the_record_converts_with_its_dimension() {
        for unit in Recorded::all() {
            let own = Unit::from(unit);
            assert_eq!((own.dimension.0, own.per_base()), (unit.dimension(), unit.per_base()), "{unit:?}");
        }
        assert_eq!(Unit::from(Recorded::SquareMetre).symbol(), "m²");
        assert_eq!(Unit::from(Recorded::MetrePerPixel).symbol(), "m/px");
        assert_eq!(Unit::from(Recorded::Degree).symbol(), "deg");
    }

    #[test]
    fn units_multiply_divide_and_have_roots() {
        let (m, px) = (Unit::of_word("m").unwrap(), Unit::of_word("px").unwrap());
        assert_eq!(m.times(&px, -1).unwrap().symbol(), "m/px");
        assert_eq!(m.times(&m, 1).unwrap().root().unwrap(), m);
        assert_eq!(m.times(&m, -1).unwrap(), Unit::NONE);
        assert_eq!(Unit::NONE.times(&px, -1).unwrap().symbol(), "1/px");
        assert!(m.root().is_none());
    }

    #[test]
    fn a_converted_number_is_the_same_bits_as_the_number_in_metres() {
        let cm = Unit::of_word("cm").unwrap();
        for hundredths in 0..2000_u32 {
            let written: f64 = format!("{}.{:02}", hundredths / 100, hundredths % 100).parse().unwrap();
            assert_eq!(cm.to_base(f64::from(hundredths)).to_bits(), written.to_bits(), "{hundredths} cm");
        }
    }
}
