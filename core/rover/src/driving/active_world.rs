//! The world that a closed loop acts on: the simulator drives in it, a recording returns its recorded data.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use sightline_geometry::camera::{CameraName, MastAngles};
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::Result;
use sightline_geometry::frames::Pixel;
use sightline_track::target::Designation;

use super::command::DriveCommand;
use super::executive::Cycle;
use super::motion::Motion;
use crate::pipeline::Stops;
use crate::visual_odometry::MeasuredMotion;

/// A world in which the rover can be driven.
pub trait ActiveWorld {
    /// The stops driven so far; for a recording, all of them.
    fn stops(&self) -> &dyn Stops;

    /// Drives one step from the last stop and adds the stop where the rover comes to rest; its mast is not pointed yet.
    ///
    /// # Errors
    /// [`sightline_geometry::error::Error::Cancelled`], or a world that cannot be driven further; no stop is added then.
    fn drive(&mut self, motion: &Motion, cancel: Cancel<'_>) -> Result<DriveReport>;

    /// Adds a stop at the same pose as the last one, for another pair.
    ///
    /// # Errors
    /// A world that cannot be continued, or a stop that cannot be stored.
    fn stay(&mut self) -> Result<()>;

    /// Adds a stop at the same pose as the last one, at which this pair on the body takes over from the main one
    /// (hand-off).
    ///
    /// # Errors
    /// As [`Self::stay`].
    fn hand_over(&mut self, to: CameraName) -> Result<()>;

    /// Stores the decision that led to the last stop, with the report of the drive, together with the stop. No effect for
    /// a recording.
    fn keep_decision(&mut self, followed: &FollowedCycle<'_>);

    /// Stores visual odometry's measurement of the motion to the last stop, and corrects the estimated pose there by it. A
    /// recording keeps its poses.
    ///
    /// # Errors
    /// A stop that cannot be stored.
    fn correct(&mut self, measured: MeasuredMotion) -> Result<()>;

    /// Marks the last stop as used by visual odometry only: the tracker does not search for its target there. No effect
    /// for a recording, which is tracked at every stop.
    ///
    /// # Errors
    /// A stop that cannot be stored.
    fn leave_to_odometry(&mut self) -> Result<()>;

    /// Stores the target at which the mast of the last stop is pointed: another target is not searched there if it is out
    /// of view. No effect for a recording.
    ///
    /// # Errors
    /// A stop that cannot be stored.
    fn keep_mast_target(&mut self, target: Designation) -> Result<()>;

    /// Points the mast of the last stop; `None` leaves it unchanged.
    ///
    /// # Errors
    /// A stop that cannot be stored.
    fn point_mast(&mut self, angles: Option<MastAngles>) -> Result<()>;

    /// Takes an additional pair for visual odometry at the last stop ([`CameraName::ODOMETRY`]), with the mast at these
    /// angles; replaces an existing one. A recording contains only its recorded pairs.
    ///
    /// # Errors
    /// A stop that cannot be stored.
    ///
    /// [`CameraName::ODOMETRY`]: sightline_geometry::camera::CameraName::ODOMETRY
    fn look(&mut self, angles: MastAngles) -> Result<()>;

    /// Centres the exposure subframe of the last stop on a pixel of the left image (R79); `None` leaves it unchanged.
    ///
    /// # Errors
    /// A stop that cannot be stored.
    fn expose(&mut self, around: Option<Pixel>) -> Result<()>;
}

/// An executed decision.
#[derive(Clone, Copy, Debug)]
pub struct FollowedCycle<'a> {
    /// The target of the drive.
    pub designation: Designation,
    /// The command.
    pub command: &'a DriveCommand,
    /// The decision, with the report of the drive.
    pub cycle: &'a Cycle,
}

/// The rover's report of one step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct DriveReport {
    /// Length of the wheels' path, m.
    pub wheels_m: f64,
    /// Duration, s.
    pub duration_s: f64,
    /// Tilt after the step from the accelerometers: angle between the vertical axes of rover and site, deg.
    pub tilt_deg: f64,
    /// Why the wheels did not complete the step; null if they did.
    pub stall: Option<Stall>,
}

/// A wheel that met a step too high to climb.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Stall {
    /// Completed fraction of the commanded motion, 0 to 1.
    pub completed: f64,
}
