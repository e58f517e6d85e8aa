//! Events: what the server tells every open page over the WebSocket.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use sightline_session::Cursor;
use sightline_study::wire::StudyJob;

use crate::recording::ImportJob;

/// What the server tells every open page over the WebSocket.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum Event {
    /// Something of a session changed: read its view again.
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
    /// An import of a recording went on.
    ImportProgress {
        /// How far it is.
        job: ImportJob,
    },
    /// The cursor of a session was moved; nothing else of it changed.
    CursorMoved {
        /// The session.
        session: String,
        /// Where to.
        cursor: Cursor,
    },
    /// A run went on.
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
        /// The present activity, in words.
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
        /// The stop that became ready, where one did.
        ready: Option<usize>,
    },
    /// A study went on.
    StudyProgress {
        /// How it stands.
        job: StudyJob,
    },
    /// Rows of a stop's trackability were made.
    TrackabilityProgress {
        /// The traverse.
        traverse: String,
        /// The stop.
        step: usize,
        /// Rows of cells done.
        k: usize,
        /// Rows of cells in all; 0 before that is known.
        n: usize,
        /// Whether nothing more will come.
        ended: bool,
    },
    /// What would have saved a step is being looked for: read the question again.
    QuestionProgress {
        /// The session.
        session: String,
        /// The target's number.
        target: usize,
        /// The run's number.
        run: usize,
        /// The step.
        step: usize,
        /// Settings and places looked at.
        k: usize,
        /// How many there are.
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
