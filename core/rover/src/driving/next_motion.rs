//! The motion of a cycle: requests a path from the navigator and limits it to the range of visual odometry.
//!
//! With a navigator on a hazard map the drive ends here without range data and if every path is vetoed; the rover then
//! stays. An approach after arrival uses arcs, and ends if the map has an obstacle under the rover's path.

use super::command::{DriveCommand, TrackedStops};
use super::ending::{Ending, StopReason};
use super::executive::{Cycle, CycleInput};
use super::map_hazards::RangeData;
use super::motion::Motion;
use super::select_path::{ArcNavigator, Navigator, PathInput};
use crate::hazards::goodness::GoodnessMap;
use crate::navigation::clear_way::{self, Obstacle};
use crate::navigation::counterfactual::LimitChange;
use crate::pipeline::Stops;
use crate::sight::has_stayed;
use crate::visual_odometry::OdometryMode;

/// Longest step and largest turn that visual odometry can measure, m and rad (driving.md 1: 75 cm, 18°).
const STEP_MAX_M: f64 = 0.75;
const TURN_MAX_RAD: f64 = 18.0 * std::f64::consts::PI / 180.0;
/// Largest slip, of either sign, that the next step compensates.
const SLIP_MADE_GOOD: f64 = 0.5;
/// Shortest remainder of a step, m, used if slip left less than that.
const PART_MIN_M: f64 = 0.1;

/// Chooses the motion of a cycle whose target is `distance_m` from the left camera, or ends the drive.
pub(super) fn choose(stops: &dyn Stops, input: &CycleInput<'_>, cycle: &mut Cycle, distance_m: f64) {
    let is_approach = input.command.is_approach(cycle.arrival_actions);
    let known = match range(input) {
        Ok(map) => map,
        Err(ending) => {
            cycle.ending = Some(ending);
            return;
        }
    };
    let site_from_rover = &stops.site_from_rover(cycle.step);
    if let Some(map) = known.filter(|_| is_approach)
        && let Some(obstacle) = clear_way::obstacle(map, site_from_rover, cycle.goal.in_rover_m)
    {
        cycle.ending = Some(unclear(&obstacle));
        return;
    }
    let (navigator, map): (&dyn Navigator, _) =
        if is_approach { (&ArcNavigator::default(), None) } else { (input.navigator, known) };
    let path_input = PathInput {
        goal_m: cycle.goal.in_rover_m,
        step_m: step_m(input, distance_m),
        before: input.before.and_then(|before| before.motion),
        map,
        site_from_rover,
    };
    let choice = navigator.select_path(&path_input);
    match choice.motion() {
        Some(motion) => {
            // On a map the rover drives no farther than the path was evaluated.
            let moved = (1..=cycle.step).rev().find(|step| !has_stayed(stops, *step));
            let slip = moved.and_then(|step| slip_to(stops, step)).filter(|_| map.is_none());
            let (motion, is_part) = followable(motion, input.command, slip);
            cycle.motion = Some(motion);
            cycle.odometry_alone = is_part && input.command.tracked_stops == TrackedStops::ByDistance;
        }
        None if choice.stays_for().is_some() => {
            cycle.ending = choice.stays_for().map(|blocked| Ending {
                value: blocked.ground.map(|ground| ground.value),
                limit: blocked.ground.map(|ground| ground.limit),
                ..Ending::named(StopReason::GoalBlocked, Some(blocked.sentence()))
            });
        }
        None => {
            let change = navigator.smallest_change(&path_input, &choice);
            let detail = change.as_ref().map_or_else(no_change, LimitChange::sentence);
            cycle.ending = Some(Ending::named(StopReason::NoSafePath, Some(detail)));
        }
    }
    cycle.choice = Some(choice).filter(|_| map.is_some());
}

/// The end of an approach with an obstacle on its path.
fn unclear(obstacle: &Obstacle) -> Ending {
    let [x_m, y_m] = obstacle.in_site_m;
    let (height_m, limit_m) = (obstacle.height_m, obstacle.limit_m);
    let detail = format!(
        "the way of the approach is not clear: at x {x_m:.1} m, y {y_m:.1} m of the site the ground is {height_m:.2} m higher than \
         around it, limit {limit_m:.2} m"
    );
    Ending::named(StopReason::NoSafePath, Some(detail))
}

fn no_change() -> String {
    "no single raised limit opens a path".to_owned()
}

/// The goodness map of the stop, if the navigator needs one.
fn range<'a>(input: &CycleInput<'a>) -> Result<Option<&'a GoodnessMap>, Ending> {
    if !input.command.navigator.needs_map() {
        return Ok(None);
    }
    let missing = |fault: &str| Ending::named(StopReason::NoRangeData, Some(fault.to_owned()));
    let hazards = input.hazards.ok_or_else(|| missing("the stop has no hazard map"))?;
    match &hazards.range {
        RangeData::Missing(fault) => Err(missing(fault)),
        RangeData::Points(count) => {
            let (count, least) = (*count as f64, f64::from(hazards.map.settings.range_points_min));
            let few = || Ending::beyond(StopReason::NoRangeData, count, least);
            if count < least { Err(few()) } else { Ok(Some(&hazards.map)) }
        }
    }
}

/// Largest length of the next motion, m; after a stop for odometry alone, the rest of the step.
fn step_m(input: &CycleInput<'_>, distance_m: f64) -> f64 {
    let step_m = input.command.step_fraction * distance_m;
    if !input.last.is_odometry_alone() {
        return step_m;
    }
    (step_m - input.last.update.target.travelled_since_update_m).max(PART_MIN_M)
}

/// Limits a motion to what odometry can measure, at most 75 cm and 18°, then lengthens it by the slip of the previous step
/// (driving.md 1). Returns whether it is only a part of the given one.
fn followable(motion: Motion, command: &DriveCommand, slip: Option<f64>) -> (Motion, bool) {
    if command.odometry == OdometryMode::Off {
        return (motion, false);
    }
    match motion {
        Motion::Turn { angle_rad } => {
            let followed_rad = angle_rad.clamp(-TURN_MAX_RAD, TURN_MAX_RAD);
            (Motion::Turn { angle_rad: followed_rad }, followed_rad != angle_rad)
        }
        Motion::Arc { length_m, curvature_per_m } => {
            let max_m = STEP_MAX_M.min(TURN_MAX_RAD / curvature_per_m.abs());
            let lost = slip.unwrap_or(0.0).clamp(-SLIP_MADE_GOOD, SLIP_MADE_GOOD);
            let is_part = length_m.abs() > max_m;
            let followed_m = match command.tracked_stops {
                TrackedStops::Every => length_m.clamp(-max_m, max_m),
                // The parts of a step have equal lengths.
                TrackedStops::ByDistance => length_m / (length_m.abs() / max_m).ceil().max(1.0),
            };
            (Motion::Arc { length_m: followed_m / (1.0 - lost), curvature_per_m }, is_part)
        }
    }
}

/// The slip ratio along the motion to a stop; `None` if it was not measured.
pub(super) fn slip_to(stops: &dyn Stops, step: usize) -> Option<f64> {
    let update = &stops.measured_motion(step)?.update;
    Some(update.slip.filter(|_| update.accepted)?.along)
}
