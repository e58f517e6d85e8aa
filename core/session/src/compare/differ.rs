//! The differences of two records: each differing value with its path, its unit and both sides.
//!
//! Units follow from the names of fields (`_px`, `_m`, …); gates record their own unit. Numbers are equal if their bits are
//! equal, or if they differ by no more than the tolerance that is given for their unit.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use utoipa::ToSchema;

use sightline_geometry::error::{Error, Result};

/// The units for which a tolerance may be given, as typed and as shown.
pub const UNITS: [(&str, &str); 8] = [
    ("px2", "px²"),
    ("px", "px"),
    ("m2", "m²"),
    ("m", "m"),
    ("rad", "rad"),
    ("deg", "°"),
    ("s", "s"),
    ("1", ""),
];

/// The largest difference at which values still count as equal, by unit.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tolerance(BTreeMap<&'static str, f64>);

impl Tolerance {
    /// Reads tolerances by unit.
    ///
    /// # Errors
    /// [`Error::Request`] for an unknown unit, or a tolerance that is negative or not finite.
    pub fn new(by_unit: &BTreeMap<String, f64>) -> Result<Self> {
        let mut found = BTreeMap::new();
        for (unit, tolerance) in by_unit {
            let Some((_, shown)) = UNITS.iter().find(|(typed, shown)| typed == unit || shown == unit) else {
                let known: Vec<&str> = UNITS.iter().map(|(typed, _)| *typed).collect();
                let known = known.join(", ");
                return Err(Error::Request(format!(
                    "tolerance: there is no unit {unit}; the units are {known}"
                )));
            };
            if !tolerance.is_finite() || *tolerance < 0.0 {
                return Err(Error::Request(format!(
                    "tolerance: {unit} must be a number from 0 on, not {tolerance}"
                )));
            }
            found.insert(*shown, *tolerance);
        }
        Ok(Self(found))
    }

    /// Whether all tolerances are zero, so that values must be equal in every bit.
    pub fn is_exact(&self) -> bool {
        self.0.values().all(|tolerance| *tolerance == 0.0)
    }

    /// Whether two numbers of a unit count as equal.
    pub fn holds(&self, unit: &str, a: f64, b: f64) -> bool {
        match self.0.get(unit) {
            Some(tolerance) if *tolerance > 0.0 => (a - b).abs() <= *tolerance,
            _ => a.to_bits() == b.to_bits(),
        }
    }
}

/// A value that differs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Difference {
    /// Its path in the record: names of fields, separated by dots.
    pub path: String,
    /// Its unit; empty for pure numbers and words.
    pub unit: String,
    /// The first run's value; null if it has none.
    #[schema(value_type = Value)]
    pub a: Value,
    /// The other run's value; null if it has none.
    #[schema(value_type = Value)]
    pub b: Value,
    /// `b` minus `a`; for lists of numbers the Euclidean norm of the difference; null if not numeric.
    pub delta: Option<f64>,
}

/// All values in which two records differ.
pub fn differences(a: &Value, b: &Value, tolerance: &Tolerance) -> Vec<Difference> {
    let mut found = Vec::new();
    walk("", "", a, b, tolerance, &mut found);
    found
}

fn walk(path: &str, unit: &str, a: &Value, b: &Value, tolerance: &Tolerance, found: &mut Vec<Difference>) {
    match (a, b) {
        (Value::Object(a), Value::Object(b)) => {
            for key in a.keys().chain(b.keys()).collect::<BTreeSet<_>>() {
                let [left, right] = [a, b].map(|side| side.get(key).unwrap_or(&Value::Null));
                let inner = unit_in(key, a, unit);
                walk(&joined(path, key), &inner, left, right, tolerance, found);
            }
        }
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() && !numbers(a, b) => {
            for (i, (left, right)) in a.iter().zip(b).enumerate() {
                // Items are identified by their name if both have the same one, else by their index.
                let name = |item: &Value| item.get("name").and_then(Value::as_str).map(str::to_owned);
                let key = name(left).filter(|key| name(right).as_ref() == Some(key));
                let key = key.unwrap_or_else(|| i.to_string());
                walk(&joined(path, &key), unit, left, right, tolerance, found);
            }
        }
        _ if is_equal(unit, a, b, tolerance) => {}
        _ => {
            let delta = delta(a, b);
            found.push(Difference {
                path: path.to_owned(),
                unit: unit.to_owned(),
                a: a.clone(),
                b: b.clone(),
                delta,
            });
        }
    }
}

fn joined(path: &str, key: &str) -> String {
    if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") }
}

fn numbers(a: &[Value], b: &[Value]) -> bool {
    a.iter().chain(b).all(Value::is_number)
}

fn is_equal(unit: &str, a: &Value, b: &Value, tolerance: &Tolerance) -> bool {
    match (a, b) {
        (Value::Number(a), Value::Number(b)) => match (a.as_f64(), b.as_f64()) {
            (Some(a), Some(b)) => tolerance.holds(unit, a, b),
            _ => a == b,
        },
        (Value::Array(a), Value::Array(b)) => {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| is_equal(unit, a, b, tolerance))
        }
        _ => a == b,
    }
}

fn delta(a: &Value, b: &Value) -> Option<f64> {
    match (a, b) {
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            let squares = a.iter().zip(b).map(|(a, b)| Some((b.as_f64()? - a.as_f64()?).powi(2)));
            squares.sum::<Option<f64>>().map(f64::sqrt)
        }
        _ => Some(b.as_f64()? - a.as_f64()?),
    }
}

/// The unit of a field: the one recorded in a gate, else the one that its name ends with, else that of the enclosing record.
fn unit_in(key: &str, record: &Map<String, Value>, around: &str) -> String {
    let said = record.get("unit").and_then(Value::as_str);
    if let Some(said) = said.filter(|_| matches!(key, "value" | "limit" | "margin")) {
        return said.to_owned();
    }
    unit_of(key).unwrap_or(around).to_owned()
}

/// The unit that follows from a field's name.
pub(crate) fn unit_of(key: &str) -> Option<&'static str> {
    let is_pixel = key.contains("pixel") || matches!(key, "predicted_left" | "predicted_right");
    match key {
        _ if key.starts_with("covariance_in_") => Some("m²"),
        _ if key.ends_with("_in_rover") || key.ends_with("_in_site") => Some("m"),
        // A derivative with respect to a pixel is not in px.
        _ if is_pixel && !key.contains("by_pixel") => Some("px"),
        _ => UNITS
            .iter()
            .find(|(typed, _)| key.strip_suffix(typed).is_some_and(|name| name.ends_with('_')))
            .map(|(_, shown)| *shown),
    }
}

/// A path in words: without dots, underscores and final unit.
pub fn words_of(path: &str) -> String {
    let stem =
        UNITS.iter().find_map(|(typed, _)| path.strip_suffix(typed)?.strip_suffix('_')).unwrap_or(path);
    stem.replace(['_', '.'], " ")
}

/// Formats two values with as many digits as are needed to distinguish them.
pub fn told_apart(a: &Value, b: &Value) -> [String; 2] {
    // Numbers with few decimals, as a person writes them, keep all their digits.
    let written = [a, b].map(decimals_of).into_iter().max().filter(|&count| count <= 6).unwrap_or_default();
    let with = |decimals: usize| [a, b].map(|value| word(value, decimals));
    let apart = (written.max(3)..=12).map(with).find(|[a, b]| a != b);
    apart.unwrap_or_else(|| [a, b].map(ToString::to_string))
}

/// Number of decimals of the shortest representation of a number.
fn decimals_of(value: &Value) -> usize {
    value.as_f64().and_then(|number| Some(number.to_string().split_once('.')?.1.len())).unwrap_or_default()
}

fn word(value: &Value, decimals: usize) -> String {
    match value {
        Value::Null => "none".to_owned(),
        Value::Bool(is) => if *is { "yes" } else { "no" }.to_owned(),
        Value::Number(number) if number.is_f64() => {
            number.as_f64().map_or_else(String::new, |number| format!("{number:.decimals$}"))
        }
        Value::String(text) => text.clone(),
        Value::Array(list) if list.len() <= 3 => {
            format!("({})", list.iter().map(|v| word(v, decimals)).collect::<Vec<_>>().join(", "))
        }
        Value::Array(list) => format!("{} values", list.len()),
        Value::Object(_) => "a record".to_owned(),
        Value::Number(_) => value.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn tolerance(unit: &str, value: f64) -> Result<Tolerance> {
        Tolerance::new(&[(unit.to_owned(), value)].into())
    }

    #[test]
    fn a_difference_of_one_bit_is_found_and_a_tolerance_of_its_unit_covers_it() {
        let near = f64::from_bits(1.5_f64.to_bits() + 1);
        let (a, b) = (json!({ "at": { "range_m": 1.5 } }), json!({ "at": { "range_m": near } }));
        let found = differences(&a, &b, &Tolerance::default());
        assert_eq!((found.len(), found[0].path.as_str(), found[0].unit.as_str()), (1, "at.range_m", "m"));
        // One unit in the last place of 1.5.
        assert_eq!(found[0].delta, Some(f64::EPSILON));
        assert!(differences(&a, &b, &tolerance("m", 1e-9).unwrap()).is_empty());
        assert_eq!(differences(&a, &b, &tolerance("px", 1e-9).unwrap()).len(), 1, "of another unit");
    }

    #[test]
    fn a_gate_is_known_by_its_name_and_says_its_unit() {
        let gate = |limit: f64| json!({ "gates": [{ "name": "far", "unit": "m", "limit": limit }] });
        let found = differences(&gate(1.0), &gate(1.25), &Tolerance::default());
        assert_eq!((found[0].path.as_str(), found[0].unit.as_str()), ("gates.far.limit", "m"));
        assert_eq!(found[0].delta, Some(0.25));
    }

    #[test]
    fn a_vector_is_one_value_and_its_difference_has_a_length() {
        let (a, b) = (
            json!({ "position_in_rover": [1.0, 2.0, 3.0] }),
            json!({ "position_in_rover": [1.0, 5.0, 7.0] }),
        );
        let found = differences(&a, &b, &Tolerance::default());
        assert_eq!((found.len(), found[0].delta, found[0].unit.as_str()), (1, Some(5.0), "m"));
        let missing = differences(&a, &json!({}), &Tolerance::default());
        assert_eq!((&missing[0].b, missing[0].delta), (&Value::Null, None));
    }

    #[test]
    fn units_are_those_of_the_names() {
        let units = [
            "gap_m",
            "covariance_px2",
            "covariance_in_rover",
            "left_pixel",
            "roll_rad",
            "time_s",
            "score",
            "scale",
        ];
        let expected = [Some("m"), Some("px²"), Some("m²"), Some("px"), Some("rad"), Some("s"), None, None];
        assert_eq!(units.map(unit_of), expected);
        assert_eq!(words_of("scale_roll.applied_roll_rad"), "scale roll applied roll");
    }

    #[test]
    fn an_unknown_unit_and_a_negative_tolerance_are_refused_by_name() {
        let message = tolerance("mm", 1.0).unwrap_err().to_string();
        assert!(message.contains("mm") && message.contains("px2"), "{message}");
        assert!(tolerance("m", -1.0).unwrap_err().to_string().contains("-1"));
        assert!(tolerance("m", f64::NAN).is_err());
    }

    #[test]
    fn two_values_have_the_digits_that_tell_them_apart() {
        assert_eq!(told_apart(&json!(1.108), &json!(1.0)), ["1.108", "1.000"]);
        assert_eq!(told_apart(&json!(0.7), &json!(0.9999)), ["0.7000", "0.9999"]);
        assert_eq!(told_apart(&json!(1.0 / 3.0), &json!(2.0 / 3.0)), ["0.333", "0.667"]);
        assert_eq!(told_apart(&json!(0.70001), &json!(0.70002)), ["0.70001", "0.70002"]);
        assert_eq!(told_apart(&json!(3), &Value::Null), ["3", "none"]);
    }
}
