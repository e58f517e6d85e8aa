//! What each stage of a step returned, in running order: the steps of `locate` have records of their own.

use serde_json::{Value, json};

use crate::records;
use crate::step::RunStep;
use sightline_record::ArrayDecl;

/// A stage of a step, or a step of `locate`, and how to get what it returned.
pub(crate) struct Place {
    /// The stage's word.
    pub stage: &'static str,
    /// The word of the step of `locate`; none for a whole stage.
    pub part: Option<&'static str>,
    /// Fields that tell most, the most telling first: the beginnings of their paths.
    pub telling: &'static [&'static str],
    /// What it returned; null where it was not reached.
    pub record: fn(&RunStep) -> Value,
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
}

/// Every place of every tracker, in running order.
pub(crate) const PLACES: [Place; 23] = [
    whole("predict", &["position_in_rover"], |trace| json(&trace.prediction())),
    whole("point_mast", &["used", "predicted_left"], |trace| json(&trace.point_mast)),
    whole("capture", &["fault"], capture),
    // Two trackers that differ do so here.
    whole("locate", &["tracker"], |trace| json!({ "tracker": tracker(trace) })),
    part(
        "scale_roll",
        &["template_step", "warped", "applied_scale", "applied_roll_rad", "scale", "arrays.reference"],
        |trace| json(&trace.template().and_then(|e| e.scale_roll.as_ref())),
    ),
    part("match_template", &["measure", "search_window", "positions", "score", "pixel"], |trace| {
        json(&trace.template().and_then(|e| e.match_template.as_ref()))
    }),
    part("drift_correction", &[], |trace| json(&trace.template().and_then(|e| e.drift_correction.as_ref()))),
    part("relief", &[], |trace| json(&trace.template().and_then(|e| e.relief.as_ref()))),
    part("point_stereo", &["right_pixel", "range_m", "score"], |trace| {
        json(&trace.template().and_then(|e| e.point_stereo.as_ref()))
    }),
    part("detect", &["left", "right"], |trace| json(&trace.features().and_then(|e| e.detect.as_ref()))),
    part("match_features", &["from_step", "matches"], match_features),
    part("triangulate", &["position_in_rover", "range_m"], |trace| {
        json(&trace.template().and_then(|e| e.triangulate.as_ref()))
    }),
    part("fit_motion", &["inliers", "translation_m"], |trace| {
        json(&trace.features().and_then(|e| e.fit_motion.as_ref()))
    }),
    part("bootstrap", &[], |trace| json(&trace.features().and_then(|e| e.bootstrap.as_ref()))),
    part("surface", &[], |trace| json(&trace.shape().and_then(|e| e.surface.as_ref()))),
    part("coarse_register", &["to_step", "coarse_shift_m"], coarse),
    part("refine_register", &["correction_m", "mean_m"], |trace| {
        json(&trace.shape().and_then(|e| e.registration.as_ref()))
    }),
    part("carried_ray", &[], |trace| {
        json(&trace.shape().and_then(|e| e.registration.as_ref()?.ray.as_ref()))
    }),
    part("hand_off", &[], |trace| {
        json(&trace.shape().and_then(|e| e.registration.as_ref()?.draped.as_ref()))
    }),
    part("placement", &[], |trace| json(&trace.shape().and_then(|e| e.placement.as_ref()))),
    whole("locate", &["left_pixel", "position_in_rover", "missing"], located),
    whole("judge", &["state.", "accepted"], |trace| json(&trace.verdict())),
    whole("update", &["template_renewed", "target.position_in_rover"], |trace| json(&trace.update)),
];

const fn whole(
    stage: &'static str,
    telling: &'static [&'static str],
    record: fn(&RunStep) -> Value,
) -> Place {
    Place { stage, part: None, telling, record }
}

const fn part(word: &'static str, telling: &'static [&'static str], record: fn(&RunStep) -> Value) -> Place {
    Place { stage: "locate", part: Some(word), telling, record }
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
    fn every_stage_and_every_array_of_the_record_has_a_place_in_running_order() {
        let recorded = records::stages().iter().map(sightline_record::Stage::schema);
        // The row repeats the stages, and the truth is no stage.
        let recorded = recorded.filter(|schema| !["step", "truth"].contains(&schema.stage.as_ref()));
        let recorded: Vec<&str> = recorded.map(|schema| schema.stage.as_ref()).collect();
        let mut places: Vec<&str> = PLACES.iter().map(Place::word).collect();
        // The tracker is compared before its steps.
        let tracker = places.iter().position(|word| *word == "locate").unwrap();
        places.remove(tracker);
        assert_eq!(places, recorded);
    }
}
