//! Notes of the open session: the user's texts about positions on the drive, in the order of a tour.
//!
//! A note being written is a draft here, so that its text is lost neither by closing its window nor by a refusal of the
//! server.

pub(crate) mod panel;
pub(crate) mod markdown;
pub(crate) mod marks;
mod update;

use sightline_session::notes::{Note, Pin};

/// A command about notes.
#[derive(Clone, Debug, PartialEq)]
pub enum NotesCommand {
    /// Starts a note at the cursor.
    Pin,
    /// Starts to edit a note.
    Edit(u64),
    /// Changes the text of the draft.
    Write(String),
    /// Saves the draft.
    Save,
    /// Closes the window; the text of a new note is kept for the next time.
    Close,
    /// Removes a note.
    Remove(u64),
    /// Restores a removed note.
    Restore(u64),
    /// Moves a note to another position in the list.
    Move {
        /// Number of the note.
        id: u64,
        /// Its new index, from 0.
        place: usize,
    },
    /// Goes to the step of a note.
    GoTo(u64),
    /// Moves by this many notes in the tour; backward if negative.
    Tour(isize),
}

/// A note being written.
#[derive(Clone, Debug, PartialEq)]
pub struct Draft {
    /// The note being edited and the revision that was read; `None` for a new note.
    pub of: Option<(u64, u64)>,
    /// The position on the drive to which a new note is pinned.
    pub pin: Pin,
    /// The text so far.
    pub text: String,
}

/// State of the notes.
#[derive(Clone, Debug, Default)]
pub struct Notes {
    /// The notes in order; `None` until received.
    pub list: Option<Vec<Note>>,
    /// The note being written, while its window is open.
    pub draft: Option<Draft>,
    /// The note visited last.
    pub at: Option<u64>,
    /// The note removed last, which can be restored.
    pub removed: Option<Note>,
    /// Text of a new note whose window was closed.
    unsaved_text: String,
    /// The session whose notes were requested.
    requested_for: Option<String>,
}
