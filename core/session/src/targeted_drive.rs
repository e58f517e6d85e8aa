//! A targeted drive from its first stop to its end without a session, for the command line, studies and tests.

use std::collections::VecDeque;
use std::sync::Arc;

use crate::driving::{DriveSummary, check_command, summary};
use crate::step::RunStep;
use crate::stop_cause::{Explained, StopExplanation};
use crate::track::{self, NextStep};
use crate::visits::{Visit, waiting_target};
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::{Error, Result};
use sightline_recordings::DrivenTraverse;
use sightline_rover::driving::executive::{self, CycleInput};
use sightline_rover::driving::{Cycle, DriveCommand, Ending, HazardMaps, WaitingTarget};
use sightline_track::settings::Settings;
use sightline_track::target::Designation;

/// A drive to one target, or to several in turn.
pub struct TargetedDrive {
    /// The world, at the stop of the last step.
    pub world: DrivenTraverse,
    /// The command.
    pub command: DriveCommand,
    /// The index of the current target in the order of visits.
    pub target: usize,
    /// The steps of the current target so far; the first is the designation.
    pub steps: Vec<Arc<RunStep>>,
    /// The decisions at the stops of the steps; one fewer than the steps until the drive has ended.
    pub cycles: Vec<Cycle>,
    /// The hazard maps of the stops so far.
    pub maps: HazardMaps,
    /// The completed visits of a drive to several targets.
    pub visits: Vec<Visit>,
    /// The settings of the last step.
    settings: Settings,
    /// The steps of the following targets.
    then: VecDeque<Vec<Arc<RunStep>>>,
}

impl TargetedDrive {
    /// Designates the target at the first stop and takes the command.
    ///
    /// # Errors
    /// Fails for a pixel without a 3-D position, or a command that is invalid for the target, and with [`Error::Cancelled`].
    pub fn begin(
        world: DrivenTraverse,
        designation: Designation,
        command: DriveCommand,
        settings: &Settings,
        cancel: Cancel<'_>,
    ) -> Result<Self> {
        Self::begin_to(world, &[designation], command, settings, cancel)
    }

    /// As [`Self::begin`], for several targets, which are visited in this order.
    ///
    /// # Errors
    /// As [`Self::begin`], and for an empty list of targets.
    pub fn begin_to(
        world: DrivenTraverse,
        targets: &[Designation],
        command: DriveCommand,
        settings: &Settings,
        cancel: Cancel<'_>,
    ) -> Result<Self> {
        command.validate()?;
        let last = world.traverse().stop_count() - 1;
        let mut all = VecDeque::with_capacity(targets.len());
        for designation in targets {
            if designation.step != last {
                let problem = format!(
                    "step {} is not the stop at which the rover stands, which is {last}",
                    designation.step
                );
                return Err(Error::Target(problem));
            }
            let first = track::designate_until(world.traverse(), *designation, settings, cancel)?;
            all.push_back(vec![Arc::new(first)]);
        }
        let Some(steps) = all.pop_front() else {
            return Err(Error::Target("a drive needs a target".to_owned()));
        };
        let command = DriveCommand { waiting: waiting(&all), ..command };
        check_command(world.traverse(), &command, &steps[0].trace)?;
        let (cycles, maps, visits) = (Vec::new(), HazardMaps::default(), Vec::new());
        let settings = settings.clone();
        Ok(Self { world, command, target: 0, steps, cycles, maps, visits, settings, then: all })
    }

    /// Whether it is a drive to several targets.
    pub fn has_several_targets(&self) -> bool {
        self.target > 0 || !self.then.is_empty()
    }

    /// The end of the drive; `None` while it goes on.
    pub fn ending(&self) -> Option<Ending> {
        self.cycles.last()?.ending.clone()
    }

    /// Decides at the last stop, drives to the next one, and tracks all targets there. Returns false once the drive to this
    /// target has ended.
    ///
    /// # Errors
    /// [`Error::Cancelled`], or an error for ground that cannot be driven on; the drive is then unchanged.
    pub fn advance(&mut self, settings: &Settings, cancel: Cancel<'_>) -> Result<bool> {
        if self.ending().is_some() {
            return Ok(false);
        }
        let (Some(first), Some(last)) = (self.steps.first().cloned(), self.steps.last().cloned()) else {
            return Ok(false);
        };
        let hazards =
            self.maps.at(self.world.traverse(), &self.command, [&first.trace, &last.trace], cancel)?;
        let input = CycleInput {
            command: &self.command,
            navigator: &*self.command.navigator.navigator(),
            first: &first.trace,
            last: &last.trace,
            before: self.cycles.last(),
            hazards: hazards.as_deref(),
        };
        self.settings.clone_from(settings);
        let before = self.world.state().to_vec();
        let advanced = executive::advance(&mut self.world, &input, settings, cancel)
            .and_then(|(cycle, trace)| Ok((cycle, trace, self.track_others(settings, cancel)?)));
        let (cycle, trace, others) = match advanced {
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
        self.then.iter_mut().zip(others).for_each(|(steps, other)| steps.extend(other));
        Ok(true)
    }

    /// The steps of the following targets at the last stop; `None` for a target that already has it.
    fn track_others(&self, settings: &Settings, cancel: Cancel<'_>) -> Result<Vec<Option<Arc<RunStep>>>> {
        let traverse = self.world.traverse();
        let track = |steps: &Vec<Arc<RunStep>>| {
            let (Some(first), Some(last)) = (steps.first(), steps.last()) else { return Ok(None) };
            if last.step + 1 == traverse.stop_count() {
                return Ok(None);
            }
            let (prediction_px, before, ended) = (None, None, None);
            let next = NextStep { first, last, settings, prediction_px, before, ended, cancel };
            next.compute(traverse).map(|step| Some(Arc::new(step)))
        };
        self.then.iter().map(track).collect()
    }

    /// Records the visit to the current target once its drive has ended, and begins the drive to the next target, which
    /// [`Self::advance`] continues. Returns false if there is no next target, or the rover cannot drive on.
    pub fn visit_next(&mut self) -> bool {
        let Some(ending) = self.ending() else { return false };
        if !self.then.is_empty() || !self.visits.is_empty() {
            let why = self.why();
            let visit = Visit::of(&self.world, &self.command, (self.target, &self.steps), &ending, why);
            self.visits.push(visit);
        }
        if !ending.reason.is_of_target() {
            return false;
        }
        let Some(steps) = self.then.pop_front() else { return false };
        self.command.waiting = waiting(&self.then);
        self.command.since = self.steps.last().map(|last| last.step);
        self.steps = steps;
        self.target += 1;
        // The decision at this stop is repeated for the next target.
        self.cycles.pop();
        true
    }

    /// Continues an ended drive from its last stop under another command; call [`Self::advance`] afterwards.
    ///
    /// # Errors
    /// Fails for a command that is invalid for the target, and for a drive that has not ended or cannot continue; the drive
    /// is then unchanged.
    pub fn go_on(&mut self, command: DriveCommand) -> Result<()> {
        let ending = self.ending().filter(|ending| ending.reason.is_of_target());
        let (Some(_), Some(first), Some(last)) = (ending, self.steps.first(), self.steps.last()) else {
            return Err(Error::Request("the drive cannot go on under another command".to_owned()));
        };
        let command = DriveCommand { since: Some(last.step), waiting: waiting(&self.then), ..command };
        check_command(self.world.traverse(), &command, &first.trace)?;
        self.command = command;
        // The decision at this stop is repeated.
        self.cycles.pop();
        Ok(())
    }

    /// The outcome so far, for the current target.
    pub fn summary(&self) -> DriveSummary {
        summary(&self.world, &self.command, &self.steps, &self.cycles)
    }

    /// Why the drive stopped; `None` while it goes on, and after arrival.
    pub fn why(&mut self) -> Option<StopExplanation> {
        let (traverse, maps) = (self.world.traverse(), &mut self.maps);
        let tracked = (&self.steps[..], &self.settings);
        Explained::default().of(traverse, &self.command, tracked, &self.cycles, maps)
    }
}

/// The targets of these steps as waiting targets.
fn waiting(then: &VecDeque<Vec<Arc<RunStep>>>) -> Vec<WaitingTarget> {
    then.iter().filter_map(|steps| Some(waiting_target(&steps.first()?.trace))).collect()
}
