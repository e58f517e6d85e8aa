//! Carries out user requests concerning files and sessions, and opens the files that arrive.

use sightline_api::endpoint::{Call, Endpoint};
use sightline_api::endpoints::{AddTraverse, BringSession, ListSessions};
use sightline_api::location::Anywhere;
use sightline_api::wire::{NewTraverse, Problem, SessionEntry};
use sightline_session::reproduce::{Opened, Reproduction};
use sightline_track::settings::{Changes, Settings};

use crate::cache::Key;
use crate::files::documents::Document;
use crate::files::inbox::Arrival;
use crate::files::{FilesCommand, documents};
use crate::panels::pane::Pane;
use crate::state::State;
use crate::state::effect::Effect;

impl State {
    /// Carries out a request.
    pub(crate) fn apply_files_command(&mut self, command: FilesCommand) {
        match command {
            FilesCommand::Open => {
                self.files.is_open = true;
                (self.files.refused, self.files.recordings.problem) = (None, None);
                self.read_recent();
                // A commanded drive may have more stops than when the list was read.
                self.read_traverses();
                self.read_recordings();
            }
            FilesCommand::Close => self.files.is_open = false,
            FilesCommand::Choose => self.outbox.add(Effect::ChooseFile),
            FilesCommand::Type(path) => self.files.path = path,
            FilesCommand::Path(path) => self.outbox.add(Effect::ReadFile(path)),
            FilesCommand::Resume(id) => {
                self.files.is_open = false;
                if self.session.as_ref().is_some_and(|open| open.id == id) {
                    self.messages.note("That session is open already.");
                } else {
                    self.sync.linked = Some(id.clone());
                    self.read_session(id);
                }
            }
            FilesCommand::TryAgain => {
                let here = self.cursor.step;
                self.cache.retry(|key| matches!(key, Key::Image { step, .. } if *step == here));
            }
            FilesCommand::Recording(command) => self.apply_recording_command(command),
            FilesCommand::RemoveSession(entry) => self.remove_session(*entry),
            FilesCommand::RestoreSession(id) => self.restore_session(id),
            FilesCommand::ConfirmDrive(id) => self.files.confirming = id,
            FilesCommand::RemoveDrive(id) => self.remove_drive(id),
            FilesCommand::Begin(traverse) => {
                self.files.is_open = false;
                self.begin_session(traverse);
            }
        }
    }

    /// Handles the outcome of opening a file.
    pub fn file_arrived(&mut self, arrival: Arrival) {
        match arrival {
            Arrival::Refused(why) => self.messages.refused_file(why),
            Arrival::Read { name, bytes } => match documents::read(&name, &bytes) {
                Ok(document) => self.open_document(&name, document),
                Err(why) => self.messages.refused_file(why),
            },
            Arrival::Chosen(chosen) => self.recording_chosen(chosen),
            Arrival::Sent(count) => self.files_sent(count),
            Arrival::NotSent(problem) => self.on_upload_refused(problem),
        }
    }

    fn open_document(&mut self, name: &str, document: Document) {
        let file = documents::shown(name);
        match document {
            Document::Drive(scenario) => {
                self.messages.note(format!("Opening the drive of {file} …"));
                self.open_drive(file, scenario);
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
                self.bring_session(file, &reproduction);
            }
            Document::Settings(changes) => self.open_settings(&file, &changes),
            Document::Breakpoints(list) => self.open_breakpoints(&file, list),
        }
    }

    /// Opens the drive of a scenario.
    pub(super) fn open_drive(&mut self, file: String, scenario: String) {
        let call = Call::with_body::<AddTraverse>(&Anywhere {}, &NewTraverse { scenario });
        self.open_file::<AddTraverse>(file, call, |state, file, entry| {
            state.messages.note(format!("{file} is the drive {}.", entry.name));
            let id = entry.id.clone();
            let list = state.traverses.get_or_insert_default();
            if list.iter().all(|known| known.id != id) {
                list.push(entry);
            }
            state.open(id);
        });
    }

    /// Begins a session from an export.
    fn bring_session(&mut self, file: String, reproduction: &Reproduction) {
        let call = Call::with_body::<BringSession>(&Anywhere {}, reproduction);
        self.open_file::<BringSession>(file, call, |state, file, view| {
            let words = format!("{file} is session {} here; its runs are computed again.", view.id);
            state.messages.note(words);
            state.read_traverses();
            state.adopt(view, true);
        });
    }

    /// Lets the server open a file; `take` receives the file's name and the reply, and a refusal names the file.
    fn open_file<E: Endpoint>(
        &mut self,
        file: String,
        call: Call,
        take: impl FnOnce(&mut Self, &str, E::Reply) + 'static,
    ) {
        self.files.opening = Some(file.clone());
        let shown = call.clone();
        self.call_with_problem::<E>(call, move |state, outcome| {
            state.files.opening = None;
            match outcome {
                Ok(reply) => {
                    state.files.is_open = false;
                    take(state, &file, reply);
                }
                Err(problem) => {
                    let detail = format!("{file} cannot be opened: {}", problem.detail);
                    state.show_refusal(&shown, &Problem { detail, ..problem }, false);
                }
            }
        });
    }

    /// Requests the list of recent sessions.
    pub(super) fn read_recent(&mut self) {
        let call = Call::to::<ListSessions>(&Anywhere {});
        self.call_with_problem::<ListSessions>(call, |state, outcome| match outcome {
            Ok(mut list) => {
                // Sessions without a known time of use are last, the newest of them first.
                list.reverse();
                let idle_s = |entry: &SessionEntry| entry.idle_s.unwrap_or(f64::INFINITY);
                list.sort_by(|a, b| idle_s(a).total_cmp(&idle_s(b)));
                state.files.recent = Some(list);
            }
            Err(problem) => state.files.refused = Some(problem.detail),
        });
    }

    /// Drafts the changes that lead from the selected run to a configuration.
    fn open_settings(&mut self, file: &str, changes: &Changes) {
        let wanted = Settings::default().with(changes).ok();
        let Some(draft) = wanted.and_then(|wanted| self.changes_to_settings(&wanted)) else {
            let words = format!(
                "{file} is a tracker configuration, but no run is selected that it could change: pick a target (T), then drop it again."
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
        self.outbox.add(Effect::reveal(Pane::Settings));
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
        self.outbox.add(Effect::reveal(Pane::Breakpoints));
        let count = list.len();
        for (expression, is_on) in list {
            self.restore_breakpoint(&expression, is_on);
        }
        let what = if count == 1 { "One breakpoint".to_owned() } else { format!("{count} breakpoints") };
        self.messages.note(format!("{what} of {file} set."));
    }
}
