//! The counterfactual: the smallest change of one setting, or of the prediction, with which a step would have been
//! accepted (R93, R97; ours).
//!
//! ```text
//! recorded step ──► goal ──► candidates: settings that tracker and stage use ──► search ──► step, recomputed ──► finding
//!                        ├─► the prediction, moved towards the match ──────────┤
//!                        └─► the prediction by visual odometry ────────────────┘
//! ```
//! | the recorded step | the goal |
//! |---|---|
//! | lost or failed | it is accepted |
//! | accepted, but false tracking | it is rejected, or accepted and right |
//!
//! Every finding is verified by computing the step with it (`track::NextStep`). If the truth is known, the finding reports
//! whether the result is right; false tracking is listed last. If a small change of a setting accepts a wrong match and a
//! larger one the right match, the larger one is the finding.
//!
//! *Smallest* means: within the grid of the setting (whole or odd numbers), and to 2 % of the change for real numbers, then
//! rounded away from the current value to few digits. The search doubles the change until the goal is reached, in both
//! directions at once, and bisects the bracket. If acceptance begins and ends within one doubling, a smaller change can be
//! missed. The limit of a failed gate has an exact answer instead, the value that failed.
//!
//! `relative` is the change over the current value; if that is 0, over the width of the setting's range; 1 for
//! switches and words; for the prediction its displacement over half the search window.
//!
//! The smallest change leaves the step close to being lost again: `with_margin` is a larger change, also verified.
//!
//! The findings are deterministic: they depend on neither time nor random numbers.

mod by_vision;
mod candidates;
mod directed;
mod margin;
mod moved;
mod search;
#[cfg(test)]
mod tests;
mod trials;
pub mod wire;
mod wording;

use std::sync::atomic::AtomicBool;

use serde::{Deserialize, Serialize};
use serde_json::Value;
use utoipa::ToSchema;

use self::trials::Trials;
use crate::step::{RunStep, StepRow};
use crate::track::Drive;
use crate::what_if::{Base, WhatIf};
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::Pixel;
use sightline_track::limits::SettingInfo;
use sightline_track::settings::Changes;
use sightline_track::target::TrackingState;

/// The goal of a change.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Goal {
    /// A lost step is accepted.
    Accepted,
    /// A step of false tracking is rejected, or accepted and right.
    NotFalse,
}

/// The outcome of a change, best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
#[schema(as = CounterfactualOutcome)]
pub enum Outcome {
    /// Accepted, and right against the truth.
    Right,
    /// Rejected, which is right for false tracking.
    Rejected,
    /// Accepted; the truth is not known.
    Unknown,
    /// Accepted, and false against the truth.
    False,
}

/// One setting that changes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SettingChange {
    /// Its name.
    pub setting: String,
    /// The value in the run.
    #[schema(value_type = Value)]
    pub from: Value,
    /// The value with which the goal is reached.
    #[schema(value_type = Value)]
    pub to: Value,
    /// Its unit, empty for pure numbers.
    pub unit: String,
}

/// A displaced prediction in the left image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Moved {
    /// The prediction of the run, px.
    pub from: Pixel,
    /// The displaced prediction, px.
    pub to: Pixel,
    /// The source of the new position, as a clause.
    pub because: String,
}

/// A change with which the goal is reached, verified.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Finding {
    /// The changed settings: one; several if no single limit suffices; none if the prediction moves.
    pub changes: Vec<SettingChange>,
    /// The displaced prediction; null if settings change.
    pub moved: Option<Moved>,
    /// The same setting with a margin beyond the smallest change, verified; null if no such value is as good.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub with_margin: Option<SettingChange>,
    /// The change over the current value of the setting; for the prediction, its displacement over half the search window.
    pub relative: f64,
    /// The outcome.
    pub outcome: Outcome,
    /// The gate that failed by the largest margin in the recorded step.
    pub gate: Option<String>,
    /// The unit of that gate.
    pub gate_unit: String,
    /// The margin of that gate with the change, in `gate_unit`.
    pub margin_after: Option<f64>,
    /// The row of the step with the change.
    pub row: StepRow,
    /// Number of times the step was computed to find it.
    pub runs: usize,
    /// The finding as one sentence.
    pub sentence: String,
}

impl Finding {
    /// The change as a what-if of the step, or for a new branch.
    pub fn what_if(&self) -> WhatIf {
        let changes = self.changes.iter().map(|change| (change.setting.clone(), change.to.clone()));
        WhatIf {
            settings: changes.collect(),
            prediction_px: self.moved.as_ref().map(|moved| moved.to),
            arrays: Vec::new(),
        }
    }
}

/// The answer so far: the progress of the search and its findings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Answer {
    /// The goal of the search.
    pub goal: Goal,
    /// Candidates examined.
    pub k: usize,
    /// Candidates in all.
    pub n: usize,
    /// The candidate being examined; empty at the end.
    pub doing: String,
    /// Number of times the step was computed.
    pub runs: usize,
    /// The findings: by outcome, best first, then by size.
    pub findings: Vec<Finding>,
    /// The candidates without success: settings by name, `limits together`, `prediction` and `visual odometry`.
    pub without: Vec<String>,
}

/// The goal of a counterfactual for a step.
///
/// # Errors
/// [`Error::Request`] with the reason why the step has no counterfactual.
pub fn goal(base: &Base<'_>) -> Result<Goal> {
    let step = base.recorded.step;
    let refuse = |why: String| Err(Error::Request(why));
    if let Some(fault) = base.recorded.fault() {
        return refuse(format!("the files of step {step} are at fault, which no setting mends: {fault}"));
    }
    if let Some(why) = base.recorded.why_not_searched() {
        return refuse(format!("at step {step} {why}: choose a tracked step"));
    }
    if let Some(before) = base.recorded.paused_before() {
        return refuse(format!(
            "step {step} is not decided yet: the drive is paused before `{}`",
            before.word()
        ));
    }
    let (Some(verdict), Some(_)) = (base.recorded.verdict(), base.last) else {
        return refuse(format!("the target is designated at step {step}: nothing is judged there"));
    };
    if verdict.state_before == TrackingState::Failed {
        return refuse(format!(
            "the target had failed before step {step}, so that no update is used any more: choose the step where it was lost"
        ));
    }
    let is_false = base.recorded.truth.as_ref().is_some_and(|truth| truth.tracked == Some(false));
    match (verdict.accepted, is_false) {
        (false, _) => Ok(Goal::Accepted),
        (true, true) => Ok(Goal::NotFalse),
        (true, false) => refuse(format!(
            "step {step} was accepted, and nothing says that it is wrong: there is nothing to save"
        )),
    }
}

/// Searches for the changes that reach the goal; calls `on` with the answer so far after each candidate.
///
/// # Errors
/// As [`goal`]; [`Error::Cancelled`] soon after `cancel` is set.
pub fn look<D: Drive>(
    drive: &D,
    base: Base<'_>,
    cancel: &AtomicBool,
    on: &mut dyn FnMut(&Answer),
) -> Result<Answer> {
    let goal = goal(&base)?;
    let infos = candidates::candidates(&base, goal);
    let mut trials = Trials::new(drive, base, goal, cancel);
    let combined = directed::combined(&trials);
    let is_moved = base.recorded.template().is_some() || base.recorded.shape().is_some();
    let has_vision = is_moved && by_vision::applies(base.recorded);
    let n = infos.len() + usize::from(combined.is_some()) + usize::from(is_moved) + usize::from(has_vision);
    let (findings, without) = (Vec::new(), Vec::new());
    let mut answer = Answer { goal, k: 0, n, doing: String::new(), runs: 0, findings, without };
    if let Some(changes) = combined {
        answer.begin("the failed limits together", on);
        let found = directed::together(&mut trials, &changes)?;
        answer.end("limits together", found, &trials, on);
    }
    if has_vision {
        answer.begin("visual odometry", on);
        let found = by_vision::look(&mut trials, cancel.into())?;
        answer.end("visual odometry", found, &trials, on);
    }
    if is_moved {
        answer.begin("the prediction, moved", on);
        let found = moved::look(&mut trials)?;
        answer.end("prediction", found, &trials, on);
    }
    for info in &infos {
        answer.begin(&info.key, on);
        let found = one_setting(&mut trials, info)?;
        answer.end(&info.key, found, &trials, on);
    }
    answer.doing.clear();
    Ok(answer)
}

impl Answer {
    fn begin(&mut self, what: &str, on: &mut dyn FnMut(&Self)) {
        what.clone_into(&mut self.doing);
        on(self);
    }

    fn end<D: Drive>(
        &mut self,
        name: &str,
        found: Option<Finding>,
        trials: &Trials<'_, D>,
        on: &mut dyn FnMut(&Self),
    ) {
        match found {
            Some(finding) => {
                let is_before =
                    |other: &Finding| (other.outcome, other.relative) <= (finding.outcome, finding.relative);
                let place = self.findings.iter().take_while(|other| is_before(other)).count();
                self.findings.insert(place, finding);
            }
            None => self.without.push(name.to_owned()),
        }
        self.k += 1;
        self.runs = trials.runs;
        on(self);
    }
}

/// Finds the smallest change of one setting.
fn one_setting<D: Drive>(trials: &mut Trials<'_, D>, info: &SettingInfo) -> Result<Option<Finding>> {
    trials.check()?;
    let before = trials.runs;
    let Some(from) = trials.base.settings.value(&info.group, &info.key) else { return Ok(None) };
    let found = match directed::exact_limit(trials, info, &from) {
        Some(to) => search::verified(trials, info, to)?,
        None => search::smallest(trials, info, &from)?,
    };
    let Some((to, trace)) = found else { return Ok(None) };
    let change = SettingChange { setting: info.key.clone(), from, to, unit: info.unit.clone() };
    let with_margin = margin::of(trials, info, &change, &trace)?;
    let runs = trials.runs - before;
    let relative = search::relative(info, &change.from, &change.to);
    let finding = trials.finding(vec![change], None, relative, (&trace, runs));
    Ok(Some(Finding { with_margin, ..finding }))
}

/// The changed settings by name, with their new values.
fn changes_of(changes: &[SettingChange]) -> Changes {
    changes.iter().map(|change| (change.setting.clone(), change.to.clone())).collect()
}

/// Whether a step is accepted.
fn is_accepted(trace: &RunStep) -> bool {
    trace.verdict().is_some_and(|verdict| verdict.accepted)
}
