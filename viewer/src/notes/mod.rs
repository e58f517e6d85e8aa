//! Notes of the open session: what a person wrote about places of the drive, in the order of a tour.
//!
//! A note that is being written is a draft here, so that nothing of it is lost: neither by closing its window nor by a
//! refusal of the server.

pub(crate) mod panel;
pub(crate) mod markdown;
pub(crate) mod marks;
mod update;

use sightline_session::notes::{Note, Pin};

/// What a person asks of notes.
#[derive(Clone, Debug, PartialEq)]
pub enum Ask {
    /// Begins a note at the cursor.
    Pin,
    /// Begins to change a note.
    Edit(u64),
    /// Changes the words of what is being written.
    Write(String),
    /// Keeps what was written.
    Save,
    /// Closes the window; the words of a new note stay for the next time.
    Close,
    /// Removes a note.
    Remove(u64),
    /// Brings a removed note back.
    Restore(u64),
    /// Moves a note to another place in the list.
    Move {
        /// The note.
        id: u64,
        /// Its new place, from 0.
        place: usize,
    },
    /// Goes to where a note is pinned.
    GoTo(u64),
    /// Goes to the next note of the tour, or back.
    Tour(isize),
}

/// A note that is being written.
#[derive(Clone, Debug, PartialEq)]
pub struct Draft {
    /// The note that is changed, with the revision that was read; none for a new one.
    pub of: Option<(u64, u64)>,
    /// Where a new one is pinned.
    pub pin: Pin,
    /// Its words so far.
    pub text: String,
}

/// The notes.
#[derive(Clone, Debug, Default)]
pub struct Notes {
    /// The notes in their order; none before the server has said.
    pub list: Option<Vec<Note>>,
    /// The note that is being written, while its window is open.
    pub draft: Option<Draft>,
    /// The note that was gone to last.
    pub at: Option<u64>,
    /// The note that was removed last, which can be brought back.
    pub removed: Option<Note>,
    /// Words of a new note whose window was closed.
    kept: String,
    /// The session whose notes were asked for.
    asked: Option<String>,
}
