//! Numbers as text: the common rule for digits in the viewer, explanations, plain pages and reports.
//!
//! | magnitude | digits | example |
//! |---|---|---|
//! | whole number below 10⁹ | all of them | `12` |
//! | below 10⁻¹² | rounding of a computation, shown as zero | `0` |
//! | below 10⁻³, or at least 10⁷ | three significant digits with an exponent | `1.20e-4` |
//! | below 1 | three significant digits | `0.0123` |
//! | below 1000 | four significant digits | `123.5` |
//! | below 10⁷ | one decimal | `1234.5` |
//!
//! Files for programs (CSV, JSON, Parquet) do not use this rule: they contain all digits.

/// Values below this are rounding errors of a computation in metres or pixels.
const ROUNDING: f64 = 1e-12;

/// Formats a number by the rule of this module.
pub fn number(value: f64) -> String {
    let size = value.abs();
    match size {
        _ if size < ROUNDING => "0".to_owned(),
        _ if value == value.trunc() && size < 1e9 => format!("{value:.0}"),
        _ if !(1e-3..1e7).contains(&size) => format!("{value:.2e}"),
        _ if size >= 100.0 => format!("{value:.1}"),
        _ if size >= 10.0 => format!("{value:.2}"),
        _ if size >= 1.0 => format!("{value:.3}"),
        _ => {
            // The first digit that is not zero, and two more.
            let decimals = (2.0 - size.log10().floor()).clamp(3.0, 5.0) as usize;
            format!("{value:.decimals$}")
        }
    }
}

/// Formats a number with its sign, also when it is positive.
pub fn signed(value: f64) -> String {
    if value > 0.0 { format!("+{}", number(value)) } else { number(value) }
}

/// Formats a number followed by its unit, if it has one.
pub fn quantity(value: f64, unit: &str) -> String {
    match unit {
        "" => number(value),
        "°" => format!("{}°", number(value)),
        unit => format!("{} {unit}", number(value)),
    }
}

/// Formats two numbers with as many digits as are needed to distinguish them.
pub(crate) fn distinct(a: f64, b: f64) -> [String; 2] {
    let plain = [number(a), number(b)];
    if plain[0] != plain[1] || a == b {
        return plain;
    }
    let digits = (3..=12).find(|&digits| format!("{a:.digits$}") != format!("{b:.digits$}"));
    digits.map_or(plain, |digits| [format!("{a:.digits$}"), format!("{b:.digits$}")])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_follow_the_magnitude() {
        let cases = [
            (0.0, "0"),
            (12.0, "12"),
            (0.7, "0.700"),
            (0.71234, "0.712"),
            (0.0123, "0.0123"),
            (0.001_234, "0.00123"),
            (0.00012, "1.20e-4"),
            (-2.71734, "-2.717"),
            (12.345, "12.35"),
            (123.456, "123.5"),
            (1234.5, "1234.5"),
            (1.5e7, "15000000"),
            (1.234_567e9 + 0.5, "1.23e9"),
            (-6.2e-18, "0"),
        ];
        for (value, expected) in cases {
            assert_eq!(number(value), expected, "{value:e}");
        }
        assert_eq!(number(f64::NAN), "NaN");
    }

    #[test]
    fn signs_and_units_surround_the_number() {
        assert_eq!(signed(0.25), "+0.250");
        assert_eq!(signed(-3.0), "-3");
        assert_eq!(quantity(123.456, "px"), "123.5 px");
        assert_eq!(quantity(2.5, "°"), "2.500°");
        assert_eq!(quantity(0.7, ""), "0.700");
    }

    #[test]
    fn a_value_just_below_its_limit_reads_differently() {
        assert_eq!(distinct(0.7, 0.699_98), ["0.70000", "0.69998"]);
        assert_eq!(distinct(0.71, 0.8), ["0.710", "0.800"]);
    }
}
