//! Opening recordings: their list, contents, upload and import, and the scenarios of the library.

use sightline_api::endpoint::Call;
use sightline_api::endpoints::{
    BeginUpload, CancelImport, ListRecordings, ListTraverses, RemoveUpload, ShowImport, ShowRecording,
    StartImport,
};
use sightline_api::location::{Anywhere, AtImport, AtUpload};
use sightline_api::recording::{
    ImportJob, ImportState, NewImport, RecordingList, RecordingPath, RecordingView, UploadView,
};
use sightline_api::wire::Problem;
use sightline_world::library;

use crate::files::inbox::Chosen;
use crate::state::State;
use crate::state::effect::Effect;

/// A user request concerning recordings.
#[derive(Clone, Debug, PartialEq)]
pub enum RecordingCommand {
    /// Changes the path in the input field.
    Type(String),
    /// Shows the contents of the recording at a path.
    Examine(String),
    /// Imports the recording shown, and opens it.
    Import,
    /// Cancels the import that this page started.
    Cancel,
    /// Returns to the list.
    Back,
    /// Opens the dialog for a folder, or an archive, to send to the server.
    Choose {
        /// Whether it is an archive.
        is_archive: bool,
    },
    /// Stops sending.
    StopSending,
    /// Opens a scenario of the library, by its name.
    Scenario(&'static str),
}

/// A recording that is being sent to the server.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sending {
    /// The chosen folder or archive.
    pub chosen: Chosen,
    /// Number of files sent.
    pub sent: usize,
}

/// The state of the recordings in the window “Open”.
#[derive(Clone, Debug, Default)]
pub struct Recordings {
    /// The recordings below the folders given at the server's start; `None` until the server has answered.
    pub list: Option<RecordingList>,
    /// The path in the input field.
    pub path: String,
    /// The path that the server is examining.
    pub examining: Option<String>,
    /// The recording shown.
    pub shown: Option<RecordingView>,
    /// Why the recording cannot be examined or imported.
    pub problem: Option<Problem>,
    /// The recording that is being sent.
    pub sending: Option<Sending>,
    /// The upload on the server that belongs to this page.
    pub upload: Option<UploadView>,
    /// The user's name of the folder or archive that was sent.
    pub sent_name: String,
    /// The folder of the recording shown, under the user's name for it.
    pub folder_name: String,
    /// Whether the import of the recording shown was requested and not yet answered.
    pub is_starting: bool,
    /// The running import that this page started.
    pub import: Option<ImportJob>,
}

impl State {
    /// Requests the list of recordings.
    pub(super) fn read_recordings(&mut self) {
        let call = Call::to::<ListRecordings>(&Anywhere {});
        self.call_with_problem::<ListRecordings>(call, |state, outcome| match outcome {
            Ok(list) => state.files.recordings.list = Some(list),
            Err(problem) => state.files.recordings.problem = Some(problem),
        });
    }

    /// Carries out a request.
    pub(super) fn apply_recording_command(&mut self, command: RecordingCommand) {
        match command {
            RecordingCommand::Type(path) => self.files.recordings.path = path,
            RecordingCommand::Examine(path) => self.examine(path),
            RecordingCommand::Import => self.import(),
            RecordingCommand::Cancel => self.cancel_import(),
            RecordingCommand::Back => {
                let recordings = &mut self.files.recordings;
                (recordings.shown, recordings.problem) = (None, None);
                self.remove_upload();
            }
            RecordingCommand::Choose { is_archive } => {
                self.outbox.add(Effect::ChooseRecording { is_archive });
            }
            RecordingCommand::StopSending => {
                self.files.recordings.sending = None;
                self.outbox.add(Effect::StopSending);
                self.remove_upload();
            }
            RecordingCommand::Scenario(name) => {
                let Some(scenario) = library::toml(name) else { return };
                self.open_drive(format!("The scenario {name}"), scenario.to_owned());
            }
        }
    }

    fn examine(&mut self, path: String) {
        let recordings = &mut self.files.recordings;
        (recordings.shown, recordings.problem) = (None, None);
        recordings.examining = Some(path.clone());
        let call = Call::with_query::<ShowRecording>(&Anywhere {}, &RecordingPath { path: path.clone() });
        self.call_with_problem::<ShowRecording>(call, move |state, outcome| {
            let recordings = &mut state.files.recordings;
            if recordings.examining.as_ref() != Some(&path) {
                // Another recording was chosen in the meantime.
                return;
            }
            recordings.examining = None;
            // A sent recording is shown under the user's name for it, not under its folder on the server.
            let sent = recordings.upload.as_ref().map(|upload| upload.path.clone());
            let name = recordings.sent_name.clone();
            let named = |text: &str| match &sent {
                Some(folder) => text.replace(folder.as_str(), &name),
                None => text.to_owned(),
            };
            match outcome {
                Ok(view) => {
                    recordings.folder_name = named(&view.path);
                    recordings.shown = Some(view);
                }
                Err(problem) => {
                    let detail = named(&problem.detail);
                    recordings.problem = Some(Problem { detail, ..problem });
                }
            }
        });
    }

    /// Sends the chosen recording.
    pub(super) fn recording_chosen(&mut self, chosen: Chosen) {
        self.remove_upload();
        self.files.is_open = true;
        let recordings = &mut self.files.recordings;
        (recordings.shown, recordings.problem) = (None, None);
        recordings.sent_name.clone_from(&chosen.name);
        recordings.sending = Some(Sending { chosen, sent: 0 });
        let call = Call::to::<BeginUpload>(&Anywhere {});
        self.call_with_problem::<BeginUpload>(call, |state, outcome| match outcome {
            Ok(upload) => {
                let id = upload.id.clone();
                state.files.recordings.upload = Some(upload);
                if state.files.recordings.sending.is_some() {
                    state.outbox.add(Effect::SendRecording(id));
                } else {
                    // The transfer was cancelled in the meantime.
                    state.remove_upload();
                }
            }
            Err(problem) => state.on_upload_refused(problem),
        });
    }

    /// Updates the number of files sent; after the last one, examines the recording.
    pub(super) fn files_sent(&mut self, sent: usize) {
        let recordings = &mut self.files.recordings;
        let Some(sending) = &mut recordings.sending else { return };
        sending.sent = sent;
        if sent >= sending.chosen.file_count {
            recordings.sending = None;
            if let Some(upload) = recordings.upload.clone() {
                self.examine(upload.path);
            }
        }
    }

    /// Handles a refused file.
    pub(super) fn on_upload_refused(&mut self, problem: Problem) {
        let recordings = &mut self.files.recordings;
        (recordings.sending, recordings.problem) = (None, Some(problem));
        self.remove_upload();
    }

    /// Removes the upload of this page if it was not imported.
    fn remove_upload(&mut self) {
        let Some(upload) = self.files.recordings.upload.take() else { return };
        let call = Call::to::<RemoveUpload>(&AtUpload { upload: upload.id });
        // The server may have removed it already: an import takes it over.
        self.call_with_problem::<RemoveUpload>(call, |_, _| {});
    }

    fn import(&mut self) {
        let recordings = &mut self.files.recordings;
        let Some(shown) = recordings.shown.as_ref().filter(|_| !recordings.is_starting) else { return };
        let path = shown.path.clone();
        (recordings.problem, recordings.is_starting) = (None, true);
        let call = Call::with_body::<StartImport>(&Anywhere {}, &NewImport { path });
        self.call_with_problem::<StartImport>(call, |state, outcome| {
            state.files.recordings.is_starting = false;
            match outcome {
                Ok(job) => {
                    state.files.recordings.import = Some(job);
                    // The import may have ended before the page received its identifier.
                    state.follow_import();
                }
                Err(problem) => state.files.recordings.problem = Some(problem),
            }
        });
    }

    /// Requests the state of this page's import, whose events it may have missed.
    pub(crate) fn follow_import(&mut self) {
        let Some(job) = &self.files.recordings.import else { return };
        let call = Call::to::<ShowImport>(&AtImport { import: job.id.clone() });
        self.call_with_problem::<ShowImport>(call, |state, outcome| match outcome {
            Ok(job) => state.update_import(job),
            // A restarted server does not have the import; if the server does not answer, ask again later.
            Err(problem) if problem.status == 404 => {
                let detail = "The server was started again during the import; import the recording again.";
                state.files.recordings.import = None;
                state.files.recordings.problem = Some(Problem::new(404, "import", "", detail));
            }
            Err(_) => {}
        });
    }

    fn cancel_import(&mut self) {
        let Some(job) = &self.files.recordings.import else { return };
        let call = Call::to::<CancelImport>(&AtImport { import: job.id.clone() });
        self.call::<CancelImport>(call, Self::update_import);
    }

    /// Updates the import of this page; other imports are ignored.
    pub(crate) fn update_import(&mut self, job: ImportJob) {
        let recordings = &mut self.files.recordings;
        let Some(own) = recordings.import.as_mut().filter(|own| own.id == job.id) else { return };
        if !job.state.has_ended() {
            // A reply may be older than an event.
            if job.k >= own.k {
                *own = job;
            }
            return;
        }
        recordings.import = None;
        match (job.state, job.traverse) {
            (ImportState::Done, Some(traverse)) => {
                // The server has taken over the upload.
                (recordings.shown, recordings.upload) = (None, None);
                self.files.is_open = false;
                job.notes.into_iter().for_each(|note| self.messages.note(note));
                self.open_imported(traverse);
            }
            (ImportState::Cancelled, _) => {
                self.messages.note("The import was cancelled; nothing of it is kept.");
            }
            _ => {
                let detail = job.problem.unwrap_or_else(|| "The import failed.".to_owned());
                recordings.problem = Some(Problem::new(422, "import", "", detail));
            }
        }
    }

    /// Opens a drive that is not yet in the list of this page.
    fn open_imported(&mut self, id: String) {
        let call = Call::to::<ListTraverses>(&Anywhere {});
        self.call::<ListTraverses>(call, move |state, list| {
            state.traverses = Some(list);
            state.open(id);
        });
    }
}
