//! Rows of a study's table: one per configuration, seed and point of the grid.
//!
//! Counts are of runs, one per target, judged at the last step (R116), unless they end in `_steps`. Targets on an
//! occluding boundary among others are counted separately, as in the paper (R119), and so are those in front of which
//! another rock passes. Refused designations, and targets whose drive ended early because of slip (`not_driven`), count
//! as not tracked. *False tracking*: state `tracking` while not tracked. *False loss*: lost or failed while the
//! evidence, had it been accepted, was right. If the truth is hidden at the last step, the run is `unjudged`.
//!
//! Errors at the last step have their number beside them: `err_px`, `err_m` and `drift_m` of the tracked runs, and
//! `err_all_m` and `drift_all_m` of all runs that were not refused.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::Value;
use utoipa::ToSchema;

use sightline_geometry::estimate::quantile::median;

use super::by_pose_row::DriveOdometry;
use super::calibration::Calibration;
use super::catalogue::Study;
use super::confidence::Trust;
use super::evenness;
use super::plan::Unit;
use super::run::{Fate, Run};
use super::spread::spread;

/// Group of targets on an occluding boundary.
pub(crate) const BOUNDARY: &str = "boundary";

/// Group of targets in front of which another rock passes.
pub(crate) const PASSED: &str = "passed";

/// One row; flat when serialised.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Row {
    /// Name of the study.
    pub study: String,
    /// Name of the configuration.
    pub configuration: String,
    /// Name of the scenario.
    pub scenario: String,
    /// Seed of the world.
    pub seed: u64,
    /// The study's variables, counts and measured values, by name.
    #[serde(flatten)]
    #[schema(additional_properties, value_type = Object)]
    pub columns: BTreeMap<String, Value>,
}

impl Row {
    /// A column as a number; `None` if it is missing or no number.
    pub fn number(&self, column: &str) -> Option<f64> {
        self.columns.get(column)?.as_f64()
    }
}

/// Rows of a unit: one, or one per step for studies of single steps.
pub fn rows(study: &Study, unit: &Unit) -> Vec<Row> {
    let row = |columns: BTreeMap<String, Value>| Row {
        study: study.name.to_owned(),
        configuration: unit.configuration.clone(),
        scenario: unit.scenario.clone(),
        seed: unit.seed,
        columns: unit.point.variables.iter().cloned().chain(columns).collect(),
    };
    if study.is_by_step {
        unit.runs.iter().flat_map(by_step).map(row).collect()
    } else {
        let mut columns = columns(&unit.runs.iter().collect::<Vec<_>>(), 1);
        columns.extend(unit.odometry.iter().flat_map(DriveOdometry::columns));
        vec![row(columns)]
    }
}

/// Counts and errors of runs in `worlds` worlds.
pub fn columns(runs: &[&Run], worlds: usize) -> BTreeMap<String, Value> {
    let is_apart = |run: &Run| run.group == BOUNDARY || run.group == PASSED;
    let among_others = runs.iter().any(|run| !is_apart(run));
    let (apart, own): (Vec<&Run>, Vec<&Run>) = runs.iter().partition(|run| among_others && is_apart(run));
    let mut columns = counts(&own);
    for group in [BOUNDARY, PASSED] {
        let of_group: Vec<&Run> = apart.iter().copied().filter(|run| run.group == group).collect();
        if !of_group.is_empty() {
            let counted = counts(&of_group);
            for name in ["targets", "tracked", "false_tracked", "false_lost"] {
                columns.insert(format!("{group}_{name}"), counted[name].clone());
            }
        }
    }
    let tracked: Vec<&Run> = own.iter().copied().filter(|run| is_tracked(run)).collect();
    let of = |value: fn(&Run) -> Option<f64>| -> Vec<f64> {
        tracked.iter().filter_map(|run| value(run)).collect()
    };
    spread(&mut columns, "err_px", &of(|run| run.summary.final_err_px));
    spread(&mut columns, "err_m", &of(|run| run.summary.final_err_m));
    spread(&mut columns, "drift_m", &of(|run| run.drift_m));
    let all: Vec<f64> = own.iter().filter_map(|run| run.summary.final_err_m).collect();
    spread(&mut columns, "err_all_m", &all);
    let all: Vec<f64> = own.iter().filter_map(|run| run.drift_m).collect();
    spread(&mut columns, "drift_all_m", &all);
    columns.extend(trust(&own));
    columns.insert("sigma_m_median".to_owned(), median(&of(|run| run.sigma_m)).into());
    if let Some(calibration) = Calibration::of(&of(|run| run.nees), worlds) {
        columns.insert("nees_mean".to_owned(), calibration.mean_nees.into());
        columns.insert("nees_low".to_owned(), calibration.band[0].into());
        columns.insert("nees_high".to_owned(), calibration.band[1].into());
        columns.insert("inside_3_sigma".to_owned(), calibration.inside_3_sigma.into());
    }
    if let Some([uneven_px, truth_px]) = evenness::of_rows(&own) {
        columns.insert("uneven_px".to_owned(), uneven_px.into());
        columns.insert("uneven_true_px".to_owned(), truth_px.into());
    }
    columns.extend(faults(&own));
    columns.extend(super::hand_over_row::columns(&own));
    columns.extend(super::by_pose_row::columns(&own));
    columns
}

/// Returns whether a run is tracked at the last step of the planned drive.
pub fn is_tracked(run: &Run) -> bool {
    run.summary.run_tracked == Some(true) && !run.is_not_driven()
}

fn counts(runs: &[&Run]) -> BTreeMap<String, Value> {
    let count = |is: &dyn Fn(&Run) -> bool| runs.iter().filter(|run| is(run)).count();
    let sum = |of: fn(&Run) -> usize| runs.iter().map(|run| of(run)).sum::<usize>();
    let says_tracking = |run: &Run| run.state.as_deref() == Some("tracking");
    let tracked = count(&is_tracked);
    let share = tracked as f64 / runs.len().max(1) as f64;
    [
        ("targets", runs.len().into()),
        ("refused", count(&|run| run.refused.is_some()).into()),
        ("unjudged", count(&|run| run.refused.is_none() && run.summary.run_tracked.is_none()).into()),
        ("tracked", tracked.into()),
        ("tracked_share", share.into()),
        ("false_tracked", count(&|run| says_tracking(run) && run.summary.run_tracked == Some(false)).into()),
        ("false_lost", count(&|run| run.end_is_false_loss).into()),
        ("steps", sum(|run| run.summary.steps).into()),
        ("false_tracked_steps", sum(|run| run.summary.false_tracked.unwrap_or(0)).into()),
        ("false_lost_steps", sum(|run| run.summary.false_lost.unwrap_or(0)).into()),
    ]
    .map(|(name, value): (&str, Value)| (name.to_owned(), value))
    .into()
}

/// Reliability of the confidence, and errors of the measured motions; empty if none were measured.
fn trust(runs: &[&Run]) -> BTreeMap<String, Value> {
    let mut columns = BTreeMap::new();
    let of = |values: fn(&Trust) -> &Vec<f64>| -> Vec<f64> {
        runs.iter().flat_map(|run| values(&run.trust).iter().copied()).collect()
    };
    let metres = of(|trust| &trust.motion_errors_m);
    if metres.is_empty() {
        return columns;
    }
    spread(&mut columns, "motion_err_m", &metres);
    spread(&mut columns, "motion_err_rad", &of(|trust| &trust.motion_errors_rad));
    let sum = |of: fn(&Trust) -> usize| runs.iter().map(|run| of(&run.trust)).sum::<usize>();
    let counts = [
        ("confident_steps", sum(|trust| trust.sure)),
        ("confident_wrong_steps", sum(|trust| trust.surely_wrong)),
        ("confident_wrong", runs.iter().filter(|run| run.trust.surely_wrong > 0).count()),
    ];
    columns.extend(counts.map(|(name, count)| (name.to_owned(), count.into())));
    columns
}

/// Outcomes of the cases of a fault: at its step, and at the end.
fn faults(runs: &[&Run]) -> BTreeMap<String, Value> {
    let cases: Vec<&&Run> =
        runs.iter().filter(|run| run.fault_step.is_some() && run.at_fault.is_some()).collect();
    if cases.is_empty() {
        return BTreeMap::new();
    }
    let at = |fate: Fate| cases.iter().filter(|run| run.at_fault == Some(fate)).count();
    let lost_then = |end: &dyn Fn(&Run) -> bool| {
        cases.iter().filter(|run| run.at_fault == Some(Fate::Lost) && end(run)).count()
    };
    [
        ("cases", cases.len()),
        ("fault_tracked", at(Fate::Tracked)),
        ("fault_lost", at(Fate::Lost)),
        ("fault_false", at(Fate::False)),
        ("cases_ever_false", cases.iter().filter(|run| run.false_after_fault > 0).count()),
        ("recovered", lost_then(&|run| run.end == Some(Fate::Tracked))),
        ("failed", lost_then(&|run| run.state.as_deref() == Some("failed"))),
    ]
    .map(|(name, count)| (name.to_owned(), count.into()))
    .into()
}

/// Rows of a single run, one per step.
fn by_step(run: &Run) -> Vec<BTreeMap<String, Value>> {
    if run.refused.is_some() {
        let columns = [("position", 1), ("targets", 1), ("refused", 1), ("tracked", 0)];
        return vec![columns.map(|(name, value)| (name.to_owned(), Value::from(value))).into()];
    }
    let row = |step: &super::step_record::StepRecord| -> BTreeMap<String, Value> {
        let says_tracking = step.state == "tracking";
        let mut columns: BTreeMap<String, Value> = match serde_json::to_value(step) {
            Ok(Value::Object(fields)) => fields.into_iter().collect(),
            _ => BTreeMap::new(),
        };
        let counts = [
            ("targets", 1),
            ("refused", 0),
            ("unjudged", usize::from(step.tracked.is_none())),
            ("tracked", usize::from(step.tracked == Some(true))),
            ("false_tracked", usize::from(says_tracking && step.tracked == Some(false))),
            ("false_lost", usize::from(step.is_false_loss)),
        ];
        columns.extend(counts.map(|(name, count)| (name.to_owned(), count.into())));
        columns
    };
    run.steps.iter().map(row).collect()
}

#[cfg(test)]
#[path = "row_tests.rs"]
mod tests;
