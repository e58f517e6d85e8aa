//! Recordings on the server's machine: their list, their contents, and their import as drives.

use serde::{Deserialize, Serialize};
use sightline_geometry::stereo_geometry::StereoGeometry;
use utoipa::{IntoParams, ToSchema};

/// The recordings below the folders given when the server was started.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RecordingList {
    /// Those folders; if empty, the server opens no recordings by path.
    pub folders: Vec<String>,
    /// The recordings, by path.
    pub recordings: Vec<RecordingEntry>,
    /// Whether the list is complete; false beyond the limit `recordings`.
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
    /// Its folder or file: absolute, or relative to a folder given when the server was started.
    pub path: String,
}

/// The contents of a recording, before its import.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RecordingView {
    /// Its folder or file.
    pub path: String,
    /// The name of its format.
    pub format: String,
    /// The name that its drive will have.
    pub name: String,
    /// Number of stops.
    pub stop_count: usize,
    /// Number of images, further cameras included.
    pub image_count: usize,
    /// Size of the left image of the first stop (width, height), px.
    pub left_size: [u32; 2],
    /// Size of the right image of the first stop (width, height), px.
    pub right_size: [u32; 2],
    /// The geometry of the stereo pair.
    pub stereo: StereoGeometry,
    /// The stereo pairs of the first stops and of the last one.
    pub pairs: Vec<RecordedPair>,
    /// The names of the cameras other than the main pair.
    pub further_cameras: Vec<String>,
    /// Whether the true poses are known.
    pub has_truth: bool,
    /// Whether it is opened in place; otherwise its images are copied.
    pub is_opened_in_place: bool,
    /// Omissions and assumptions of the import, one sentence each.
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

/// An upload of a recording.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct UploadView {
    /// Its name in paths.
    pub id: String,
    /// The folder of its files, as the path for `GET recordings/contents`.
    pub path: String,
    /// Number of files received.
    pub files: usize,
    /// Number of bytes received or unpacked.
    pub bytes: u64,
}

/// Names a file of an upload.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct UploadPath {
    /// Its path in the recording, separated by `/`: for example `drive/image_0/000000.png`.
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
    /// The state of the import.
    pub state: ImportState,
    /// Images done.
    pub k: usize,
    /// Images in all; 0 while that is unknown.
    pub n: usize,
    /// The id of the drive; null until the import is done.
    pub traverse: Option<String>,
    /// Why it failed; null otherwise.
    pub problem: Option<String>,
    /// Omissions and assumptions of the import, one sentence each.
    pub notes: Vec<String>,
}

/// The state of an import.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ImportState {
    /// It waits for other imports.
    Waiting,
    /// Images are being copied.
    Running,
    /// The drive is open.
    Done,
    /// It was cancelled; nothing is kept.
    Cancelled,
    /// It failed; nothing is kept.
    Failed,
}

impl ImportState {
    /// Whether the import has ended.
    pub const fn has_ended(self) -> bool {
        matches!(self, Self::Done | Self::Cancelled | Self::Failed)
    }
}
