//! Examines a recording before an import: format, stops, image sizes and stereo pairs.
//!
//! A foreign recording is imported without writing, so that result and errors are those of the import; pixels are not
//! read. [`find`] lists the recordings below a folder.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use super::{FORMATS, ImportOptions, Output, index_file, links, recognise};
use crate::{Existing, Traverse};
use sightline_geometry::error::{Error, Result};
use sightline_world::traverse::{CameraSource, TraverseIndex, View};

/// The name of the native format.
pub const NATIVE: &str = "Sightline drive";

/// The content of a recording.
#[derive(Clone, Debug)]
pub struct Examined {
    /// The name of its format.
    pub format: &'static str,
    /// Whether it can be opened without an import.
    pub is_native: bool,
    /// The index that an import would write, or the existing one.
    pub index: TraverseIndex,
    /// Width and height of the left image of the first stop, px.
    pub left_size: [u32; 2],
    /// Width and height of the right image of the first stop, px.
    pub right_size: [u32; 2],
    /// Number of images, those of further cameras included.
    pub image_count: usize,
    /// Omissions and assumptions of an import, one sentence each.
    pub notes: Vec<String>,
}

/// Examines the recording at `path`, a folder or a file.
///
/// # Errors
/// Those errors of an import that do not depend on pixels.
pub fn examine(path: &Path, options: &ImportOptions, cancel: &AtomicBool) -> Result<Examined> {
    if let Some(root) = &options.within {
        links::check(path, root, cancel)?;
    }
    if index_file::find(path).is_ok() {
        return native(path);
    }
    if path.is_dir() && std::fs::read_dir(path).is_ok_and(|mut entries| entries.next().is_none()) {
        return Err(Error::format(path, "is empty; choose the folder of a recording"));
    }
    options.check()?;
    let format = recognise(path)?;
    let mut output = Output {
        folder: Path::new(""),
        existing: Existing::Refuse,
        is_dry: true,
        cancel,
        progress: &mut |_, _| {},
        expected: 0,
        written: Vec::new(),
        notes: Vec::new(),
    };
    let index = format.import(path, options, &mut output)?;
    let size = |view: Option<&View>| match view.map(|view| &view.camera) {
        Some(CameraSource::Inline(camera)) => camera.size,
        _ => [0, 0],
    };
    let first = index.stops.first();
    Ok(Examined {
        format: format.name(),
        is_native: false,
        left_size: size(first.map(|stop| &stop.left)),
        right_size: size(first.map(|stop| &stop.right)),
        image_count: output.expected,
        notes: output.notes,
        index,
    })
}

fn native(path: &Path) -> Result<Examined> {
    let traverse = Traverse::open(path)?;
    let further: usize = (0..traverse.stop_count())
        .flat_map(|step| traverse.further_cameras(step))
        .map(|camera| 1 + usize::from(camera.right.is_some()))
        .sum();
    Ok(Examined {
        format: NATIVE,
        is_native: true,
        left_size: traverse.left_camera(0).size,
        right_size: traverse.right_camera(0).size,
        image_count: 2 * traverse.stop_count() + further,
        notes: traverse.warnings().to_vec(),
        index: traverse.index().clone(),
    })
}

/// A recording below a folder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Found {
    /// Its folder.
    pub path: PathBuf,
    /// The name of its format.
    pub format: &'static str,
}

/// Lists the recordings in `folder` and at most `depth` folders below it, by path, at most `limit`; also returns
/// whether these are all.
///
/// Links are not followed, and a recording is not searched for others.
pub fn find(folder: &Path, depth: usize, limit: usize) -> (Vec<Found>, bool) {
    let mut found = Vec::new();
    let is_all = find_into(&mut found, folder, depth, limit);
    (found, is_all)
}

fn find_into(found: &mut Vec<Found>, folder: &Path, depth: usize, limit: usize) -> bool {
    if let Some(format) = format_of(folder) {
        found.push(Found { path: folder.to_owned(), format });
        return true;
    }
    if depth == 0 {
        return true;
    }
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let is_shown = |path: &PathBuf| !path.file_name().is_some_and(|n| n.to_string_lossy().starts_with('.'));
    let folders = entries.filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_dir()));
    let mut folders: Vec<PathBuf> = folders.map(|entry| entry.path()).filter(is_shown).collect();
    folders.sort();
    folders.iter().all(|below| found.len() < limit && find_into(found, below, depth - 1, limit))
}

/// The format of the recording in a folder; `None` without one.
fn format_of(folder: &Path) -> Option<&'static str> {
    if index_file::find(folder).is_ok() {
        return Some(NATIVE);
    }
    FORMATS.into_iter().find(|format| format.sniff(folder)).map(super::ImportFormat::name)
}
