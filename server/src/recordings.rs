//! Recordings that pages may open by path: only below the folders named at the server's start.
//!
//! Paths are compared after all links are resolved, and no link inside a recording may lead out of that folder.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use sightline_api::recording::{RecordedPair, RecordingEntry, RecordingList, RecordingView};
use sightline_recordings::import::ImportOptions;
use sightline_recordings::import::examine::{Examined, examine, find};

use crate::folders::Folders;
use crate::limits::Limits;
use crate::problem::{ApiError, ApiResult};
use crate::state::AppState;

/// Maximum depth of recordings below a named folder.
const DEPTH: usize = 4;
/// Number of first stops whose stereo pairs are shown.
const PAIRS_SHOWN: usize = 3;

/// A path that pages may open.
#[derive(Clone, Debug)]
pub(crate) struct Confined {
    /// The recording, with all links resolved.
    pub(crate) path: PathBuf,
    /// The named folder or upload folder that contains it.
    root: PathBuf,
    /// Whether it was uploaded by a page.
    pub(crate) is_upload: bool,
}

impl Confined {
    /// The folder that confines the recording.
    pub(crate) fn root(&self) -> &Path {
        &self.root
    }

    /// The options for importing the recording.
    pub(crate) fn options(&self) -> ImportOptions {
        ImportOptions { within: Some(self.root.clone()), ..ImportOptions::default() }
    }
}

/// Lists the recordings below the named folders.
pub(crate) fn list(folders: &Folders, limits: &Limits) -> RecordingList {
    let mut list = RecordingList { is_complete: true, ..RecordingList::default() };
    for root in &folders.recordings {
        list.folders.push(root.display().to_string());
        let room = limits.recordings.count().saturating_sub(list.recordings.len());
        let (found, is_all) = find(root, DEPTH, room);
        let entry = |path: &Path, format: &str| {
            let (path, format) = (path.display().to_string(), format.to_owned());
            RecordingEntry { path, format }
        };
        list.recordings.extend(found.iter().map(|found| entry(&found.path, found.format)));
        list.is_complete &= is_all;
    }
    list
}

/// Resolves the path requested by a page.
///
/// # Errors
/// A problem if no folder was named, or the path is outside the named folders.
pub(crate) fn confine(state: &AppState, path: &str) -> ApiResult<Confined> {
    let real = Path::new(path).canonicalize().ok().filter(|_| Path::new(path).is_absolute());
    let sent = real.and_then(|real| Some((state.uploads().root_of(&real)?, real)));
    match sent {
        Some((root, path)) => only_one(Confined { path, root, is_upload: true }),
        None => confine_named(state.folders(), path).and_then(only_one),
    }
}

/// Descends from a folder to the only recording in it.
fn only_one(confined: Confined) -> ApiResult<Confined> {
    if !confined.path.is_dir() {
        return Ok(confined);
    }
    match find(&confined.path, DEPTH, 2).0.as_slice() {
        [one] => Ok(Confined { path: one.path.clone(), ..confined }),
        [first, second, ..] => {
            let shown = |path: &Path| path.strip_prefix(&confined.path).unwrap_or(path).display().to_string();
            let (first, second) = (shown(&first.path), shown(&second.path));
            let detail = format!("path: the folder contains more than one recording ({first}, {second} …).");
            Err(ApiError::invalid("path", detail).hint("Choose the folder of one of them."))
        }
        [] => Ok(confined),
    }
}

/// Resolves a path relative to the named folders.
///
/// # Errors
/// As [`confine`].
pub(crate) fn confine_named(folders: &Folders, path: &str) -> ApiResult<Confined> {
    let shown: String = crate::printable::printable(path).chars().take(200).collect();
    if path.trim().is_empty() {
        let problem = ApiError::invalid("path", "path: is empty, but must name a folder or file.");
        return Err(problem.hint("Choose one of the recordings that `GET recordings` lists."));
    }
    if folders.recordings.is_empty() {
        let detail = format!(
            "path: “{shown}” cannot be opened, because the server was started without a folder of recordings."
        );
        return Err(ApiError::invalid("path", detail).hint(
            "Start it with `sightline serve --recordings FOLDER`, where FOLDER contains the recording.",
        ));
    }
    // Joining a relative path to a folder appends it; an absolute path replaces the folder.
    let found = folders.recordings.iter().find_map(|folder| {
        let real = folder.join(path).canonicalize().ok()?;
        let root = folders.recordings.iter().find(|root| real.starts_with(root))?.clone();
        Some(Confined { path: real, root, is_upload: false })
    });
    found.ok_or_else(|| {
        let detail = format!("path: “{shown}” is nothing below the folders of recordings.");
        let named: Vec<String> = folders.recordings.iter().map(|root| root.display().to_string()).collect();
        ApiError::invalid("path", detail).hint(format!(
            "These are {}; check the spelling, or start the server with `sightline serve --recordings FOLDER` for another one.",
            named.join(", ")
        ))
    })
}

/// The contents of the recording at a path.
///
/// # Errors
/// A problem that names the file and the fault.
pub(crate) fn contents(
    recording: &Confined,
    limits: &Limits,
    cancel: &AtomicBool,
) -> ApiResult<RecordingView> {
    let Examined { format, is_native, index, left_size, right_size, image_count, notes } =
        examine(&recording.path, &recording.options(), cancel).map_err(refusal)?;
    let stop_count = index.stops.len();
    if stop_count > limits.stops.count() {
        let detail = format!("{} has {stop_count} stops.", recording.path.display());
        return Err(ApiError::invalid("file", detail).hint(limits.stops.raise()));
    }
    let shown = (0..stop_count.min(PAIRS_SHOWN)).chain((stop_count > PAIRS_SHOWN).then(|| stop_count - 1));
    let pair = |step: usize| {
        let stop = &index.stops[step];
        RecordedPair { step, left: stop.left.image.clone(), right: stop.right.image.clone() }
    };
    let mut further_cameras: Vec<String> =
        index.stops.iter().flat_map(|stop| &stop.cameras).map(|camera| camera.name.to_string()).collect();
    further_cameras.sort();
    further_cameras.dedup();
    Ok(RecordingView {
        path: recording.path.display().to_string(),
        format: format.to_owned(),
        pairs: shown.map(pair).collect(),
        has_truth: index.stops.iter().any(|stop| stop.truth.is_some()),
        name: index.name,
        stop_count,
        image_count,
        left_size,
        right_size,
        stereo: index.stereo,
        further_cameras,
        is_opened_in_place: is_native,
        notes,
    })
}

/// The problem for a recording that cannot be opened.
pub(crate) fn refusal(error: sightline_geometry::error::Error) -> ApiError {
    let error = ApiError::from(error);
    let is_unknown = error.problem().detail.contains("is of no known format");
    error.hint(if is_unknown {
        "Choose the folder that holds all of this, perhaps the one above; nothing was imported."
    } else {
        "Mend the file that is named, or choose another folder; nothing was imported."
    })
}
