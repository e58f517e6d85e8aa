//! Requests and replies that viewer and server exchange, in addition to the types of `sightline_session::view`. Server and
//! viewer do not depend on each other; they share these types alone.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use sightline_geometry::camera::{Camera, CameraName, MastAngles};
use sightline_geometry::frames::{Pixel, PoseRecord};
use sightline_geometry::odometry_error::OdometryError;
use sightline_geometry::stereo_geometry::StereoGeometry;
use sightline_rover::designate::Place;
use sightline_rover::driving::DriveCommand;
use sightline_rover::visual_odometry::{MeasuredMotion, OdometryCorner, OdometrySettings};
use sightline_session::faults::NewFault;
use sightline_session::pause::StagePause;
use sightline_session::view::SessionView;
use sightline_track::settings::Changes;

/// A traverse in the server's list.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TraverseEntry {
    /// Its name in paths.
    pub id: String,
    /// Its display name.
    pub name: String,
    /// A description in words.
    pub description: String,
    /// Whether its images are simulated, and rendered on demand.
    pub simulated: bool,
    /// Number of stops.
    pub stop_count: usize,
    /// Whether it can be removed: true if it was opened by a request, false if it was given when the server was started.
    pub removable: bool,
}

/// A session in the server's list.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SessionEntry {
    /// Its name in paths.
    pub id: String,
    /// The traverse's name in paths.
    pub traverse: String,
    /// Number of targets.
    pub target_count: usize,
    /// The traverse's display name.
    pub traverse_name: String,
    /// Number of runs of all targets.
    pub run_count: usize,
    /// The step of the cursor.
    pub step: usize,
    /// Number of stops of the traverse.
    pub stop_count: usize,
    /// Time of the last change or cursor move: RFC 3339, UTC; null if unknown.
    pub used: Option<String>,
    /// Time since then, s; null if unknown.
    pub idle_s: Option<f64>,
}

/// Opens a simulated drive.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewTraverse {
    /// Its scenario, as TOML.
    pub scenario: String,
}

/// A traverse as pages and scripts see it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TraverseView {
    /// Its name in paths.
    pub id: String,
    /// Its display name.
    pub name: String,
    /// A description in words.
    pub description: String,
    /// Whether its images are simulated, and rendered on demand.
    pub simulated: bool,
    /// The command-line argument that opens it on the server's machine: a scenario of the library, or its folder.
    pub source: String,
    /// The geometry of the stereo pair.
    pub stereo: StereoGeometry,
    /// Warnings from opening it.
    pub warnings: Vec<String>,
    /// The error model of the pose estimates.
    #[serde(default)]
    pub odometry_error: OdometryError,
    /// Its stops.
    pub stops: Vec<StopView>,
}

/// One stop as pages and scripts see it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StopView {
    /// Time since the first stop, s.
    pub time_s: f64,
    /// The estimated pose in the site frame.
    pub site_from_rover: PoseRecord,
    /// The true pose; null if unknown.
    pub true_site_from_rover: Option<PoseRecord>,
    /// Size of the left image (width, height), px.
    pub left_size: [u32; 2],
    /// Size of the right image (width, height), px.
    pub right_size: [u32; 2],
    /// Whether the images exist; those of a simulated traverse are rendered on the first request.
    pub ready: bool,
    /// The motion to this stop as measured by visual odometry; left out if it was not measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub odometry: Option<MeasuredMotion>,
    /// The cameras other than the main pair.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cameras: Vec<StopCameraView>,
}

/// A camera of a stop other than the main pair.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StopCameraView {
    /// Its name.
    pub name: CameraName,
    /// Size of its left or only image (width, height), px.
    pub left_size: [u32; 2],
    /// Size of its right image (width, height), px; null for a single camera, in which tracking is not possible.
    pub right_size: Option<[u32; 2]>,
    /// The angles of the mast; null for a camera on the body.
    pub mast: Option<MastAngles>,
}

/// The models of a camera other than the main pair, in the rover frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StopCameraModels {
    /// Its name.
    pub name: CameraName,
    /// The left or only camera, m and px.
    pub left: Camera,
    /// The right camera, m and px; null for a single camera.
    pub right: Option<Camera>,
}

/// One stop with its cameras.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StopDetail {
    /// The stop as in the traverse.
    pub stop: StopView,
    /// The left camera in the rover frame, m and px.
    pub left: Camera,
    /// The right camera in the rover frame, m and px.
    pub right: Camera,
    /// The angles of the mast; null without a mast.
    pub mast: Option<MastAngles>,
    /// The models of the cameras other than the main pair.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cameras: Vec<StopCameraModels>,
}

/// The motion to a stop as measured by visual odometry, with its corners.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StopOdometry {
    /// The settings of the preset.
    pub settings: OdometrySettings,
    /// The pose by wheel odometry, and the update with its gates, slip and covariance.
    pub measured: MeasuredMotion,
    /// The corners of the left image of the previous stop; they are not stored but recomputed on request.
    pub corners: Vec<OdometryCorner>,
}

/// Exchanges the access token for a cookie. No `Debug`: the token is a secret.
#[derive(Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Login {
    /// The access token.
    pub token: String,
}

/// Begins a session.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewSession {
    /// The traverse's name in paths.
    pub traverse: String,
}

/// Designates a target in one of three ways: exactly one of `pixel`, `point_in_rover` and `point_in_site`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewTarget {
    /// The stop at which it is designated.
    pub step: usize,
    /// The stereo pair in which it is designated and tracked; default: the main pair.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<CameraName>,
    /// Its position in the left image, px.
    #[serde(default)]
    pub pixel: Option<Pixel>,
    /// The mast angles at which that image was taken; default: those of the stop.
    #[serde(default)]
    pub mast: Option<MastAngles>,
    /// Its position in the rover frame of the stop, m.
    #[serde(default)]
    #[schema(min_items = 3, max_items = 3)]
    pub point_in_rover: Option<[f64; 3]>,
    /// Its position in the site frame, m.
    #[serde(default)]
    #[schema(min_items = 3, max_items = 3)]
    pub point_in_site: Option<[f64; 3]>,
    /// Its label; default: `target` and its number.
    #[serde(default)]
    pub label: Option<String>,
    /// Settings that differ from the defaults, by name.
    #[serde(default)]
    #[schema(value_type = Object)]
    pub settings: Changes,
}

impl NewTarget {
    /// A pixel of the left image of a stop, with the default settings.
    pub fn at_pixel(step: usize, pixel: Pixel) -> Self {
        Self {
            step,
            camera: None,
            pixel: Some(pixel),
            mast: None,
            point_in_rover: None,
            point_in_site: None,
            label: None,
            settings: Changes::new(),
        }
    }

    /// Where the target is designated.
    pub fn place(&self) -> Place {
        Place {
            camera: self.camera,
            pixel: self.pixel,
            mast: self.mast,
            point_in_rover: self.point_in_rover,
            point_in_site: self.point_in_site,
        }
    }
}

/// The label of a target.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct TargetLabel {
    /// The label; if blank, `target` and its number.
    pub label: String,
}

/// A designated target, and the session that contains it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Designated {
    /// The target's number in paths.
    pub target: usize,
    /// Distance of the surface point found by stereo from the given point, m; null if a pixel was given.
    pub gap_m: Option<f64>,
    /// The session after the designation.
    pub session: SessionView,
}

/// Runs a target again from a step with changed settings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewRun {
    /// The run to fork from.
    pub run: usize,
    /// The first step to compute anew.
    pub from_step: usize,
    /// The settings that change, by name.
    #[serde(default)]
    #[schema(value_type = Object)]
    pub settings: Changes,
    /// The prediction of that one step in the left image, px; default: by dead reckoning.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub prediction_px: Option<Pixel>,
}

/// Begins a drive on commands that a run steers, in a world of its own.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewDrive {
    /// The command of the drive.
    #[serde(default)]
    pub command: DriveCommand,
    /// Numbers of the targets to which it drives afterwards, in this order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub then: Vec<usize>,
    /// Faults to inject, in addition to those of the drive from which it branches.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<NewFault>,
    /// The stop from which it drives; default: the last stop of a drive on commands, the first stop of any other.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from_step: Option<usize>,
    /// The stop at which it pauses; default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pause_at: Option<usize>,
    /// Pause before or after a stage of that stop; default: before `drive`, once the target is located.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pause: Option<StagePause>,
}

/// The live Rerun stream of a session.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RerunStream {
    /// Path below `/api/v1/` of the page that displays it.
    pub viewer_path: String,
    /// Path below `/api/v1/` of the recording, for an external viewer: `curl -N … | rerun -`.
    pub stream_path: String,
}

/// A problem as the server reports it (RFC 9457).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Problem {
    /// A stable name for programs.
    pub code: String,
    /// A short title.
    pub title: String,
    /// The HTTP status.
    pub status: u16,
    /// One sentence that names the field or object at fault.
    pub detail: String,
    /// How to correct the request.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hint: Option<String>,
    /// The nearest acceptable pixel of the left image, if a pixel was refused.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nearest_pixel: Option<Box<Pixel>>,
    /// The request's id and time; added by the server when it replies.
    #[serde(flatten, default, skip_serializing_if = "Option::is_none")]
    pub received: Option<Box<Received>>,
}

/// Identifies a request in the server's log.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct Received {
    /// The request's id in the log.
    pub request_id: String,
    /// When it was answered: RFC 3339, UTC.
    pub time: String,
}

impl Problem {
    /// A problem of that status; `code` is its stable name for programs.
    pub fn new(status: u16, code: &str, title: &str, detail: impl Into<String>) -> Self {
        Self {
            code: code.to_owned(),
            title: title.to_owned(),
            status,
            detail: detail.into(),
            hint: None,
            nearest_pixel: None,
            received: None,
        }
    }

    /// The field of the request at fault; `None` if `detail` does not begin with its name.
    pub fn field(&self) -> Option<&str> {
        let is_named = matches!(self.code.as_str(), "field" | "setting" | "query" | "expression");
        let name = self.detail.split_once(": ").map(|(name, _)| name).filter(|_| is_named)?;
        let name = name.strip_prefix("setting ").unwrap_or(name);
        let is_part = |c: char| c.is_ascii_alphanumeric() || "_.[]".contains(c);
        (!name.is_empty() && name.chars().all(is_part)).then_some(name)
    }
}

/// A range of characters in a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct TextRange {
    /// The first character, from 0.
    pub from: usize,
    /// The first character after the range.
    pub to: usize,
}

/// The location of a fault in a request.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct ProblemPlace {
    /// The field of the request.
    pub field: String,
    /// The characters of its text.
    pub position: TextRange,
}

/// A problem with an expression: a [`Problem`] with the field and the characters at fault.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ExpressionProblem {
    /// The problem.
    #[serde(flatten)]
    pub problem: Problem,
    /// The location of the fault.
    #[serde(flatten)]
    pub place: ProblemPlace,
}
