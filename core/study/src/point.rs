//! One point of a study's grid: which scenario, which of its stops and targets, what is changed and what goes wrong.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use sightline_rover::visual_odometry::OdometryMode;
use sightline_track::settings::TrackerKind;

/// Which stops of a drive are visited.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Visit {
    /// Every so many stops, from the first on.
    Every(usize),
    /// All but `count` stops from `first` on: one step that is larger than the others.
    LeavingOut {
        /// The first stop that is left out; the jump leads to the step of this number.
        first: usize,
        /// How many stops are left out.
        count: usize,
    },
    /// All stops but the last, at which other cameras take over; all of them where the tracker hands the target over.
    AllButLast,
}

impl Visit {
    /// The same for a tracker.
    #[must_use]
    pub const fn by(self, tracker: TrackerKind) -> Self {
        match self {
            Self::AllButLast if tracker.asks_shape() => Self::Every(1),
            other => other,
        }
    }

    /// The stops that are visited of `count`.
    pub fn stops(self, count: usize) -> Vec<usize> {
        match self {
            Self::Every(stride) => (0..count).step_by(stride.max(1)).collect(),
            Self::LeavingOut { first, count: left_out } => {
                (0..count).filter(|stop| !(first..first + left_out).contains(stop)).collect()
            }
            Self::AllButLast => (0..count.saturating_sub(1)).collect(),
        }
    }
}

/// Which pixels of the first left image become targets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Picks {
    /// By the scenario's own rule.
    Rule,
    /// On occluding boundaries, which the rule of the window forbids (R20).
    Boundary,
    /// Off to the side, so that they leave the left image before the last stop.
    Leaving,
}

/// What goes wrong, and how the step at which it does is found (R88, R126).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fault {
    /// Something stands before the target: the first step at which its point is hidden.
    Occlusion,
    /// A cloud darkens everything at this step.
    Cloud(usize),
    /// The rover's shadow falls on the target: the first step at which its point is in shadow.
    Shadow,
    /// The window shows something farther behind from the start: the first step.
    Boundary,
    /// The line of sight turns by more than the nominal step at this step.
    AzimuthJump(usize),
    /// The target leaves the left image: the first step at which its point is not seen.
    OutOfFrame,
    /// The estimated heading jumps at this step.
    HeadingJump {
        /// The step.
        step: usize,
        /// By how much, degrees.
        yaw_deg: f64,
    },
    /// The estimated position jumps sideways at the last stop of the first cameras, one before the last.
    PositionJump {
        /// By how much, to the right, m.
        across_m: f64,
    },
    /// Nothing but what the point itself changes: the first step.
    FromTheStart,
}

/// One point of a study's grid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// The scenario, by its name in the library.
    pub scenario: String,
    /// The study's variables at this point, by name.
    pub variables: Vec<(String, Value)>,
    /// The stops that are visited.
    pub visit: Visit,
    /// The targets.
    pub picks: Picks,
    /// Settings that belong to the point, as `key=value`; they come after those of the configuration.
    pub changes: Vec<String>,
    /// What goes wrong.
    pub fault: Option<Fault>,
    /// What visual odometry is used for in the drive; `None` where the study does not ask: the poses are those of the scenario.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub odometry: Option<OdometryMode>,
}

impl Point {
    /// All stops and the scenario's own targets, with nothing changed and nothing wrong.
    pub fn plain(scenario: &str, variable: &str, value: impl Into<Value>) -> Self {
        Self {
            scenario: scenario.to_owned(),
            variables: vec![(variable.to_owned(), value.into())],
            visit: Visit::Every(1),
            picks: Picks::Rule,
            changes: Vec::new(),
            fault: None,
            odometry: None,
        }
    }
}
