//! The choices of `sightline drive`.

use clap::ValueEnum;
use sightline_rover::driving::{ArrivalAction, NavigatorKind};
use sightline_rover::visual_odometry::OdometryMode;

/// An action after arrival.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum OnArrival {
    /// Point the mast at the target, take another pair and locate the target in it.
    Look,
    /// Drive on to the final standoff.
    Approach,
    /// Locate the target in the pair on the body.
    HandOff,
}

impl OnArrival {
    pub(super) const fn action(self) -> ArrivalAction {
        match self {
            Self::Look => ArrivalAction::Look,
            Self::Approach => ArrivalAction::Approach,
            Self::HandOff => ArrivalAction::HandOff,
        }
    }
}

/// The use of visual odometry.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum Odometry {
    /// Visual odometry does not run; the pose comes from wheels, gyro and accelerometers.
    Off,
    /// Visual odometry measures the slip, which may end the drive; the pose comes from wheels, gyro and accelerometers.
    SlipCheck,
    /// Accepted updates correct the pose as well.
    Full,
}

/// The motion that the measured motion is compared with.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum SlipOf {
    /// The motion that the wheels have driven.
    Wheels,
    /// The whole command, even if a time limit ended the motion early.
    Command,
}

/// The pairs used by visual odometry.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum Pairs {
    /// The pairs of the tracker; after a refused update, also pairs that look back.
    Shared,
    /// Separate pairs at every stop, ahead, and back once an update is refused.
    Own,
}

/// The navigator that chooses the motions.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum NavigatorName {
    /// The arc or turn to the goal, without a hazard map.
    Arcs,
    /// Avoids hazards: votes of hazard, goal and steering.
    Gestalt,
    /// Avoids hazards: goodness and certainty integrated under the path.
    Morphin,
}

/// The stops at which the target is tracked.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum Tracked {
    /// Every stop.
    Every,
    /// After each step of --step-fraction and after each turn; odometry runs alone at the intermediate stops.
    ByDistance,
}

impl Odometry {
    pub(super) const fn mode(self) -> OdometryMode {
        match self {
            Self::Off => OdometryMode::Off,
            Self::SlipCheck => OdometryMode::SlipCheck,
            Self::Full => OdometryMode::Full,
        }
    }
}

impl NavigatorName {
    /// The navigator of a command.
    pub const fn kind(self) -> NavigatorKind {
        match self {
            Self::Arcs => NavigatorKind::Arcs,
            Self::Gestalt => NavigatorKind::Gestalt,
            Self::Morphin => NavigatorKind::Morphin,
        }
    }
}
