//! Opening one's own recording: which there are, what one contains, its import, and the scenarios that come with the program.

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

/// What a person asks of recordings.
#[derive(Clone, Debug, PartialEq)]
pub enum Ask {
    /// Changes the path that is being typed.
    Type(String),
    /// Shows what the recording at a path contains.
    Examine(String),
    /// Imports the recording that is shown, and opens it.
    Import,
    /// Cancels the import that this page started.
    Cancel,
    /// Goes back to the list.
    Back,
    /// Lets the person choose a folder, or an archive, that is sent to the server.
    Choose {
        /// Whether it is an archive.
        is_archive: bool,
    },
    /// Sends no more of it.
    StopSending,
    /// Opens a scenario that comes with the program, by its name.
    Scenario(&'static str),
}

/// A recording that is sent to the server.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sending {
    /// What was chosen.
    pub chosen: Chosen,
    /// How many files are sent.
    pub sent: usize,
}

/// What is known of recordings.
#[derive(Clone, Debug, Default)]
pub struct Recordings {
    /// The recordings below the folders named at start; `None` before the server has said.
    pub list: Option<RecordingList>,
    /// The path that is being typed.
    pub path: String,
    /// The path whose contents the server looks for.
    pub examining: Option<String>,
    /// The recording that is shown.
    pub shown: Option<RecordingView>,
    /// Why the recording cannot be examined or imported.
    pub problem: Option<Problem>,
    /// The recording that is sent.
    pub sending: Option<Sending>,
    /// The upload that the server has of this page.
    pub upload: Option<UploadView>,
    /// What the person calls the folder or archive that was sent.
    pub sent_name: String,
    /// The folder of the recording that is shown, as the person knows it.
    pub folder_name: String,
    /// Whether the import of the recording that is shown was asked for and not answered yet.
    pub is_starting: bool,
    /// The import that this page started and that has not ended.
    pub import: Option<ImportJob>,
}

impl State {
    /// Asks for the recordings.
    pub(super) fn read_recordings(&mut self) {
        let call = Call::to::<ListRecordings>(&Anywhere {});
        self.call_with_problem::<ListRecordings>(call, |state, outcome| match outcome {
            Ok(list) => state.files.recordings.list = Some(list),
            Err(problem) => state.files.recordings.problem = Some(problem),
        });
    }

    /// Carries out what was asked.
    pub(super) fn ask_of_recordings(&mut self, ask: Ask) {
        match ask {
            Ask::Type(path) => self.files.recordings.path = path,
            Ask::Examine(path) => self.examine(path),
            Ask::Import => self.import(),
            Ask::Cancel => self.cancel_import(),
            Ask::Back => {
                let recordings = &mut self.files.recordings;
                (recordings.shown, recordings.problem) = (None, None);
                self.remove_upload();
            }
            Ask::Choose { is_archive } => self.outbox.add(Effect::ChooseRecording { is_archive }),
            Ask::StopSending => {
                self.files.recordings.sending = None;
                self.outbox.add(Effect::StopSending);
                self.remove_upload();
            }
            Ask::Scenario(name) => {
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
                // Another one was chosen meanwhile.
                return;
            }
            recordings.examining = None;
            // What was sent is named as the person knows it, not by its folder on the server.
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

    /// Sends the recording that was chosen.
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
                    // It was cancelled meanwhile.
                    state.remove_upload();
                }
            }
            Err(problem) => state.not_sent(problem),
        });
    }

    /// So many files are sent; the last one was the last to wait for.
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

    /// A file was refused.
    pub(super) fn not_sent(&mut self, problem: Problem) {
        let recordings = &mut self.files.recordings;
        (recordings.sending, recordings.problem) = (None, Some(problem));
        self.remove_upload();
    }

    /// Removes what this page has sent and not imported.
    fn remove_upload(&mut self) {
        let Some(upload) = self.files.recordings.upload.take() else { return };
        let call = Call::to::<RemoveUpload>(&AtUpload { upload: upload.id });
        // The server may have removed it: an import takes it over.
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
                    // It may have ended before the page knew its name.
                    state.follow_import();
                }
                Err(problem) => state.files.recordings.problem = Some(problem),
            }
        });
    }

    /// Asks how far the import of this page is, whose events it may have missed.
    pub(crate) fn follow_import(&mut self) {
        let Some(job) = &self.files.recordings.import else { return };
        let call = Call::to::<ShowImport>(&AtImport { import: job.id.clone() });
        self.call_with_problem::<ShowImport>(call, |state, outcome| match outcome {
            Ok(job) => state.import_went_on(job),
            // A server that was started anew does not have it; one that does not answer is asked again later.
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
        self.call::<CancelImport>(call, Self::import_went_on);
    }

    /// An import went on, perhaps that of this page.
    pub(crate) fn import_went_on(&mut self, job: ImportJob) {
        let recordings = &mut self.files.recordings;
        let Some(own) = recordings.import.as_mut().filter(|own| own.id == job.id) else { return };
        if !job.state.has_ended() {
            // An answer may be older than an event.
            if job.k >= own.k {
                *own = job;
            }
            return;
        }
        recordings.import = None;
        match (job.state, job.traverse) {
            (ImportState::Done, Some(traverse)) => {
                // The server has taken over what was sent.
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

    /// Opens a drive that is new to this page.
    fn open_imported(&mut self, id: String) {
        let call = Call::to::<ListTraverses>(&Anywhere {});
        self.call::<ListTraverses>(call, move |state, list| {
            state.traverses = Some(list);
            state.open(id);
        });
    }
}
