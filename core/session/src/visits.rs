//! A drive to several targets, one after the other (R207–R209): which were visited, and the next one.
//!
//! All targets are tracked at every stop while the rover drives to one of them. Those that are out of view, as the mast is pointed
//! at that one, are carried by the pose estimate until the mast looks at them. A target that the tracker gave up, or whose goal cannot be reached, is dropped;
//! what concerns the rover itself (slip, tilt, a stall, time) ends the whole drive.

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

/// A target that the rover was sent to, and how that part of the drive ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Visit {
    /// The target's number.
    pub target: usize,
    /// The stop at which the rover was sent to it.
    pub since: usize,
    /// The stop at which that ended.
    pub until: usize,
    /// Why it ended.
    pub reason: StopReason,
    /// Details of the reason; null where there are none.
    #[serde(default)]
    pub detail: Option<String>,
    /// Root cause of an end before the goal, its evidence, and changes that alter the decision there; null where it has arrived.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<StopExplanation>,
    /// Distance between the estimated and the true target in the rover frame at that stop, m; null without truth.
    pub target_error_m: Option<f64>,
    /// Horizontal distance of the true rover from the goal that follows from the true target, m; null without truth.
    pub goal_error_m: Option<f64>,
}

impl Visit {
    /// The visit to a target that ended at the last of a run's steps.
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

/// A target that waits, by the step at which it was designated.
pub(crate) fn waiting_target(first: &StepTrace) -> WaitingTarget {
    let target = &first.update.target;
    WaitingTarget {
        designation: target.designation,
        in_site_m: target.initial_position_in_site.coords.into(),
    }
}

impl Session {
    /// Notes how the drive to its target ended at the last stop, and `why`, and sends the rover to the next one; returns the target and run
    /// that drive now. `None` where there is no next one, or the rover cannot drive on.
    ///
    /// # Errors
    /// [`Error::Request`] when nobody drives.
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
        // A drive that was continued, under a changed command perhaps, ends the same visit again.
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

    /// The targets with these numbers as those that wait; one that is not located yet is left out.
    pub(crate) fn waiting(&self, then: &[usize]) -> Vec<WaitingTarget> {
        let first = |target: &usize| self.run(*target, self.newest_run(*target)?).ok()?.steps.first();
        then.iter().filter_map(|target| Some(waiting_target(&first(target)?.trace))).collect()
    }

    /// The number of a target's newest run; `None` for a target that was removed.
    fn newest_run(&self, target: usize) -> Option<usize> {
        self.target(target).ok()?.runs.iter().rposition(|run| !run.removed)
    }

    /// Refuses a list of further targets that no drive can have.
    ///
    /// # Errors
    /// [`Error::Setting`] that names the entry.
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
