//! Opening one's own recording: which there are, what one contains, its import, and the scenarios that come with the program.

use sightline_api::endpoint::Call;
use sightline_api::endpoints::{
    CancelImport, ListRecordings, ListTraverses, ShowImport, ShowRecording, StartImport,
};
use sightline_api::location::{Anywhere, AtImport};
use sightline_api::recording::{
    ImportJob, ImportState, NewImport, RecordingList, RecordingPath, RecordingView,
};
use sightline_api::wire::Problem;
use sightline_world::library;

use crate::state::State;

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
    /// Opens a scenario that comes with the program, by its name.
    Scenario(&'static str),
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
            match outcome {
                Ok(view) => recordings.shown = Some(view),
                Err(problem) => recordings.problem = Some(problem),
            }
        });
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
                    let at = AtImport { import: job.id.clone() };
                    state.files.recordings.import = Some(job);
                    // It may have ended before the page knew its name.
                    let call = Call::to::<ShowImport>(&at);
                    state.call::<ShowImport>(call, Self::import_went_on);
                }
                Err(problem) => state.files.recordings.problem = Some(problem),
            }
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
                recordings.shown = None;
                self.files.is_open = false;
                job.notes.into_iter().for_each(|note| self.messages.note(note));
                self.open_imported(traverse);
            }
            (ImportState::Cancelled, _) => {
                self.messages.note("The import was cancelled; nothing of it is kept.")
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
