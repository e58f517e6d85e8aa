//! Everything that crosses the network. Nothing here blocks: answers come in through a channel.

mod ask;
mod events;
pub mod files;
mod http;
pub mod why;

use std::collections::HashSet;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;

use sightline_core::limits::SettingInfo;
use sightline_core::session::Cursor;
use sightline_core::session::compare::{Comparison, NewComparison, RunName};
use sightline_core::session::exports::ExportEntry;
use sightline_core::session::metrics::RunMetrics;
use sightline_core::session::notes::{EditNote, NewNote, Note};
use sightline_core::session::view::{RunView, SessionView};
use sightline_core::session::wire::{
    Event, NewRun, NewSession, NewTarget, Problem, RerunStream, SessionEntry, TraverseEntry, TraverseView,
};

use sightline_core::settings::Changes;
use sightline_core::study::row::Row;
use sightline_core::study::wire::{NewStudy, StudyInfo, StudyJob};
use sightline_core::trackability::MapProgress;

use self::events::Events;
use self::files::{FileReply, FileRequest};
pub(crate) use self::http::{describe, revision};
use self::why::{WhyReply, WhyRequest};
use crate::cache::{Item, Key};
use crate::state::Connection;
use crate::state::ask::{AskReply, AskRequest};

/// How many images, arrays and records are asked for at a time.
const AT_A_TIME: usize = 6;

/// How many of them may be images that must be rendered first: a browser has few connections to one server.
const SLOW_AT_A_TIME: usize = 2;

/// After how long at the latest the page takes in what nobody waits for; mostly it comes with a frame that is laid out
/// anyway.
const UNHURRIED: Duration = Duration::from_millis(50);

/// What the page asks of the server.
#[derive(Clone, Debug, PartialEq)]
pub enum Request {
    /// The list of traverses.
    Traverses,
    /// The table of settings.
    Settings,
    /// A traverse.
    Traverse(String),
    /// The list of sessions.
    Sessions,
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
    /// To begin a session.
    NewSession(NewSession),
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
    /// To stream a session to Rerun.
    OpenRerun(String),
    /// The studies that can be started.
    Studies,
    /// The studies that were started.
    StudyJobs,
    /// To start a study.
    StartStudy(Box<NewStudy>),
    /// To stop a study.
    CancelStudy(String),
    /// To let a study go on.
    ResumeStudy(String),
    /// The table of a study.
    StudyRows(String),
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
    /// What a part of a session can be exported as.
    Exports {
        /// The session.
        session: String,
        /// One target by its number.
        target: Option<usize>,
        /// One run of it by its number.
        run: Option<usize>,
    },
    /// About breakpoints and expressions.
    Ask(AskRequest),
    /// About what is opened.
    Files(FileRequest),
}

/// What the server answered.
pub enum Reply {
    /// The list of traverses.
    Traverses(Vec<TraverseEntry>),
    /// The table of settings.
    Settings(Vec<SettingInfo>),
    /// A traverse.
    Traverse(Box<TraverseView>),
    /// The list of sessions.
    Sessions(Vec<SessionEntry>),
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
    /// A stream to Rerun.
    Rerun(RerunStream),
    /// The studies that can be started.
    Studies(Vec<StudyInfo>),
    /// The studies that were started.
    StudyJobs(Vec<StudyJob>),
    /// How a study stands.
    StudyJob(StudyJob),
    /// The table of a study.
    StudyRows(Vec<Row>),
    /// An image, an array or a record.
    Item(Item),
    /// The notes of a session.
    Notes(Vec<Note>),
    /// What can be exported.
    Exports(Vec<ExportEntry>),
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
    /// About what is opened.
    Files(FileReply),
}

/// An answer with what was asked.
pub struct Arrived {
    /// What was asked.
    pub request: Request,
    /// What came of it.
    pub outcome: Result<Reply, Problem>,
}

/// The network side of the page.
pub struct Net {
    origin: String,
    context: egui::Context,
    sender: Sender<Arrived>,
    receiver: Receiver<Arrived>,
    under_way: HashSet<Key>,
    slow: HashSet<Key>,
    events: Events,
}

impl Net {
    /// Talks to the server at `origin`; wakes `context` when something arrives.
    pub fn new(origin: String, context: egui::Context) -> Self {
        let (sender, receiver) = channel();
        let events = Events::new(&origin, context.clone());
        Self { origin, context, sender, receiver, under_way: HashSet::new(), slow: HashSet::new(), events }
    }

    /// Takes a place for something that is asked for next, where there is one.
    pub fn take_place(&mut self, key: &Key, is_slow: bool) -> bool {
        let is_place = self.under_way.len() < AT_A_TIME && (!is_slow || self.slow.len() < SLOW_AT_A_TIME);
        if is_place {
            self.under_way.insert(key.clone());
        }
        if is_place && is_slow {
            self.slow.insert(key.clone());
        }
        is_place
    }

    /// Sends a request; its answer arrives later.
    pub fn send(&mut self, request: Request) {
        if request == Request::Reconnect {
            self.events.reconnect_now();
            return;
        }
        let (sender, context) = (self.sender.clone(), self.context.clone());
        http::send(&self.origin, request, &self.context, move |arrived| {
            let shows_nothing = matches!(arrived.request, Request::PutCursor { .. });
            // Without a receiver the page is closing, and nobody waits for the answer.
            match sender.send(arrived) {
                Ok(()) if shows_nothing => context.request_repaint_after(UNHURRIED),
                Ok(()) => context.request_repaint(),
                Err(_) => {}
            }
        });
    }

    /// What arrived since the last time.
    pub fn poll(&mut self) -> Vec<Arrived> {
        let arrived: Vec<Arrived> = self.receiver.try_iter().collect();
        for answer in &arrived {
            if let Request::Item(key) = &answer.request {
                self.under_way.remove(key);
                self.slow.remove(key);
            }
        }
        arrived
    }

    /// When the events want to be polled next although nothing arrived.
    pub fn retry_at(&self) -> Option<f64> {
        self.events.retry_at()
    }

    /// The events since the last time, and how they come in.
    pub fn poll_events(&mut self, now: f64) -> (Vec<Event>, Connection) {
        self.events.poll(now)
    }
}
