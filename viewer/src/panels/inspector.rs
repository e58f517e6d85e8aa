//! The inspector: the selected stage's record as a tree of values with units.

use egui::{CollapsingHeader, RichText, ScrollArea, Ui};
use serde_json::{Value, json};
use sightline_core::locate::features::FeatureEvidence;
use sightline_core::locate::shape_tracker::ShapeEvidence;
use sightline_core::settings::TrackerKind;
use sightline_core::trace::StepTrace;

use super::compare::readouts;
use super::{digits, numbers};
use crate::command::{Command, Stage};
use crate::state::State;
use crate::{panels, theme};

/// Shows the record.
pub fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    ui.horizontal_wrapped(|ui| {
        ui.label(RichText::new(state.stage().word()).strong().color(theme::strong()));
        ui.label(theme::note(state.stage().question()));
    });
    let Some(trace) = state.trace() else {
        panels::missing(ui, "", &state.missing_step());
        return;
    };
    let Some(record) = record(trace, state.stage()) else {
        panels::missing(ui, "", &not_reached(trace, state));
        return;
    };
    ScrollArea::vertical().auto_shrink(false).id_salt(state.stage()).show(ui, |ui| {
        readouts::record(ui, state);
        asked_fields(ui, trace, state.stage(), &record, out);
        entries(ui, &record);
        if let Some(truth) = trace.truth.as_ref().and_then(|truth| serde_json::to_value(truth).ok()) {
            ui.add_space(4.0);
            ui.label(theme::title("against the truth"));
            entries(ui, &truth);
        }
    });
}

/// The fields whose origin is known, each a link to it.
fn asked_fields(ui: &mut Ui, trace: &StepTrace, stage: Stage, record: &Value, out: &mut Vec<Command>) {
    let fields = record.as_object().into_iter().flatten();
    let asked: Vec<(&String, &str)> =
        fields.filter_map(|(key, _)| Some((key, numbers::name_of(trace, stage, key)?))).collect();
    if asked.is_empty() {
        return;
    }
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 6.0;
        ui.label(theme::note("why:"));
        for (key, name) in asked {
            let copied = words(key, &record[key]).unwrap_or_else(|| record[key].to_string());
            let (label, _) = name_and_unit(key);
            let link =
                ui.link(RichText::new(label).small()).on_hover_text(format!("Where {name} comes from"));
            numbers::ask(&link, trace.step, name, &copied, out);
        }
    });
}

fn not_reached(trace: &StepTrace, state: &State) -> String {
    let word = state.stage().word();
    match (&trace.fault, trace.predict.is_none()) {
        (Some(fault), _) => format!("{word} was not reached: {fault}"),
        (None, true) => {
            let other = match state.tracker() {
                TrackerKind::Template => "point_stereo",
                TrackerKind::Features | TrackerKind::Combined => "triangulate",
                TrackerKind::Shape => "surface",
            };
            format!(
                "{word} is not part of the designation. Go one step on (Right) to see it, or select `{other}`."
            )
        }
        (None, false) => format!("{word} was not reached: {}", state.missing_step()),
    }
}

/// Whether a stage was reached.
pub fn is_reached(trace: &StepTrace, stage: Stage) -> bool {
    let (evidence, features) = (trace.template(), trace.features());
    let registration = trace.shape().and_then(|evidence| evidence.registration.as_ref());
    match stage {
        Stage::Predict => trace.predict.is_some(),
        Stage::PointMast => trace.point_mast.is_some(),
        Stage::Capture => trace.capture.is_some(),
        Stage::Locate => trace.locate.is_some(),
        Stage::ScaleRoll => evidence.is_some_and(|e| e.scale_roll.is_some()),
        Stage::MatchTemplate => evidence.is_some_and(|e| e.match_template.is_some()),
        Stage::PointStereo => evidence.is_some_and(|e| e.point_stereo.is_some()),
        Stage::Detect => features.is_some_and(|e| e.detect.is_some()),
        Stage::MatchFeatures => features.is_some_and(|e| e.match_features.is_some()),
        Stage::Triangulate => {
            features.map_or(evidence.is_some_and(|e| e.triangulate.is_some()), |e| e.detect.is_some())
        }
        Stage::FitMotion => features.is_some_and(|e| e.fit_motion.is_some()),
        Stage::Bootstrap => features.is_some_and(|e| e.bootstrap.is_some()),
        Stage::Surface => trace.shape().is_some_and(|e| e.surface.is_some()),
        Stage::CoarseRegister => registration.is_some(),
        Stage::RefineRegister => registration.is_some_and(|found| found.mean_m[2].is_some()),
        Stage::CarriedRay => registration.is_some_and(|found| found.ray.is_some()),
        Stage::Judge => trace.judge.is_some(),
        Stage::Update => true,
    }
}

/// What a stage returned; none where it was not reached.
pub fn record(trace: &StepTrace, stage: Stage) -> Option<Value> {
    if let Some(shape) = trace.shape().filter(|_| stage.is_step_of_shape()) {
        return shape_record(shape, stage);
    }
    if let Some(features) = trace.features().filter(|_| stage.is_step_of_locate()) {
        return feature_record(features, stage);
    }
    let evidence = trace.template();
    let value = match stage {
        Stage::Predict => serde_json::to_value(trace.predict.as_ref()?),
        Stage::PointMast => serde_json::to_value(trace.point_mast.as_ref()?),
        Stage::Capture => serde_json::to_value(trace.capture.as_ref()?),
        Stage::Locate => serde_json::to_value(trace.locate.as_ref()?),
        Stage::ScaleRoll => serde_json::to_value(evidence?.scale_roll.as_ref()?),
        Stage::MatchTemplate => serde_json::to_value(evidence?.match_template.as_ref()?),
        Stage::PointStereo => serde_json::to_value(evidence?.point_stereo.as_ref()?),
        Stage::Triangulate => serde_json::to_value(evidence?.triangulate.as_ref()?),
        Stage::Detect | Stage::MatchFeatures | Stage::FitMotion | Stage::Bootstrap => return None,
        Stage::Surface | Stage::CoarseRegister | Stage::RefineRegister | Stage::CarriedRay => return None,
        Stage::Judge => serde_json::to_value(trace.judge.as_ref()?),
        Stage::Update => serde_json::to_value(&trace.update),
    };
    let mut value = value.ok()?;
    if let (Stage::Locate, Some(object)) = (stage, value.as_object_mut()) {
        // Its steps have records of their own.
        object.remove("evidence");
    }
    Some(value)
}

/// What a step of the feature tracker returned.
fn feature_record(features: &FeatureEvidence, stage: Stage) -> Option<Value> {
    let found = features.detect.as_ref();
    let mut record = match stage {
        Stage::Detect => found.map(|d| json!({ "left": d.left, "right": d.right }))?,
        Stage::MatchFeatures => {
            let mut record = serde_json::to_value(features.match_features.as_ref()).ok()?;
            if record.is_null() {
                record = json!({});
            }
            record["stereo_matches"] = found.map(|d| d.stereo_matches)?.into();
            record["anchors"] = serde_json::to_value(&features.anchors).ok()?;
            record
        }
        Stage::Triangulate => {
            found.map(|d| json!({ "points": d.points, "median_range_m": d.median_range_m }))?
        }
        Stage::FitMotion => serde_json::to_value(features.fit_motion.as_ref()?).ok()?,
        Stage::Bootstrap => serde_json::to_value(features.bootstrap.as_ref()?).ok()?,
        _ => return None,
    };
    if let (Stage::Triangulate, Some(designation)) = (stage, &features.designation) {
        // The pick is a measurement by point stereo, whose steps are no stages of this tracker.
        record["pick_by_point_stereo"] = serde_json::to_value(designation).ok()?;
    }
    Some(record)
}

/// What a step of the shape tracker returned.
fn shape_record(shape: &ShapeEvidence, stage: Stage) -> Option<Value> {
    let found = shape.registration.as_ref();
    let mut record = match stage {
        Stage::Surface => serde_json::to_value(shape.surface.as_ref()?).ok()?,
        Stage::CoarseRegister => found.map(|found| {
            json!({
                "to_step": found.to_step, "start_in_rover": found.start_in_rover, "half_width_m": found.half_width_m,
                "sensor_side_m": found.sensor_side_m, "search_m": found.search_m,
                "coarse_shift_m": found.coarse_shift_m, "mean_m": found.mean_m[1],
            })
        })?,
        Stage::RefineRegister => serde_json::to_value(found?).ok()?,
        Stage::CarriedRay => serde_json::to_value(found?.ray.as_ref()?).ok()?,
        _ => return None,
    };
    record["why"] = shape.why.clone().into();
    Some(record)
}

/// The fields of a record, plain values first.
fn entries(ui: &mut Ui, record: &Value) {
    let Some(fields) = record.as_object() else {
        ui.label(theme::number(record.to_string()));
        return;
    };
    let (plain, nested): (Vec<_>, Vec<_>) =
        fields.iter().partition(|(key, value)| words(key, value).is_some());
    egui::Grid::new(ui.next_auto_id()).num_columns(2).spacing([10.0, 2.0]).show(ui, |ui| {
        for (key, value) in plain {
            let (name, unit) = name_and_unit(key);
            ui.label(theme::label(name).size(12.0));
            ui.horizontal_wrapped(|ui| {
                ui.spacing_mut().item_spacing.x = 4.0;
                ui.label(theme::number(words(key, value).unwrap_or_default()));
                ui.label(theme::note(unit));
            });
            ui.end_row();
        }
    });
    for (key, value) in nested {
        let (name, unit) = name_and_unit(key);
        let list = value.as_array().filter(|_| !is_matrix(key, value));
        let count = list.map(|list| format!(" ({})", list.len())).unwrap_or_default();
        let header = RichText::new(format!("{name}{count} {unit}").trim_end().to_owned())
            .size(12.0)
            .color(theme::text());
        CollapsingHeader::new(header)
            .id_salt(key)
            .default_open(is_small(key, value))
            .show(ui, |ui| children(ui, key, value));
    }
}

fn children(ui: &mut Ui, key: &str, value: &Value) {
    match value {
        Value::Array(list) if is_matrix(key, value) => matrix(ui, list),
        Value::Array(list) => {
            for (i, item) in list.iter().enumerate() {
                let step = || item.get("step").map(|step| format!("step {step}"));
                let name = item.get("name").and_then(Value::as_str).map(str::to_owned);
                let title = name.or_else(step).unwrap_or_else(|| i.to_string());
                if item.is_object() {
                    CollapsingHeader::new(RichText::new(title).size(12.0))
                        .id_salt(i)
                        .show(ui, |ui| entries(ui, item));
                } else {
                    ui.label(theme::number(item.to_string()));
                }
            }
        }
        _ => entries(ui, value),
    }
}

/// Whether a record is short enough to be open from the start.
fn is_small(key: &str, value: &Value) -> bool {
    match value {
        Value::Array(_) => is_matrix(key, value),
        Value::Object(fields) => fields.len() <= 8,
        _ => true,
    }
}

/// Whether a list is a square matrix: they are written as one list, column by column.
fn is_matrix(key: &str, value: &Value) -> bool {
    let is_named = key.contains("covariance") || key.contains("_from_");
    is_named
        && value
            .as_array()
            .is_some_and(|list| matches!(list.len(), 4 | 9 | 36) && list.iter().all(Value::is_number))
}

/// A square matrix in rows and columns.
fn matrix(ui: &mut Ui, list: &[Value]) {
    let side = list.len().isqrt();
    egui::Grid::new(ui.next_auto_id()).spacing([14.0, 1.0]).show(ui, |ui| {
        for row in 0..side {
            for column in 0..side {
                let value = list[column * side + row].as_f64().unwrap_or(f64::NAN);
                ui.label(theme::number(format!("{value:+.2e}")).size(11.0));
            }
            ui.end_row();
        }
    });
}

/// A value that fits on a line; none for records and long lists.
fn words(key: &str, value: &Value) -> Option<String> {
    match value {
        Value::Null => Some("none".to_owned()),
        Value::Bool(is) => Some(if *is { "yes" } else { "no" }.to_owned()),
        Value::Number(number) => {
            let number = number.as_f64()?;
            if key.ends_with("_rad") {
                return Some(format!("{} ({:.2}°)", digits(number), number.to_degrees()));
            }
            Some(digits(number))
        }
        Value::String(text) => Some(text.clone()),
        Value::Array(list) if list.is_empty() => Some("none".to_owned()),
        Value::Array(list)
            if list.len() <= 4 && !is_matrix(key, value) && list.iter().all(Value::is_number) =>
        {
            Some(list.iter().filter_map(Value::as_f64).map(digits).collect::<Vec<_>>().join("  "))
        }
        Value::Object(fields)
            if fields.len() == 2 && fields.contains_key("x") && fields.contains_key("y") =>
        {
            let [x, y] = ["x", "y"].map(|k| fields[k].as_f64().unwrap_or(f64::NAN));
            Some(format!("{x:.2}, {y:.2}"))
        }
        _ => None,
    }
}

/// A field's name in words and the unit that its name ends with.
fn name_and_unit(key: &str) -> (String, &'static str) {
    const UNITS: [(&str, &str); 8] = [
        ("_px2", "px²"),
        ("_px", "px"),
        ("_m2", "m²"),
        ("_m", "m"),
        ("_rad", "rad"),
        ("_deg", "°"),
        ("_s", "s"),
        ("_in_rover", "m, rover"),
    ];
    if key.starts_with("covariance_in_rover") {
        return ("covariance".to_owned(), "m², rover");
    }
    if let Some(name) = key.strip_suffix("_in_site") {
        return (name.replace('_', " "), "m, site");
    }
    if matches!(
        key,
        "left_pixel" | "right_pixel" | "pixel" | "predicted_left" | "predicted_right" | "integer"
    ) {
        return (key.replace('_', " "), "px");
    }
    let found = UNITS.iter().find_map(|(suffix, unit)| Some((key.strip_suffix(suffix)?, *unit)));
    let (name, unit) = found.unwrap_or((key, ""));
    (name.replace('_', " "), unit)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn units_come_from_the_names() {
        assert_eq!(name_and_unit("gap_m"), ("gap".to_owned(), "m"));
        assert_eq!(name_and_unit("covariance_px2"), ("covariance".to_owned(), "px²"));
        assert_eq!(name_and_unit("position_in_rover"), ("position".to_owned(), "m, rover"));
        assert_eq!(name_and_unit("score"), ("score".to_owned(), ""));
        assert_eq!(name_and_unit("left_pixel"), ("left pixel".to_owned(), "px"));
    }

    #[test]
    fn values_read_like_values() {
        assert_eq!(words("roll_rad", &json!(0.1)).unwrap(), "0.100 (5.73°)");
        assert_eq!(words("pixel", &json!({"x": 1.25, "y": 2.0})).unwrap(), "1.25, 2.00");
        assert_eq!(words("position_in_rover", &json!([1.0, 2.5, -0.2])).unwrap(), "1  2.500  -0.200");
        assert_eq!(words("missing", &Value::Null).unwrap(), "none");
        assert_eq!(words("tried", &json!([])).unwrap(), "none");
        assert!(words("peak", &json!({"score": 1, "x": 2})).is_none());
        assert!(words("covariance_px2", &json!([1.0, 0.0, 0.0, 1.0])).is_none());
    }
}
