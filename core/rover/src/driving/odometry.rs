//! Stage 0, `odometry`: measures the motion to a stop by visual odometry and corrects the pose estimate there (R11, R94).
//!
//! The tracker's pair serves both, or visual odometry takes a separate pair at every stop ([`OdometryPair`]), for which
//! the mast keeps the ground of the previous pair in view; the tracker's mast then follows the corrected pose.
//!
//! If an update is refused, the mast looks back at the rover's own tracks (R142) for the next motion: if that is refused
//! in the main pair, too, it is measured in the pairs that look back. Sources: domain.md 9.2; R94, R142.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use sightline_geometry::camera::{CameraName, MastAngles};
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::Result;
use sightline_geometry::frames::Pose;

use super::active_world::ActiveWorld;
use super::command::DriveCommand;
use crate::pipeline::Stops;
use crate::sight::has_stayed;
use crate::visual_odometry::look::{is_back, look, look_back};
use crate::visual_odometry::{MeasuredMotion, OdometryMode};

/// The pairs in which visual odometry measures the motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum OdometryPair {
    /// Those of the tracker; after a refused update, also pairs that look back.
    #[default]
    Shared,
    /// Pairs of its own at every stop, ahead, and back once an update is refused.
    Own,
}

/// Measures the motion to the last stop, of index `step`, and corrects the estimated pose there. Does nothing without
/// odometry, if the rover stayed, or if the motion is already measured.
///
/// # Errors
/// Images that cannot be read, a stop that cannot be stored, or [`sightline_geometry::error::Error::Cancelled`].
pub fn run(
    world: &mut dyn ActiveWorld,
    command: &DriveCommand,
    step: usize,
    cancel: Cancel<'_>,
) -> Result<()> {
    let stops = world.stops();
    // Without images the pose remains that of wheels, gyro and accelerometers.
    let is_blind = [step - 1, step].into_iter().any(|step| stops.has_dropped_out(step));
    if command.odometry == OdometryMode::Off
        || has_stayed(stops, step)
        || is_blind
        || stops.measured_motion(step).is_some()
    {
        return Ok(());
    }
    let measured = match command.odometry_pair {
        OdometryPair::Shared => {
            let measured = measure(world, command, (step, None), cancel)?;
            if measured.update.accepted { measured } else { again(world, command, measured, step, cancel)? }
        }
        OdometryPair::Own => in_own_pair(world, command, step, cancel)?,
    };
    world.correct(measured)
}

/// Takes the separate pair at a stop that the rover is about to leave, if odometry needs one there and has none.
///
/// # Errors
/// A stop that cannot be stored.
pub(super) fn before_drive(world: &mut dyn ActiveWorld, command: &DriveCommand) -> Result<()> {
    let stops = world.stops();
    let step = stops.stop_count() - 1;
    let wants_own = command.odometry != OdometryMode::Off && command.odometry_pair == OdometryPair::Own;
    let ahead = stops.mast().and_then(|mast| look(mast, None, &Pose::identity()));
    match ahead.filter(|_| wants_own && own_pair(stops, step).is_none()) {
        Some(angles) => world.look(angles),
        None => Ok(()),
    }
}

fn measure(
    world: &dyn ActiveWorld,
    command: &DriveCommand,
    (step, camera): (usize, Option<CameraName>),
    cancel: Cancel<'_>,
) -> Result<MeasuredMotion> {
    let how = (command.odometry, command.odometry_preset);
    MeasuredMotion::measure(world.stops(), step, camera, how, cancel)
}

/// The second attempt after the main pair was refused: in the pairs that look back, if the previous stop has one. If it
/// has none, or that is refused as well, the mast looks back for the next motion.
fn again(
    world: &mut dyn ActiveWorld,
    command: &DriveCommand,
    refused: MeasuredMotion,
    step: usize,
    cancel: Cancel<'_>,
) -> Result<MeasuredMotion> {
    if !look_at_the_ground_before(world, step)? {
        look_back_from(world, step)?;
        return Ok(refused);
    }
    let back = measure(world, command, (step, Some(CameraName::ODOMETRY)), cancel)?;
    Ok(if back.update.accepted {
        MeasuredMotion { refused_too: refused.update.refusal(), ..back }
    } else {
        MeasuredMotion { refused_too: back.update.refusal(), ..refused }
    })
}

/// Measures the motion in the separate pairs. After a refusal ahead, the mast looks back.
fn in_own_pair(
    world: &mut dyn ActiveWorld,
    command: &DriveCommand,
    step: usize,
    cancel: Cancel<'_>,
) -> Result<MeasuredMotion> {
    if !look_at_the_ground_before(world, step)? {
        // Cameras on the body, or a command that was changed on the way.
        return measure(world, command, (step, None), cancel);
    }
    let measured = measure(world, command, (step, Some(CameraName::ODOMETRY)), cancel)?;
    if !measured.update.accepted {
        look_back_from(world, step)?;
    }
    Ok(measured)
}

/// Points the mast for a pair that covers the ground of the previous stop's pair; false if that stop has none.
fn look_at_the_ground_before(world: &mut dyn ActiveWorld, step: usize) -> Result<bool> {
    let stops = world.stops();
    let predicted = stops.site_from_rover(step).inverse() * stops.site_from_rover(step - 1);
    let angles = own_pair(stops, step - 1).zip(stops.mast()).and_then(|(before, mast)| {
        let look = if is_back(before) { look_back } else { look };
        look(mast, Some(before.azimuth_rad), &predicted)
    });
    angles.map_or(Ok(()), |angles| world.look(angles))?;
    Ok(angles.is_some())
}

fn look_back_from(world: &mut dyn ActiveWorld, step: usize) -> Result<()> {
    let stops = world.stops();
    let back = stops.mast().and_then(|mast| look_back(mast, None, &Pose::identity()));
    match back.filter(|_| !own_pair(stops, step).is_some_and(is_back)) {
        Some(angles) => world.look(angles),
        None => Ok(()),
    }
}

/// Whether the mast looked back from a stop, for the next motion.
pub(super) fn has_looked_back(stops: &dyn Stops, step: usize) -> bool {
    own_pair(stops, step).is_some_and(is_back)
}

/// Mast angles of visual odometry's separate pair at a stop; `None` without one.
fn own_pair(stops: &dyn Stops, step: usize) -> Option<MastAngles> {
    let cameras = stops.further_cameras(step);
    cameras.iter().find(|camera| camera.name == CameraName::ODOMETRY)?.mast_angles
}
