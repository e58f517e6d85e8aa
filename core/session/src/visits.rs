//! A drive to several targets in turn (R207–R209): the completed visits, and the next target.
//!
//! All targets are tracked at every stop while the rover drives to one of them. Targets out of view, because the mast is
//! pointed at the current one, are propagated by the pose estimate until the mast is pointed at them. A target that failed,
//! or whose goal cannot be reached, is skipped; conditions of the rover itself (slip, tilt, a stall, time) end the drive.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::Session;
use crate::driving::{Steering, summary};
use crate::step::RunStep;
use crate::stop_cause::StopExplanation;
use sightline_geometry::error::{Error, Result};
use sightline_recordings::DrivenTraverse;
use sightline_rover::driving::{DriveCommand, Ending, StopReason, WAITING_MAX, WaitingTarget};
use sightline_track::trace::StepTrace;

/// A visit: the drive to one target, with its end.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Visit {
    /// The target's number.
    pub target: usize,
    /// The stop at which the drive to it began.
    pub since: usize,
    /// The stop at which the drive to it ended.
    pub until: usize,
    /// Why it ended.
    pub reason: StopReason,
    /// Details of the reason; null without details.
    #[serde(default)]
    pub detail: Option<String>,
    /// Root cause of an end before the goal, its evidence, and changes that alter the decision there; null after arrival.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<StopExplanation>,
    /// Distance between the estimated and the true target in the rover frame at that stop, m; null without truth.
    pub target_error_m: Option<f64>,
    /// Horizontal distance of the true rover from the goal computed from the true target, m; null without truth.
    pub goal_error_m: Option<f64>,
}

impl Visit {
    /// The visit that ended at the last step of a run.
    pub(crate) fn of(
        world: &DrivenTraverse,
        command: &DriveCommand,
        (target, steps): (usize, &[Arc<RunStep>]),
        ending: &Ending,
        why: Option<StopExplanation>,
    ) -> Self {
        let first = steps.first().map_or(0, |first| first.step);
        let outcome = summary(world, command, steps, &[]);
        Self {
            target,
            since: command.since.unwrap_or(first),
            until: steps.last().map_or(first, |last| last.step),
            reason: ending.reason,
            detail: ending.detail.clone(),
            why,
            target_error_m: outcome.target_error_m,
            goal_error_m: outcome.goal_error_m,
        }
    }
}

/// The waiting target of a designation step.
pub(crate) fn waiting_target(first: &StepTrace) -> WaitingTarget {
    let target = &first.update.target;
    WaitingTarget {
        designation: target.designation,
        in_site_m: target.initial_position_in_site.coords.into(),
    }
}

impl Session {
    /// Records the visit that ended at the last stop, with its cause `why`, and begins the drive to the next target. Returns
    /// the new target and run; `None` if there is no next target, or the rover cannot drive on.
    ///
    /// # Errors
    /// [`Error::Request`] if no run drives.
    pub fn visit_next(
        &mut self,
        world: &DrivenTraverse,
        ending: &Ending,
        why: Option<StopExplanation>,
    ) -> Result<Option<(usize, usize)>> {
        let steering = self.steering.clone();
        let steering = steering.ok_or_else(|| Error::Request("nobody drives in this session".to_owned()))?;
        let run = self.run(steering.target, steering.run)?;
        let visit = Visit::of(world, &steering.command, (steering.target, run.whole_steps()), ending, why);
        let until = visit.until;
        // A continued drive, possibly under a changed command, ends the same visit again.
        self.visits.retain(|known| (known.target, known.since) != (visit.target, visit.since));
        if !steering.then.is_empty() || !self.visits.is_empty() {
            self.visits.push(visit);
        }
        if !ending.reason.is_of_target() {
            return Ok(None);
        }
        let mut then = steering.then.iter().copied();
        let Some((target, run)) = then.find_map(|target| Some((target, self.newest_run(target)?))) else {
            return Ok(None);
        };
        let then: Vec<usize> = then.collect();
        let waiting = self.waiting(&then);
        let command = DriveCommand { since: Some(until), waiting, ..steering.command.clone() };
        self.steering = Some(Steering { target, run, command, then, ..steering });
        Ok(Some((target, run)))
    }

    /// The targets with these numbers as waiting targets; those not yet located are left out.
    pub(crate) fn waiting(&self, then: &[usize]) -> Vec<WaitingTarget> {
        let first = |target: &usize| self.run(*target, self.newest_run(*target)?).ok()?.steps.first();
        then.iter().filter_map(|target| Some(waiting_target(&first(target)?.trace))).collect()
    }

    /// The number of a target's newest run; `None` for a target that was removed.
    fn newest_run(&self, target: usize) -> Option<usize> {
        self.target(target).ok()?.runs.iter().rposition(|run| !run.removed)
    }

    /// Checks the list of following targets.
    ///
    /// # Errors
    /// [`Error::Setting`] with the entry, if the list is too long, or a target does not exist or is listed twice.
    pub(crate) fn check_then(&self, target: usize, then: &[usize]) -> Result<()> {
        if then.len() > WAITING_MAX {
            let problem = format!(
                "{} targets are more than {WAITING_MAX}, the most that a drive visits afterwards",
                then.len()
            );
            return Err(Error::setting("then", problem));
        }
        for (index, next) in then.iter().enumerate() {
            let refuse = |problem: String| Err(Error::setting(format!("then[{index}]"), problem));
            if self.target(*next).is_err() {
                return refuse(format!("there is no target {next}"));
            }
            if *next == target || then[..index].contains(next) {
                return refuse(format!("target {next} is visited already"));
            }
        }
        Ok(())
    }
}
