//! Opening files: the window with recent sessions and drives, and the handling of dropped and chosen files.
//!
//! The open session is not replaced until the new one is loaded; a refused file changes nothing.

pub(crate) mod documents;
pub(crate) mod inbox;
pub(crate) mod window;
pub(crate) mod download;
#[cfg(target_arch = "wasm32")]
mod outgoing;
pub(crate) mod recording;
mod recording_window;
mod removal;
mod update;

use sightline_api::wire::SessionEntry;

/// A user request concerning files and sessions.
#[derive(Clone, Debug, PartialEq)]
pub enum FilesCommand {
    /// Opens the window “Open”.
    Open,
    /// Closes the window.
    Close,
    /// Opens the browser's file dialog.
    Choose,
    /// Opens the file at this path; only in the native program.
    Path(String),
    /// Changes the path in the input field.
    Type(String),
    /// Opens an existing session.
    Resume(String),
    /// Begins a new session on a traverse.
    Begin(String),
    /// Removes a session.
    RemoveSession(Box<SessionEntry>),
    /// Restores a removed session.
    RestoreSession(String),
    /// Asks the user to confirm the removal of a drive; `None` cancels.
    ConfirmDrive(Option<String>),
    /// Removes a drive with its images.
    RemoveDrive(String),
    /// A request concerning recordings.
    Recording(recording::RecordingCommand),
    /// Retries loading the images of the cursor's stop.
    TryAgain,
}

/// The state of the window “Open”.
#[derive(Clone, Debug, Default)]
pub struct Files {
    /// Whether the window is open.
    pub is_open: bool,
    /// The sessions, most recently used first; `None` until the server has answered.
    pub recent: Option<Vec<SessionEntry>>,
    /// Why the list of sessions could not be loaded.
    pub refused: Option<String>,
    /// Whether files are dragged over the page.
    pub is_hovered: bool,
    /// The file that the server is opening.
    pub opening: Option<String>,
    /// The path in the input field.
    pub path: String,
    /// The recordings on the server's machine.
    pub recordings: recording::Recordings,
    /// The sessions that this page removed and can restore, the latest at the end.
    pub removed: Vec<SessionEntry>,
    /// The drive whose removal the user is asked to confirm.
    pub confirming: Option<String>,
}
