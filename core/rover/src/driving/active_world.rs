//! The world that a closed loop acts on. The simulator drives in it; a recording answers with its recorded data.

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
    /// The stops driven to so far; of a recording all of them.
    fn stops(&self) -> &dyn Stops;

    /// Drives one step from the last stop and adds the stop at which the rover comes to rest, its mast not pointed yet.
    ///
    /// # Errors
    /// [`sightline_geometry::error::Error::Cancelled`], or a world that cannot be driven further; no stop is added then.
    fn drive(&mut self, motion: &Motion, cancel: Cancel<'_>) -> Result<DriveReport>;

    /// Adds a stop at which the rover stands as at the last one, for another pair.
    ///
    /// # Errors
    /// A world that cannot be continued, or a stop that cannot be stored.
    fn stay(&mut self) -> Result<()>;

    /// Adds a stop at which the rover stands as at the last one, and this pair on the body takes over from the main one.
    ///
    /// # Errors
    /// As [`Self::stay`].
    fn hand_over(&mut self, to: CameraName) -> Result<()>;

    /// Keeps the decision that led to the last stop, with the report of the drive; it is stored with the stop. A recording was
    /// driven by other decisions.
    fn keep_decision(&mut self, followed: &FollowedCycle<'_>);

    /// Keeps how vision measured the motion to the last stop, and corrects the estimated pose there by it. A recording keeps
    /// its poses.
    ///
    /// # Errors
    /// A stop that cannot be stored.
    fn correct(&mut self, measured: MeasuredMotion) -> Result<()>;

    /// Leaves the last stop to visual odometry alone: the tracker does not look for its target there. A recording is tracked at
    /// every stop.
    ///
    /// # Errors
    /// A stop that cannot be stored.
    fn leave_to_odometry(&mut self) -> Result<()>;

    /// Keeps at which target the mast of the last stop is pointed: another one that is out of view there is not searched. A
    /// recording does not know it.
    ///
    /// # Errors
    /// A stop that cannot be stored.
    fn keep_mast_target(&mut self, target: Designation) -> Result<()>;

    /// Points the mast of the last stop; `None` leaves it as it is.
    ///
    /// # Errors
    /// A stop that cannot be stored.
    fn point_mast(&mut self, angles: Option<MastAngles>) -> Result<()>;

    /// Takes a pair of its own for visual odometry at the last stop ([`CameraName::ODOMETRY`]), the mast at these angles, in the
    /// place of one that is there. A recording has the pairs that were recorded.
    ///
    /// # Errors
    /// A stop that cannot be stored.
    ///
    /// [`CameraName::ODOMETRY`]: sightline_geometry::camera::CameraName::ODOMETRY
    fn look(&mut self, angles: MastAngles) -> Result<()>;

    /// Puts the exposure subframe of the last stop around a pixel of the left image (R79); `None` leaves it where it is.
    ///
    /// # Errors
    /// A stop that cannot be stored.
    fn expose(&mut self, around: Option<Pixel>) -> Result<()>;
}

/// A decision that was followed.
#[derive(Clone, Copy, Debug)]
pub struct FollowedCycle<'a> {
    /// The target on whose estimates the rover moved.
    pub designation: Designation,
    /// The command.
    pub command: &'a DriveCommand,
    /// The decision, with the report of the drive.
    pub cycle: &'a Cycle,
}

/// What the rover reports of one step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct DriveReport {
    /// Length of the wheels' path, m.
    pub wheels_m: f64,
    /// Duration, s.
    pub duration_s: f64,
    /// Angle between the rover's vertical and that of the site after the step, by the accelerometers, deg.
    pub tilt_deg: f64,
    /// Why the wheels did not complete the step; null where they did.
    pub stall: Option<Stall>,
}

/// A wheel that met a step too high to climb.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Stall {
    /// Part of the commanded motion that was completed, 0 to 1.
    pub completed: f64,
}
