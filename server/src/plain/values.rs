//! The record of a stage as rows of a table: name, value, unit. The unit is what the name ends with.

use serde_json::Value;

/// Lists of more numbers than these are counted, not listed.
const MOST_LISTED: usize = 9;

/// The values of a record, those of records inside it under their names.
pub(super) fn rows(record: &Value) -> Vec<Vec<String>> {
    let mut rows = Vec::new();
    collect("", record, &mut rows);
    rows
}

fn collect(name: &str, value: &Value, rows: &mut Vec<Vec<String>>) {
    match value {
        Value::Object(fields) => {
            for (field, value) in fields {
                let name = if name.is_empty() { field.clone() } else { format!("{name}, {field}") };
                collect(&name, value, rows);
            }
        }
        value => rows.push(vec![name.replace('_', " "), words(value), unit(name).to_owned()]),
    }
}

fn words(value: &Value) -> String {
    match value {
        Value::Null => "–".to_owned(),
        Value::Bool(true) => "yes".to_owned(),
        Value::Bool(false) => "no".to_owned(),
        Value::Number(number) => number
            .as_f64()
            .filter(|_| !number.is_i64() && !number.is_u64())
            .map_or_else(|| number.to_string(), digits),
        Value::String(text) => text.clone(),
        Value::Array(values) if values.is_empty() => "none".to_owned(),
        Value::Array(values)
            if values.len() <= MOST_LISTED && values.iter().all(|v| !v.is_object() && !v.is_array()) =>
        {
            values.iter().map(words).collect::<Vec<_>>().join(", ")
        }
        Value::Array(values) => format!("{} entries", values.len()),
        Value::Object(_) => String::new(),
    }
}

/// A number with as many digits as make sense for its size.
pub(super) fn digits(value: f64) -> String {
    match value.abs() {
        size if size < 1e-12 => "0".to_owned(),
        size if !(1e-3..1e7).contains(&size) => format!("{value:.3e}"),
        size if size >= 100.0 => format!("{value:.2}"),
        size if size >= 1.0 => format!("{value:.3}"),
        _ => format!("{value:.4}"),
    }
}

/// The unit that a name ends with.
pub(super) fn unit(name: &str) -> &'static str {
    // Pixels and points bear their frame, their coordinates only an axis.
    let name =
        name.rsplit_once(", ").map_or(name, |(outer, inner)| if inner.len() == 1 { outer } else { inner });
    if name.starts_with("covariance_in_") {
        return "m²";
    }
    if name.starts_with("position_in_") {
        return "m";
    }
    match name.rsplit('_').next().unwrap_or_default() {
        "m" => "m",
        "px" | "pixel" => "px",
        "px2" => "px²",
        "m2" => "m²",
        "rad" => "rad",
        "deg" => "deg",
        "s" => "s",
        _ => "",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_becomes_names_values_and_units() {
        let record = serde_json::json!({
            "range_m": 5.25, "pixel": { "x": 1.5, "y": 2 }, "curve": [{ "a": 1 }, { "a": 2 }], "missing": null,
            "covariance_in_rover": [1, 0, 0, 0, 1, 0, 0, 0, 1]
        });
        let rows = rows(&record);
        let find = |name: &str| rows.iter().find(|row| row[0] == name).unwrap().clone();
        assert_eq!(find("range m"), ["range m", "5.250", "m"]);
        assert_eq!(find("pixel, x"), ["pixel, x", "1.500", "px"]);
        assert_eq!(find("curve"), ["curve", "2 entries", ""]);
        assert_eq!(find("missing")[1], "–");
        assert_eq!(find("covariance in rover")[2], "m²");
    }
}
