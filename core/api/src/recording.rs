//! Recordings on the server's machine: which there are, what one contains, and its import as a drive.

use serde::{Deserialize, Serialize};
use sightline_geometry::stereo_geometry::StereoGeometry;
use utoipa::{IntoParams, ToSchema};

/// The recordings below the folders that were named when the server was started.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RecordingList {
    /// Those folders; empty: the server opens no recordings by their path.
    pub folders: Vec<String>,
    /// The recordings, by path.
    pub recordings: Vec<RecordingEntry>,
    /// Whether these are all; false beyond the limit `recordings`.
    pub is_complete: bool,
}

/// A recording that was found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RecordingEntry {
    /// Its folder.
    pub path: String,
    /// The name of its format.
    pub format: String,
}

/// Names a recording.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct RecordingPath {
    /// Its folder or file: absolute, or relative to a folder that was named when the server was started.
    pub path: String,
}

/// What a recording contains, before it is imported.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RecordingView {
    /// Its folder or file.
    pub path: String,
    /// The name of its format.
    pub format: String,
    /// The name that its drive will have.
    pub name: String,
    /// How many stops it has.
    pub stop_count: usize,
    /// How many images it has, those of further cameras included.
    pub image_count: usize,
    /// Size of the left image of the first stop (width, height), px.
    pub left_size: [u32; 2],
    /// Size of the right image of the first stop (width, height), px.
    pub right_size: [u32; 2],
    /// How the two images of a stop relate.
    pub stereo: StereoGeometry,
    /// The images that form the stereo pairs of the first stops and of the last one.
    pub pairs: Vec<RecordedPair>,
    /// The names of the cameras beside the main pair.
    pub further_cameras: Vec<String>,
    /// Whether the true poses are known.
    pub has_truth: bool,
    /// Whether it is opened where it is; otherwise its images are copied.
    pub is_opened_in_place: bool,
    /// What is left out or assumed, one sentence each.
    pub notes: Vec<String>,
}

/// The images of a stop.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RecordedPair {
    /// The stop.
    pub step: usize,
    /// The left image, relative to the drive.
    pub left: String,
    /// The right image, relative to the drive.
    pub right: String,
}

/// A recording that a page sends.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct UploadView {
    /// Its name in paths.
    pub id: String,
    /// The folder that its files are in, which `GET recordings/contents` takes.
    pub path: String,
    /// How many files have arrived.
    pub files: usize,
    /// How many bytes have arrived, or were unpacked.
    pub bytes: u64,
}

/// Names a file of an upload.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct UploadPath {
    /// Its path in the recording, with `/`: for example `drive/image_0/000000.png`.
    pub path: String,
}

/// Imports a recording.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewImport {
    /// Its folder or file, as in `GET recordings/contents`.
    pub path: String,
}

/// An import that was started.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ImportJob {
    /// Its name in paths.
    pub id: String,
    /// The recording.
    pub path: String,
    /// How far it is.
    pub state: ImportState,
    /// Images done.
    pub k: usize,
    /// Images in all; 0 before that is known.
    pub n: usize,
    /// The drive, once it is done.
    pub traverse: Option<String>,
    /// Why it failed.
    pub problem: Option<String>,
    /// What was left out or assumed, one sentence each.
    pub notes: Vec<String>,
}

/// How far an import is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ImportState {
    /// Others are before it.
    Waiting,
    /// Images are copied.
    Running,
    /// The drive is open.
    Done,
    /// It was cancelled; nothing of it is kept.
    Cancelled,
    /// It failed; nothing of it is kept.
    Failed,
}

impl ImportState {
    /// Whether nothing more will come.
    pub const fn has_ended(self) -> bool {
        matches!(self, Self::Done | Self::Cancelled | Self::Failed)
    }
}
