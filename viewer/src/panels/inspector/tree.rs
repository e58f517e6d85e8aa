//! The evidence of a stage that is not a declared quantity, as a tree: plain values first, then nested records and lists.

use egui::{CollapsingHeader, RichText, Ui};
use serde_json::Value;
use sightline_record::{Unit, label, unit_label};
use sightline_session::{records, why};

use super::RecordedStage;
use super::quantities::{matrix, with_degrees};
use crate::command::Command;
use crate::panels::{digits, numbers};
use crate::theme;

/// The position of an entry in the evidence of a stage.
pub(super) struct EvidencePath {
    /// The stage.
    pub(super) stage: RecordedStage,
    /// Names of fields with dots between; empty for the evidence itself.
    pub(super) path: String,
    /// The step.
    pub(super) step: usize,
}

impl EvidencePath {
    /// The position of a field.
    fn field(&self, key: &str) -> Self {
        let dot = if self.path.is_empty() { "" } else { "." };
        Self { path: format!("{}{dot}{key}", self.path), ..*self }
    }

    /// The name by which the panel “Why” explains it.
    fn explained_name(&self) -> String {
        format!("{}.{}", self.stage.schema().stage, self.path)
    }

    /// The unit that the stage declares, else the unit of the value's kind.
    fn unit(&self, value: &Value) -> Unit {
        let found = records::unit_at(&format!("{}.{}", self.stage.schema().path, self.path));
        found.unwrap_or(if records::is_pixel(value) { Unit::Pixel } else { Unit::One })
    }
}

/// Shows the fields of a record, plain values first.
pub(super) fn entries(ui: &mut Ui, at: &EvidencePath, record: &Value, out: &mut Vec<Command>) {
    let Some(fields) = record.as_object() else {
        ui.label(theme::number(record.to_string()));
        return;
    };
    let (plain, nested): (Vec<_>, Vec<_>) = fields
        .iter()
        .filter(|(_, value)| !is_empty(value))
        .partition(|(key, value)| words(key, value).is_some());
    egui::Grid::new(ui.next_auto_id()).num_columns(2).spacing([10.0, 2.0]).show(ui, |ui| {
        for (key, value) in plain {
            let (at, words) = (at.field(key), words(key, value).unwrap_or_default());
            let unit = at.unit(value);
            name_of(ui, &at, &label(key, unit), &words, out);
            ui.horizontal_wrapped(|ui| {
                ui.spacing_mut().item_spacing.x = 4.0;
                ui.label(theme::number(words));
                ui.label(theme::note(unit_label(key, unit)));
            });
            ui.end_row();
        }
    });
    for (key, value) in nested {
        let at = at.field(key);
        let unit = at.unit(value);
        let list = value.as_array().filter(|_| !is_matrix(key, value));
        let count = list.map(|list| format!(" ({})", list.len())).unwrap_or_default();
        let header = format!("{}{count} {}", label(key, unit), unit_label(key, unit));
        let header = RichText::new(header.trim_end().to_owned()).size(12.0).color(theme::text());
        CollapsingHeader::new(header).id_salt(key).default_open(is_small(key, value)).show(ui, |ui| {
            if why::is_explained(&at.explained_name()) {
                let link = ui.link(RichText::new("why").small());
                numbers::explain_on_click(&link, at.step, &at.explained_name(), &value.to_string(), out);
            }
            children(ui, &at, key, value, out);
        });
    }
}

/// The name of an entry, with a link to its origin if that is explained.
fn name_of(ui: &mut Ui, at: &EvidencePath, name: &str, value: &str, out: &mut Vec<Command>) {
    if why::is_explained(&at.explained_name()) {
        let link = ui.link(RichText::new(name).size(12.0));
        numbers::explain_on_click(&link, at.step, &at.explained_name(), value, out);
    } else {
        ui.label(theme::label(name).size(12.0));
    }
}

fn children(ui: &mut Ui, at: &EvidencePath, key: &str, value: &Value, out: &mut Vec<Command>) {
    match value {
        Value::Array(list) if is_matrix(key, value) => {
            // Serialised as one list, column by column.
            let side = list.len().isqrt();
            let at = |row: usize, column: usize| list[column * side + row].as_f64().unwrap_or(f64::NAN);
            let row = |row: usize| (0..side).map(|column| at(row, column)).collect();
            matrix(ui, &(0..side).map(row).collect::<Vec<_>>());
        }
        Value::Array(list) => {
            for (i, item) in list.iter().enumerate() {
                let step = || item.get("step").map(|step| format!("step {step}"));
                let name = item.get("name").and_then(Value::as_str).map(str::to_owned);
                let title = name.or_else(step).unwrap_or_else(|| i.to_string());
                if item.is_object() {
                    CollapsingHeader::new(RichText::new(title).size(12.0))
                        .id_salt(i)
                        .show(ui, |ui| entries(ui, at, item, out));
                } else {
                    ui.label(theme::number(item.to_string()));
                }
            }
        }
        _ => entries(ui, at, value, out),
    }
}

/// Whether an entry has nothing to show.
fn is_empty(value: &Value) -> bool {
    match value {
        Value::Null => true,
        Value::Array(list) => list.is_empty(),
        Value::Object(fields) => fields.values().all(is_empty),
        _ => false,
    }
}

/// Whether a record is short enough to be open initially.
fn is_small(key: &str, value: &Value) -> bool {
    match value {
        Value::Array(_) => is_matrix(key, value),
        Value::Object(fields) => fields.len() <= 8,
        _ => true,
    }
}

/// Whether a list is a square matrix.
fn is_matrix(key: &str, value: &Value) -> bool {
    let is_named = key.contains("covariance") || key.contains("_from_");
    is_named
        && value
            .as_array()
            .is_some_and(|list| matches!(list.len(), 4 | 9 | 36) && list.iter().all(Value::is_number))
}

/// A value that fits on a line; `None` for records and long lists.
fn words(key: &str, value: &Value) -> Option<String> {
    match value {
        Value::Bool(is) => Some(if *is { "yes" } else { "no" }.to_owned()),
        Value::Number(number) => {
            Some(with_degrees(number.as_f64()?, Unit::of_name(key).unwrap_or(Unit::One)))
        }
        Value::String(text) => Some(text.clone()),
        Value::Array(list)
            if list.len() <= 4 && !is_matrix(key, value) && list.iter().all(Value::is_number) =>
        {
            Some(list.iter().filter_map(Value::as_f64).map(digits).collect::<Vec<_>>().join("  "))
        }
        Value::Object(fields) if records::is_pixel(value) => {
            let [x, y] = ["x", "y"].map(|k| fields[k].as_f64().unwrap_or(f64::NAN));
            Some(format!("{x:.2}, {y:.2}"))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn values_read_like_values() {
        assert_eq!(words("roll_rad", &json!(0.1)).unwrap(), "0.100 (5.73°)");
        assert_eq!(words("pixel", &json!({"x": 1.25, "y": 2.0})).unwrap(), "1.25, 2.00");
        assert_eq!(words("position_in_rover", &json!([1.0, 2.5, -0.2])).unwrap(), "1  2.500  -0.200");
        for empty in [Value::Null, json!([]), json!({ "left": null, "right": [] })] {
            assert!(is_empty(&empty), "{empty}");
        }
        assert!(!is_empty(&json!({ "left": 0 })));
        assert!(words("peak", &json!({"score": 1, "x": 2})).is_none());
        assert!(words("covariance_px2", &json!([1.0, 0.0, 0.0, 1.0])).is_none());
    }

    #[test]
    fn units_of_fields_are_declared_or_in_their_names() {
        let at = |stage: &str, path: &str| EvidencePath {
            stage: records::stage(stage).unwrap(),
            path: path.to_owned(),
            step: 0,
        };
        assert_eq!(at("match_template", "peak.integer").unit(&json!([1, 2])), Unit::Pixel);
        assert_eq!(at("match_template", "edge_distance_px").unit(&json!(1.0)), Unit::Pixel);
        assert_eq!(at("point_stereo", "curve.pixel").unit(&json!({"x": 1.0, "y": 2.0})), Unit::Pixel);
        assert_eq!(at("point_mast", "left.C").unit(&json!([0.0, 0.0, 0.0])), Unit::Metre);
        assert_eq!(at("judge", "reason").unit(&Value::Null), Unit::One);
    }
}
