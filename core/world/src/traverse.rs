//! The index of a traverse: stops with time, estimated pose, mast angles, camera models, image names and optional truth.
//!
//! The simulator produces it, `sightline_recordings` reads and writes it as TOML or JSON. It contains ground truth;
//! therefore no stage crate may depend on this one.

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};
use utoipa::ToSchema;

use sightline_geometry::camera::{Camera, CameraName, Mast, MastAngles};
use sightline_geometry::frames::{Pixel, PoseRecord, Vector3};
use sightline_geometry::odometry_error::OdometryError;
use sightline_geometry::stereo_geometry::StereoGeometry;
use sightline_rover::visual_odometry::MeasuredMotion;
use sightline_track::target::Designation;

/// Version of the folder format that this code writes.
pub const FORMAT_VERSION: u32 = 1;
/// Largest number of cameras of a stop beside its main pair.
pub const FURTHER_CAMERAS_LIMIT: usize = 16;

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
    /// 1σ error of each mast angle, deg; 0 where it is not known.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub pointing_error_deg: f64,
    /// The error model of the pose estimates.
    #[serde(default)]
    pub odometry_error: OdometryError,
    /// The mast that carries the cameras, if known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mast: Option<Mast>,
    /// The file with the simulated scenario from which missing images are rendered.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scenario: Option<String>,
    /// The stops in driving order.
    pub stops: Vec<Stop>,
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

/// One stop of the rover.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Stop {
    /// Time since the first stop, s.
    pub time_s: f64,
    /// The estimated pose of the rover in the site frame.
    pub site_from_rover: PoseRecord,
    /// How visual odometry measured the motion to this stop, if it did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub odometry: Option<MeasuredMotion>,
    /// Whether visual odometry ran alone here: no tracker looks for its target at this stop.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub odometry_alone: bool,
    /// The target at which a drive pointed the mast; left out if it pointed at none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mast_target: Option<Designation>,
    /// The mast angles at which the pair was taken, if there is a mast.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mast_angles: Option<MastAngles>,
    /// Centre of the subframe that automatic exposure meters in the left image, px; the image's centre where left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub metered_px: Option<Pixel>,
    /// The left (or first) image.
    pub left: View,
    /// The right (or second) image.
    pub right: View,
    /// Light and exposure of the pair, if the recording contains them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub light: Option<StopLight>,
    /// Ground truth of the stop, if known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub truth: Option<StopTruth>,
    /// Further cameras of the stop beside the main pair `left` and `right`, with unique names.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cameras: Vec<StopCamera>,
}

impl Stop {
    /// All images of the stop, those of the main pair first.
    pub fn views(&self) -> impl Iterator<Item = &View> {
        let further =
            self.cameras.iter().flat_map(|camera| std::iter::once(&camera.left).chain(&camera.right));
        [&self.left, &self.right].into_iter().chain(further)
    }

    /// The further camera of this name.
    pub fn camera(&self, name: CameraName) -> Option<&StopCamera> {
        self.cameras.iter().find(|camera| camera.name == name)
    }
}

/// A further stereo pair of a stop, or a single camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct StopCamera {
    /// Name, unique within the stop; the same name at another stop is the same camera.
    pub name: CameraName,
    /// The mast angles at which the images were taken; left out for a camera on the body.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mast_angles: Option<MastAngles>,
    /// The left image, or the only one.
    pub left: View,
    /// The right image; left out for a single camera, in which nothing can be tracked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub right: Option<View>,
    /// The true left camera in the rover frame, where it differs from the one the tracker is given.
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "optional_camera")]
    pub true_left_camera: Option<Camera>,
    /// The true right camera in the rover frame, where it differs from the one the tracker is given.
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "optional_camera")]
    pub true_right_camera: Option<Camera>,
}

/// The light of one stop.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct StopLight {
    /// Azimuth of the sun, clockwise from the site frame's +x seen from above, deg.
    pub sun_azimuth_deg: f64,
    /// Elevation of the sun above the horizon, deg.
    pub sun_elevation_deg: f64,
    /// Exposure time of the left image, s.
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
/// Deserialised by hand below: an untagged enum could not report which field is wrong.
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
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "optional_camera")]
    pub left_camera: Option<Camera>,
    /// The true right camera in the rover frame, where it differs from the one the tracker is given.
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "optional_camera")]
    pub right_camera: Option<Camera>,
    /// Positions (x, y) of the six wheels on the way to this stop, where they left tracks: in order of time, site
    /// frame, m. Left out where they left none, or where the scenario plans the drive.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<Vec<[[f64; 2]; 6]>>)]
    pub wheel_places_m: Option<Vec<WheelPlaces>>,
}

/// x and y of the six wheels, site frame, m: left front, right front, left middle, right middle, left rear, right rear.
pub type WheelPlaces = [[f64; 2]; 6];

impl<'de> Deserialize<'de> for CameraSource {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let table = serde_json::Map::deserialize(deserializer)?;
        if let Some(file) = table.get("file") {
            if let Some(other) = table.keys().find(|key| *key != "file") {
                return Err(D::Error::custom(format!(
                    "`{other}` beside `file`; give the camera in one place"
                )));
            }
            let file = file.as_str().ok_or_else(|| D::Error::custom("`file` must be the name of a file"))?;
            return Ok(Self::File { file: file.to_owned() });
        }
        camera_from_table(table).map(Self::Inline).map_err(D::Error::custom)
    }
}

/// Reads an optional camera; rejects unknown fields.
fn optional_camera<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Camera>, D::Error> {
    let table = Option::<serde_json::Map<_, _>>::deserialize(deserializer)?;
    table.map(camera_from_table).transpose().map_err(D::Error::custom)
}

fn camera_from_table(table: serde_json::Map<String, serde_json::Value>) -> Result<Camera, String> {
    let fields: &[&str] = match table.get("model").and_then(serde_json::Value::as_str) {
        Some("CAHV") => &["C", "A", "H", "V"],
        Some("CAHVOR") => &["C", "A", "H", "V", "O", "R"],
        Some("CAHVORE") => &["C", "A", "H", "V", "O", "R", "E", "T", "P"],
        Some(other) => return Err(format!("the model is `{other}`, but it must be CAHV, CAHVOR or CAHVORE")),
        None => return Err("give the camera's `model` (CAHV, CAHVOR or CAHVORE) or its `file`".to_owned()),
    };
    let known = |key: &str| matches!(key, "model" | "size") || fields.contains(&key);
    if let Some(unknown) = table.keys().find(|key| !known(key)) {
        return Err(format!("unknown field `{unknown}`, expected model, size, {}", fields.join(", ")));
    }
    // TOML allows numbers that are not finite; they become null in the table.
    let is_number = |value: &serde_json::Value| value.is_number();
    for field in fields {
        match (*field, table.get(*field)) {
            (_, None) => {}
            ("T" | "P", Some(value)) if is_number(value) => {}
            ("T" | "P", Some(_)) => return Err(format!("{field}: must be a finite number")),
            (_, Some(serde_json::Value::Array(v))) if v.len() == 3 && v.iter().all(is_number) => {}
            (_, Some(_)) => return Err(format!("{field}: must be three finite numbers")),
        }
    }
    serde_json::from_value(serde_json::Value::Object(table)).map_err(|error| error.to_string())
}
