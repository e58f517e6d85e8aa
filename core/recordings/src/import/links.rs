//! Confines a recording to a folder: no symbolic link in it may lead out.
//!
//! A page may have the server open a recording below the folders named at its start, and nothing else. An importer
//! reads only the recording's folder, so checking its links before the import protects against a prepared folder.
//! Anyone who can exchange files during the import can read them anyway.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use sightline_geometry::error::{Error, Result};

/// The largest number of files and folders that a recording may have.
const ENTRY_LIMIT: usize = 500_000;

/// Rejects a recording, given by its folder or one of its files, with a link that leads out of `root`, which is canonical.
///
/// # Errors
/// Such a link, a folder that cannot be read, too many files, or [`Error::Cancelled`].
pub(super) fn check(path: &Path, root: &Path, cancel: &AtomicBool) -> Result<()> {
    let folder = if path.is_dir() { path } else { path.parent().unwrap_or(path) };
    let unreadable = |path: &Path, source| Error::Read { path: path.to_owned(), source };
    let first = folder.canonicalize().map_err(|source| unreadable(folder, source))?;
    let leads_out = |path: &Path| {
        Error::format(
            path,
            "is a link that leads out of the recordings folder or nowhere; copy the file instead",
        )
    };
    if !first.starts_with(root) {
        return Err(leads_out(folder));
    }
    let (mut seen, mut waiting, mut count) = (BTreeSet::from([first.clone()]), vec![first], 0);
    while let Some(folder) = waiting.pop() {
        if cancel.load(Ordering::Relaxed) {
            return Err(Error::Cancelled);
        }
        for entry in std::fs::read_dir(&folder).map_err(|source| unreadable(&folder, source))? {
            let entry = entry.map_err(|source| unreadable(&folder, source))?;
            count += 1;
            if count > ENTRY_LIMIT {
                let problem =
                    format!("has more than {ENTRY_LIMIT} files; choose the folder of one recording");
                return Err(Error::format(path, problem));
            }
            let kind = entry.file_type().map_err(|source| unreadable(&entry.path(), source))?;
            if !kind.is_symlink() && !kind.is_dir() {
                continue;
            }
            let real = entry.path().canonicalize().map_err(|_| leads_out(&entry.path()))?;
            if !real.starts_with(root) {
                return Err(leads_out(&entry.path()));
            }
            if real.is_dir() && seen.insert(real.clone()) {
                waiting.push(real);
            }
        }
    }
    Ok(())
}
