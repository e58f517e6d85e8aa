//! The targeted drive of a session and its comparison with the truth: the driving run, the decisions, the outcome.
//!
//! The loop of `sightline_rover::driving` uses estimates alone; the comparison has no influence on it.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::Run;
use crate::pause::{self, Halt, StagePause};
use crate::step::RunStep;
use crate::stop_cause::{Explained, StopExplanation};
use crate::visits::Visit;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::Vector3;
use sightline_recordings::{DrivenTraverse, Followed, Traverse};
use sightline_rover::driving::executive::{self, CycleInput};
use sightline_rover::driving::map_hazards::{body_pair, hazard_cameras};
use sightline_rover::driving::set_goal::goal_position_m;
use sightline_rover::driving::{ArrivalAction, Cycle, DriveCommand, HazardMaps, StopReason};
use sightline_track::trace::StepTrace;
use sightline_world::World;
use sightline_world::scenario::Fault;
use sightline_world::target_truth::{TargetTruth, TruthSource};

/// The run on whose estimates the rover of a session drives, and its command.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Steering {
    /// The target's number.
    pub target: usize,
    /// The run's number.
    pub run: usize,
    /// The command.
    #[serde(default)]
    pub command: DriveCommand,
    /// Numbers of the targets to which the rover drives afterwards, in this order; each with its newest run.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub then: Vec<usize>,
    /// The stop at or after which the drive pauses; null for none.
    #[serde(default)]
    pub pause_at: Option<usize>,
    /// Pause before or after a stage of that stop; null: before `drive`, once the target is located.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pause: Option<StagePause>,
}

/// A drive as pages and scripts see it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct DriveView {
    /// The driving run and its command; null before the first command.
    pub steering: Option<Steering>,
    /// The decisions at the stops that the run has reached, made on its own estimates.
    pub cycles: Vec<Cycle>,
    /// The visits that have ended, of a drive to several targets.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub visits: Vec<Visit>,
    /// The faults that were injected into the world.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<Fault>,
    /// The outcome so far, for the current target; null before the first command.
    pub summary: Option<DriveSummary>,
    /// Why the drive stopped; null while it goes on, and after arrival.
    #[serde(default)]
    pub why: Option<StopExplanation>,
    /// Whether the next stop is being computed or queued.
    pub is_driving: bool,
    /// Stop and stage at which the drive is paused; null while it drives, after its end, and if its run was stopped.
    #[serde(default)]
    pub paused: Option<Halt>,
}

impl DriveView {
    /// The drive of a run: its decisions and outcome up to the pause.
    pub fn of(
        world: &DrivenTraverse,
        steering: &Steering,
        run: &Run,
        (maps, explained): (&mut HazardMaps, &mut Explained),
        is_driving: bool,
    ) -> Self {
        let mut cycles = cycles(world, &steering.command, run.whole_steps(), maps);
        steering.up_to_halt(&mut cycles);
        let summary = summary(world, &steering.command, run.whole_steps(), &cycles);
        let goes_on = !is_driving && summary.reason.is_none() && run.why_stopped().is_none();
        let halted = || pause::halted(steering, &run.steps, world.traverse().stop_count());
        let paused = goes_on.then(halted).flatten();
        let tracked = (run.whole_steps(), &*run.settings);
        let why = explained.of(world.traverse(), &steering.command, tracked, &cycles, maps);
        let (steering, summary) = (Some(steering.clone()), Some(summary));
        let faults = world.faults().to_vec();
        Self { steering, cycles, visits: Vec::new(), faults, summary, why, is_driving, paused }
    }
}

/// The outcome of a drive.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct DriveSummary {
    /// Number of stops, the first included.
    pub stops: usize,
    /// Whether the rover has arrived by its own estimate.
    pub arrived: bool,
    /// Why it stopped; null while it drives.
    pub reason: Option<StopReason>,
    /// Distance between the estimated and the true target in the rover frame at the last stop, m; null without truth.
    pub target_error_m: Option<f64>,
    /// Horizontal distance of the true rover from the goal computed from the true target, m; null without truth.
    pub goal_error_m: Option<f64>,
    /// Length of the wheels' path, m.
    pub driven_m: f64,
    /// Number of steps that a rock ended, and of stops at which a rock intersects the rover's body.
    pub collisions: u32,
    /// Whether the target was tracked at the last stop; null without truth.
    pub tracked: Option<bool>,
    /// Time on Mars, min.
    pub flight_minutes: f64,
}

/// Checks a command against the target at its designation.
///
/// # Errors
/// [`Error::Setting`] as [`DriveCommand::validate_for`], for a navigator whose hazard pair is missing, for a goal outside
/// the ground of a simulated world, and for a tilt limit that the rover already exceeds.
pub(crate) fn check_command(traverse: &Traverse, command: &DriveCommand, first: &StepTrace) -> Result<()> {
    let target = &first.update.target;
    command.validate_for(&target.position_in_rover)?;
    hazard_cameras(traverse, first.step, command)?;
    if command.on_arrival.contains(&ArrivalAction::HandOff) {
        body_pair(traverse, first.step, command)?;
    }
    let since = command.since.unwrap_or(first.step);
    if !(first.step..traverse.stop_count()).contains(&since) {
        let problem = format!("{since} is no stop between the designation, {}, and the last one", first.step);
        return Err(Error::setting("since", problem));
    }
    let target_in_site = traverse.site_from_rover(first.step) * target.position_in_rover;
    let pose = traverse.site_from_rover(since);
    let tilt_deg = (pose.rotation * Vector3::z()).z.clamp(-1.0, 1.0).acos().to_degrees();
    if tilt_deg > command.tilt_max_deg {
        let limit_deg = command.tilt_max_deg;
        let problem =
            format!("{limit_deg}° is less than the {tilt_deg:.1}° by which the rover tilts already");
        return Err(Error::setting("tilt_max_deg", problem));
    }
    let start = pose.translation.vector;
    let goal_m = goal_position_m(command, 0, &target_in_site, [start.x, start.y]);
    let Some(ground_m) = traverse.world().map(World::ground_extent_m) else { return Ok(()) };
    if (0..2).all(|axis| (ground_m[axis][0]..=ground_m[axis][1]).contains(&goal_m[axis])) {
        return Ok(());
    }
    let [[x_from, x_to], [y_from, y_to]] = ground_m;
    let problem = format!(
        "the goal at x {:.1} m, y {:.1} m is outside the ground of this world (x {x_from:.1} to {x_to:.1} m, y {y_from:.1} to \
         {y_to:.1} m); choose a smaller offset",
        goal_m[0], goal_m[1]
    );
    Err(Error::setting("offset_m", problem))
}

/// The decisions at the stops of a run: recorded ones where the rover followed them, computed ones elsewhere.
///
/// Decisions that are unknown, or were followed for another target, are made again under the command: they show where the
/// run would have driven. `maps` caches the hazard maps; missing maps are computed, and missing images of their pair
/// rendered.
fn cycles(
    world: &DrivenTraverse,
    command: &DriveCommand,
    steps: &[Arc<RunStep>],
    maps: &mut HazardMaps,
) -> Vec<Cycle> {
    let mut cycles = Vec::<Cycle>::with_capacity(steps.len());
    let Some(first) = steps.first() else { return cycles };
    let navigator = &*command.navigator.navigator();
    let designation = first.trace.update.target.designation;
    for step in steps {
        // Before `since` the rover drove to other targets.
        let is_own = |known: &&Followed| {
            known.designation == designation || command.since.is_some_and(|since| step.step < since)
        };
        if let Some(followed) = world.followed(step.step).filter(is_own) {
            cycles.push(followed.cycle.clone());
            continue;
        }
        let before = cycles.last().map(|last| towards_goal(world, command, last.clone()));
        let before = before.as_ref();
        let (first, last) = (&first.trace, &step.trace);
        // The default is never cancelled.
        let hazards = maps.at(world.traverse(), command, [first, last], Cancel::default()).ok().flatten();
        let input = CycleInput { command, navigator, first, last, before, hazards: hazards.as_deref() };
        let mut cycle = executive::decide(world.traverse(), &input);
        if let Some(report) = world.report(step.step + 1).filter(|_| cycle.motion.is_some()) {
            cycle.add(report);
        }
        cycles.push(cycle);
    }
    cycles
}

/// The decision at the last of `steps`, as the predecessor of the next decision.
pub fn cycle_before(
    world: &DrivenTraverse,
    command: &DriveCommand,
    steps: &[Arc<RunStep>],
    maps: &mut HazardMaps,
) -> Option<Cycle> {
    cycles(world, command, steps, maps).pop().map(|last| towards_goal(world, command, last))
}

/// A decision as the predecessor of the next one: actions after arrival at another goal are not counted.
fn towards_goal(world: &DrivenTraverse, command: &DriveCommand, mut cycle: Cycle) -> Cycle {
    if world.followed(cycle.step).is_some_and(|followed| !command.has_goal_of(&followed.command)) {
        (cycle.arrival_actions, cycle.motions_begun) = (0, 0);
    }
    cycle
}

/// The outcome of a drive so far.
pub fn summary(
    world: &DrivenTraverse,
    command: &DriveCommand,
    steps: &[Arc<RunStep>],
    cycles: &[Cycle],
) -> DriveSummary {
    let truth = steps.last().and_then(|step| step.truth.as_ref());
    let ending = cycles.last().and_then(|cycle| cycle.ending.as_ref());
    DriveSummary {
        stops: steps.len(),
        arrived: ending.is_some_and(|ending| ending.reason == StopReason::Arrived),
        reason: ending.map(|ending| ending.reason),
        target_error_m: truth.map(|truth| truth.err_m),
        goal_error_m: goal_error_m(world, command, steps, cycles.last()),
        driven_m: cycles.iter().filter_map(|cycle| cycle.report).map(|report| report.wheels_m).sum(),
        collisions: world.collisions(),
        tracked: truth.and_then(|truth| truth.tracked),
        flight_minutes: cycles.last().map_or(0.0, |cycle| cycle.flight_minutes),
    }
}

fn goal_error_m(
    world: &DrivenTraverse,
    command: &DriveCommand,
    steps: &[Arc<RunStep>],
    decided: Option<&Cycle>,
) -> Option<f64> {
    let (first, last) = (steps.first()?, steps.last()?);
    let traverse = world.traverse();
    let target = &first.update.target;
    let truth = TargetTruth::new(traverse, target.designation, Some(&target.position_in_rover))?;
    let since = command.since.unwrap_or(first.step);
    let start = TruthSource::true_site_from_rover(traverse, since)?.translation.vector;
    let actions = decided.map_or(0, |cycle| cycle.arrival_actions);
    let goal_m = goal_position_m(command, actions, &truth.position_in_site(), [start.x, start.y]);
    let rover = TruthSource::true_site_from_rover(traverse, last.step)?.translation.vector;
    Some((rover.x - goal_m[0]).hypot(rover.y - goal_m[1]))
}
