//! The serialised evidence of a stage, for views that show all of it: the quantities, then the rest as a tree.

use serde_json::Value;

use sightline_record::Stage;

use super::stages;
use crate::step::RunStep;

/// The evidence of a stage without that of nested stages; for a stage without its own evidence, its quantities.
pub fn evidence(stage: &Stage<RunStep>, step: &RunStep) -> Value {
    let schema = stage.schema();
    let Some(mut evidence) = stage.evidence(step) else {
        let values = schema.quantities.iter().enumerate().filter_map(|(index, quantity)| {
            Some((quantity.name.to_string(), serde_json::to_value(stage.value(step, index)).ok()?))
        });
        return Value::Object(values.collect());
    };
    for other in stages().iter().flat_map(|other| other.schema().paths()) {
        for inside in schema.paths().filter_map(|own| other.strip_prefix(own)?.strip_prefix('.')) {
            remove(&mut evidence, inside, |_| true);
        }
    }
    evidence
}

/// The evidence that is not a quantity of the stage.
pub fn rest(stage: &Stage<RunStep>, step: &RunStep) -> Value {
    let mut rest = evidence(stage, step);
    for quantity in &stage.schema().quantities {
        // A record of several fields contains more than the quantity with its name.
        remove(&mut rest, &quantity.name, |value| !value.is_object() || is_pixel(value));
    }
    drop_empty(&mut rest);
    rest
}

/// Whether a value is a pixel.
pub fn is_pixel(value: &Value) -> bool {
    value.as_object().is_some_and(|f| f.len() == 2 && f.contains_key("x") && f.contains_key("y"))
}

fn remove(tree: &mut Value, path: &str, is_meant: impl Fn(&Value) -> bool) {
    let (around, field) = path.rsplit_once('.').unwrap_or(("", path));
    let place = around.split('.').filter(|part| !part.is_empty()).map(|part| format!("/{part}"));
    let fields = tree.pointer_mut(&place.collect::<String>()).and_then(Value::as_object_mut);
    if let Some(fields) = fields.filter(|fields| fields.get(field).is_some_and(is_meant)) {
        fields.remove(field);
    }
}

/// Removes records that have become empty.
fn drop_empty(tree: &mut Value) {
    if let Some(fields) = tree.as_object_mut() {
        fields.values_mut().for_each(drop_empty);
        fields.retain(|_, value| value.as_object().is_none_or(|fields| !fields.is_empty()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_field_is_removed_at_its_path_and_empty_records_with_it() {
        let mut tree =
            json!({ "peak": { "score": 1.0 }, "state": { "state": "lost", "count": 1 }, "left": 2 });
        for path in ["peak.score", "left", "nothing.at_all"] {
            remove(&mut tree, path, |_| true);
        }
        remove(&mut tree, "state", |value| !value.is_object());
        drop_empty(&mut tree);
        assert_eq!(tree, json!({ "state": { "state": "lost", "count": 1 } }));
        assert!(is_pixel(&json!({ "x": 1, "y": 2 })) && !is_pixel(&json!({ "x": 1, "width": 2 })));
    }
}
