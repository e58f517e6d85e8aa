//! A drive command evaluated along a recording: the decision at every stop, compared with the recorded motion.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::driving::check_command;
use crate::step::RunStep;
use crate::track;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::Result;
use sightline_recordings::Traverse;
use sightline_recordings::replayed::{Answer, Replayed};
use sightline_rover::driving::executive::{self, CycleInput};
use sightline_rover::driving::{Cycle, DriveCommand, HazardMaps, StopReason};
use sightline_rover::visual_odometry::OdometryMode;
use sightline_track::settings::Settings;
use sightline_track::target::{Designation, TrackingState};

/// A drive along a recording.
pub struct ReplayedDrive<'a> {
    traverse: &'a Traverse,
    world: Replayed<'a>,
    command: DriveCommand,
    /// The steps so far; the first is the designation.
    pub steps: Vec<Arc<RunStep>>,
    /// The decisions at the stops of the steps.
    pub cycles: Vec<Cycle>,
    maps: HazardMaps,
}

/// Comparison of a recording with the commands of the drive loop.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ReplaySummary {
    /// Number of stops, the first included.
    pub stops: usize,
    /// Why the commanded drive would have stopped; null if the recording ends first.
    pub reason: Option<StopReason>,
    /// Median and largest distance between the commanded and the recorded end of a step, m; null without a step.
    pub apart_m: Option<[f64; 2]>,
    /// Largest angle between the commanded and the recorded direction of the mast, deg; null without a mast.
    pub mast_apart_deg: Option<f64>,
    /// Whether the state at the last stop is `tracking`.
    pub holds_target: bool,
}

impl<'a> ReplayedDrive<'a> {
    /// Designates the target and takes the command.
    ///
    /// # Errors
    /// Fails for a pixel without a 3-D position, or a command that is invalid for the target, and with
    /// [`sightline_geometry::error::Error::Cancelled`].
    pub fn begin(
        traverse: &'a Traverse,
        designation: Designation,
        command: DriveCommand,
        settings: &Settings,
        cancel: Cancel<'_>,
    ) -> Result<Self> {
        command.validate()?;
        // The recorded poses are used.
        let command = DriveCommand { odometry: OdometryMode::Off, ..command };
        let first = track::designate_until(traverse, designation, settings, cancel)?;
        check_command(traverse, &command, &first.trace)?;
        let world = Replayed::new(traverse, first.step);
        let steps = vec![Arc::new(first)];
        Ok(Self { traverse, world, command, steps, cycles: Vec::new(), maps: HazardMaps::default() })
    }

    /// Decides at the last stop and tracks at the next one. Returns false once the drive or the recording has ended.
    ///
    /// # Errors
    /// [`sightline_geometry::error::Error::Cancelled`].
    pub fn advance(&mut self, settings: &Settings, cancel: Cancel<'_>) -> Result<bool> {
        let (Some(first), Some(last)) = (self.steps.first().cloned(), self.steps.last().cloned()) else {
            return Ok(false);
        };
        if self.cycles.len() == self.steps.len() {
            return Ok(false);
        }
        let hazards = self.maps.at(self.traverse, &self.command, [&first.trace, &last.trace], cancel)?;
        let input = CycleInput {
            command: &self.command,
            navigator: &*self.command.navigator.navigator(),
            first: &first.trace,
            last: &last.trace,
            before: self.cycles.last(),
            hazards: hazards.as_deref(),
        };
        if !self.world.goes_on() {
            self.cycles.push(executive::decide(self.traverse, &input));
            return Ok(false);
        }
        let (cycle, trace) = executive::advance(&mut self.world, &input, settings, cancel)?;
        self.cycles.push(cycle);
        let Some(trace) = trace else { return Ok(false) };
        self.steps.push(Arc::new(track::compared(self.traverse, trace, Some(&first.trace))));
        Ok(true)
    }

    /// The difference between the command of this cycle and the recorded next stop.
    pub fn answer_to(&self, cycle: &Cycle) -> Option<&Answer> {
        self.world.answers().iter().find(|answer| answer.step == cycle.step + 1)
    }

    /// The comparison so far.
    pub fn summary(&self) -> ReplaySummary {
        let answers = self.world.answers();
        let mut apart_m: Vec<f64> = answers.iter().map(|answer| answer.apart_m).collect();
        apart_m.sort_by(f64::total_cmp);
        let median_m = apart_m.get(apart_m.len() / 2);
        ReplaySummary {
            stops: self.steps.len(),
            reason: self.cycles.last().and_then(|cycle| cycle.ending.as_ref()).map(|ending| ending.reason),
            apart_m: median_m.zip(apart_m.last()).map(|(median_m, max_m)| [*median_m, *max_m]),
            mast_apart_deg: answers.iter().filter_map(|answer| answer.mast_apart_deg).reduce(f64::max),
            holds_target: self
                .steps
                .last()
                .is_some_and(|step| matches!(step.update.state, TrackingState::Tracking)),
        }
    }
}
