//! The target: one surface point to be tracked, with the memory of its tracker.
//!
//! A target is designated by a sub-pixel position in the left image of a stop (R16); its 3-D position is measured
//! there by point stereo. From then on every accepted update renews position, covariance and memory; the initial
//! position is kept unchanged for the gates of `judge` (R19, R84).

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::locate::TrackerMemory;
use sightline_geometry::camera::CameraName;
use sightline_geometry::frames::{Pixel, Point3};

pub use crate::verdict::TrackingState;

/// The designation of a target: a position in the left image of a stop.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Designation {
    /// The stop whose left image was clicked, from 0.
    pub step: usize,
    /// The position, px.
    pub pixel: Pixel,
    /// The camera pair in which the target is tracked; if omitted, the main pair.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<CameraName>,
}

impl Designation {
    /// A position in the left image of the main pair of a stop, px.
    pub const fn new(step: usize, pixel: Pixel) -> Self {
        Self { step, pixel, camera: None }
    }
}

/// The target as one stop passes it to the next.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Target {
    /// The designation.
    pub designation: Designation,
    /// The stop in whose rover frame the position is given.
    pub step: usize,
    /// Position in the rover frame, m.
    #[schema(value_type = [f64; 3])]
    pub position_in_rover: Point3,
    /// Covariance of that position, m².
    #[schema(value_type = Vec<f64>)]
    pub covariance_in_rover: Matrix3<f64>,
    /// Position at designation in the site frame, m; never changed (Kim09 §4.6).
    #[schema(value_type = [f64; 3])]
    pub initial_position_in_site: Point3,
    /// Distance from the left camera at designation, m.
    pub initial_distance_m: f64,
    /// Distance driven since the designation, m.
    pub travelled_m: f64,
    /// Distance from the left camera at the last accepted update, m (`D_old`).
    pub last_distance_m: f64,
    /// Distance driven since the last accepted update, m (`L_step`).
    pub travelled_since_update_m: f64,
    /// The memory of its tracker.
    #[schema(value_type = Object)]
    pub memory: TrackerMemory,
}
