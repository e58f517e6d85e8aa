//! What page and server say to each other, beside the types of `sightline_session::view`: requests, the traverse, and events.
//! Server and viewer never see each other's code; these types are their whole common language.

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
    /// Its short name.
    pub name: String,
    /// What was recorded.
    pub description: String,
    /// Whether its images are rendered.
    pub simulated: bool,
    /// How many stops it has.
    pub stop_count: usize,
    /// Whether it can be removed: it was opened by its scenario, not given when the server was started.
    pub removable: bool,
}

/// A session in the server's list.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SessionEntry {
    /// Its name in paths.
    pub id: String,
    /// The traverse's name in paths.
    pub traverse: String,
    /// How many targets it has.
    pub target_count: usize,
    /// The traverse's short name.
    pub traverse_name: String,
    /// How many runs its targets have.
    pub run_count: usize,
    /// The step that was looked at last.
    pub step: usize,
    /// How many stops the traverse has.
    pub stop_count: usize,
    /// When something of it was changed or stepped through last: RFC 3339, UTC; null where that is not known.
    pub used: Option<String>,
    /// How long ago that was, s.
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
    /// Its short name.
    pub name: String,
    /// What was recorded.
    pub description: String,
    /// Whether its images are rendered.
    pub simulated: bool,
    /// What opens it on the command line of the server's machine: a scenario of the library, or its folder.
    pub source: String,
    /// How the two images of a stop relate.
    pub stereo: StereoGeometry,
    /// What was odd when it was opened.
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
    /// The true pose, where it is known.
    pub true_site_from_rover: Option<PoseRecord>,
    /// Size of the left image (width, height), px.
    pub left_size: [u32; 2],
    /// Size of the right image (width, height), px.
    pub right_size: [u32; 2],
    /// Whether the images are there; those of a simulated traverse are rendered when they are first asked for.
    pub ready: bool,
    /// How vision measured the motion to this stop; left out where it did not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub odometry: Option<MeasuredMotion>,
    /// The cameras beside the main pair.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cameras: Vec<StopCameraView>,
}

/// A camera of a stop beside its main pair.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StopCameraView {
    /// Its name.
    pub name: CameraName,
    /// Size of its left or only image (width, height), px.
    pub left_size: [u32; 2],
    /// Size of its right image (width, height), px; null for a single camera, in which nothing can be tracked.
    pub right_size: Option<[u32; 2]>,
    /// The angles of the mast; null for a camera on the body.
    pub mast: Option<MastAngles>,
}

/// The models of a camera beside the main pair, in the rover frame.
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
    /// What the traverse says of it.
    pub stop: StopView,
    /// The left camera in the rover frame, m and px.
    pub left: Camera,
    /// The right camera in the rover frame, m and px.
    pub right: Camera,
    /// The angles of the mast; none without a mast.
    pub mast: Option<MastAngles>,
    /// The models of the cameras beside the main pair.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cameras: Vec<StopCameraModels>,
}

/// How vision measured the motion to a stop, corner by corner.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StopOdometry {
    /// The settings of the preset.
    pub settings: OdometrySettings,
    /// The pose by the wheels and the update with its gates, slip and covariance.
    pub measured: MeasuredMotion,
    /// The corners of the left image of the stop before; no drive stores them, they are computed again.
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
    /// The pair of the stop in which it is designated and tracked; left out: the main pair.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<CameraName>,
    /// Its position in the left image, px.
    #[serde(default)]
    pub pixel: Option<Pixel>,
    /// The mast angles at which that image was taken; left out: those of the stop.
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
    /// What to call it.
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

    /// What was said of the target.
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

/// The name of a target.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct TargetLabel {
    /// The name; blank: `target` and its number.
    pub label: String,
}

/// A target that was designated, with the session that now has it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Designated {
    /// The target's number in paths.
    pub target: usize,
    /// How far the surface that stereo found lies from the point that was given, m; null for a pixel.
    pub gap_m: Option<f64>,
    /// The session with it.
    pub session: SessionView,
}

/// Runs a target again from a step with changed settings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewRun {
    /// The run to leave.
    pub run: usize,
    /// The first step to compute anew.
    pub from_step: usize,
    /// The settings that change, by name.
    #[serde(default)]
    #[schema(value_type = Object)]
    pub settings: Changes,
    /// Where to put the prediction of that one step in the left image, px; left out: where dead reckoning has it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub prediction_px: Option<Pixel>,
}

/// Begins a drive on commands with a run, in a world of its own.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewDrive {
    /// What the rover is told.
    #[serde(default)]
    pub command: DriveCommand,
    /// The targets to which it drives afterwards, in this order, by their numbers.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub then: Vec<usize>,
    /// Faults to be injected, beside those of the drive from which it branches.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<NewFault>,
    /// The stop from which it drives; left out: the last one of a drive on commands, the first one of any other.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from_step: Option<usize>,
    /// The stop at which it waits; left out: it drives on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pause_at: Option<usize>,
    /// The stage of that stop before or after which it waits; left out: before `drive`, once the target is located.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pause: Option<StagePause>,
}

/// The live Rerun stream of a session.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RerunStream {
    /// Path below `/api/v1/` of the page that shows it.
    pub viewer_path: String,
    /// Path below `/api/v1/` of the recording, for another viewer: `curl -N … | rerun -`.
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
    /// One sentence that names the culprit.
    pub detail: String,
    /// How to mend it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hint: Option<String>,
    /// The nearest pixel of the left image that would do, where one was refused.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nearest_pixel: Option<Box<Pixel>>,
    /// Which request it answers, and when; what the server adds on the way out.
    #[serde(flatten, default, skip_serializing_if = "Option::is_none")]
    pub received: Option<Box<Received>>,
}

/// By which a person's report finds the lines of the server's log.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct Received {
    /// The request's name in the log.
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

    /// The field of the request that is at fault, where the sentence begins with its name.
    pub fn field(&self) -> Option<&str> {
        let is_named = matches!(self.code.as_str(), "field" | "setting" | "query" | "expression");
        let name = self.detail.split_once(": ").map(|(name, _)| name).filter(|_| is_named)?;
        let name = name.strip_prefix("setting ").unwrap_or(name);
        let is_part = |c: char| c.is_ascii_alphanumeric() || "_.[]".contains(c);
        (!name.is_empty() && name.chars().all(is_part)).then_some(name)
    }
}

/// Characters of a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct TextRange {
    /// The first one, from 0.
    pub from: usize,
    /// The first one after it.
    pub to: usize,
}

/// Where in a request something is wrong.
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
    /// Where it is.
    #[serde(flatten)]
    pub place: ProblemPlace,
}
