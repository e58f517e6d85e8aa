//! Small parts of the state: progress of a run, refused designations, and the synchronisation of page and server.

use std::collections::BTreeSet;

use sightline_geometry::camera::CameraName;
use sightline_geometry::frames::Pixel;
use sightline_session::Cursor;
use sightline_session::view::{SessionView, waiting_for};

use crate::page::link::Fragment;
use crate::state::State;

/// Progress of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Progress {
    /// Steps done.
    pub k: usize,
    /// Total number of steps.
    pub n: usize,
    /// The current activity, as words.
    pub doing: String,
}

impl State {
    /// Shows what the waiting runs wait for, if they began to wait before the page was connected.
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

/// An image position at a stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImagePosition {
    /// Number of the stop.
    pub step: usize,
    /// The pixel in the left image.
    pub pixel: Pixel,
    /// The further camera; `None`: the main pair.
    pub camera: Option<CameraName>,
}

/// Why a target was not designated.
#[derive(Clone, Debug, PartialEq)]
pub struct Refusal {
    /// The position that was picked.
    pub place: ImagePosition,
    /// The server's explanation, or the one of the trackability map.
    pub sentence: String,
    /// The nearest pixel with good trackability.
    pub nearest: Option<Pixel>,
    /// Whether the map advises against the position, which was not submitted; the user may insist.
    pub is_advice: bool,
}

/// State of the synchronisation of page and server.
#[derive(Default)]
pub(crate) struct Sync {
    /// The session must be read again.
    pub session_stale: bool,
    /// A read of the session is pending; it was requested at this value of `cursor_messages`.
    pub session_read: Option<u64>,
    /// The server's cursor, as last reported.
    pub server_cursor: Cursor,
    /// The cursor that was sent and is not yet acknowledged.
    pub cursor_sent: Option<Cursor>,
    /// Number of cursors sent and acknowledged. Between the two, a reply may contain either cursor.
    pub cursor_messages: u64,
    /// The server's cursor must be read: another page may have moved it.
    pub cursor_stale: bool,
    /// A read of the cursor is pending; it was requested at this value of `cursor_messages`.
    pub cursor_read: Option<u64>,
    /// Runs with more rows on the server than in the page: target and run.
    pub runs_ahead: BTreeSet<(usize, usize)>,
    /// A read of rows is pending.
    pub is_reading_rows: bool,
    /// The session in the page's link, until it is opened.
    pub linked: Option<String>,
    /// The rest of the link, until its session is loaded.
    pub link: Option<Fragment>,
    /// The traverse whose latest session is to be opened.
    pub opening: Option<String>,
    /// The page's cursor overrides the server's at the next read of the session, because the server was unreachable.
    pub keeps_cursor: bool,
}
