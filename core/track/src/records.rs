//! The stages of a step in running order, each with its question and the way from the step to its evidence.
//!
//! ```text
//! step ─► predict ─► point_mast ─► capture ─► the steps of locate ─► locate ─► judge ─► update
//! ```
//! The quantities, arrays, marks and gates are declared beside each evidence type (`impl Record`). `session::records` adds
//! the row of a step and its comparison with the truth; tables, comparisons, expressions, logs and pages are views of that
//! list. A quantity or an array is added in one file, a stage in its own file and one entry here.

use std::sync::LazyLock;

use sightline_record::{ArrayDecl, ArrayView, Stage};

use crate::locate::features::FeatureEvidence;
use crate::locate::shape_tracker::evidence::{Registered, ShapeArrays};
use crate::locate::template::memory::TemplateMemory;
use crate::trace::StepTrace;

static STAGES: LazyLock<Vec<Stage<StepTrace>>> = LazyLock::new(stages);

/// The stages of all trackers, in running order.
pub fn stages() -> Vec<Stage<StepTrace>> {
    let mut stages = vec![
        Stage::of("predict", "Where should the target be now, by dead reckoning?", StepTrace::prediction)
            .at("predict"),
        Stage::of(
            "point_mast",
            "Which pointing centres the prediction, and where does it appear?",
            |t: &StepTrace| Some(&t.point_mast),
        )
        .at("point_mast"),
        Stage::of("capture", "What was photographed, and how well is it exposed?", StepTrace::capture)
            .at("capture"),
    ];
    stages.extend(template_stages());
    stages.extend(feature_stages());
    stages.extend(shape_stages());
    stages.extend([
        Stage::of("locate", "Where is the target now?", StepTrace::located).at("locate"),
        Stage::of("judge", "Can the match be trusted?", StepTrace::verdict).at("judge"),
        Stage::of("update", "What does this stop leave to the next?", |t: &StepTrace| Some(&t.update))
            .with(|t: &StepTrace| t.update.target.memory.template(), TemplateMemory::declare)
            .at("update"),
    ]);
    stages
}

/// The declarations of all arrays, in the order of the stages.
pub(crate) fn arrays() -> impl Iterator<Item = &'static ArrayDecl> {
    STAGES.iter().flat_map(|stage| &stage.schema().arrays)
}

/// The array of a name, where its stage made it at this step.
pub fn array<'a>(trace: &'a StepTrace, name: &str) -> Option<ArrayView<'a>> {
    STAGES.iter().find_map(|stage| stage.array(trace, name))
}

/// The stages of the template tracker, to which other trackers leave the designation.
fn template_stages() -> [Stage<StepTrace>; 5] {
    [
        Stage::of("scale_roll", "How should the template look from here?", |t: &StepTrace| {
            t.template()?.scale_roll.as_ref()
        })
        .at("locate.evidence.scale_roll")
        .at("locate.evidence.designation.scale_roll")
        .at("locate.evidence.features.designation.scale_roll"),
        Stage::of(
            "match_template",
            "Where does the template fit best in the left image?",
            |t: &StepTrace| t.template()?.match_template.as_ref(),
        )
        .at("locate.evidence.match_template")
        .at("locate.evidence.designation.match_template")
        .at("locate.evidence.features.designation.match_template"),
        Stage::of("drift_correction", "Where does the designated window fit?", |t: &StepTrace| {
            t.template()?.drift_correction.as_ref()
        })
        .at("locate.evidence.drift_correction")
        .at("locate.evidence.designation.drift_correction")
        .at("locate.evidence.features.designation.drift_correction"),
        Stage::of("relief", "Which heights surround the target?", |t: &StepTrace| {
            t.template()?.relief.as_ref()
        })
        .at("locate.evidence.relief")
        .at("locate.evidence.designation.relief")
        .at("locate.evidence.features.designation.relief"),
        Stage::of("point_stereo", "Which point of the right image is it?", |t: &StepTrace| {
            t.template()?.point_stereo.as_ref()
        })
        .at("locate.evidence.point_stereo")
        .at("locate.evidence.designation.point_stereo")
        .at("locate.evidence.features.designation.point_stereo"),
    ]
}

fn feature_stages() -> [Stage<StepTrace>; 5] {
    [
        Stage::of("detect", "Which features do the two images have?", |t: &StepTrace| {
            t.features()?.detect.as_ref()
        })
        .with(StepTrace::features, FeatureEvidence::declare_features)
        .at("locate.evidence.detect")
        .at("locate.evidence.features.detect"),
        Stage::of(
            "match_features",
            "Which features are the same, in the other eye and at an earlier stop?",
            |t: &StepTrace| t.features()?.match_features.as_ref(),
        )
        .at("locate.evidence.match_features")
        .at("locate.evidence.features.match_features"),
        Stage::of("triangulate", "Which point in space do both pixels see?", |t: &StepTrace| {
            t.template()?.triangulate.as_ref()
        })
        .at("locate.evidence.triangulate")
        .at("locate.evidence.designation.triangulate")
        .at("locate.evidence.features.designation.triangulate"),
        Stage::of("fit_motion", "Which rigid motion do most matches agree with?", |t: &StepTrace| {
            t.features()?.fit_motion.as_ref()
        })
        .at("locate.evidence.fit_motion")
        .at("locate.evidence.features.fit_motion"),
        Stage::of("bootstrap", "How certain is that motion?", |t: &StepTrace| {
            t.features()?.bootstrap.as_ref()
        })
        .with(StepTrace::features, FeatureEvidence::declare_cloud)
        .at("locate.evidence.bootstrap")
        .at("locate.evidence.features.bootstrap"),
    ]
}

fn shape_stages() -> [Stage<StepTrace>; 6] {
    [
        Stage::of("surface", "Which surface does the pair show?", |t: &StepTrace| {
            t.shape()?.surface.as_ref()
        })
        .with(shape_arrays, ShapeArrays::declare_surface)
        .at("locate.evidence.surface"),
        Stage::of_parts("coarse_register", "By which shift does it fit the earlier surface, roughly?")
            .with(|t: &StepTrace| registration(t), Registered::declare_coarse)
            .with(shape_arrays, ShapeArrays::declare_coarse)
            .at("locate.evidence.registration"),
        Stage::of(
            "refine_register",
            "By which motion does it fit best, and how certain is that?",
            |t: &StepTrace| registration(t),
        )
        .with(shape_arrays, ShapeArrays::declare_refine)
        .at("locate.evidence.registration"),
        Stage::of("carried_ray", "Where does the first line of sight meet the surface?", |t: &StepTrace| {
            registration(t)?.ray.as_ref()
        })
        .at("locate.evidence.registration.ray"),
        Stage::of("hand_off", "Where do other cameras see the last image of the target?", |t: &StepTrace| {
            registration(t)?.draped.as_ref()
        })
        .at("locate.evidence.registration.draped"),
        Stage::of("placement", "Can the arm reach the target, and where does it touch?", |t: &StepTrace| {
            t.shape()?.placement.as_ref()
        })
        .at("locate.evidence.placement"),
    ]
}

fn registration(trace: &StepTrace) -> Option<&Registered> {
    trace.shape()?.registration.as_ref()
}

fn shape_arrays(trace: &StepTrace) -> Option<&ShapeArrays> {
    trace.shape().map(|evidence| &evidence.arrays)
}
