//! Why a drive ends: the checks at a stop, in order.
//!
//! | order | reason | check |
//! |---|---|---|
//! | 1 | `arrived` | distance to the goal within the tolerance, or an action after arrival has begun |
//! | 1 | `completed` | instead of `arrived` in a directed drive: all its motions are driven |
//! | 2 | `lost` | the tracker has given the target up, and the goal follows it; not in a directed drive |
//! | 3 | `stalled` | a wheel stalled on the motion to this stop |
//! | 4 | `slip` | measured slip of the motion to this stop against `slip_max`, of what `slip_check` names |
//! | 5 | `odometry_refused` | consecutive refused updates of visual odometry against `refusals_max` |
//! | 6 | `tilt` | tilt against `tilt_max_deg` |
//! | 7 | `time` | time on Mars against `flight_minutes_max`; again including the hazard map's (`executive.rs`) |
//! | 8 | `stop_limit` | number of stops, excluding looks at waiting targets, against `stops_max` |
//! | 9 | `limit_cycle` | visits to this place (`limit_cycle.rs`); not in a directed drive |
//!
//! The remaining reasons follow from the selection of the path (`next_motion.rs`).

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use sightline_geometry::frames::Pose;
use sightline_track::target::TrackingState;

use super::command::{DriveCommand, GoalRule, SlipCheck};
use super::executive::{Cycle, CycleInput};
use super::limit_cycle;
use super::next_motion::slip_to;
use super::waiting;
use crate::pipeline::Stops;

/// Why a drive stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum StopReason {
    /// The rover is within the tolerance of the goal.
    Arrived,
    /// All motions of a directed drive were driven.
    Completed,
    /// The tracker has given the target up.
    Lost,
    /// A wheel met a step too high to climb.
    Stalled,
    /// The slip ratio exceeded its limit.
    Slip,
    /// Visual odometry refused too many motions in a row.
    OdometryRefused,
    /// The tilt exceeds its limit.
    Tilt,
    /// The time on Mars is used up.
    Time,
    /// The number of stops is used up.
    StopLimit,
    /// The rover has returned to one place too often.
    LimitCycle,
    /// Every path is vetoed by the hazard map.
    NoSafePath,
    /// The rover cannot reach its goal, and is about as near to it as possible.
    GoalBlocked,
    /// The pair of the hazard map is missing, or gives too few points.
    NoRangeData,
}

impl StopReason {
    /// Whether the reason concerns one target only: the drive may go on to another one.
    pub const fn is_of_target(self) -> bool {
        matches!(
            self,
            Self::Arrived
                | Self::Completed
                | Self::Lost
                | Self::LimitCycle
                | Self::NoSafePath
                | Self::GoalBlocked
        )
    }

    /// Name of the reason.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Arrived => "arrived",
            Self::Completed => "all motions driven",
            Self::Lost => "target lost",
            Self::Stalled => "a wheel stalled at a rock",
            Self::Slip => "slipped too much",
            Self::OdometryRefused => "visual odometry refused too often",
            Self::Tilt => "tilted too much",
            Self::Time => "time on Mars used up",
            Self::StopLimit => "all stops used up",
            Self::LimitCycle => "limit cycle",
            Self::NoSafePath => "no safe path",
            Self::GoalBlocked => "goal on bad ground",
            Self::NoRangeData => "no range data",
        }
    }
}

/// The end of a drive.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Ending {
    /// Why it stopped.
    pub reason: StopReason,
    /// The deciding value, in the unit of its limit: m, a fraction, deg, min, a count; null for `completed`, `lost`,
    /// `stalled`, `limit_cycle` and `no_safe_path`, and for a missing pair; for `goal_blocked` that of the ground at the
    /// goal.
    pub value: Option<f64>,
    /// The limit of the value; null if the value is.
    pub limit: Option<f64>,
    /// Details: for `no_safe_path` the smallest change of a limit that opens a path, for `goal_blocked` why the goal
    /// cannot be reached, for `no_range_data` why there are none, for `limit_cycle` the stops at one place; null for the
    /// other reasons.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub detail: Option<String>,
}

impl Ending {
    /// An end because a value is beyond its limit.
    pub(super) fn beyond(reason: StopReason, value: f64, limit: f64) -> Self {
        Self { reason, value: Some(value), limit: Some(limit), detail: None }
    }

    /// An end without a value.
    pub(super) fn named(reason: StopReason, detail: Option<String>) -> Self {
        Self { reason, value: None, limit: None, detail }
    }
}

/// The end of the drive at this stop; `None` if it goes on.
pub(super) fn ending(stops: &dyn Stops, input: &CycleInput<'_>, cycle: &Cycle) -> Option<Ending> {
    let command = input.command;
    let end = |reason, value: f64, limit: f64| Some(Ending::beyond(reason, value, limit));
    let named = |reason| Some(Ending::named(reason, None));
    if has_driven_all(input, cycle) {
        return named(StopReason::Completed);
    }
    // A later look may move the goal slightly; the rover still counts as arrived.
    let is_at_goal = cycle.goal.arrived && input.last.why_not_searched().is_none();
    let has_acted = cycle.arrival_actions > 0 && !command.is_approach(cycle.arrival_actions);
    if !command.is_directed() && (is_at_goal || has_acted) {
        return end(StopReason::Arrived, cycle.goal.distance_m, command.tolerance_m);
    }
    // The baseline drives on regardless of the tracker.
    let follows = command.goal == GoalRule::FollowsTarget && !command.is_directed();
    if follows && input.last.update.state == TrackingState::Failed {
        return named(StopReason::Lost);
    }
    if let Some(report) = input.before.and_then(|before| before.report) {
        if report.stall.is_some() {
            return named(StopReason::Stalled);
        }
        let slip = input.before.and_then(|before| checked_slip(stops, before, command.slip_check));
        if let Some(slip) = slip.filter(|slip| *slip > command.slip_max) {
            return end(StopReason::Slip, slip, command.slip_max);
        }
        let refusals = refusals(stops, [input.since(), cycle.step]);
        if let Some(most) = command.refusals_max.filter(|most| refusals > *most as usize) {
            return end(StopReason::OdometryRefused, refusals as f64, f64::from(most));
        }
        if report.tilt_deg > command.tilt_max_deg {
            return end(StopReason::Tilt, report.tilt_deg, command.tilt_max_deg);
        }
    }
    if let Some(ending) = time_up(command, cycle.flight_minutes) {
        return Some(ending);
    }
    let count = waiting::stops_beside_looks(stops, input.first, cycle.step);
    if count >= command.stops_max as usize {
        return end(StopReason::StopLimit, count as f64, f64::from(command.stops_max));
    }
    if command.is_directed() {
        return None;
    }
    let visits = visits(stops, [input.since(), cycle.step]);
    (visits.len() >= limit_cycle::VISITS_MAX)
        .then(|| Ending::named(StopReason::LimitCycle, Some(limit_cycle::sentence(&visits))))
}

/// The end of a drive if its time on Mars, min, exceeds the command's limit.
pub(super) fn time_up(command: &DriveCommand, minutes: f64) -> Option<Ending> {
    let most = command.flight_minutes_max;
    (minutes > most).then(|| Ending::beyond(StopReason::Time, minutes, most))
}

/// Whether all motions of a directed drive are driven; one cut off by a rock or by time has its own reason.
pub(super) fn has_driven_all(input: &CycleInput<'_>, cycle: &Cycle) -> bool {
    let is_whole = |before: &Cycle| {
        before.time_up_after.is_none() && before.report.is_none_or(|report| report.stall.is_none())
    };
    let command = input.command;
    command.is_directed()
        && cycle.motions_begun as usize >= command.motions.len()
        && (cycle.arrival_actions > 0 || input.before.is_none_or(is_whole))
}

/// The first stop of each visit, among the stops `first` to `last`, to the place where the rover stands at `last`.
pub fn visits(stops: &dyn Stops, [first, last]: [usize; 2]) -> Vec<usize> {
    let poses: Vec<Pose> = (first..=last).map(|step| stops.site_from_rover(step)).collect();
    limit_cycle::visits(&poses).into_iter().map(|index| first + index).collect()
}

/// Number of consecutive motions up to the stop `last` that visual odometry refused, excluding the motion to `first`.
pub fn refusals(stops: &dyn Stops, [first, last]: [usize; 2]) -> usize {
    let measured = (first + 1..=last).rev().filter_map(|step| stops.measured_motion(step));
    measured.take_while(|measured| !measured.update.accepted).count()
}

/// The slip ratio to check, for the motion after a decision.
fn checked_slip(stops: &dyn Stops, before: &Cycle, check: SlipCheck) -> Option<f64> {
    let slip = slip_to(stops, before.step + 1)?;
    Some(match check {
        SlipCheck::Wheels => slip,
        // The part that the wheels did not drive counts as slip.
        SlipCheck::Command => 1.0 - (1.0 - slip) * before.time_up_after.unwrap_or(1.0),
    })
}
