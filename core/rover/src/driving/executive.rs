//! The loop of targeted driving: from one tracked stop to the next (R94).
//!
//! [`advance`] is one cycle. It is a function of the world's state, the last step and the command, so that a drive can be
//! stepped, resumed and branched; with the same input it has the same bits.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::Result;
use sightline_geometry::frames::{Point3, Pose};
use sightline_geometry::odometry_error::PoseChangeError;
use sightline_track::settings::Settings;
use sightline_track::stages::predict;
use sightline_track::stages::update::Updated;
use sightline_track::target::Designation;
use sightline_track::trace::StepTrace;

use super::active_world::{ActiveWorld, DriveReport, FollowedCycle};
use super::command::{ArrivalAction, DriveCommand, GoalRule};
use super::dead_reckoning::Reckoned;
use super::ending::{Ending, ending, has_driven_all, time_up};
use super::flight_time::{FlightTime, drive_s};
use super::map_hazards::{StopHazards, body_pair};
use super::motion::Motion;
use super::next_motion;
use super::odometry::{self, OdometryPair};
use super::path_choice::PathChoice;
use super::select_path::Navigator;
use super::set_goal::{Goal, set_goal};
use super::waiting;
use crate::pipeline::{self, StepChanges, Stops};
use crate::visual_odometry::pose_change_error;

/// The decision at a stop, made after the target is located there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Cycle {
    /// Index of the stop.
    pub step: usize,
    /// The goal.
    pub goal: Goal,
    /// The horizontal pose estimate, with its covariance since the designation.
    pub estimated: Reckoned,
    /// The horizontal pose by the wheels alone, with its covariance since the designation.
    pub by_wheels: Reckoned,
    /// The chosen motion; null if the drive ended or the rover stays.
    pub motion: Option<Motion>,
    /// Fraction of the motion after which the command's time was used up and the rover stopped, 0 to 1; null if it was
    /// not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time_up_after: Option<f64>,
    /// Whether only visual odometry runs at the stop that the motion leads to, because it is part of a step.
    #[serde(default)]
    pub odometry_alone: bool,
    /// Number of points that the pair of the hazard map gives at this stop; null without a hazard map.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range_points: Option<usize>,
    /// Every path that was considered on the hazard map; null if no path was chosen on one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub choice: Option<PathChoice>,
    /// The rover's report of the motion; null without one.
    pub report: Option<DriveReport>,
    /// Number of actions after arrival that have begun, including the one decided here.
    pub arrival_actions: u32,
    /// Number of motions of a directed drive that have begun, including the one decided here.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub motions_begun: u32,
    /// The waiting target at which the mast looks next, while the rover stays; null for none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub looks_at: Option<Designation>,
    /// The action after arrival that was decided here; null for none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub action: Option<ArrivalAction>,
    /// Time of this stop on Mars, by stage.
    pub flight: FlightTime,
    /// Time on Mars up to the end of this stop's drive, min.
    pub flight_minutes: f64,
    /// The end of the drive; null if it goes on.
    pub ending: Option<Ending>,
}

/// Inputs of a cycle besides the world.
#[derive(Clone, Copy)]
pub struct CycleInput<'a> {
    /// The command.
    pub command: &'a DriveCommand,
    /// The navigator that chooses the motions.
    pub navigator: &'a dyn Navigator,
    /// The step at which the target was designated.
    pub first: &'a StepTrace,
    /// The step of the stop at which the decision is made.
    pub last: &'a StepTrace,
    /// The cycle of the previous stop; `None` at the first.
    pub before: Option<&'a Cycle>,
    /// The goodness map of the stop, from `HazardMaps::at`; `None` for a navigator without one.
    pub hazards: Option<&'a StopHazards>,
}

impl CycleInput<'_> {
    /// The stop at which the drive to this target began.
    pub fn since(&self) -> usize {
        self.command.since.unwrap_or(self.first.step)
    }
}

/// One cycle: decides at the last stop and, unless the drive ends there, drives, points the mast and tracks at the next.
///
/// # Errors
/// [`sightline_geometry::error::Error::Cancelled`], or a failure of the world; the world may then have one stop more than
/// there are steps, which must be discarded.
pub fn advance(
    world: &mut dyn ActiveWorld,
    input: &CycleInput<'_>,
    settings: &Settings,
    cancel: Cancel<'_>,
) -> Result<(Cycle, Option<StepTrace>)> {
    let cycle = drive(world, input, cancel)?;
    if cycle.ending.is_some() {
        return Ok((cycle, None));
    }
    arrive(world, input, cancel)?;
    let trace = pipeline::run_step_changed(
        world.stops(),
        &input.last.update,
        settings,
        &StepChanges::default(),
        cancel,
    )?;
    Ok((cycle, Some(trace)))
}

/// Measures the motion to the last stop by visual odometry and points the mast there. If the tracker's pair serves both,
/// the mast is pointed by the wheels' pose estimate.
fn arrive(world: &mut dyn ActiveWorld, input: &CycleInput<'_>, cancel: Cancel<'_>) -> Result<()> {
    let step = input.last.step + 1;
    let is_before = input.command.odometry_pair == OdometryPair::Own;
    if is_before {
        odometry::run(world, input.command, step, cancel)?;
        if world.stops().is_odometry_alone(step) {
            return Ok(());
        }
    }
    point_mast(world, input.command, &input.last.update)?;
    if is_before { Ok(()) } else { odometry::run(world, input.command, step, cancel) }
}

/// Decides at the last stop and, unless the drive ends there, drives to the next, without pointing the mast.
///
/// # Errors
/// As [`advance`].
pub fn drive(world: &mut dyn ActiveWorld, input: &CycleInput<'_>, cancel: Cancel<'_>) -> Result<Cycle> {
    cancel.check()?;
    let mut cycle = decide(world.stops(), input);
    if cycle.ending.is_some() {
        return Ok(cycle);
    }
    match cycle.motion {
        Some(motion) => {
            odometry::before_drive(world, input.command)?;
            let left_s = (60.0 * (input.command.flight_minutes_max - cycle.flight_minutes)).max(0.0);
            cycle.time_up_after = Some(left_s / drive_s(&motion)).filter(|part| *part < 1.0);
            let driven = motion.part(cycle.time_up_after.unwrap_or(1.0));
            cycle.add(world.drive(&driven, cancel)?);
            if cycle.odometry_alone {
                world.leave_to_odometry()?;
            }
        }
        None if cycle.action == Some(ArrivalAction::HandOff) => {
            let to = body_pair(world.stops(), cycle.step, input.command)?;
            world.hand_over(to)?;
        }
        None => {
            world.stay()?;
            if let Some(target) = cycle.looks_at {
                world.keep_mast_target(target)?;
            }
        }
    }
    let designation = input.first.update.target.designation;
    world.keep_decision(&FollowedCycle { designation, command: input.command, cycle: &cycle });
    Ok(cycle)
}

/// The decision at a stop, before the rover moves; it depends only on estimates and reports, so that it can be repeated at
/// any time.
pub fn decide(stops: &dyn Stops, input: &CycleInput<'_>) -> Cycle {
    let step = input.last.step;
    let pose = stops.site_from_rover(step);
    let start = stops.site_from_rover(input.since()).translation.vector;
    let target_in_site = target_in_site(input, stops);
    let (left, right) = stops.cameras(step);
    let mut time = FlightTime::of_stop([left.size, right.size], stops.measured_motion(step));
    if input.last.is_odometry_alone() {
        time = time.without_tracking(input.command.odometry_pair);
    }
    let flight_minutes = input.before.map_or(0.0, |before| before.flight_minutes) + time.total_s() / 60.0;
    let before_here = input.before.filter(|before| before.step >= input.since());
    let arrival_actions = before_here.map_or(0, |before| before.arrival_actions);
    let goal = |actions: u32| set_goal(input.command, actions, &target_in_site, [start.x, start.y], &pose);
    let [estimated, by_wheels] = reckoned(stops, input, &pose);
    let mut cycle = Cycle {
        step,
        goal: goal(arrival_actions),
        estimated,
        by_wheels,
        motion: None,
        time_up_after: None,
        odometry_alone: false,
        range_points: input.hazards.and_then(StopHazards::point_count),
        choice: None,
        report: None,
        arrival_actions,
        motions_begun: before_here.map_or(0, |before| before.motions_begun),
        looks_at: None,
        action: None,
        flight: time,
        flight_minutes,
        ending: None,
    };
    if input.last.is_out_of_view() {
        // Look at a waiting target that is due, otherwise back at the current one.
        cycle.ending = ending(stops, input, &cycle);
        cycle.looks_at = looks_at(stops, input, &cycle);
        return cycle;
    }
    begin_action(input, &mut cycle);
    if let Some(action) = cycle.action {
        if action == ArrivalAction::Approach {
            cycle.goal = goal(cycle.arrival_actions);
            choose_motion(stops, input, &mut cycle, &target_in_site);
        }
        return cycle;
    }
    cycle.ending = ending(stops, input, &cycle);
    cycle.looks_at = looks_at(stops, input, &cycle);
    let looks_back = waiting::looked_at(stops, input.command, step).is_some();
    if cycle.ending.is_none() && cycle.looks_at.is_none() && !looks_back {
        choose_motion(stops, input, &mut cycle, &target_in_site);
    }
    cycle
}

/// The waiting target at which the mast looks before the rover moves.
fn looks_at(stops: &dyn Stops, input: &CycleInput<'_>, cycle: &Cycle) -> Option<Designation> {
    let may_look = cycle.ending.is_none() && !input.last.is_odometry_alone();
    let due = waiting::due(stops, input.command, cycle.step).filter(|_| may_look)?;
    Some(due.designation)
}

/// Begins the next action after arrival, if the rover has arrived and an action is left.
fn begin_action(input: &CycleInput<'_>, cycle: &mut Cycle) {
    let is_there = if input.command.is_directed() {
        has_driven_all(input, cycle)
    } else {
        cycle.goal.arrived && !input.last.is_odometry_alone()
    };
    let has_acted = cycle.arrival_actions > 0 && !input.command.is_approach(cycle.arrival_actions);
    let has_arrived = is_there || has_acted;
    cycle.action =
        input.command.on_arrival.get(cycle.arrival_actions as usize).copied().filter(|_| has_arrived);
    cycle.arrival_actions += u32::from(cycle.action.is_some());
}

/// Chooses the motion from a stop at which the drive goes on.
fn choose_motion(stops: &dyn Stops, input: &CycleInput<'_>, cycle: &mut Cycle, target_in_site: &Point3) {
    if let Some(motion) = input.command.motions.get(cycle.motions_begun as usize) {
        cycle.motion = Some(*motion);
        cycle.motions_begun += 1;
        return;
    }
    // If odometry alone brought the rover to the goal, it stays for the tracker.
    if !cycle.goal.arrived {
        let target_in_rover = stops.site_from_rover(cycle.step).inverse_transform_point(target_in_site);
        let distance_m = (target_in_rover - stops.cameras(cycle.step).0.model.centre()).norm();
        next_motion::choose(stops, input, cycle, distance_m);
        if input.hazards.is_some_and(|hazards| hazards.point_count().is_some()) {
            let before_s = cycle.flight.total_s();
            cycle.flight = cycle.flight.with_hazards();
            cycle.flight_minutes += (cycle.flight.total_s() - before_s) / 60.0;
            if cycle.motion.is_some()
                && let Some(ending) = time_up(input.command, cycle.flight_minutes)
            {
                (cycle.motion, cycle.odometry_alone, cycle.ending) = (None, false, Some(ending));
            }
        }
    }
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it so")]
fn is_zero(count: &u32) -> bool {
    *count == 0
}

/// The pose at this stop by the pose estimates and by the wheels alone.
fn reckoned(stops: &dyn Stops, input: &CycleInput<'_>, pose: &Pose) -> [Reckoned; 2] {
    let Some(before) = input.before else { return [Reckoned::exactly(pose); 2] };
    let (Some(motion), Some(report)) = (&before.motion, &before.report) else {
        // The rover has not moved.
        return [before.estimated, before.by_wheels];
    };
    let part = before.time_up_after.unwrap_or(1.0) * report.stall.map_or(1.0, |stall| stall.completed);
    let change_error = pose_change_error(stops, input.last.step);
    [before.estimated.at(pose, &change_error), before.by_wheels.rolled(motion, part, &stops.odometry_error())]
}

impl Cycle {
    /// Adds the rover's report of its motion.
    pub fn add(&mut self, report: DriveReport) {
        self.flight.drive_s = report.duration_s;
        self.flight_minutes += report.duration_s / 60.0;
        self.report = Some(report);
    }
}

/// The target position that determines the goal, site frame.
fn target_in_site(input: &CycleInput<'_>, stops: &dyn Stops) -> Point3 {
    let from = match input.command.goal {
        GoalRule::FollowsTarget => input.last,
        GoalRule::Fixed => input.first,
    };
    stops.site_from_rover(from.step) * from.update.target.position_in_rover
}

/// Points the mast of the last stop at the predicted target, or at the waiting target to look at, and centres the exposure
/// subframe on it.
///
/// # Errors
/// A stop that cannot be stored.
pub fn point_mast(world: &mut dyn ActiveWorld, command: &DriveCommand, last: &Updated) -> Result<()> {
    let stops = world.stops();
    let [then, now] = [last.target.step, last.target.step + 1].map(|step| stops.site_from_rover(step));
    let (target, in_rover) = match waiting::looked_at(stops, command, last.target.step + 1) {
        Some(waiting) => (waiting.designation, waiting.in_rover(&now)),
        None => {
            let error = PoseChangeError::Modelled(stops.odometry_error());
            (last.target.designation, predict::predict(&last.target, &then, &now, &error).position_in_rover)
        }
    };
    let wanted = stops.mast().and_then(|mast| mast.point_left_centre_at(&in_rover));
    world.keep_mast_target(target)?;
    world.point_mast(wanted)?;
    let (left, _) = world.stops().cameras(last.target.step + 1);
    let around = left.project(&in_rover);
    world.expose(around)
}
