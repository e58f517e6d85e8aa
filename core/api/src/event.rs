//! Events that the server sends to every open page over the WebSocket.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use sightline_session::Cursor;
use sightline_study::wire::StudyJob;

use crate::recording::ImportJob;

/// An event that the server sends to every open page over the WebSocket.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum Event {
    /// A session changed: read its view again.
    SessionChanged {
        /// The session.
        session: String,
    },
    /// A session was removed.
    SessionRemoved {
        /// The session.
        session: String,
    },
    /// A drive was removed.
    TraverseRemoved {
        /// The traverse.
        traverse: String,
    },
    /// The import of a recording progressed.
    ImportProgress {
        /// The import with its progress.
        job: ImportJob,
    },
    /// The cursor of a session was moved; nothing else of it changed.
    CursorMoved {
        /// The session.
        session: String,
        /// The new cursor.
        cursor: Cursor,
    },
    /// A run progressed.
    RunProgress {
        /// The session.
        session: String,
        /// The target's number.
        target: usize,
        /// The run's number.
        run: usize,
        /// Steps done.
        k: usize,
        /// Steps in all.
        n: usize,
        /// Whether it has ended.
        ended: bool,
        /// The current activity, in words.
        doing: String,
    },
    /// Images of a simulated traverse were rendered.
    RenderProgress {
        /// The traverse.
        traverse: String,
        /// Stops done.
        k: usize,
        /// Stops in all.
        n: usize,
        /// The stop that became ready; null if none did.
        ready: Option<usize>,
    },
    /// A study progressed.
    StudyProgress {
        /// The study with its progress.
        job: StudyJob,
    },
    /// Rows of a stop's trackability map were computed.
    TrackabilityProgress {
        /// The traverse.
        traverse: String,
        /// The stop.
        step: usize,
        /// Rows of cells done.
        k: usize,
        /// Rows of cells in all; 0 while that is unknown.
        n: usize,
        /// Whether the computation has ended.
        ended: bool,
    },
    /// The search for a counterfactual of a step progressed: read the question again.
    QuestionProgress {
        /// The session.
        session: String,
        /// The target's number.
        target: usize,
        /// The run's number.
        run: usize,
        /// The step.
        step: usize,
        /// Candidates examined.
        k: usize,
        /// Candidates in all.
        n: usize,
        /// Whether it has ended.
        ended: bool,
    },
    /// Notes of a session changed: read them again.
    NotesChanged {
        /// The session.
        session: String,
    },
}
