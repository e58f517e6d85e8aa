//! What the page asks of the server, and what arrives.

use sightline_api::endpoint::Call;
use sightline_api::wire::{NewRun, NewTarget, Problem};
use sightline_rover::trackability::MapProgress;
use sightline_session::Cursor;
use sightline_session::compare::{Comparison, NewComparison, RunName};
use sightline_session::metrics::RunMetrics;
use sightline_session::notes::{EditNote, NewNote, Note};
use sightline_session::view::{RunView, SessionView};
use sightline_track::settings::Changes;

use crate::breakpoints::{AskReply, AskRequest};
use crate::cache::{Item, Key};
use crate::net::why::{WhyReply, WhyRequest};

/// What the page asks of the server.
#[derive(Clone, Debug, PartialEq)]
pub enum Request {
    /// A session.
    Session(String),
    /// The cursor of a session.
    Cursor(String),
    /// The rows of a run from one on, counted from 0.
    Rows {
        /// The session.
        session: String,
        /// The target's number.
        target: usize,
        /// The run's number.
        run: usize,
        /// The first row.
        from_row: usize,
    },
    /// To move a session's cursor.
    PutCursor {
        /// The session.
        session: String,
        /// Where to.
        cursor: Cursor,
    },
    /// To designate a target.
    NewTarget {
        /// The session.
        session: String,
        /// The designation.
        target: NewTarget,
    },
    /// To remove a target.
    RemoveTarget {
        /// The session.
        session: String,
        /// The target's number.
        target: usize,
    },
    /// To run again from a step.
    NewRun {
        /// The session.
        session: String,
        /// The target's number.
        target: usize,
        /// Which run to leave, where, and how.
        new: NewRun,
    },
    /// To stop a run.
    CancelRun {
        /// The session.
        session: String,
        /// The target's number.
        target: usize,
        /// The run's number.
        run: usize,
    },
    /// To let a stopped run go on.
    ResumeRun {
        /// The session.
        session: String,
        /// The target's number.
        target: usize,
        /// The run's number.
        run: usize,
    },
    /// A call of an endpoint, whose taker waits under the ticket.
    Call {
        /// The number of the taker.
        ticket: u64,
        /// The call.
        call: Call,
    },
    /// An image, an array or a record.
    Item(Key),
    /// To connect to the events again at once.
    Reconnect,
    /// Runs side by side.
    Compare {
        /// The session.
        session: String,
        /// Which runs, and how.
        new: Box<NewComparison>,
    },
    /// What a run is worth.
    Metrics {
        /// The session.
        session: String,
        /// The run.
        run: RunName,
    },
    /// The trackability of a stop.
    Trackability {
        /// The traverse.
        traverse: String,
        /// The stop.
        step: usize,
        /// The limits that are not the defaults.
        limits: Changes,
    },
    /// To give it up.
    CancelTrackability {
        /// The traverse.
        traverse: String,
        /// The stop.
        step: usize,
        /// The limits that are not the defaults.
        limits: Changes,
    },
    /// About single steps.
    Why(WhyRequest),
    /// The notes of a session.
    Notes(String),
    /// To pin a note.
    NewNote {
        /// The session.
        session: String,
        /// The note.
        new: NewNote,
    },
    /// To change a note.
    EditNote {
        /// The session.
        session: String,
        /// The note's number.
        id: u64,
        /// The revision that was read.
        revision: u64,
        /// The change.
        edit: EditNote,
    },
    /// To remove a note.
    RemoveNote {
        /// The session.
        session: String,
        /// The note's number.
        id: u64,
        /// The revision that was read.
        revision: u64,
    },
    /// To bring a removed note back.
    RestoreNote {
        /// The session.
        session: String,
        /// The note's number.
        id: u64,
    },
    /// About breakpoints and expressions.
    Ask(AskRequest),
}

impl Request {
    /// Whether this may only be sent when those of its kind before it are answered: quick changes that a user makes and
    /// takes back, and the list that they change. Connections are parallel, so that a removal could overtake what it undoes.
    pub(crate) const fn is_in_order(&self) -> bool {
        match self {
            Self::RemoveTarget { .. }
            | Self::NewNote { .. }
            | Self::EditNote { .. }
            | Self::RemoveNote { .. }
            | Self::RestoreNote { .. } => true,
            Self::Why(request) => matches!(
                request,
                WhyRequest::RemoveRun { .. }
                    | WhyRequest::RestoreRun { .. }
                    | WhyRequest::RestoreTarget { .. }
            ),
            Self::Ask(request) => !matches!(request, AskRequest::Query { .. }),
            _ => false,
        }
    }
}

/// What the server answered.
pub enum Reply {
    /// A session.
    Session(Box<SessionView>),
    /// A designated target.
    Designated {
        /// Its number.
        target: usize,
        /// The session with it.
        session: Box<SessionView>,
    },
    /// A run, or rows of it.
    Run(Box<RunView>),
    /// The cursor of a session.
    Cursor(Cursor),
    /// The body of an answer to an [`Request::Call`].
    Body(Vec<u8>),
    /// An image, an array or a record.
    Item(Item),
    /// The notes of a session.
    Notes(Vec<Note>),
    /// It is done.
    Done,
    /// Runs side by side.
    Compared(Box<Comparison>),
    /// What a run is worth.
    Metrics(Box<RunMetrics>),
    /// The trackability of a stop, as far as it was made.
    Trackability(Box<MapProgress>),
    /// About single steps.
    Why(WhyReply),
    /// About breakpoints and expressions.
    Ask(AskReply),
}

/// An answer with what was asked.
pub struct Arrived {
    /// What was asked.
    pub request: Request,
    /// What came of it.
    pub outcome: Result<Reply, Problem>,
}
