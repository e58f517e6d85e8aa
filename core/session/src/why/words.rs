//! Numbers in explanations: the rule of [`crate::format`], with a word for a value that does not exist.

use crate::format;

/// A number by the common rule; `none` if it is not finite.
pub fn number(value: f64) -> String {
    if value.is_finite() { format::number(value) } else { "none".to_owned() }
}

/// The same with its sign.
pub fn signed(value: f64) -> String {
    if value > 0.0 { format!("+{}", number(value)) } else { number(value) }
}

/// Two numbers with as many digits as it takes to see that they differ.
pub fn told_apart(a: f64, b: f64) -> [String; 2] {
    if a.is_finite() && b.is_finite() { format::distinct(a, b) } else { [number(a), number(b)] }
}
