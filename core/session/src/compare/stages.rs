//! The results of the stages of a step, in running order. Each step of `locate` has its own result.

use std::sync::LazyLock;

use serde_json::{Value, json};

use crate::records;
use crate::step::RunStep;
use sightline_record::{ArrayDecl, Stage};

/// Reads the result of a stage from a step.
type Record = Box<dyn Fn(&RunStep) -> Value + Send + Sync>;

/// A stage, or a step of `locate`, with the function that reads its result.
pub(crate) struct Place {
    /// The stage's name.
    pub stage: &'static str,
    /// The name of the step of `locate`; `None` for a whole stage.
    pub part: Option<&'static str>,
    /// Reads the result; null if the stage was not reached.
    pub record: Record,
}

impl Place {
    /// The arrays that it declares.
    pub(crate) fn arrays(&self) -> impl Iterator<Item = &'static ArrayDecl> {
        // A stage with several entries declares its arrays under the name of its step.
        let stage = records::stage(self.word());
        stage.into_iter().flat_map(|stage| &stage.schema().arrays)
    }

    /// The displayed name: the step of `locate` if there is one, else the stage.
    pub(crate) fn word(&self) -> &'static str {
        self.part.unwrap_or(self.stage)
    }

    /// Prefixes of the paths of the most informative fields, in descending order.
    pub(crate) fn telling(&self) -> &'static [&'static str] {
        let own = TELLING.iter().find(|(word, _)| *word == self.word());
        own.map_or(&[], |(_, fields)| fields)
    }
}

/// The stages of all trackers in running order; the name of the tracker precedes the steps of `locate`.
pub(crate) static PLACES: LazyLock<Vec<Place>> = LazyLock::new(|| {
    // The row repeats values of the stages, and the truth is not a stage.
    let is_place =
        |stage: &&'static Stage<RunStep>| !["step", "truth"].contains(&stage.schema().stage.as_ref());
    let mut places: Vec<Place> = records::stages().iter().filter(is_place).map(place).collect();
    let first_step = places.iter().position(|place| place.part.is_some()).unwrap_or(0);
    // Runs of different trackers differ first here.
    let tracker: fn(&RunStep) -> Value = |trace| json!({ "tracker": tracker(trace) });
    places.insert(first_step, Place { stage: "locate", part: None, record: Box::new(tracker) });
    places
});

/// The most informative fields by stage.
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

/// A stop with damaged files has a fault instead of a record of `capture`.
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

/// The result of `locate` as a whole, without the records of its steps.
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
