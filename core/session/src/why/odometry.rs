//! Visual odometry in explanations: its gates, and its part in the loss of a target.
//!
//! The findings need no truth. They use the record of odometry; without one, the evidence of the matches about the pose.

use sightline_rover::visual_odometry::MeasuredMotion;
use sightline_track::settings::Settings;
use sightline_track::stages::judge::{Gate, Verdict};

use super::Book;
use super::gates::{by_margin, label};
use super::node::{Draft, OriginKind};
use super::sentence::AT_RIM_PX;
use super::template::edge_distance_px;
use super::words::{number, signed, told_apart};
use crate::metrics::uncertainty::nis;
use crate::step::RunStep;

/// The name of its stage in the record.
const STAGE: &str = "visual_odometry";

/// Minimum significant disagreement, standard deviations.
const SIGMAS: f64 = 3.0;

/// The number of the last criterion on match scores; the later ones are on the position.
const LAST_SCORE: u8 = 2;

/// The part of odometry in the loss of a target.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Finding {
    /// One sentence.
    pub(super) sentence: String,
    /// Whether odometry refused its motion, so that the pose was not corrected.
    pub(super) is_refusal: bool,
}

/// The part of odometry in the loss of the target; `None` if it is not lost, or without evidence against the pose.
pub(super) fn finding(trace: &RunStep, before: Option<&RunStep>, settings: &Settings) -> Option<Finding> {
    let verdict = trace.verdict().filter(|verdict| !verdict.good)?;
    let plain = |sentence| Finding { sentence, is_refusal: false };
    match trace.odometry.as_deref() {
        Some(measured) => match refusal(measured) {
            Some(reason) => Some(Finding { sentence: refused(&reason), is_refusal: true }),
            None => not_used(measured).map(|words| plain(format!("{words}."))),
        },
        None => {
            let evidence = against_the_pose(trace, verdict, before, settings)?;
            Some(plain(format!(
                "The pose is without visual odometry, and {evidence}: the rover may have slipped."
            )))
        }
    }
}

/// The sentence, without full stop, for a pose that is not corrected by visual odometry and differs significantly from it.
pub(super) fn disagreement(trace: &RunStep) -> Option<String> {
    not_used(trace.odometry.as_deref().filter(|measured| measured.update.accepted)?)
}

/// Why a motion was refused, as a clause with value and limit of its worst gate; `None` for an accepted motion.
pub(crate) fn refusal(measured: &MeasuredMotion) -> Option<String> {
    if measured.update.accepted {
        return None;
    }
    let margins = by_margin(&measured.update.gates);
    let failed = margins.iter().map(|margin| margin.gate).find(|gate| !gate.passed && gate.value.is_some());
    let reason = failed.and_then(gate_words).or_else(|| measured.update.missing.clone());
    Some(reason.unwrap_or_else(|| "there is no motion".to_owned()))
}

fn refused(reason: &str) -> String {
    format!("Visual odometry refused its update: {reason}; the pose is that of wheels and gyro.")
}

/// Value, limit and margin of a gate; `None` without a value.
fn gate_words(gate: &Gate) -> Option<String> {
    let [value, limit] = told_apart(gate.value?, gate.limit);
    let unit = if gate.unit.is_empty() { String::new() } else { format!(" {}", gate.unit) };
    Some(format!(
        "{} is {value}{unit}, limit {limit}{unit}, margin {}{unit}",
        label(&gate.name),
        signed(gate.margin?)
    ))
}

/// The sentence for a motion that does not correct the pose and differs significantly from it; `None` otherwise.
fn not_used(measured: &MeasuredMotion) -> Option<String> {
    let update = &measured.update;
    let (motion, covariance) = (update.after_from_before?, update.covariance?);
    let seen = motion.to_pose().inverse().translation.vector;
    let apart_m = (seen - nalgebra::Vector3::from(update.wheels_m)).norm();
    let block = covariance.fixed_view::<3, 3>(0, 0).into_owned();
    let sigma_m = block.symmetric_eigenvalues().max().max(0.0).sqrt();
    (!measured.corrects && apart_m > SIGMAS * sigma_m).then(|| {
        format!(
            "Visual odometry checks the slip alone: it puts the rover {} m ({} σ) from the pose of wheels and gyro, which is used",
            number(apart_m),
            number(apart_m / sigma_m)
        )
    })
}

/// Evidence that the pose is wrong: a good match beyond a position gate, a peak at the edge of the search window, or a
/// significant innovation at the previous step.
fn against_the_pose(
    trace: &RunStep,
    verdict: &Verdict,
    before: Option<&RunStep>,
    settings: &Settings,
) -> Option<String> {
    let is_match = !verdict.gates.iter().any(|gate| gate.criterion <= LAST_SCORE && !gate.passed);
    let is_of_position = |gate: &&Gate| gate.name.ends_with("_correction_m") && !gate.passed;
    if let Some(words) = verdict.gates.iter().find(is_of_position).filter(|_| is_match).and_then(gate_words) {
        return Some(format!("the scores of the match are good but {words}"));
    }
    let matched = trace.template().and_then(|evidence| evidence.match_template.as_ref());
    let at_rim = matched.filter(|matched| {
        matched.descent.is_none()
            && edge_distance_px(matched, settings.template.template_size_px) <= AT_RIM_PX
    });
    if at_rim.is_some() {
        return Some("the best match is at the rim of the search window".to_owned());
    }
    let before = before?;
    let sigmas = nis(before)?.sqrt();
    (sigmas > SIGMAS).then(|| {
        format!("at step {} the match was {} σ from its prediction already", before.step, number(sigmas))
    })
}

impl Book<'_> {
    /// A gate of odometry.
    pub(super) fn odometry_gate(&self, name: &str) -> Option<&Gate> {
        self.trace.odometry.as_ref()?.update.gates.iter().find(|gate| gate.name == name)
    }

    /// The stage that judges a gate.
    pub(super) fn judge_of(&self, gate: &Gate) -> &'static str {
        if self.odometry_gate(&gate.name).is_some() { STAGE } else { "judge" }
    }

    /// The value of a gate of odometry.
    pub(super) fn odometry_value(&self, gate: &Gate) -> Option<Draft> {
        self.odometry_gate(&gate.name)?;
        let quantity = match gate.name.as_str() {
            "odometry_inliers" => "inliers",
            "odometry_chi2" => "chi2_per_dof",
            "odometry_sigma_m" => "sigma_m",
            "odometry_translation_m" => "wheels_apart_m",
            "odometry_ambiguity" => "ambiguity",
            "odometry_repetition" => "repetition",
            _ => "",
        };
        let draft = self.of_record(STAGE, quantity).unwrap_or_else(|| {
            let draft = Draft::numbers(STAGE, &gate.name, &gate.unit, gate.value);
            self.origin_of(STAGE, draft)
        });
        Some(match gate.name.as_str() {
            "odometry_inlier_share" => draft.roughly(
                "inliers as a fraction of the matches",
                &["visual_odometry.inliers", "visual_odometry.matches"],
            ),
            "odometry_attitude_deg" => draft.roughly(
                "angle between the rotation by vision and the rotation by gyro and accelerometers",
                &[],
            ),
            _ => draft,
        })
    }

    /// The limit of a gate of odometry: a setting of the odometry preset, not of the tracker.
    pub(super) fn odometry_limit(&self, gate: &Gate, draft: Draft) -> Option<Draft> {
        self.odometry_gate(&gate.name)?;
        let setting = gate.setting.as_deref().unwrap_or_default();
        let formula = match setting {
            "slip_max" => "slip_max · the motion of the wheels + 5 cm".to_owned(),
            setting => format!("{setting} of the odometry preset of the drive"),
        };
        Some(draft.roughly(&formula, &[]).from(OriginKind::Setting, format!("odometry {setting}"), None))
    }
}
