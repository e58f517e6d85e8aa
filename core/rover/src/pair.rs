//! The stereo pair of a stop in which a target is tracked: the main one, or a further pair by its name.
//!
//! For the stages: the cameras of that pair, its mast angles and its images. A stop that lacks the pair does not end a
//! run; the error here becomes the fault of that step.

use std::sync::Arc;

use sightline_geometry::camera::{Camera, CameraName, MastAngles};
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::{Error, Result};
use sightline_track::locate::store::Shared;
use sightline_track::stages::capture::StereoPair;
use sightline_track::stages::point_mast::UsedPointing;
use sightline_vision::image::GrayImage;

use crate::pipeline::Stops;

/// A stereo pair of a stop, as input of the stages.
#[derive(Clone, Copy, Debug)]
pub struct StopPair<'a> {
    /// The left camera in the rover frame.
    pub left: &'a Camera,
    /// The right camera in the rover frame.
    pub right: &'a Camera,
    /// The mast angles of this pair; `None` for cameras on the body and where they are unknown.
    pub mast_angles: Option<MastAngles>,
    /// The store of results that all targets of this pair share.
    pub shared: Option<Shared<'a>>,
}

/// A camera of a stop beside its main pair: a pair, or a single camera.
#[derive(Clone, Copy, Debug)]
pub struct FurtherCamera<'a> {
    /// Its name.
    pub name: CameraName,
    /// The left camera, or the only one, in the rover frame.
    pub left: &'a Camera,
    /// The right camera in the rover frame; `None` for a single camera.
    pub right: Option<&'a Camera>,
    /// The mast angles at which its images were taken; `None` for a camera on the body.
    pub mast_angles: Option<MastAngles>,
}

/// The images of a further camera: the left or only one, and the right one of a pair.
pub type FurtherImages = (Arc<GrayImage>, Option<Arc<GrayImage>>);

impl StopPair<'_> {
    /// The pointing of the pair.
    pub(crate) fn pointing<'a>(
        &'a self,
        stops: &'a dyn Stops,
        camera: Option<CameraName>,
    ) -> UsedPointing<'a> {
        // A further pair without mast angles is fixed to the body.
        let is_carried = camera.is_none() || self.mast_angles.is_some();
        UsedPointing {
            mast: stops.mast().filter(|_| is_carried),
            angles: self.mast_angles,
            error_rad: stops.pointing_error_deg().to_radians(),
            left: self.left,
            right: self.right,
        }
    }
}

/// The pair of a stop: the main one, or the one of this name.
///
/// # Errors
/// A stop without a pair of this name.
pub fn of_stop(stops: &dyn Stops, step: usize, camera: Option<CameraName>) -> Result<StopPair<'_>> {
    match camera {
        Some(name) => stops.further_pair(step, name),
        None => {
            let (left, right) = stops.cameras(step);
            Ok(StopPair { left, right, mast_angles: stops.mast_angles(step), shared: stops.shared(step) })
        }
    }
}

/// The images of that pair.
///
/// # Errors
/// As [`Stops::capture`], and a stop without a pair of this name.
pub fn capture(
    stops: &dyn Stops,
    step: usize,
    camera: Option<CameraName>,
    cancel: Cancel<'_>,
) -> Result<StereoPair> {
    match camera {
        Some(name) => stops.capture_further(step, name, cancel),
        None => stops.capture(step, cancel),
    }
}

/// The error for a stop without a camera of this name.
pub fn missing(step: usize, name: CameraName) -> Error {
    Error::Request(format!("stop {step} has no pair `{name}`"))
}

/// The error for a stop whose camera of this name is a single one.
pub fn single(step: usize, name: CameraName) -> Error {
    Error::Request(format!("stop {step} has only a single image of `{name}`"))
}

/// Converts the error of a pair to that of a designation in it.
pub(crate) fn as_target(error: Error) -> Error {
    match error {
        Error::Request(sentence) => Error::Target(sentence),
        other => other,
    }
}
