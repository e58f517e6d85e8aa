//! Numbers as a person reads them.

/// Three significant digits, or all of a whole number; no exponent for what is between a ten-thousandth and ten million.
pub fn number(value: f64) -> String {
    let size = value.abs();
    match size {
        _ if !value.is_finite() => "none".to_owned(),
        _ if size == 0.0 => "0".to_owned(),
        _ if !(1e-4..1e7).contains(&size) => format!("{value:.2e}"),
        _ if size >= 100.0 => format!("{value:.0}"),
        _ if size >= 10.0 => format!("{value:.1}"),
        _ if size >= 1.0 => format!("{value:.2}"),
        _ => {
            // The first digit that is not 0, and two more.
            let decimals = (2.0 - size.log10().floor()).clamp(2.0, 7.0) as usize;
            format!("{value:.decimals$}")
        }
    }
}

/// The same with its sign.
pub fn signed(value: f64) -> String {
    if value > 0.0 { format!("+{}", number(value)) } else { number(value) }
}

/// Two numbers with so many digits that they do not read the same.
pub fn told_apart(a: f64, b: f64) -> [String; 2] {
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
    fn numbers_keep_three_digits_that_say_something() {
        let cases = [
            (0.7, "0.700"),
            (0.0123, "0.0123"),
            (12.345, "12.3"),
            (0.0, "0"),
            (27.0, "27.0"),
            (1234.5, "1234"),
        ];
        for (value, expected) in cases {
            assert_eq!(number(value), expected);
        }
        assert_eq!(signed(0.25), "+0.250");
        assert_eq!(signed(-3.0), "-3.00");
    }

    #[test]
    fn a_value_just_below_its_limit_does_not_read_like_it() {
        assert_eq!(told_apart(0.7, 0.699_98), ["0.70000", "0.69998"]);
        assert_eq!(told_apart(0.71, 0.8), ["0.710", "0.800"]);
    }
}
