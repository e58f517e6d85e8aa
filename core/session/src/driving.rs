//! A targeted drive with its comparison against the truth: the loop of `sightline_rover::driving`, one stop at a time.
//!
//! Page, REST and command line drive through [`TargetedDrive`], so that they show the same numbers. The loop itself sees
//! estimates alone: leaving the comparison out changes no bit of it.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::step::RunStep;
use crate::track;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::{Error, Result};
use sightline_recordings::DrivenTraverse;
use sightline_rover::driving::executive::{self, CycleInput};
use sightline_rover::driving::set_goal::goal_position_m;
use sightline_rover::driving::{ArcNavigator, Cycle, DriveCommand, Ending, StopReason};
use sightline_track::settings::Settings;
use sightline_track::target::Designation;
use sightline_world::target_truth::{TargetTruth, TruthSource};

/// A drive towards one target.
pub struct TargetedDrive {
    /// The world, at the stop of the last step.
    pub world: DrivenTraverse,
    /// The command.
    pub command: DriveCommand,
    /// The steps so far; the first is the designation.
    pub steps: Vec<Arc<RunStep>>,
    /// The decisions at the stops of the steps, one fewer than there are steps until the drive has ended.
    pub cycles: Vec<Cycle>,
}

/// The outcome of a drive.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct DriveSummary {
    /// Stops, the first included.
    pub stops: usize,
    /// Whether the rover believes to have arrived.
    pub arrived: bool,
    /// Why it stopped; null while it drives.
    pub reason: Option<StopReason>,
    /// Distance between the estimated and the true target in the rover frame at the last stop, m; null without truth.
    pub target_error_m: Option<f64>,
    /// Horizontal distance of the true rover from the goal that follows from the true target, m; null without truth.
    pub goal_error_m: Option<f64>,
    /// Length of the wheels' path, m.
    pub driven_m: f64,
    /// Steps that a rock ended, and stops at which a rock reaches into the rover's body.
    pub collisions: u32,
    /// Whether the target was tracked at the last stop (R116); null without truth.
    pub tracked: Option<bool>,
    /// Time on Mars, min.
    pub flight_minutes: f64,
}

impl TargetedDrive {
    /// Designates the target at the first stop and takes the command.
    ///
    /// # Errors
    /// A pixel without a 3-D position, a command that makes no sense for the target, or [`Error::Cancelled`].
    pub fn begin(
        world: DrivenTraverse,
        designation: Designation,
        command: DriveCommand,
        settings: &Settings,
        cancel: Cancel<'_>,
    ) -> Result<Self> {
        command.validate()?;
        let last = world.traverse().stop_count() - 1;
        if designation.step != last {
            let problem = format!(
                "step {} is not the stop at which the rover stands, which is {last}",
                designation.step
            );
            return Err(Error::Target(problem));
        }
        let first = track::designate_until(world.traverse(), designation, settings, cancel)?;
        command.validate_for(&first.update.target.position_in_rover)?;
        Ok(Self { world, command, steps: vec![Arc::new(first)], cycles: Vec::new() })
    }

    /// The end of the drive; `None` while it goes on.
    pub fn ending(&self) -> Option<Ending> {
        self.cycles.last()?.ending
    }

    /// Decides at the last stop and drives to the next, where the target is found; false once the drive has ended.
    ///
    /// # Errors
    /// [`Error::Cancelled`], or ground that cannot be driven on; the drive is then as it was before.
    pub fn advance(&mut self, settings: &Settings, cancel: Cancel<'_>) -> Result<bool> {
        if self.ending().is_some() {
            return Ok(false);
        }
        let (Some(first), Some(last)) = (self.steps.first().cloned(), self.steps.last().cloned()) else {
            return Ok(false);
        };
        let input = CycleInput {
            command: &self.command,
            navigator: &ArcNavigator::default(),
            first: &first.trace,
            last: &last.trace,
            before: self.cycles.last(),
            settings,
            cancel,
        };
        let before = self.world.state().to_vec();
        let (cycle, trace) = match executive::advance(&mut self.world, &input) {
            Ok(advanced) => advanced,
            Err(error) => {
                self.world.restore(before)?;
                return Err(error);
            }
        };
        self.cycles.push(cycle);
        let Some(trace) = trace else { return Ok(false) };
        let step = track::compared(self.world.traverse(), trace, Some(&first.trace));
        self.steps.push(Arc::new(step));
        Ok(true)
    }

    /// The outcome so far.
    pub fn summary(&self) -> DriveSummary {
        let last = self.steps.last();
        let truth = last.and_then(|step| step.truth.as_ref());
        let ending = self.ending();
        DriveSummary {
            stops: self.steps.len(),
            arrived: ending.is_some_and(|ending| ending.reason == StopReason::Arrived),
            reason: ending.map(|ending| ending.reason),
            target_error_m: truth.map(|truth| truth.err_m),
            goal_error_m: self.goal_error_m(),
            driven_m: self.cycles.iter().filter_map(|cycle| cycle.report).map(|report| report.wheels_m).sum(),
            collisions: self.world.collisions(),
            tracked: truth.and_then(|truth| truth.tracked),
            flight_minutes: self.cycles.last().map_or(0.0, |cycle| cycle.flight_minutes),
        }
    }

    fn goal_error_m(&self) -> Option<f64> {
        let (first, last) = (self.steps.first()?, self.steps.last()?);
        let traverse = self.world.traverse();
        let target = &first.update.target;
        let truth = TargetTruth::new(traverse, target.designation, Some(&target.position_in_rover))?;
        let start = TruthSource::true_site_from_rover(traverse, first.step)?.translation.vector;
        let goal_m = goal_position_m(&self.command, &truth.position_in_site(), [start.x, start.y]);
        let rover = TruthSource::true_site_from_rover(traverse, last.step)?.translation.vector;
        Some((rover.x - goal_m[0]).hypot(rover.y - goal_m[1]))
    }
}
