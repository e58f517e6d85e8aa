//! The numbers of a step, one scalar per entity, for the time series.
//!
//! Every number declared by a stage is logged as `/{target}/record/{stage}/{quantity}`. Numbers plotted by the layout also
//! have coloured entities next to the evidence: a table of entities with the quantity or gate that each shows.

use rerun::{RecordingStream, Scalars};
use sightline_record::{Kind, Unit};
use sightline_session::records::{self, StageQuantity};
use sightline_session::step::RunStep;

use super::Logged;
use super::palette::{FAILED, LIMIT, LOST, MEASUREMENT, PREDICTION, Rgb, SECOND_PEAK, TRACKING, color};
use super::step::{Step, log_series, path};

/// One plotted number of a step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Score {
    /// Its entity; a suffix such as `_deg` is the unit in which it is logged.
    pub(super) entity: &'static str,
    /// The condition for the number, in words.
    pub(super) when: &'static str,
    /// The number in the record: `stage.quantity`, or `stage.gates.name.value` and `.limit` of a gate.
    source: &'static str,
    rgb: Rgb,
}

const fn score(entity: &'static str, when: &'static str, rgb: Rgb, source: &'static str) -> Score {
    Score { entity, when, source, rgb }
}

/// All plotted numbers, in the order of the stages.
#[rustfmt::skip]
pub(super) const SCORES: &[Score] = &[
    score("/{target}/point_mast/wanted_azimuth_deg", "there is a mast and it reaches", PREDICTION, "point_mast.wanted.azimuth_rad"),
    score("/{target}/point_mast/wanted_elevation_deg", "there is a mast and it reaches", SECOND_PEAK, "point_mast.wanted.elevation_rad"),
    score("/{target}/point_mast/used_azimuth_deg", "there is a mast", MEASUREMENT, "point_mast.used.azimuth_rad"),
    score("/{target}/point_mast/used_elevation_deg", "there is a mast", LOST, "point_mast.used.elevation_rad"),
    score("/{target}/capture/subframe_mean", "the subframe lies in the image", MEASUREMENT, "capture.subframe_mean"),
    score("/{target}/capture/subframe_saturated", "the subframe lies in the image", LOST, "capture.subframe_saturated"),
    score("/{target}/locate/scale_roll/scale", "prepared", MEASUREMENT, "scale_roll.scale"),
    score("/{target}/locate/scale_roll/roll_deg", "prepared", SECOND_PEAK, "scale_roll.roll_rad"),
    score("/{target}/locate/match_template/second_peak_ratio", "there is a second peak", LOST, "match_template.second_peak.ratio"),
    score("/{target}/locate/point_stereo/range_m", "stereo matched", MEASUREMENT, "point_stereo.range_m"),
    score("/{target}/locate/point_stereo/across_px", "stereo matched", LOST, "point_stereo.across_px"),
    score("/{target}/locate/triangulate/gap_px", "triangulated", SECOND_PEAK, "triangulate.gap_px"),
    score("/{target}/locate/fit_motion/inliers", "a motion was fitted", TRACKING, "fit_motion.inliers"),
    score("/{target}/locate/coarse_register/mean_m", "shifts were searched and surfaces overlap", MEASUREMENT, "coarse_register.mean_coarse_m"),
    score("/{target}/locate/refine_register/mean_m", "surfaces were compared", SECOND_PEAK, "refine_register.mean_fine_m"),
    score("/{target}/locate/refine_register/overlap", "surfaces were compared", MEASUREMENT, "refine_register.overlap"),
    score("/{target}/locate/refine_register/overlap/limit", "registered", LIMIT, "refine_register.gates.shape_overlap.limit"),
    score("/{target}/locate/refine_register/misfit", "surfaces were compared", LOST, "refine_register.misfit"),
    score("/{target}/locate/refine_register/misfit/limit", "registered", LIMIT, "refine_register.gates.shape_misfit.limit"),
    score("/{target}/locate/refine_register/sigma_m", "the shape holds the target", TRACKING, "refine_register.sigma_m"),
    score("/{target}/locate/refine_register/sigma_m/limit", "registered", LIMIT, "refine_register.gates.shape_sigma_m.limit"),
    score("/{target}/locate/hand_off/score", "the last picture was found at a hand-off", MEASUREMENT, "hand_off.score"),
    score("/{target}/judge/ncc", "judged and matched", MEASUREMENT, "judge.gates.ncc.value"),
    score("/{target}/judge/ncc/limit", "judged", LIMIT, "judge.gates.ncc.limit"),
    score("/{target}/judge/stereo_ncc", "judged and stereo matched", SECOND_PEAK, "judge.gates.stereo_ncc.value"),
    score("/{target}/judge/stereo_ncc/limit", "judged", LIMIT, "judge.gates.stereo_ncc.limit"),
    score("/{target}/judge/distance_correction_m", "judged and triangulated", MEASUREMENT, "judge.gates.distance_correction_m.value"),
    score("/{target}/judge/distance_correction_m/limit", "judged", LIMIT, "judge.gates.distance_correction_m.limit"),
    score("/{target}/judge/position_correction_m", "judged and triangulated", SECOND_PEAK, "judge.gates.position_correction_m.value"),
    score("/{target}/judge/position_correction_m/limit", "judged", LIMIT, "judge.gates.position_correction_m.limit"),
    score("/{target}/judge/confidence", "judged by confidence and located", MEASUREMENT, "judge.gates.confidence.value"),
    score("/{target}/judge/confidence/limit", "judged by confidence", LIMIT, "judge.gates.confidence.limit"),
    score("/{target}/update/sigma_m", "always", MEASUREMENT, "step.sigma_m"),
    score("/{target}/update/correction_px", "matched and predicted in the left image", PREDICTION, "update.correction_px"),
    score("/{target}/update/correction_m", "triangulated", PREDICTION, "update.correction_m"),
    score("/truth/{target}/err_px", "matched and the truth is visible", FAILED, "truth.err_px"),
    score("/truth/{target}/tolerance_px", "the truth is known", LIMIT, "truth.tolerance_px"),
    score("/truth/{target}/err_m", "the truth is known", FAILED, "truth.err_m"),
    score("/truth/{target}/nees", "the truth is known and there is a covariance", TRACKING, "truth.nees"),
];

impl Score {
    /// The number at a step; `None` if it is missing or not finite.
    pub(super) fn at(&self, trace: &RunStep) -> Option<f64> {
        self.read(trace).filter(|value| value.is_finite())
    }

    fn read(&self, trace: &RunStep) -> Option<f64> {
        if let Some((stage, gate)) = self.source.split_once(".gates.") {
            let (name, part) = gate.rsplit_once('.')?;
            let gates = records::stage(stage)?.record(trace).gates;
            let gate = gates.into_iter().find(|gate| gate.name == name)?;
            return if part == "limit" { Some(gate.limit) } else { gate.value };
        }
        let quantity = StageQuantity::named(self.source)?;
        let declared = quantity.declared().unit;
        let logged = Unit::of_name(self.entity).unwrap_or(declared);
        Some(quantity.number(trace)? * (logged.per_base() / declared.per_base()))
    }

    /// The last segment of the entity, such as `ncc`, or `ncc limit` for a limit.
    fn name(&self) -> String {
        let mut words = self.entity.rsplit('/');
        let last = words.next().unwrap_or_default();
        if last == "limit" { format!("{} limit", words.next().unwrap_or_default()) } else { last.to_owned() }
    }
}

/// Every number declared by the stages, in their order.
pub(super) fn declared() -> impl Iterator<Item = StageQuantity> {
    StageQuantity::all()
        .filter(|quantity| matches!(quantity.declared().kind, Kind::Number | Kind::Count | Kind::Flag))
}

/// The entity of a declared number.
pub(super) fn entity_of(quantity: StageQuantity) -> String {
    let name = quantity.declared().name.replace('.', "/");
    format!("/{{target}}/record/{}/{name}", quantity.stage().schema().stage)
}

fn name_of(quantity: StageQuantity) -> String {
    let declared = quantity.declared();
    format!("{} {}", declared.name, declared.unit.symbol()).trim_end().to_owned()
}

/// Logs the numbers declared by the stages.
pub(super) fn log_declared(step: &Step<'_>) -> Logged {
    declared().try_for_each(|number| {
        step.log(&entity_of(number), number.number(step.trace).map(|value| Scalars::new([value])))
    })
}

/// Logs one plotted number of a step.
pub(super) fn log_score(step: &Step<'_>, score: &Score) -> Logged {
    step.log(score.entity, score.at(step.trace).map(|value| Scalars::new([value])))
}

/// Logs the drawing style of a run's numbers: names and colours, with limits thinner than the limited quantities.
pub(super) fn log_styles(stream: &RecordingStream, root: &str) -> Logged {
    declared().try_for_each(|number| {
        log_series(stream, &path(&entity_of(number), root), &name_of(number), color(MEASUREMENT), 2.0)
    })?;
    SCORES.iter().try_for_each(|score| {
        let width = if score.rgb == LIMIT { 1.0 } else { 2.0 };
        log_series(stream, &path(score.entity, root), &score.name(), color(score.rgb), width)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_score_reads_a_declared_number() {
        for score in SCORES {
            let is_declared = match score.source.split_once(".gates.") {
                Some((stage, gate)) => {
                    let (name, part) = gate.rsplit_once('.').unwrap();
                    let gates = &records::stage(stage).unwrap().schema().gates;
                    gates.iter().any(|gate| gate.name == name) && ["value", "limit"].contains(&part)
                }
                None => {
                    let declared = StageQuantity::named(score.source).unwrap().declared();
                    let logged = Unit::of_name(score.entity).unwrap_or(declared.unit);
                    logged.dimension() == declared.unit.dimension()
                }
            };
            assert!(is_declared, "{} ← {}", score.entity, score.source);
        }
    }
}
