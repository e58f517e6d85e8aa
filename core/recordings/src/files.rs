//! Names inside a traverse's folder, and files that appear complete or not at all.
//!
//! An index may come from anyone, so a name in it must stay inside the folder: relative, without `..`,
//! and without a symbolic link that leads out.

use std::fs::{File, OpenOptions};
use std::io::{ErrorKind, Read, Write};
use std::path::{Component, Path, PathBuf};

use sightline_geometry::error::{Error, Result};
use sightline_vision::image::io::open_regular;

/// How often a free temporary name is sought.
const TEMPORARY_NAMES: u32 = 10_000;

/// The path of `name` inside `folder`; the file need not exist.
///
/// # Errors
/// A sentence without the file's name: what is wrong with the name.
pub(super) fn resolve(folder: &Path, name: &str) -> Result<PathBuf, String> {
    if name.trim().is_empty() {
        return Err("the file name is empty".to_owned());
    }
    let relative = Path::new(name);
    let stays_inside = relative.components().all(|part| matches!(part, Component::Normal(_)));
    if !stays_inside || name.contains(['\\', '\0']) {
        return Err(format!("\"{name}\" must be a path inside the folder, with '/' and without '..'"));
    }
    let path = folder.join(relative);
    let root = folder.canonicalize().map_err(|error| format!("the folder cannot be read ({error})"))?;
    // A missing file has no real path yet; the nearest folder that exists decides where it would lie.
    let real = path.ancestors().find_map(|part| match part.symlink_metadata() {
        Ok(_) => Some(part.canonicalize()),
        Err(_) => None,
    });
    match real {
        Some(Ok(real)) if real.starts_with(&root) => Ok(path),
        _ => Err(format!(
            "\"{name}\" is a link that leads out of the folder or nowhere; copy the file instead"
        )),
    }
}

/// Opens a regular file for reading.
///
/// # Errors
/// As [`open_regular`].
pub(super) fn open(path: &Path) -> Result<File> {
    open_regular(path).map_err(|source| Error::Read { path: path.to_owned(), source })
}

/// The text of a regular file.
///
/// # Errors
/// As [`open_regular`], or a file that is not UTF-8.
pub(super) fn read_text(path: &Path) -> std::io::Result<String> {
    let mut text = String::new();
    open_regular(path)?.read_to_string(&mut text)?;
    Ok(text)
}

/// Writes `bytes` under a temporary name and renames it, so that nobody ever sees half a file.
///
/// # Errors
/// [`Error::Write`] naming `path`; nothing is left behind.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<()> {
    let unwritable = |source| Error::Write { path: path.to_owned(), source };
    let folder = path.parent().unwrap_or(Path::new(""));
    std::fs::create_dir_all(folder).map_err(unwritable)?;
    let (written, temporary) = {
        let (mut file, temporary) = create_temporary(path).map_err(unwritable)?;
        (file.write_all(bytes).and_then(|()| file.sync_all()), temporary)
    };
    written.and_then(|()| std::fs::rename(&temporary, path)).map_err(|source| {
        // The first error is the one to tell; a temporary file that cannot be removed does no harm.
        let _ = std::fs::remove_file(&temporary);
        unwritable(source)
    })
}

fn create_temporary(path: &Path) -> std::io::Result<(std::fs::File, PathBuf)> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    for attempt in 0..TEMPORARY_NAMES {
        let temporary = path.with_file_name(format!(".{name}.{attempt}.part"));
        match OpenOptions::new().write(true).create_new(true).open(&temporary) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            opened => return Ok((opened?, temporary)),
        }
    }
    Err(std::io::Error::new(ErrorKind::AlreadyExists, "too many temporary files of this name"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_leave_the_folder_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["", " ", "/etc/passwd", "../x.png", "a/../../x.png", "a\\..\\x.png", "a\0b"] {
            assert!(resolve(folder.path(), name).is_err(), "{name:?}");
        }
        let path = resolve(folder.path(), "not/yet/there.png").unwrap();
        assert_eq!(path, folder.path().join("not/yet/there.png"));
    }

    #[cfg(unix)]
    #[test]
    fn links_that_leave_the_folder_are_refused_and_others_followed() {
        let (folder, outside) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        std::fs::write(outside.path().join("secret.png"), "x").unwrap();
        let link = |to: &Path, name: &str| std::os::unix::fs::symlink(to, folder.path().join(name)).unwrap();
        link(outside.path(), "images");
        link(&outside.path().join("secret.png"), "left.png");
        link(Path::new("nowhere.png"), "dangling.png");
        for name in ["images/secret.png", "images/missing.png", "left.png", "dangling.png"] {
            assert!(resolve(folder.path(), name).is_err(), "{name}");
        }
        std::fs::write(folder.path().join("real.png"), "x").unwrap();
        link(Path::new("real.png"), "inside.png");
        assert!(resolve(folder.path(), "inside.png").is_ok());
    }

    #[test]
    fn a_written_file_is_complete_and_leaves_no_temporary_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("new/folder/file.txt");
        write_atomically(&path, b"first").unwrap();
        write_atomically(&path, b"second").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"second");
        assert_eq!(std::fs::read_dir(path.parent().unwrap()).unwrap().count(), 1);
        let blocked = path.join("below/a/file");
        assert!(write_atomically(&blocked, b"x").unwrap_err().to_string().contains("below"));
    }
}
