//! Small things that are known: how far a run is, where a target could not be picked, how page and server stand.

use std::collections::BTreeSet;

use sightline_geometry::camera::CameraName;
use sightline_geometry::frames::Pixel;
use sightline_session::Cursor;
use sightline_session::view::{SessionView, waiting_for};

use crate::page::link::Fragment;
use crate::state::State;

/// How far a run is.
#[derive(Clone, Debug, PartialEq)]
pub struct Progress {
    /// Steps done.
    pub k: usize,
    /// Steps in all.
    pub n: usize,
    /// What is being done.
    pub doing: String,
}

impl State {
    /// Shows what runs wait for that waited before this page listened.
    pub(crate) fn note_waiting_runs(&mut self, view: &SessionView) {
        for target in &view.targets {
            let n = view.stop_count - target.designation.step;
            for run in &target.runs {
                if let Some(before) = run.waits_for {
                    let progress = Progress { k: run.rows.len(), n, doing: waiting_for(before) };
                    self.progress.entry((target.number, run.number)).or_insert(progress);
                }
            }
        }
    }
}

/// A place in the left image of a stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// The stop.
    pub step: usize,
    /// The position, px.
    pub pixel: Pixel,
    /// The camera beside the main pair; `None`: the main pair.
    pub camera: Option<CameraName>,
}

/// Why a target was not designated.
#[derive(Clone, Debug, PartialEq)]
pub struct Refusal {
    /// Where.
    pub place: Place,
    /// What the server said, or what the map of trackability says of the place.
    pub sentence: String,
    /// The nearest pixel that would do.
    pub nearest: Option<Pixel>,
    /// Whether the place was not tried: a person may insist on it.
    pub is_advice: bool,
}

/// How page and server stand to each other.
#[derive(Default)]
pub(crate) struct Sync {
    /// The session is to be read again.
    pub session_stale: bool,
    /// The session is being read, asked for at this count of cursor messages.
    pub session_asked: Option<u64>,
    /// The cursor as the server knows it.
    pub server_cursor: Cursor,
    /// The cursor that is on its way to the server.
    pub cursor_sent: Option<Cursor>,
    /// How often a cursor was sent or its answer came in: between the two an answer may hold either cursor.
    pub cursor_messages: u64,
    /// The server's cursor is to be read: perhaps another page moved it.
    pub cursor_stale: bool,
    /// It is being read, asked for at this count of cursor messages.
    pub cursor_read: Option<u64>,
    /// Runs with more rows than the page has: target and run.
    pub runs_ahead: BTreeSet<(usize, usize)>,
    /// Rows of a run are being read.
    pub rows_asked: bool,
    /// The session named by the page's link, before it was opened.
    pub linked: Option<String>,
    /// The rest of the link, until its session is here.
    pub link: Option<Fragment>,
    /// The traverse whose latest session is to be opened.
    pub opening: Option<String>,
    /// The page's cursor counts more than the server's when the session is read next: the server was gone.
    pub keeps_cursor: bool,
}
