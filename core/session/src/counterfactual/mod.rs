//! The counterfactual: the smallest change of one setting, or of the prediction, with which a step would have been
//! accepted (R93, R97; ours).
//!
//! ```text
//! recorded step ──► goal ──► candidates: settings that tracker and stage use ──► search ──► the step, really run ──► finding
//!                        ├─► the prediction, moved to where the match is ──────┤
//!                        └─► the prediction, where visual odometry puts it ────┘
//! ```
//! | the recorded step | the goal |
//! |---|---|
//! | lost or failed | it is accepted |
//! | accepted, yet false against the truth | it is rejected, or accepted and right |
//!
//! Every finding was verified by computing the step with it (`track::NextStep`), and says whether the result is
//! right where the truth is known: an acceptance that is false tracking is said plainly and comes last. Of a setting with
//! which a small change accepts a wrong match and a larger one the right match, the larger one is the finding.
//!
//! *Smallest* is meant within the grid of the setting (whole or odd numbers), and to two hundredths of the change for real
//! numbers, then rounded away from the present value to a sensible digit. The search doubles the change until the step
//! turns, in both directions at once, and halves the bracket: where acceptance comes and goes within a doubling, an
//! earlier turn can be missed. The limit of a failed criterion has an exact answer instead, the value that failed.
//!
//! `relative` is the change over the present value; where that is 0, over the width of the setting's range; 1 for
//! switches and words; for the prediction its way over half the search window.
//!
//! The smallest change leaves the step at the edge of being lost again: `with_margin` is a larger one, verified too.
//!
//! No clock, no chance: the same step gives the same findings.

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

/// What a change is to bring about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Goal {
    /// A lost step is accepted.
    Accepted,
    /// A step of false tracking is rejected, or accepted and right.
    NotFalse,
}

/// What came of a change, best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
#[schema(as = CounterfactualOutcome)]
pub enum Outcome {
    /// Accepted, and right against the truth.
    Right,
    /// Rejected, as false tracking should be.
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
    /// The value with which the step turns.
    #[schema(value_type = Value)]
    pub to: Value,
    /// Its unit, empty for pure numbers.
    pub unit: String,
}

/// A prediction that is put elsewhere in the left image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Moved {
    /// Where the run had it, px.
    pub from: Pixel,
    /// Where it is put, px.
    pub to: Pixel,
    /// How it was known where to, as a clause.
    pub because: String,
}

/// A change with which the step turns, verified.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Finding {
    /// The settings that change: one; several where no single limit suffices; none where the prediction moves.
    pub changes: Vec<SettingChange>,
    /// The prediction that moves.
    pub moved: Option<Moved>,
    /// The same setting with a margin beyond the smallest change, verified; `None` where no such value is as good.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub with_margin: Option<SettingChange>,
    /// The size of the change (see the module).
    pub relative: f64,
    /// What came of it.
    pub outcome: Outcome,
    /// The criterion that failed worst in the recorded step.
    pub gate: Option<String>,
    /// Its unit.
    pub gate_unit: String,
    /// Its margin with the change, in its unit.
    pub margin_after: Option<f64>,
    /// The step with the change, as one line.
    pub row: StepRow,
    /// How many times the step was computed for it.
    pub runs: usize,
    /// All of this as one sentence.
    pub sentence: String,
}

impl Finding {
    /// The change as it is tried at the step, or branched.
    pub fn what_if(&self) -> WhatIf {
        let changes = self.changes.iter().map(|change| (change.setting.clone(), change.to.clone()));
        WhatIf {
            settings: changes.collect(),
            prediction_px: self.moved.as_ref().map(|moved| moved.to),
            arrays: Vec::new(),
        }
    }
}

/// How far the question is answered.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Answer {
    /// What was looked for.
    pub goal: Goal,
    /// Settings and places looked at.
    pub k: usize,
    /// How many there are.
    pub n: usize,
    /// What is looked at now; empty at the end.
    pub doing: String,
    /// How many times the step was computed.
    pub runs: usize,
    /// What was found: right first, then the smallest change.
    pub findings: Vec<Finding>,
    /// What was looked at without success: settings by name, `prediction` and `visual odometry`.
    pub without: Vec<String>,
}

/// What is asked about a step.
///
/// # Errors
/// [`Error::Request`] with the sentence that says why there is nothing to ask.
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

/// Looks for the changes with which the step turns; `on` hears of every one as it is found.
///
/// # Errors
/// Those of [`goal`]; [`Error::Cancelled`] soon after `cancel` is set.
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

/// The smallest change of one setting.
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

/// What of a recorded step and its truth a change turns.
fn changes_of(changes: &[SettingChange]) -> Changes {
    changes.iter().map(|change| (change.setting.clone(), change.to.clone())).collect()
}

/// Whether a step is accepted.
fn is_accepted(trace: &RunStep) -> bool {
    trace.verdict().is_some_and(|verdict| verdict.accepted)
}
