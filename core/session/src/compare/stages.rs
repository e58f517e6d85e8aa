//! The results of the stages of a step, in running order. Each step of `locate` has a result of its own.

use std::sync::LazyLock;

use serde_json::{Value, json};

use crate::records;
use crate::step::RunStep;
use sightline_record::{ArrayDecl, Stage};

/// Reads the result of a stage from a step.
type Record = Box<dyn Fn(&RunStep) -> Value + Send + Sync>;

/// A stage, or a step of `locate`, with the function that reads its result.
pub(crate) struct Place {
    /// The stage's word.
    pub stage: &'static str,
    /// The word of the step of `locate`; none for a whole stage.
    pub part: Option<&'static str>,
    /// The result; null where the stage was not reached.
    pub record: Record,
}

impl Place {
    /// The arrays that it makes.
    pub(crate) fn arrays(&self) -> impl Iterator<Item = &'static ArrayDecl> {
        // A stage that stands at two places makes its arrays at the one with the name of its step.
        let stage = records::stage(self.word());
        stage.into_iter().flat_map(|stage| &stage.schema().arrays)
    }

    /// The word by which people know it.
    pub(crate) fn word(&self) -> &'static str {
        self.part.unwrap_or(self.stage)
    }

    /// Fields that tell most, the most telling first: the beginnings of their paths.
    pub(crate) fn telling(&self) -> &'static [&'static str] {
        let own = TELLING.iter().find(|(word, _)| *word == self.word());
        own.map_or(&[], |(_, fields)| fields)
    }
}

/// Every place of every tracker, in running order: the stages of the record; before the steps of `locate` the tracker.
pub(crate) static PLACES: LazyLock<Vec<Place>> = LazyLock::new(|| {
    // The row repeats the stages, and the truth is no stage.
    let is_place =
        |stage: &&'static Stage<RunStep>| !["step", "truth"].contains(&stage.schema().stage.as_ref());
    let mut places: Vec<Place> = records::stages().iter().filter(is_place).map(place).collect();
    let first_step = places.iter().position(|place| place.part.is_some()).unwrap_or(0);
    // Two trackers that differ do so here.
    let tracker: fn(&RunStep) -> Value = |trace| json!({ "tracker": tracker(trace) });
    places.insert(first_step, Place { stage: "locate", part: None, record: Box::new(tracker) });
    places
});

/// The most telling fields of the stages that have some.
const TELLING: [(&str, &[&str]); 15] = [
    ("predict", &["position_in_rover"]),
    ("point_mast", &["used", "predicted_left"]),
    ("capture", &["fault"]),
    (
        "scale_roll",
        &["template_step", "warped", "applied_scale", "applied_roll_rad", "scale", "arrays.reference"],
    ),
    ("match_template", &["measure", "search_window", "positions", "score", "pixel"]),
    ("point_stereo", &["right_pixel", "range_m", "score"]),
    ("triangulate", &["position_in_rover", "range_m"]),
    ("detect", &["left", "right"]),
    ("match_features", &["from_step", "matches"]),
    ("fit_motion", &["inliers", "translation_m"]),
    ("coarse_register", &["to_step", "coarse_shift_m"]),
    ("refine_register", &["correction_m", "mean_m"]),
    ("locate", &["tracker", "left_pixel", "position_in_rover", "missing"]),
    ("judge", &["state.", "accepted"]),
    ("update", &["template_renewed", "target.position_in_rover"]),
];

fn place(stage: &'static Stage<RunStep>) -> Place {
    let schema = stage.schema();
    let record: Record = match schema.stage.as_ref() {
        "capture" => Box::new(capture),
        "match_features" => Box::new(match_features),
        "coarse_register" => Box::new(coarse),
        "locate" => Box::new(located),
        _ => Box::new(|trace| stage.evidence(trace).unwrap_or_default()),
    };
    if schema.path.starts_with("locate.") {
        Place { stage: "locate", part: Some(&schema.stage), record }
    } else {
        Place { stage: &schema.stage, part: None, record }
    }
}

fn json(value: &impl serde::Serialize) -> Value {
    serde_json::to_value(value).unwrap_or_default()
}

/// A stop whose files are damaged has no record of `capture`, but a fault.
fn capture(trace: &RunStep) -> Value {
    match trace.fault() {
        Some(fault) => json!({ "fault": fault }),
        None => json(&trace.capture()),
    }
}

fn tracker(trace: &RunStep) -> Option<&'static str> {
    trace.located().map(|located| located.evidence.tracker().word())
}

fn match_features(trace: &RunStep) -> Value {
    let Some(evidence) = trace.features() else { return Value::Null };
    let mut record = json(&evidence.match_features);
    if let Some(fields) = record.as_object_mut() {
        fields.insert("anchors".to_owned(), json(&evidence.anchors));
    }
    record
}

fn coarse(trace: &RunStep) -> Value {
    let found = trace.shape().and_then(|evidence| evidence.registration.as_ref());
    found.map_or(Value::Null, |found| {
        json!({
            "to_step": found.to_step, "start_in_rover": found.start_in_rover, "half_width_m": found.half_width_m,
            "sensor_side_m": found.sensor_side_m, "search_m": found.search_m,
            "coarse_shift_m": found.coarse_shift_m,
        })
    })
}

/// What `locate` returned as a whole; its steps have records of their own.
fn located(trace: &RunStep) -> Value {
    let mut record = json(&trace.located());
    if let Some(fields) = record.as_object_mut() {
        fields.remove("evidence");
    }
    if let (Some(fields), Some(evidence)) = (record.as_object_mut(), trace.template()) {
        fields.insert("warnings".to_owned(), json(&evidence.warnings));
    }
    record
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn telling_fields_belong_to_places_and_the_tracker_stands_before_its_steps() {
        let words: Vec<&str> = PLACES.iter().map(Place::word).collect();
        assert!(TELLING.iter().all(|(word, _)| words.contains(word)));
        let at = |word: &str| words.iter().position(|known| *known == word).unwrap();
        assert!(at("capture") < at("locate") && at("locate") < at("scale_roll"));
        assert_eq!(words.iter().filter(|word| **word == "locate").count(), 2);
        assert!(words.ends_with(&["locate", "judge", "update"]), "{words:?}");
    }
}
