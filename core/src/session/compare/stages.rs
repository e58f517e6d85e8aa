//! What each stage of a step returned, in running order: the steps of `locate` have records of their own.

use serde_json::{Value, json};

use crate::locate::Evidence;
use crate::trace::{ArrayName, StepTrace};

/// A stage of a step, or a step of `locate`, and how to get what it returned.
pub struct Place {
    /// The stage's word.
    pub stage: &'static str,
    /// The word of the step of `locate`; none for a whole stage.
    pub part: Option<&'static str>,
    /// Fields that tell most, the most telling first: the beginnings of their paths.
    pub telling: &'static [&'static str],
    /// The arrays that it makes.
    pub arrays: &'static [ArrayName],
    /// What it returned; null where it was not reached.
    pub record: fn(&StepTrace) -> Value,
}

impl Place {
    /// The word by which people know it.
    pub fn word(&self) -> &'static str {
        self.part.unwrap_or(self.stage)
    }
}

use ArrayName as Name;

/// Every place of every tracker, in running order.
pub const PLACES: [Place; 19] = [
    whole("predict", &["position_in_rover"], |trace| json(&trace.predict)),
    whole("point_mast", &["used", "predicted_left"], |trace| json(&trace.point_mast)),
    whole("capture", &["fault"], capture),
    // Two trackers that differ do so here.
    whole("locate", &["tracker"], |trace| json!({ "tracker": tracker(trace) })),
    part(
        "scale_roll",
        &["template_step", "warped", "applied_scale", "applied_roll_rad", "scale", "arrays.reference"],
        &[Name::Reference, Name::Scaled, Name::Rolled],
        |trace| json(&trace.template().and_then(|e| e.scale_roll.as_ref())),
    ),
    part(
        "match_template",
        &["measure", "search_window", "positions", "score", "pixel"],
        &[Name::Matched, Name::Difference, Name::Surface],
        match_template,
    ),
    part("point_stereo", &["right_pixel", "range_m", "score"], &[Name::RightWindow], |trace| {
        json(&trace.template().and_then(|e| e.point_stereo.as_ref()))
    }),
    part("detect", &["left", "right"], &[Name::Features], |trace| {
        json(&trace.features().and_then(|e| e.detect.as_ref()))
    }),
    part("match_features", &["from_step", "matches"], &[], match_features),
    part("triangulate", &["position_in_rover", "range_m"], &[], |trace| {
        json(&trace.template().and_then(|e| e.triangulate.as_ref()))
    }),
    part("fit_motion", &["inliers", "translation_m"], &[], |trace| {
        json(&trace.features().and_then(|e| e.fit_motion.as_ref()))
    }),
    part("bootstrap", &[], &[Name::Cloud], |trace| {
        json(&trace.features().and_then(|e| e.bootstrap.as_ref()))
    }),
    part("surface", &[], &[Name::Disparities, Name::Ranges], |trace| {
        json(&trace.shape().and_then(|e| e.surface.as_ref()))
    }),
    part("coarse_register", &["to_step", "coarse_shift_m"], &[Name::Sensor, Name::CoarseSearch], coarse),
    part("refine_register", &["correction_m", "mean_m"], &[Name::ErrorFine, Name::RefinePath], |trace| {
        json(&trace.shape().and_then(|e| e.registration.as_ref()))
    }),
    part("carried_ray", &[], &[Name::Draped, Name::DrapedMatch], |trace| {
        json(&trace.shape().and_then(|e| e.registration.as_ref()?.ray.as_ref()))
    }),
    whole("locate", &["left_pixel", "position_in_rover", "missing"], located),
    whole("judge", &["state.", "accepted"], |trace| json(&trace.judge)),
    whole("update", &["template_renewed", "target.position_in_rover"], |trace| json(&trace.update)),
];

const fn whole(
    stage: &'static str,
    telling: &'static [&'static str],
    record: fn(&StepTrace) -> Value,
) -> Place {
    Place { stage, part: None, telling, arrays: &[], record }
}

const fn part(
    word: &'static str,
    telling: &'static [&'static str],
    arrays: &'static [ArrayName],
    record: fn(&StepTrace) -> Value,
) -> Place {
    Place { stage: "locate", part: Some(word), telling, arrays, record }
}

fn json(value: &impl serde::Serialize) -> Value {
    serde_json::to_value(value).unwrap_or_default()
}

/// A stop whose files are damaged has no record of `capture`, but a fault.
fn capture(trace: &StepTrace) -> Value {
    match &trace.fault {
        Some(fault) => json!({ "fault": fault }),
        None => json(&trace.capture),
    }
}

fn tracker(trace: &StepTrace) -> Option<&'static str> {
    trace.locate.as_ref().map(|located| match located.evidence {
        Evidence::Template(_) => "template",
        Evidence::Features(_) => "features",
        Evidence::Shape(_) => "shape",
    })
}

fn match_template(trace: &StepTrace) -> Value {
    let Some(evidence) = trace.template() else { return Value::Null };
    let mut record = json(&evidence.match_template);
    if let (Some(fields), Some(corrected)) = (record.as_object_mut(), &evidence.drift_correction) {
        fields.insert("drift_correction".to_owned(), json(corrected));
    }
    record
}

fn match_features(trace: &StepTrace) -> Value {
    let Some(evidence) = trace.features() else { return Value::Null };
    let mut record = json(&evidence.match_features);
    if let Some(fields) = record.as_object_mut() {
        fields.insert("anchors".to_owned(), json(&evidence.anchors));
    }
    record
}

fn coarse(trace: &StepTrace) -> Value {
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
fn located(trace: &StepTrace) -> Value {
    let mut record = json(&trace.locate);
    if let Some(fields) = record.as_object_mut() {
        fields.remove("evidence");
    }
    if let (Some(fields), Some(evidence)) = (record.as_object_mut(), trace.template()) {
        fields.insert("warnings".to_owned(), json(&evidence.warnings));
    }
    record
}
