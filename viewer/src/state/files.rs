//! Opening: the window with recent sessions and drives, and what comes of a file that was dropped or chosen.
//!
//! Whatever a file holds, the open session stays as it is until there is something better: a refusal changes nothing.

use sightline_core::session::breakpoints::NewBreakpoint;
use sightline_core::session::reproduce::Opened;
use sightline_core::session::wire::{NewSession, NewTraverse, Problem, SessionEntry};
use sightline_core::settings::{Changes, Settings};

use super::State;
use super::ask::AskRequest;
use crate::cache::Key;
use crate::inbox::Arrival;
use crate::layout::Pane;
use crate::net::Request;
use crate::net::files::{FileReply, FileRequest};
use crate::opening::{self, Document};

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
    /// Whether the person wants to choose a file; the page takes it.
    pub wants_choice: bool,
    /// A path that is to be read; the page takes it.
    pub wants_path: Option<String>,
    /// A panel that is to be brought to the front; the page takes it.
    pub reveal: Option<Pane>,
}

impl State {
    /// Carries out what was asked.
    pub(super) fn ask_of_files(&mut self, ask: Ask) {
        match ask {
            Ask::Open => {
                self.files.is_open = true;
                self.files.refused = None;
                self.outbox.push(Request::Files(FileRequest::Recent));
            }
            Ask::Close => self.files.is_open = false,
            Ask::Choose => self.files.wants_choice = true,
            Ask::Type(path) => self.files.path = path,
            Ask::Path(path) => self.files.wants_path = Some(path),
            Ask::Resume(id) => {
                self.files.is_open = false;
                if self.session.as_ref().is_some_and(|open| open.id == id) {
                    self.messages.note("That session is open already.");
                } else {
                    self.sync.linked = Some(id.clone());
                    self.outbox.push(Request::Session(id));
                }
            }
            Ask::TryAgain => {
                let here = self.cursor.step;
                self.cache.retry(|key| matches!(key, Key::Image { step, .. } if *step == here));
            }
            Ask::Begin(traverse) => {
                self.files.is_open = false;
                self.outbox.push(Request::NewSession(NewSession { traverse }));
            }
        }
    }

    /// Takes in what came of a file.
    pub fn file_arrived(&mut self, arrival: Arrival) {
        match arrival {
            Arrival::Refused(why) => self.messages.refused_file(why),
            Arrival::Read { name, bytes } => match opening::read(&name, &bytes) {
                Ok(document) => self.open_document(&name, document),
                Err(why) => self.messages.refused_file(why),
            },
        }
    }

    fn open_document(&mut self, name: &str, document: Document) {
        let file = opening::shown(name);
        match document {
            Document::Drive(scenario) => {
                self.messages.note(format!("Opening the drive of {file} …"));
                self.ask_file(FileRequest::Drive { file, new: NewTraverse { scenario } });
            }
            Document::Session(opened) => {
                let Opened { reproduction, other_tracker } = *opened;
                if let Some(other) = other_tracker {
                    self.messages.problem(
                        format!(
                            "{file} was made with tracker {other}: its numbers may come out differently here."
                        ),
                        Some("Compare with the rows of its own export before you rely on them.".to_owned()),
                    );
                }
                self.messages.note(format!("Beginning the session of {file} again …"));
                self.ask_file(FileRequest::Session { file, new: Box::new(reproduction) });
            }
            Document::Settings(changes) => self.open_settings(&file, &changes),
            Document::Breakpoints(list) => self.open_breakpoints(&file, list),
        }
    }

    fn ask_file(&mut self, request: FileRequest) {
        if let FileRequest::Drive { file, .. } | FileRequest::Session { file, .. } = &request {
            self.files.opening = Some(file.clone());
        }
        self.outbox.push(Request::Files(request));
    }

    /// Puts a configuration into the draft: what takes the run that is looked at to it.
    fn open_settings(&mut self, file: &str, changes: &Changes) {
        let wanted = Settings::default().with(changes).ok();
        let Some(draft) = wanted.and_then(|wanted| self.changes_to_settings(&wanted)) else {
            let words = format!(
                "{file} is a tracker configuration, but no run is looked at that it could change: pick a target (T), then drop it again."
            );
            self.messages.refused_file(words);
            return;
        };
        self.files.is_open = false;
        if draft.is_empty() {
            self.messages.note(format!("{file} is the configuration of this very run."));
            return;
        }
        let before = std::mem::replace(&mut self.draft, draft);
        self.drafted(before);
        self.files.reveal = Some(Pane::Settings);
        let count = self.draft.len();
        let what = if count == 1 { "one setting".to_owned() } else { format!("{count} settings") };
        self.messages
            .note(format!("{file} changes {what} of this run: R runs again from this step with it."));
    }

    fn open_breakpoints(&mut self, file: &str, list: Vec<(String, bool)>) {
        if self.session.is_none() {
            let words = format!(
                "{file} lists breakpoints, but no session is open that could have them: open a drive first."
            );
            self.messages.refused_file(words);
            return;
        }
        self.files.is_open = false;
        self.ask.reveal = true;
        let count = list.len();
        for (expression, is_on) in list {
            if !is_on {
                self.undo.switch_off(&expression);
            }
            self.ask(|session| {
                let new = NewBreakpoint { expression: Some(expression), step: None };
                Request::Ask(AskRequest::Add { session, new })
            });
        }
        let what = if count == 1 { "One breakpoint".to_owned() } else { format!("{count} breakpoints") };
        self.messages.note(format!("{what} of {file} set."));
    }

    /// Takes in an answer.
    pub(super) fn answered_file(&mut self, request: FileRequest, reply: FileReply) {
        match (request, reply) {
            (_, FileReply::Recent(mut list)) => {
                // Those of which nobody knows when they were used come last, the newest of them first.
                list.reverse();
                let idle_s = |entry: &SessionEntry| entry.idle_s.unwrap_or(f64::INFINITY);
                list.sort_by(|a, b| idle_s(a).total_cmp(&idle_s(b)));
                self.files.recent = Some(list);
            }
            (FileRequest::Drive { file, .. }, FileReply::Drive(entry)) => {
                (self.files.opening, self.files.is_open) = (None, false);
                self.messages.note(format!("{file} is the drive {}.", entry.name));
                let id = entry.id.clone();
                let list = self.traverses.get_or_insert_default();
                if list.iter().all(|known| known.id != id) {
                    list.push(entry);
                }
                self.open(id);
            }
            (FileRequest::Session { file, .. }, FileReply::Session(view)) => {
                (self.files.opening, self.files.is_open) = (None, false);
                self.messages
                    .note(format!("{file} is session {} here; its runs are computed again.", view.id));
                self.outbox.push(Request::Traverses);
                self.adopt(*view, true);
            }
            _ => {}
        }
    }

    /// Takes in a refusal; true where it is to be said among the messages as well.
    pub(super) fn refused_file(&mut self, request: &FileRequest, problem: &mut Problem) -> bool {
        match request {
            FileRequest::Recent => {
                self.files.refused = Some(problem.detail.clone());
                false
            }
            FileRequest::Drive { file, .. } | FileRequest::Session { file, .. } => {
                self.files.opening = None;
                problem.detail = format!("{file} cannot be opened: {}", problem.detail);
                true
            }
        }
    }
}
