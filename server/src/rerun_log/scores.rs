//! The numbers of a step, one scalar per entity, for the time series.
//!
//! They are one table, because they differ in nothing but their name and where the number is read.

use rerun::{RecordingStream, Scalars};
use sightline_core::camera::MastAngles;
use sightline_core::locate::shape_tracker::evidence::{Check, Registered};
use sightline_core::locate::template::TemplateEvidence;
use sightline_core::stages::capture::Capture;
use sightline_core::stages::judge::Gate;
use sightline_core::trace::{StepTrace, StepTruth};

use super::Logged;
use super::palette::{FAILED, LIMIT, LOST, MEASUREMENT, PREDICTION, Rgb, SECOND_PEAK, TRACKING, color};
use super::step::{Step, log_series, path};

/// One number of a step.
#[derive(Clone, Copy)]
pub(super) struct Score {
    /// Its entity.
    pub(super) entity: &'static str,
    /// When there is such a number.
    pub(super) when: &'static str,
    /// Where it is read.
    pub(super) value: fn(&StepTrace) -> Option<f64>,
    rgb: Rgb,
}

const fn score(
    entity: &'static str,
    when: &'static str,
    rgb: Rgb,
    value: fn(&StepTrace) -> Option<f64>,
) -> Score {
    Score { entity, when, value, rgb }
}

/// All numbers, in the order of the stages.
#[rustfmt::skip]
pub(super) const SCORES: &[Score] = &[
    score("/{target}/point_mast/wanted_azimuth_deg", "there is a mast and it reaches", PREDICTION, |t| Some(wanted(t)?.azimuth_rad.to_degrees())),
    score("/{target}/point_mast/wanted_elevation_deg", "there is a mast and it reaches", SECOND_PEAK, |t| Some(wanted(t)?.elevation_rad.to_degrees())),
    score("/{target}/point_mast/used_azimuth_deg", "there is a mast", MEASUREMENT, |t| Some(used(t)?.azimuth_rad.to_degrees())),
    score("/{target}/point_mast/used_elevation_deg", "there is a mast", LOST, |t| Some(used(t)?.elevation_rad.to_degrees())),
    score("/{target}/capture/subframe_mean", "the subframe lies in the image", MEASUREMENT, |t| capture(t)?.subframe_mean.map(f64::from)),
    score("/{target}/capture/subframe_saturated", "the subframe lies in the image", LOST, |t| capture(t)?.subframe_saturated.map(f64::from)),
    score("/{target}/locate/scale_roll/scale", "prepared", MEASUREMENT, |t| Some(evidence(t)?.scale_roll.as_ref()?.scale)),
    score("/{target}/locate/scale_roll/roll_deg", "prepared", SECOND_PEAK, |t| Some(evidence(t)?.scale_roll.as_ref()?.roll_rad.to_degrees())),
    score("/{target}/locate/match_template/second_peak_ratio", "there is a second peak", LOST, |t| Some(evidence(t)?.match_template.as_ref()?.second_peak.as_ref()?.ratio)),
    score("/{target}/locate/point_stereo/range_m", "stereo matched", MEASUREMENT, |t| Some(evidence(t)?.point_stereo.as_ref()?.range_m)),
    score("/{target}/locate/point_stereo/across_px", "stereo matched", LOST, |t| Some(evidence(t)?.point_stereo.as_ref()?.across_px)),
    score("/{target}/locate/triangulate/gap_px", "triangulated", SECOND_PEAK, |t| Some(evidence(t)?.triangulate.as_ref()?.gap_px)),
    score("/{target}/locate/fit_motion/inliers", "a motion was fitted", TRACKING, |t| Some(t.features()?.fit_motion.as_ref()?.inliers as f64)),
    score("/{target}/locate/coarse_register/mean_m", "shifts were searched and surfaces overlap", MEASUREMENT, |t| registration(t)?.mean_m[1]),
    score("/{target}/locate/refine_register/mean_m", "surfaces were compared", SECOND_PEAK, |t| registration(t)?.mean_m[2]),
    score("/{target}/locate/refine_register/overlap", "surfaces were compared", MEASUREMENT, |t| check(t, "shape_overlap")?.value),
    score("/{target}/locate/refine_register/overlap/limit", "registered", LIMIT, |t| Some(check(t, "shape_overlap")?.limit)),
    score("/{target}/locate/refine_register/misfit", "surfaces were compared", LOST, |t| check(t, "shape_misfit")?.value),
    score("/{target}/locate/refine_register/misfit/limit", "registered", LIMIT, |t| Some(check(t, "shape_misfit")?.limit)),
    score("/{target}/locate/refine_register/sigma_m", "the shape holds the target", TRACKING, |t| check(t, "shape_sigma_m")?.value),
    score("/{target}/locate/refine_register/sigma_m/limit", "registered", LIMIT, |t| Some(check(t, "shape_sigma_m")?.limit)),
    score("/{target}/locate/hand_off/score", "the last picture was found at a hand-off", MEASUREMENT, |t| Some(registration(t)?.draped.as_ref()?.score)),
    score("/{target}/judge/ncc", "judged and matched", MEASUREMENT, |t| gate(t, "ncc")?.value),
    score("/{target}/judge/ncc/limit", "judged", LIMIT, |t| Some(gate(t, "ncc")?.limit)),
    score("/{target}/judge/stereo_ncc", "judged and stereo matched", SECOND_PEAK, |t| gate(t, "stereo_ncc")?.value),
    score("/{target}/judge/stereo_ncc/limit", "judged", LIMIT, |t| Some(gate(t, "stereo_ncc")?.limit)),
    score("/{target}/judge/distance_correction_m", "judged and triangulated", MEASUREMENT, |t| gate(t, "distance_correction_m")?.value),
    score("/{target}/judge/distance_correction_m/limit", "judged", LIMIT, |t| Some(gate(t, "distance_correction_m")?.limit)),
    score("/{target}/judge/position_correction_m", "judged and triangulated", SECOND_PEAK, |t| gate(t, "position_correction_m")?.value),
    score("/{target}/judge/position_correction_m/limit", "judged", LIMIT, |t| Some(gate(t, "position_correction_m")?.limit)),
    score("/{target}/judge/confidence", "judged by confidence and located", MEASUREMENT, |t| gate(t, "confidence")?.value),
    score("/{target}/judge/confidence/limit", "judged by confidence", LIMIT, |t| Some(gate(t, "confidence")?.limit)),
    score("/{target}/update/sigma_m", "always", MEASUREMENT, |t| t.row().sigma_m),
    score("/{target}/update/correction_px", "matched and predicted in the left image", PREDICTION, |t| t.update.correction_px),
    score("/{target}/update/correction_m", "triangulated", PREDICTION, |t| t.update.correction_m),
    score("/truth/{target}/err_px", "matched and the truth is visible", FAILED, |t| truth(t)?.err_px),
    score("/truth/{target}/tolerance_px", "the truth is known", LIMIT, |t| Some(truth(t)?.tolerance_px)),
    score("/truth/{target}/err_m", "the truth is known", FAILED, |t| Some(truth(t)?.err_m)),
    score("/truth/{target}/nees", "the truth is known and there is a covariance", TRACKING, |t| truth(t)?.nees),
];

impl Score {
    /// The number at a step; what is not finite cannot be drawn and counts as missing.
    pub(super) fn at(&self, trace: &StepTrace) -> Option<f64> {
        (self.value)(trace).filter(|value| value.is_finite())
    }

    /// The last words of the entity: `ncc`, or `ncc limit` below it.
    fn name(&self) -> String {
        let mut words = self.entity.rsplit('/');
        let last = words.next().unwrap_or_default();
        if last == "limit" { format!("{} limit", words.next().unwrap_or_default()) } else { last.to_owned() }
    }
}

/// One number of a step.
pub(super) fn log_score(step: &Step<'_>, score: &Score) -> Logged {
    step.log(score.entity, score.at(step.trace).map(|value| Scalars::new([value])))
}

/// How the numbers of a run are drawn: their names and colours, limits thinner than what they limit.
pub(super) fn log_styles(stream: &RecordingStream, root: &str) -> Logged {
    SCORES.iter().try_for_each(|score| {
        let width = if score.rgb == LIMIT { 1.0 } else { 2.0 };
        log_series(stream, &path(score.entity, root), &score.name(), color(score.rgb), width)
    })
}

fn wanted(trace: &StepTrace) -> Option<MastAngles> {
    trace.point_mast.as_ref()?.wanted
}

fn used(trace: &StepTrace) -> Option<MastAngles> {
    trace.point_mast.as_ref()?.used
}

fn capture(trace: &StepTrace) -> Option<&Capture> {
    trace.capture.as_ref()
}

fn evidence(trace: &StepTrace) -> Option<&TemplateEvidence> {
    trace.template()
}

fn gate<'a>(trace: &'a StepTrace, name: &str) -> Option<&'a Gate> {
    trace.judge.as_ref()?.gates.iter().find(|gate| gate.name == name)
}

fn registration(trace: &StepTrace) -> Option<&Registered> {
    trace.shape()?.registration.as_ref()
}

fn check<'a>(trace: &'a StepTrace, name: &str) -> Option<&'a Check> {
    registration(trace)?.checks.iter().find(|check| check.name == name)
}

fn truth(trace: &StepTrace) -> Option<&StepTruth> {
    trace.truth.as_ref()
}
