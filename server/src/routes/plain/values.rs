//! The record of a stage as rows of a table: name, value, unit.

use serde_json::Value;
use sightline_record::{Stage, Unit};
use sightline_session::format;
use sightline_session::records;
use sightline_session::step::RunStep;

/// Longer lists of numbers are not printed; only their length is.
const MOST_LISTED: usize = 9;

/// The quantities of a stage, then the rest of its evidence, except fields named in `without`, at any depth.
pub(super) fn rows(stage: &Stage<RunStep>, trace: &RunStep, without: &[&str]) -> Vec<Vec<String>> {
    let schema = stage.schema();
    let row = |(index, quantity): (usize, &sightline_record::Quantity)| {
        let value = serde_json::to_value(stage.value(trace, index)).unwrap_or_default();
        vec![in_words(&quantity.name), words(&value), quantity.unit.symbol().to_owned()]
    };
    let mut rows: Vec<Vec<String>> = schema.quantities.iter().enumerate().map(row).collect();
    collect(&schema.path, "", &records::rest(stage, trace), without, &mut rows);
    rows
}

/// Collects the values of the evidence at a path, and those of nested records with their names.
fn collect(path: &str, around: &str, value: &Value, without: &[&str], rows: &mut Vec<Vec<String>>) {
    match value {
        Value::Object(fields) => {
            for (field, value) in fields.iter().filter(|(field, _)| !without.contains(&field.as_str())) {
                let dot = if around.is_empty() { "" } else { "." };
                collect(path, &format!("{around}{dot}{field}"), value, without, rows);
            }
        }
        value => {
            rows.push(vec![in_words(around), words(value), unit(&format!("{path}.{around}")).to_owned()]);
        }
    }
}

/// The name of a field, with commas between nested records.
fn in_words(name: &str) -> String {
    name.replace('.', ", ").replace('_', " ")
}

fn words(value: &Value) -> String {
    match value {
        Value::Null => "–".to_owned(),
        Value::Bool(true) => "yes".to_owned(),
        Value::Bool(false) => "no".to_owned(),
        Value::Number(number) => number
            .as_f64()
            .filter(|_| !number.is_i64() && !number.is_u64())
            .map_or_else(|| number.to_string(), format::number),
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

/// The declared unit of the field at a path; components have the unit of the whole.
fn unit(path: &str) -> &'static str {
    let whole = path.rsplit_once('.').filter(|(_, part)| part.len() == 1).map_or(path, |(whole, _)| whole);
    records::unit_at(whole).map_or("", Unit::symbol)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_becomes_names_values_and_units() {
        let record = serde_json::json!({
            "range_m": 5.25, "left_pixel": { "x": 1.5, "y": 2 }, "curve": [{ "a": 1 }, { "a": 2 }], "missing": null,
            "covariance_in_rover": [1, 0, 0, 0, 1, 0, 0, 0, 1], "camera": { "C": 1 }
        });
        let mut rows = Vec::new();
        collect("locate", "", &record, &["camera"], &mut rows);
        let find = |name: &str| rows.iter().find(|row| row[0] == name).unwrap().clone();
        assert_eq!(find("range m"), ["range m", "5.250", "m"]);
        assert_eq!(find("left pixel, x"), ["left pixel, x", "1.500", "px"]);
        assert_eq!(find("curve"), ["curve", "2 entries", ""]);
        assert_eq!(find("missing")[1], "–");
        assert_eq!(find("covariance in rover")[2], "m²");
        assert_eq!(rows.len(), 6, "without the camera");
    }
}
