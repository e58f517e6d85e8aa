//! One point of a study's grid: scenario, visited stops, targets, changes and fault.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use sightline_rover::visual_odometry::OdometryMode;
use sightline_track::settings::TrackerKind;

/// Visited stops of a drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Visit {
    /// Every n-th stop, starting at the first.
    Every(usize),
    /// All but `count` stops starting at `first`: one step is larger than the others.
    LeavingOut {
        /// First omitted stop; the jump leads to the step with this number.
        first: usize,
        /// Number of omitted stops.
        count: usize,
    },
    /// All stops but the last, which is for other cameras; all stops with a tracker that hands the target off.
    AllButLast,
}

impl Visit {
    /// Returns the visited stops for a tracker.
    #[must_use]
    pub const fn by(self, tracker: TrackerKind) -> Self {
        match self {
            Self::AllButLast if tracker.asks_shape() => Self::Every(1),
            other => other,
        }
    }

    /// Indices of the visited stops of a drive with `count` stops.
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

/// Selection of target pixels in the first left image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Picks {
    /// By the scenario's own rule.
    Rule,
    /// On occluding boundaries, which the window rule forbids (R20).
    Boundary,
    /// Near the side, so that they leave the left image before the last stop.
    Leaving,
}

/// Kind of fault, and definition of its step (R88, R126).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fault {
    /// Something occludes the target: the first step at which its point is hidden.
    Occlusion,
    /// A cloud darkens the scene at this step.
    Cloud(usize),
    /// The rover's shadow falls on the target: the first step at which its point is in shadow.
    Shadow,
    /// The window includes background from the start: the first step.
    Boundary,
    /// The line of sight rotates by more than the nominal step at this step.
    AzimuthJump(usize),
    /// The target leaves the left image: the first step at which its point is not visible.
    OutOfFrame,
    /// The estimated heading jumps at this step.
    HeadingJump {
        /// Step of the jump.
        step: usize,
        /// Change of the heading, degrees, clockwise seen from above.
        yaw_deg: f64,
    },
    /// The estimated position jumps sideways at the last but one visited stop, the last of the first cameras.
    PositionJump {
        /// Displacement to the right, m.
        across_m: f64,
    },
    /// No fault except the point's own changes: the first step.
    FromTheStart,
}

/// One point of a study's grid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Name of the scenario in the library.
    pub scenario: String,
    /// The study's variables at this point: name and value.
    pub variables: Vec<(String, Value)>,
    /// Visited stops.
    pub visit: Visit,
    /// Selection of the targets.
    pub picks: Picks,
    /// Settings of the point, as `key=value`; applied after those of the configuration.
    pub changes: Vec<String>,
    /// The fault; `None` without one.
    pub fault: Option<Fault>,
    /// Use of visual odometry in the drive; `None`: the poses are those of the scenario.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub odometry: Option<OdometryMode>,
}

impl Point {
    /// All stops and the scenario's own targets, without changes or faults.
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
