//! Imports recordings as drives: one at a time, with progress. Imported drives are reopened after a restart.
//!
//! Each import has its own folder, whose index is written last: a folder without an index is the remains of a killed server
//! and is removed at the next start. A native drive is opened in place; a file with its path refers to it.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use sightline_api::event::Event;
use sightline_api::recording::{ImportJob, ImportState};
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::{Error, Result};
use sightline_recordings::Traverse;
use sightline_recordings::files::write_atomically;
use sightline_recordings::import::examine::examine;
use sightline_recordings::import::import;
use sightline_track::locate::store::Cache;
use tokio::sync::broadcast;

use crate::folders::{Folders, make_private};
use crate::identity::Identity;
use crate::import_session::remove_folder;
use crate::jobs::{Lane, lock};
use crate::limits::SharedLimits;
use crate::naming::{hash, slug};
use crate::problem::{ApiError, ApiResult};
use crate::recordings::{Confined, confine_named, refusal};
use crate::rendering::OpenTraverse;
use crate::state::AppState;

/// File extension of references to drives elsewhere.
const REFERENCE: &str = "path";

/// The imports of a server.
pub(crate) struct Imports {
    lane: Lane,
    jobs: Mutex<Vec<Arc<Job>>>,
    limits: SharedLimits,
}

/// A started import.
struct Job {
    recording: Confined,
    view: Mutex<ImportJob>,
    cancel: AtomicBool,
}

impl Imports {
    /// An empty list.
    pub(crate) fn new(limits: &SharedLimits) -> Self {
        let lane = Lane::new(1, limits.imports_waiting.count());
        Self { lane, jobs: Mutex::default(), limits: Arc::clone(limits) }
    }

    /// Starts an import.
    ///
    /// # Errors
    /// A problem if too many are waiting.
    pub(crate) fn start(&self, state: &AppState, recording: Confined) -> ApiResult<ImportJob> {
        let job = self.add(recording)?;
        let (work, state) = (Arc::clone(&job), state.clone());
        let started = self.lane.submit(move || work.carry_out(&state));
        if let Err(problem) = started {
            lock(&self.jobs).retain(|other| !Arc::ptr_eq(other, &job));
            return Err(problem);
        }
        Ok(job.view())
    }

    fn add(&self, recording: Confined) -> ApiResult<Arc<Job>> {
        let mut jobs = lock(&self.jobs);
        if jobs.len() >= self.limits.imports.count() {
            let ended = jobs.iter().position(|job| job.view().state.has_ended());
            let ended = ended.ok_or_else(|| ApiError::full(&self.limits.imports))?;
            jobs.remove(ended);
        }
        let numbers =
            jobs.iter().filter_map(|job| job.view().id.strip_prefix("import-")?.parse::<u64>().ok());
        let view = ImportJob {
            id: format!("import-{}", numbers.max().unwrap_or(0) + 1),
            path: recording.path.display().to_string(),
            state: ImportState::Waiting,
            k: 0,
            n: 0,
            traverse: None,
            problem: None,
            notes: Vec::new(),
        };
        let job = Arc::new(Job { recording, view: Mutex::new(view), cancel: AtomicBool::new(false) });
        jobs.push(Arc::clone(&job));
        Ok(job)
    }

    /// The progress of an import.
    ///
    /// # Errors
    /// A problem if it does not exist.
    pub(crate) fn view(&self, id: &str) -> ApiResult<ImportJob> {
        Ok(self.job(id)?.view())
    }

    /// Cancels an import; has no effect on a finished one.
    ///
    /// # Errors
    /// A problem if it does not exist.
    pub(crate) fn cancel(&self, id: &str) -> ApiResult<ImportJob> {
        let job = self.job(id)?;
        job.cancel.store(true, Ordering::Relaxed);
        Ok(job.view())
    }

    fn job(&self, id: &str) -> ApiResult<Arc<Job>> {
        let found = lock(&self.jobs).iter().find(|job| lock(&job.view).id == id).cloned();
        found.ok_or_else(|| ApiError::not_found("There is no such import."))
    }
}

impl Job {
    fn view(&self) -> ImportJob {
        lock(&self.view).clone()
    }

    /// Changes the view and notifies all pages.
    fn change(&self, state: &AppState, change: impl FnOnce(&mut ImportJob)) {
        let job = {
            let mut view = lock(&self.view);
            change(&mut view);
            view.clone()
        };
        state.send_event(Event::ImportProgress { job });
    }

    fn carry_out(&self, state: &AppState) {
        self.change(state, |view| view.state = ImportState::Running);
        let work = std::panic::AssertUnwindSafe(|| self.import(state));
        let outcome = std::panic::catch_unwind(work);
        let outcome = outcome.unwrap_or_else(|_| Err(ApiError::internal("an import panicked")));
        self.change(state, |view| match outcome {
            Ok(id) => (view.state, view.traverse) = (ImportState::Done, Some(id)),
            Err(_) if self.cancel.load(Ordering::Relaxed) => view.state = ImportState::Cancelled,
            Err(problem) => {
                let detail = problem.problem().detail.clone();
                let hint = problem.problem().hint.as_ref().map(|hint| format!(" {hint}")).unwrap_or_default();
                (view.state, view.problem) = (ImportState::Failed, Some(format!("{detail}{hint}")));
            }
        });
    }

    /// Imports and opens the recording; returns the name of the drive.
    fn import(&self, state: &AppState) -> ApiResult<String> {
        Cancel::from(&self.cancel).check()?;
        let (folders, options) = (state.folders(), self.recording.options());
        make_private(&folders.imported)
            .map_err(|source| Error::Write { path: folders.imported.clone(), source })?;
        let examined = examine(&self.recording.path, &options, &self.cancel).map_err(refusal)?;
        if examined.is_native && !self.recording.is_upload {
            return self.open_in_place(state);
        }
        let folder = new_folder(&folders.imported, &examined.index.name)?;
        let made = self
            .fill(state, &folder, examined.is_native)
            .and_then(|notes| Ok((notes, self.open(state, &folder)?)));
        let (notes, open) = made.inspect_err(|_| {
            // Ignored, so that the first problem is reported.
            let _ = remove_folder(&folder);
        })?;
        if open.traverse.folder() != folder {
            // The drive was already open.
            remove_folder(&folder)?;
        }
        if self.recording.is_upload {
            state.uploads().imported(self.recording.root());
        }
        self.change(state, |view| view.notes = notes);
        Ok(open.id.clone())
    }

    /// Creates the drive in `folder`; returns notes about omissions and assumptions.
    fn fill(&self, state: &AppState, folder: &Path, is_native: bool) -> ApiResult<Vec<String>> {
        if is_native {
            // The folder is empty, so the rename replaces it.
            let moved = std::fs::rename(&self.recording.path, folder);
            moved.map_err(|source| Error::Write { path: folder.to_owned(), source })?;
            return Ok(Vec::new());
        }
        let mut reported_share = 0;
        let mut progress = |k: usize, n: usize| {
            // At most a hundred messages.
            let share = k * 100 / n.max(1);
            if share > reported_share || k == 0 {
                reported_share = share;
                self.change(state, |view| (view.k, view.n) = (k, n));
            }
        };
        let options = self.recording.options();
        let made = import(&self.recording.path, &options, folder, &mut progress, &self.cancel);
        Ok(made.map_err(refusal)?.notes)
    }

    /// Opens a native drive in place.
    fn open_in_place(&self, state: &AppState) -> ApiResult<String> {
        let open = self.open(state, &self.recording.path)?;
        if state.is_removable(&open) && open.traverse.folder() == self.recording.path {
            let reference = reference(&state.folders().imported, &self.recording.path);
            write_atomically(&reference, self.recording.path.as_os_str().as_encoded_bytes())?;
        }
        Ok(open.id.clone())
    }

    fn open(&self, state: &AppState, folder: &Path) -> ApiResult<Arc<OpenTraverse>> {
        let _lock = state.drive_folder_lock();
        let (traverse, count) = (Traverse::open(folder).map_err(refusal)?, state.traverses().len());
        let limits = state.limits();
        limits.check_drive(&traverse)?;
        if count >= limits.drives.count() {
            let detail = format!("There are {count} drives already.");
            return Err(ApiError::conflict(detail)
                .hint(limits.drives.hint("Remove one that is not needed: DELETE traverses/{id}.")));
        }
        let identity = Identity::of(&traverse, Some(&state.folders().digests))?;
        let traverse = traverse.with_cache(state.cache());
        Ok(state.add_traverse(Arc::new(OpenTraverse::new(identity, traverse, state.events().clone())))?)
    }
}

/// Creates a new folder among the imports.
fn new_folder(imported: &Path, name: &str) -> Result<PathBuf> {
    let prefix = format!("{}-", slug(name));
    let made = tempfile::Builder::new().prefix(&prefix).tempdir_in(imported);
    made.map(tempfile::TempDir::keep).map_err(|source| Error::Write { path: imported.to_owned(), source })
}

/// The path of the file that refers to a drive elsewhere.
fn reference(imported: &Path, folder: &Path) -> PathBuf {
    imported.join(format!("{}.{REFERENCE}", hash(folder.as_os_str().as_encoded_bytes())))
}

/// Removes the files of a drive if it was imported or opened by its path; returns whether it was.
///
/// # Errors
/// A folder or file that cannot be removed.
pub(crate) fn forget(folders: &Folders, open: &OpenTraverse) -> Result<bool> {
    let folder = open.traverse.folder();
    if folder.parent() == Some(&folders.imported) {
        remove_folder(folder)?;
        return Ok(true);
    }
    let reference = reference(&folders.imported, folder);
    match std::fs::remove_file(&reference) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(false),
        Err(source) => Err(Error::Write { path: reference, source }),
    }
}

/// Reopens the imports of earlier starts; returns one sentence for each that cannot be opened.
pub(crate) fn reopen(
    folders: &Folders,
    cache: &Arc<Cache>,
    open: &mut Vec<Arc<OpenTraverse>>,
    events: &broadcast::Sender<Event>,
) -> Vec<String> {
    let entries = std::fs::read_dir(&folders.imported).into_iter().flatten().flatten();
    let mut all: Vec<_> = entries.map(|entry| entry.path()).collect();
    all.sort();
    let mut lost = Vec::new();
    for path in all {
        let opened = match traverse_folder(folders, &path) {
            Ok(Some(folder)) => Traverse::open(&folder).map_err(|error| error.to_string()),
            Ok(None) => continue,
            Err(why) => Err(why),
        };
        let identified = opened.and_then(|traverse| {
            let identity = Identity::of(&traverse, Some(&folders.digests));
            Ok((identity.map_err(|error| error.to_string())?, traverse))
        });
        match identified {
            Ok((identity, traverse)) if open.iter().all(|other| other.id != identity.id()) => {
                open.push(Arc::new(OpenTraverse::new(identity, traverse.with_cache(cache), events.clone())));
            }
            Ok(_) => {}
            Err(why) => lost.push(format!("an imported drive cannot be opened again: {why}")),
        }
    }
    lost
}

/// The drive of an entry in the folder of imports; removes remains of an interrupted import and returns `None`.
fn traverse_folder(folders: &Folders, entry: &Path) -> std::result::Result<Option<PathBuf>, String> {
    if entry.is_dir() {
        let names = ["traverse.toml", "traverse.json"];
        if names.iter().any(|name| entry.join(name).is_file()) {
            return Ok(Some(entry.to_owned()));
        }
        // A failure to remove it is harmless.
        let _ = remove_folder(entry);
        return Ok(None);
    }
    if entry.extension().is_none_or(|ending| ending != REFERENCE) {
        return Ok(None);
    }
    let path = std::fs::read_to_string(entry).map_err(|error| format!("{} ({error})", entry.display()))?;
    let confined = confine_named(folders, &path).map_err(|problem| {
        let Some(hint) = &problem.problem().hint else { return problem.problem().detail.clone() };
        format!("{} {hint}", problem.problem().detail)
    })?;
    Ok(Some(confined.path))
}
