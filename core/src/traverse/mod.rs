//! A traverse: the stops of one drive, each with a pose estimate, a stereo pair and, perhaps, the truth.
//!
//! Everything is opened through the native folder (`native.rs` documents the format): a simulated traverse
//! is a folder whose images are rendered when they are first asked for, and a foreign recording is turned
//! into a folder by its importer (`import/`, one file per format).

mod check;
pub mod files;
mod image_cache;
pub mod import;
mod index_file;
pub mod native;
pub mod render_cache;
mod simulated;
mod stops;
pub mod truth_files;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::camera::{Camera, Mast, MastAngles};
use crate::frames::{PoseRecord, Vector3};

pub use index_file::{Existing, IndexFormat};
pub use native::{Traverse, write};
pub use render_cache::RenderCache;
pub use simulated::create_simulated;

/// The version of the folder format that this code writes.
pub const FORMAT_VERSION: u32 = 1;

/// How the two images of a stop relate, which decides how `point_stereo` searches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum StereoGeometry {
    /// Two eyes side by side: the search interval is one of disparity (R74, R75).
    #[default]
    Lateral,
    /// Two freely placed views: the search walks the epipolar curve by range.
    Convergent,
}

/// The error model of the pose estimate, from which `predict` grows the covariance (domain.md 5.5).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct OdometryError {
    /// 1σ error along the way, as a fraction of the distance driven.
    pub along_fraction: f64,
    /// 1σ error across the way, as a fraction of the distance driven.
    pub across_fraction: f64,
    /// 1σ error of each attitude angle per step, deg.
    pub attitude_deg: f64,
}

impl Default for OdometryError {
    fn default() -> Self {
        Self { along_fraction: 0.02, across_fraction: 0.02, attitude_deg: 0.2 }
    }
}

/// The index of a traverse: `traverse.toml` or `traverse.json` of the folder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct TraverseIndex {
    /// Version of the format.
    pub format: u32,
    /// A short name.
    pub name: String,
    /// What was recorded, where, by which camera.
    #[serde(default)]
    pub description: String,
    /// The grey value that counts as full scale; by default the largest of the PNG's depth.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub full_scale_dn: Option<f64>,
    /// How the two images of a stop relate.
    #[serde(default)]
    pub stereo: StereoGeometry,
    /// The error model of the pose estimates.
    #[serde(default)]
    pub odometry_error: OdometryError,
    /// The mast that carries the cameras, where it is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mast: Option<Mast>,
    /// The file with the simulated scenario from which missing images are rendered.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scenario: Option<String>,
    /// The stops in driving order.
    pub stops: Vec<Stop>,
}

/// One stop of the rover.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Stop {
    /// Time since the first stop, s.
    pub time_s: f64,
    /// The estimated pose of the rover in the site frame.
    pub site_from_rover: PoseRecord,
    /// The mast angles at which the pair was taken, where there is a mast.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mast_angles: Option<MastAngles>,
    /// The left (or first) image.
    pub left: View,
    /// The right (or second) image.
    pub right: View,
    /// How the pair was lit and exposed, where the recording says so.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub light: Option<StopLight>,
    /// What is known to be true, where anything is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub truth: Option<StopTruth>,
}

/// The light of one stop.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct StopLight {
    /// Where the sun stands, clockwise from the site frame's +x seen from above, deg.
    pub sun_azimuth_deg: f64,
    /// Its height over the level, deg.
    pub sun_elevation_deg: f64,
    /// For how long the left image was exposed, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exposure_s: Option<f64>,
}

impl StopLight {
    /// The unit direction to the sun, site frame.
    pub fn to_sun_in_site(&self) -> Vector3 {
        let (azimuth, elevation) = (self.sun_azimuth_deg.to_radians(), self.sun_elevation_deg.to_radians());
        Vector3::new(elevation.cos() * azimuth.cos(), elevation.cos() * azimuth.sin(), -elevation.sin())
    }
}

/// One image with its camera model in the rover frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct View {
    /// The PNG file, relative to the folder.
    pub image: String,
    /// The camera model in the rover frame at this stop.
    pub camera: CameraSource,
}

/// A camera model, written in the index or in a file of JPL's text form beside it.
///
/// Read by hand (`index_file.rs`), because an untagged enum could not say which field is wrong.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
#[serde(untagged)]
pub enum CameraSource {
    /// Written in the index itself.
    Inline(Camera),
    /// The name of a `.cahv`, `.cahvor` or `.cahvore` file, relative to the folder.
    File {
        /// The file's name.
        file: String,
    },
}

/// The truth of one stop.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct StopTruth {
    /// The true pose of the rover in the site frame.
    pub site_from_rover: PoseRecord,
    /// The true left camera in the rover frame, where it differs from the one the tracker is given.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "index_file::optional_camera"
    )]
    pub left_camera: Option<Camera>,
    /// The true right camera in the rover frame, alike.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "index_file::optional_camera"
    )]
    pub right_camera: Option<Camera>,
}
