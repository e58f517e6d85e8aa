//! Opening: the window with recent sessions and drives, and what comes of a file that was dropped or chosen.
//!
//! Whatever a file holds, the open session stays as it is until there is something better: a refusal changes nothing.

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

/// What a person asks of files and sessions.
#[derive(Clone, Debug, PartialEq)]
pub enum Ask {
    /// Opens the window.
    Open,
    /// Closes it.
    Close,
    /// Lets the person choose a file.
    Choose,
    /// Opens the file at this path; only where the page runs as a program of its own.
    Path(String),
    /// Changes the path that is being typed.
    Type(String),
    /// Goes on with a session.
    Resume(String),
    /// Begins a new session on a traverse.
    Begin(String),
    /// Removes a session.
    RemoveSession(Box<SessionEntry>),
    /// Takes the removal of a session back.
    RestoreSession(String),
    /// Asks whether to remove a drive; none when not to.
    ConfirmDrive(Option<String>),
    /// Removes a drive with its images.
    RemoveDrive(String),
    /// Asks something of recordings.
    Recording(recording::Ask),
    /// Asks again for what of the cursor's stop could not be shown.
    TryAgain,
}

/// What is known of files and sessions.
#[derive(Clone, Debug, Default)]
pub struct Files {
    /// Whether the window is open.
    pub is_open: bool,
    /// The sessions, the one used last first; none before the server has said.
    pub recent: Option<Vec<SessionEntry>>,
    /// Why there are none.
    pub refused: Option<String>,
    /// Whether files are dragged over the page.
    pub is_hovered: bool,
    /// The file that the server works on.
    pub opening: Option<String>,
    /// The path that is being typed.
    pub path: String,
    /// The recordings on the server's machine.
    pub recordings: recording::Recordings,
    /// The sessions that were removed here and can be restored, the last one at the end.
    pub removed: Vec<SessionEntry>,
    /// The drive about whose removal the user is asked.
    pub confirming: Option<String>,
}
