//! The path parameters: one type for each kind of resource that a path can name.

use serde::{Deserialize, Serialize};
use utoipa::IntoParams;

/// The whole server.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, IntoParams)]
#[into_params(parameter_in = Path)]
pub struct Anywhere {}

/// A traverse.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, IntoParams)]
#[into_params(parameter_in = Path)]
pub struct AtTraverse {
    /// The traverse's id.
    pub id: String,
}

/// A stop of a traverse.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, IntoParams)]
#[into_params(parameter_in = Path)]
pub struct AtStop {
    /// The traverse's id.
    pub id: String,
    /// The stop's index.
    pub step: usize,
}

/// An image of a stop.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, IntoParams)]
#[into_params(parameter_in = Path)]
pub struct AtImage {
    /// The traverse's id.
    pub id: String,
    /// The stop's index.
    pub step: usize,
    /// left.png or right.png
    pub file: String,
}

/// An import of a recording.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, IntoParams)]
#[into_params(parameter_in = Path)]
pub struct AtImport {
    /// The import's id.
    pub import: String,
}

/// An upload of a recording.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, IntoParams)]
#[into_params(parameter_in = Path)]
pub struct AtUpload {
    /// The upload's id.
    pub upload: String,
}

/// A session.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, IntoParams)]
#[into_params(parameter_in = Path)]
pub struct AtSession {
    /// The session's id.
    pub session: String,
}

/// A stop of the drive of a session.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, IntoParams)]
#[into_params(parameter_in = Path)]
pub struct AtDriveStop {
    /// The session's id.
    pub session: String,
    /// The stop's index.
    pub step: usize,
}

/// A file that a session can be exported as.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, IntoParams)]
#[into_params(parameter_in = Path)]
pub struct AtExport {
    /// The session's id.
    pub session: String,
    /// One of the names that the list of exports gives
    pub file: String,
}

/// A target of a session.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, IntoParams)]
#[into_params(parameter_in = Path)]
pub struct AtTarget {
    /// The session's id.
    pub session: String,
    /// The target's number.
    pub target: usize,
}

/// A run of a target.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, IntoParams)]
#[into_params(parameter_in = Path)]
pub struct AtRun {
    /// The session's id.
    pub session: String,
    /// The target's number.
    pub target: usize,
    /// The run's number.
    pub run: usize,
}

/// A step of a run.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, IntoParams)]
#[into_params(parameter_in = Path)]
pub struct AtStep {
    /// The session's id.
    pub session: String,
    /// The target's number.
    pub target: usize,
    /// The run's number.
    pub run: usize,
    /// The step's index in the traverse.
    pub step: usize,
}

/// A note of a session.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, IntoParams)]
#[into_params(parameter_in = Path)]
pub struct AtNote {
    /// The session's id.
    pub session: String,
    /// The note's number.
    pub note: u64,
}

/// A breakpoint of a session.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, IntoParams)]
#[into_params(parameter_in = Path)]
pub struct AtBreakpoint {
    /// The session's id.
    pub session: String,
    /// The breakpoint's number.
    pub breakpoint: usize,
}

/// A document.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, IntoParams)]
#[into_params(parameter_in = Path)]
pub struct AtDocument {
    /// The document's name.
    pub name: String,
}

/// A study that was started.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, IntoParams)]
#[into_params(parameter_in = Path)]
pub struct AtStudyJob {
    /// The study job's id.
    pub job: String,
}

/// A file of Rerun's web viewer.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, IntoParams)]
#[into_params(parameter_in = Path)]
pub struct AtViewerFile {
    /// index.html, re_viewer.js, re_viewer_bg.wasm, favicon.ico or apple-touch-icon.png
    pub file: String,
}
