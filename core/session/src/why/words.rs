//! Text of explanations: numbers by the rule of [`crate::format`], and the display names of settings.

use sightline_record::{Unit, label};
use sightline_track::locate::gate_kinds;

use super::gates;
use crate::format;

/// A number by the common rule; `none` if it is not finite.
pub fn number(value: f64) -> String {
    if value.is_finite() { format::number(value) } else { "none".to_owned() }
}

/// A number with its sign, by the common rule.
pub fn signed(value: f64) -> String {
    if value > 0.0 { format!("+{}", number(value)) } else { number(value) }
}

/// Two numbers with as many digits as are needed to distinguish them.
pub fn told_apart(a: f64, b: f64) -> [String; 2] {
    if a.is_finite() && b.is_finite() { format::distinct(a, b) } else { [number(a), number(b)] }
}

/// Words with a capital first letter.
pub fn capitalised(words: &str) -> String {
    let mut letters = words.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// The display name of a setting: from its gate if it is the limit of exactly one, else its key in words.
pub fn setting_name(key: &str) -> String {
    let mut own = gate_kinds().into_iter().filter(|kind| kind.setting == Some(key));
    match (own.next(), own.next()) {
        (Some(kind), None) => format!("{} limit", gates::label(kind.name)),
        _ => label(key, Unit::of_name(key).unwrap_or(Unit::One)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_setting_is_named_like_its_gate() {
        assert_eq!(setting_name("ncc_min"), "match score limit");
        assert_eq!(setting_name("far_ncc_min"), "far match score limit");
        assert_eq!(setting_name("search_window_px"), "search window");
        assert_eq!(setting_name("tolerance_factor"), "tolerance factor");
    }
}
