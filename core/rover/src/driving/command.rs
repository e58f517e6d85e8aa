//! The command of a targeted drive: standoff, offset, limits, actions after arrival (R5–R8). The target is that of the run.

use serde::{Deserialize, Deserializer, Serialize};
use utoipa::ToSchema;

use sightline_geometry::camera::CameraName;
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::Point3;

use super::motion::Motion;
use super::odometry::OdometryPair;
use super::select_path::{ArcNavigator, Navigator};
use super::waiting::WaitingTarget;
use crate::navigation::{HazardNavigator, NavigatorPreset};
use crate::visual_odometry::{OdometryMode, OdometryPreset};

/// Whether tracking moves the goal.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum GoalRule {
    /// Each tracking update moves the goal with the target (R6).
    #[default]
    FollowsTarget,
    /// The goal stays at its position from the designation: the baseline, independent of tracking (R8, R96).
    Fixed,
}

/// The stops at which the tracker looks for the target.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum TrackedStops {
    /// Every stop.
    #[default]
    Every,
    /// After each step of `step_fraction` of the distance and after each turn. If visual odometry needs shorter motions, it runs
    /// alone at the intermediate stops.
    ByDistance,
}

/// The reference motion of the slip that may end a drive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum SlipCheck {
    /// The motion that the wheels have driven.
    #[default]
    Wheels,
    /// The whole commanded motion, even if the rover ended it early because its time was used up.
    Command,
}

/// The navigator that chooses the motions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum NavigatorKind {
    /// The arc or turn to the goal, without a hazard map.
    #[default]
    Arcs,
    /// Avoids the hazards of a goodness map: votes of hazard, goal and steering.
    Gestalt,
    /// Avoids the hazards of a goodness map: goodness and certainty integrated under the path.
    Morphin,
}

impl NavigatorKind {
    /// The navigator, with the settings of its preset.
    pub fn navigator(self) -> Box<dyn Navigator> {
        let on_map = |preset: NavigatorPreset| HazardNavigator { settings: preset.settings() };
        match self {
            Self::Arcs => Box::new(ArcNavigator::default()),
            Self::Gestalt => Box::new(on_map(NavigatorPreset::Gestalt)),
            Self::Morphin => Box::new(on_map(NavigatorPreset::Morphin)),
        }
    }

    /// Whether the navigator needs a hazard map.
    pub fn needs_map(self) -> bool {
        self != Self::Arcs
    }

    /// Name in a command.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Arcs => "arcs",
            Self::Gestalt => "gestalt",
            Self::Morphin => "morphin",
        }
    }
}

/// An action after arrival (Kim09 §3).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ArrivalAction {
    /// Points the mast at the located target, takes another pair and locates the target in it.
    Look,
    /// Drives to `final_standoff_m` from the target, into the workspace of the arm, by arcs; with a hazard map only if
    /// nothing under wheels and body is too high (`no_safe_path`). The next action follows on arrival.
    Approach,
    /// Locates the target in the pair on the body, near the arm: that of `hazard_cameras`, or the first forward-looking
    /// one (R205).
    HandOff,
}

/// Largest number of pairs for the hazard map.
pub const HAZARD_CAMERAS_MAX: usize = 4;

/// Largest number of actions after arrival.
const ACTIONS_MAX: usize = 10;

/// Largest number of waiting targets.
pub const WAITING_MAX: usize = 20;

/// Largest number of motions of a directed drive, and the largest length of one, m.
const MOTIONS_MAX: usize = 200;
const MOTION_MAX_M: f64 = 20.0;

/// The command of a targeted drive.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct DriveCommand {
    /// Horizontal distance of the goal from the target, m (2; 0.3 to 50).
    pub standoff_m: f64,
    /// Added to the goal, x and y of the site frame, m (0, 0; −20 to 20).
    pub offset_m: [f64; 2],
    /// The stop at which the drive to this target began, from whose pose the goal is approached (null: that of the
    /// designation). Set for a later target of a drive to several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub since: Option<usize>,
    /// Whether tracking moves the goal (`follows_target`).
    pub goal: GoalRule,
    /// The rover has arrived when its frame's origin is within this horizontal distance of the goal, m (0.05: ours; 0.001
    /// to 1).
    pub tolerance_m: f64,
    /// Longest step as a fraction of the distance to the target (0.10: Kim09 §5.4; 0.01 to 0.5).
    pub step_fraction: f64,
    /// The stops at which the target is searched (`every`). No effect without odometry.
    pub tracked_stops: TrackedStops,
    /// Largest number of stops, including the first, excluding looks at waiting targets (100; 2 to 1000).
    pub stops_max: u32,
    /// Use of visual odometry (`full`).
    pub odometry: OdometryMode,
    /// The pairs in which visual odometry measures the motion (`shared`).
    pub odometry_pair: OdometryPair,
    /// Preset of visual odometry's settings (`sightline`).
    pub odometry_preset: OdometryPreset,
    /// The navigator (`arcs`).
    pub navigator: NavigatorKind,
    /// Names of the pairs of every stop for the hazard map (none: the first forward-looking pair on the body; at most 4).
    /// The first of them on the body is also the one to which the target is handed off (`on_arrival`). No effect with
    /// `arcs` and without a hand-off. Older files contain `hazard_camera`: one name, or null.
    #[serde(alias = "hazard_camera", deserialize_with = "names")]
    pub hazard_cameras: Vec<CameraName>,
    /// Ground nearer to the target counts as good on the hazard map, m (0: none; 0 to 5; Kim09 §6).
    pub exemption_radius_m: f64,
    /// The drive stops when the measured slip ratio of a step exceeds this (0.9; 0.05 to 2). No effect without odometry.
    pub slip_max: f64,
    /// The motion to which the slip ratio refers (`wheels`).
    pub slip_check: SlipCheck,
    /// The drive stops when visual odometry has refused more motions in a row than this (null: it never does; 0 to 1000). Without
    /// odometry it has no effect.
    pub refusals_max: Option<u32>,
    /// The drive stops when the rover tilts by more than this, deg (30: domain.md 5.4; 1 to 45).
    pub tilt_max_deg: f64,
    /// The drive stops after this time on Mars, min (480; 1 to 10,000). A motion that would exceed it is ended early.
    pub flight_minutes_max: f64,
    /// Motions to drive in order, unchanged, instead of those to the goal: directed driving (none; at most 200). The drive
    /// ends after the last of them; the target is tracked meanwhile.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub motions: Vec<Motion>,
    /// The targets to which the rover drives afterwards (none; at most 20). Filled in by the server and the command line
    /// from their list; those of a request are ignored.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub waiting: Vec<WaitingTarget>,
    /// Whether the mast also looks at a waiting target, at a separate stop, once the rover has moved by `step_fraction` of
    /// the distance to it since it was last in view (true).
    pub look_at_waiting: bool,
    /// Actions after arrival, in order (none; at most 10). A look and the hand-off add one stop each, at which the rover
    /// does not move.
    pub on_arrival: Vec<ArrivalAction>,
    /// Horizontal distance of the goal from the target in an `approach` after arrival, m (1.3: ours, from where the arm reaches the
    /// target; 0.3 to 50).
    pub final_standoff_m: f64,
}

impl Default for DriveCommand {
    fn default() -> Self {
        Self {
            standoff_m: 2.0,
            offset_m: [0.0; 2],
            since: None,
            goal: GoalRule::FollowsTarget,
            tolerance_m: 0.05,
            step_fraction: 0.10,
            stops_max: 100,
            tracked_stops: TrackedStops::Every,
            odometry: OdometryMode::Full,
            odometry_pair: OdometryPair::Shared,
            odometry_preset: OdometryPreset::Sightline,
            navigator: NavigatorKind::Arcs,
            hazard_cameras: Vec::new(),
            exemption_radius_m: 0.0,
            slip_max: 0.9,
            slip_check: SlipCheck::Wheels,
            refusals_max: None,
            tilt_max_deg: 30.0,
            flight_minutes_max: 480.0,
            motions: Vec::new(),
            waiting: Vec::new(),
            look_at_waiting: true,
            on_arrival: Vec::new(),
            final_standoff_m: 1.3,
        }
    }
}

/// Names as a list, as one name, or null for none.
fn names<'de, D: Deserializer<'de>>(document: D) -> std::result::Result<Vec<CameraName>, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged, expecting = "a list of names of cameras, each of 1 to 32 characters of a-z, 0-9 and _")]
    enum Names {
        List(Vec<CameraName>),
        One(Option<CameraName>),
    }
    Ok(match Names::deserialize(document)? {
        Names::List(names) => names,
        Names::One(name) => name.into_iter().collect(),
    })
}

impl DriveCommand {
    /// Rejects values out of range.
    ///
    /// # Errors
    /// [`Error::Setting`] with the field and its range.
    pub fn validate(&self) -> Result<()> {
        let within = |key: &str, value: f64, low: f64, high: f64| {
            if (low..=high).contains(&value) {
                return Ok(());
            }
            Err(Error::setting(key, format!("{value} is outside {low} to {high}")))
        };
        within("standoff_m", self.standoff_m, 0.3, 50.0)?;
        within("final_standoff_m", self.final_standoff_m, 0.3, 50.0)?;
        within("offset_m[0]", self.offset_m[0], -20.0, 20.0)?;
        within("offset_m[1]", self.offset_m[1], -20.0, 20.0)?;
        within("tolerance_m", self.tolerance_m, 0.001, 1.0)?;
        within("step_fraction", self.step_fraction, 0.01, 0.5)?;
        within("stops_max", f64::from(self.stops_max), 2.0, 1000.0)?;
        within("exemption_radius_m", self.exemption_radius_m, 0.0, 5.0)?;
        within("slip_max", self.slip_max, 0.05, 2.0)?;
        within("refusals_max", f64::from(self.refusals_max.unwrap_or(0)), 0.0, 1000.0)?;
        within("tilt_max_deg", self.tilt_max_deg, 1.0, 45.0)?;
        within("flight_minutes_max", self.flight_minutes_max, 1.0, 10_000.0)?;
        within("waiting (number of targets)", self.waiting.len() as f64, 0.0, WAITING_MAX as f64)?;
        within("motions (number of motions)", self.motions.len() as f64, 0.0, MOTIONS_MAX as f64)?;
        for (index, motion) in self.motions.iter().enumerate() {
            let (length_m, turn_rad) = motion.length_and_turn();
            within(&format!("motions[{index}]: length in m"), length_m, -MOTION_MAX_M, MOTION_MAX_M)?;
            let turn_deg = turn_rad.to_degrees();
            within(&format!("motions[{index}]: turn in deg"), turn_deg, -360.0, 360.0)?;
        }
        within(
            "hazard_cameras (number of pairs)",
            self.hazard_cameras.len() as f64,
            0.0,
            HAZARD_CAMERAS_MAX as f64,
        )?;
        if let Some(twice) = self
            .hazard_cameras
            .iter()
            .enumerate()
            .find_map(|(index, name)| self.hazard_cameras[..index].contains(name).then_some(name))
        {
            return Err(Error::setting("hazard_cameras", format!("{twice} is named twice")));
        }
        let looks = self.on_arrival.len();
        if looks <= ACTIONS_MAX && looks + 2 > self.stops_max as usize {
            let problem = format!(
                "{} stops are too few for two stops and {looks} looks after arrival (on_arrival)",
                self.stops_max
            );
            return Err(Error::setting("stops_max", problem));
        }
        self.validate_approach()?;
        within("on_arrival (number of actions)", self.on_arrival.len() as f64, 0.0, ACTIONS_MAX as f64)?;
        if self.tolerance_m >= self.standoff_m {
            let problem = format!(
                "{} m is not less than the standoff of {} m: every place would count as the goal",
                self.tolerance_m, self.standoff_m
            );
            return Err(Error::setting("tolerance_m", problem));
        }
        Ok(())
    }

    fn validate_approach(&self) -> Result<()> {
        let approaches = self.on_arrival.iter().filter(|action| **action == ArrivalAction::Approach).count();
        let problem = match approaches {
            0 => return Ok(()),
            1 if self.is_directed() => "an approach needs a goal: leave it out, or the motions",
            1 if self.final_standoff_m >= self.standoff_m => {
                let problem = format!(
                    "{} m is not less than the standoff of {} m, from which the rover approaches",
                    self.final_standoff_m, self.standoff_m
                );
                return Err(Error::setting("final_standoff_m", problem));
            }
            1 if self.tolerance_m >= self.final_standoff_m => {
                let problem = format!("{} m is not less than final_standoff_m", self.tolerance_m);
                return Err(Error::setting("tolerance_m", problem));
            }
            1 => return Ok(()),
            _ => "the rover can approach once: leave the other ones out",
        };
        Err(Error::setting("on_arrival", problem))
    }

    /// Horizontal distance of the goal from the target, m, after `actions` actions after arrival have begun.
    pub(crate) fn standoff_after_m(&self, actions: u32) -> f64 {
        let begun = &self.on_arrival[..(actions as usize).min(self.on_arrival.len())];
        if begun.contains(&ArrivalAction::Approach) { self.final_standoff_m } else { self.standoff_m }
    }

    /// Whether the last of these begun actions is an approach to the final standoff.
    pub fn is_approach(&self, actions: u32) -> bool {
        let last = (actions as usize).checked_sub(1).and_then(|last| self.on_arrival.get(last));
        last == Some(&ArrivalAction::Approach)
    }

    /// Whether the rover drives given motions instead of those to a goal.
    pub(crate) fn is_directed(&self) -> bool {
        !self.motions.is_empty()
    }

    /// Whether another command has the same goal for the same target, or the same motions.
    pub fn has_goal_of(&self, other: &Self) -> bool {
        if self.motions != other.motions {
            return false;
        }
        let goal = |of: &Self| (of.standoff_m, of.offset_m, of.since, of.goal, of.tolerance_m);
        goal(self) == goal(other)
    }

    /// Rejects a command that is impossible for a target at this position in the rover frame of the designation.
    ///
    /// # Errors
    /// [`Error::Setting`] if the first target is behind the rover or nearer than the standoff.
    pub fn validate_for(&self, target_in_rover: &Point3) -> Result<()> {
        self.validate()?;
        if self.since.is_some() || self.is_directed() {
            // The rover has moved since the designation, or does not go to the target.
            return Ok(());
        }
        let distance_m = target_in_rover.x.hypot(target_in_rover.y);
        if target_in_rover.x <= 0.0 {
            let problem = format!(
                "it lies {:.2} m behind the rover; turn the rover towards it first",
                -target_in_rover.x
            );
            return Err(Error::setting("target", problem));
        }
        if self.standoff_m >= distance_m {
            let problem = format!(
                "{} m is not less than the {distance_m:.2} m from the rover to the target; choose a smaller standoff",
                self.standoff_m
            );
            return Err(Error::setting("standoff_m", problem));
        }
        Ok(())
    }
}

#[cfg(test)]
#[path = "command_tests.rs"]
mod tests;
