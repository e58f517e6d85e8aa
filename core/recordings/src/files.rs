//! Names inside a traverse's folder, and files that appear complete or not at all.
//!
//! An index may come from an untrusted source, so a name in it must stay inside the folder: relative, without `..`,
//! and without a symbolic link that leads out.

use std::fs::File;
use std::io::{Read, Write};
use std::path::{Component, Path, PathBuf};

use sightline_geometry::error::{Error, Result};
use sightline_vision::image::io::open_regular;
use tempfile::NamedTempFile;

/// Suffix of the names of temporary files.
pub const PARTIAL: &str = ".partial";

/// Returns the path of `name` inside `folder`; the file need not exist.
///
/// # Errors
/// The problem of the name, as a sentence without it.
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
    // A missing file has no real path yet; its nearest existing ancestor is checked instead.
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

/// Reads the text of a regular file.
///
/// # Errors
/// As [`open_regular`], or a file that is not UTF-8.
pub(super) fn read_text(path: &Path) -> std::io::Result<String> {
    let mut text = String::new();
    open_regular(path)?.read_to_string(&mut text)?;
    Ok(text)
}

/// Writes `bytes` under a temporary name and renames it, so that a partial file is never visible.
///
/// # Errors
/// [`Error::Write`] naming `path`; nothing is left behind.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<()> {
    let folder = path.parent().unwrap_or(Path::new(""));
    std::fs::create_dir_all(folder).map_err(|source| Error::Write { path: path.to_owned(), source })?;
    let mut file = PartialFile::create(path)?;
    file.write_all(bytes).map_err(|source| Error::Write { path: path.to_owned(), source })?;
    file.replace()
}

/// An unfinished file under a temporary name beside its path: it gets its own name once it is complete and on disk.
/// If dropped before, it is removed. A file left by a killed program is not locked, and [`remove_left_overs`] removes it.
#[derive(Debug)]
pub struct PartialFile {
    file: NamedTempFile,
    path: PathBuf,
}

impl PartialFile {
    /// Creates the temporary file of `path`, whose folder exists.
    ///
    /// # Errors
    /// [`Error::Write`] naming `path`.
    pub fn create(path: &Path) -> Result<Self> {
        let prefix = format!(".{}.", path.file_name().unwrap_or_default().to_string_lossy());
        let mut builder = tempfile::Builder::new();
        builder.prefix(&prefix).suffix(PARTIAL);
        // As for any new file, the umask decides who may read it.
        #[cfg(unix)]
        let mode = std::os::unix::fs::PermissionsExt::from_mode(0o666);
        #[cfg(unix)]
        builder.permissions(mode);
        let file = builder
            .tempfile_in(folder_of(path))
            .map_err(|source| Error::Write { path: path.to_owned(), source })?;
        // On a file system without locks, the files of killed programs remain.
        let _ = file.as_file().try_lock();
        Ok(Self { file, path: path.to_owned() })
    }

    /// Completes the file, replacing an existing one.
    ///
    /// # Errors
    /// [`Error::Write`]; nothing is left behind.
    pub fn replace(self) -> Result<()> {
        self.complete(|file, path| file.persist(path).map(|_| ()).map_err(|failed| failed.error))
    }

    /// Completes the file, never replacing an existing one.
    ///
    /// # Errors
    /// [`Error::Write`], also if a file of its name exists; nothing of this one is left behind.
    pub fn complete_new(self) -> Result<()> {
        self.complete(|file, path| file.persist_noclobber(path).map(|_| ()).map_err(|failed| failed.error))
    }

    fn complete(self, persist: impl FnOnce(NamedTempFile, &Path) -> std::io::Result<()>) -> Result<()> {
        let Self { file, path } = self;
        let on_disk = file.as_file().sync_all().and_then(|()| persist(file, &path));
        on_disk.and_then(|()| sync_folder(folder_of(&path))).map_err(|source| Error::Write { path, source })
    }
}

impl Write for PartialFile {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.file.flush()
    }
}

/// Writes the entries of a folder to disk, as syncing a file does not: otherwise a new file may be lost in a power failure.
///
/// # Errors
/// Those of the system.
pub fn sync_folder(folder: &Path) -> std::io::Result<()> {
    #[cfg(unix)]
    match File::open(folder).and_then(|opened| opened.sync_all()) {
        // Some file systems do not support it, and a writable folder need not be readable.
        Err(error)
            if !matches!(
                error.kind(),
                std::io::ErrorKind::InvalidInput
                    | std::io::ErrorKind::Unsupported
                    | std::io::ErrorKind::PermissionDenied
            ) =>
        {
            return Err(error);
        }
        _ => {}
    }
    #[cfg(not(unix))]
    let _ = folder;
    Ok(())
}

/// Removes the temporary files that killed programs left in a folder, or only those of the file `name`; a file that
/// is being written is locked and stays.
pub fn remove_left_overs(folder: &Path, name: Option<&str>) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let own = entry.file_name().to_string_lossy().into_owned();
        let Some(stem) = own.strip_prefix('.').and_then(temporary_of) else { continue };
        if name.is_some_and(|name| name != stem) || !entry.file_type().is_ok_and(|kind| kind.is_file()) {
            continue;
        }
        if File::open(entry.path()).is_ok_and(|file| file.try_lock().is_ok()) {
            // A file that cannot be removed does no harm.
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

/// Removes the temporary files that killed programs left of the file `path`.
pub fn remove_left_overs_of(path: &Path) {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    remove_left_overs(folder_of(path), Some(&name));
}

/// The final name of a temporary file, given without its leading dot: `NAME.X.partial`, in folders of earlier
/// versions also `NAME.NUMBER.part`.
fn temporary_of(name: &str) -> Option<&str> {
    if let Some(rest) = name.strip_suffix(PARTIAL) {
        return rest.rsplit_once('.').map(|(stem, _)| stem);
    }
    let (stem, number) = name.strip_suffix(".part")?.rsplit_once('.')?;
    number.bytes().all(|byte| byte.is_ascii_digit()).then_some(stem)
}

/// The folder of a file.
fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
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

    #[test]
    fn a_partial_file_has_no_name_before_it_is_complete() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rows.csv");
        let mut dropped = PartialFile::create(&path).unwrap();
        dropped.write_all(b"half").unwrap();
        assert!(!path.exists());
        drop(dropped);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
        let mut whole = PartialFile::create(&path).unwrap();
        whole.write_all(b"whole").unwrap();
        whole.complete_new().unwrap();
        assert!(PartialFile::create(&path).unwrap().complete_new().is_err());
        assert_eq!(std::fs::read(&path).unwrap(), b"whole");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn left_overs_are_removed_and_files_in_work_stay() {
        let folder = tempfile::tempdir().unwrap();
        let place = |name: &str| folder.path().join(name);
        let left = [".rows.csv.4711.partial", ".rows.csv.Xy12.partial", ".rows.csv.0.part", ".a.b.3.partial"];
        let others = ["rows.csv", ".rows.csv", ".movie.mkv.part", "x.1.partial", ".partial", "y.part"];
        for name in left.iter().chain(&others) {
            std::fs::write(place(name), "x").unwrap();
        }
        let in_work = PartialFile::create(&place("rows.csv")).unwrap();
        remove_left_overs(folder.path(), Some("rows.csv"));
        assert!(place(left[3]).exists() && left[..3].iter().all(|name| !place(name).exists()));
        remove_left_overs(folder.path(), None);
        assert!(!place(left[3]).exists() && others.iter().all(|name| place(name).exists()));
        in_work.replace().unwrap();
        assert_eq!(std::fs::read(place("rows.csv")).unwrap(), b"");
    }
}
