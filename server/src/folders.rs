//! The folders of the server.

use std::io::Result;
use std::path::{Path, PathBuf};

use sightline_recordings::files::remove_left_overs;

/// The folders with the server's data.
#[derive(Clone, Debug)]
pub(crate) struct Folders {
    /// Sessions.
    pub sessions: PathBuf,
    /// Studies, with their worlds.
    pub studies: PathBuf,
    /// Simulated traverses.
    pub traverses: PathBuf,
    /// Commanded drives.
    pub commanded_drives: PathBuf,
    /// Recordings imported from pages, and references to those opened in place.
    pub imported: PathBuf,
    /// Recordings uploaded by pages, until they are imported; emptied at each start.
    pub uploads: PathBuf,
    /// Digests of the files of recorded traverses; a cache that can be removed at any time.
    pub digests: PathBuf,
    /// The folders below which pages may open recordings; canonical paths, outside the server's own folders.
    pub recordings: Vec<PathBuf>,
}

impl Folders {
    /// Sessions in `folder` itself, the others in subfolders.
    pub(crate) fn in_one(folder: &Path) -> Self {
        let [studies, traverses, commanded_drives, imported, uploads, digests] =
            ["studies", "traverses", "driven", "imported", "uploads", "digests"]
                .map(|name| folder.join(name));
        let recordings = Vec::new();
        Self {
            sessions: folder.to_owned(),
            studies,
            traverses,
            commanded_drives,
            imported,
            uploads,
            digests,
            recordings,
        }
    }

    /// Sets the folders below which pages may open recordings.
    ///
    /// # Errors
    /// A path that is not a folder.
    pub(crate) fn with_recordings(self, recordings: &[PathBuf]) -> sightline_geometry::error::Result<Self> {
        let real = |path: &PathBuf| {
            let real = path.canonicalize().ok().filter(|real| real.is_dir());
            real.ok_or_else(|| {
                let problem = "is no folder; give --recordings a folder that exists";
                sightline_geometry::error::Error::format(path, problem)
            })
        };
        let recordings = recordings.iter().map(real).collect::<sightline_geometry::error::Result<_>>()?;
        Ok(Self { recordings, ..self })
    }

    /// Creates all folders except that of the sessions, accessible to the owner only, and starts to remove remains of a
    /// killed server from them. This runs in the background, because they may contain a hundred thousand images.
    ///
    /// # Errors
    /// Errors of the system.
    pub(crate) fn prepare(&self) -> Result<()> {
        let folders = [
            &self.studies,
            &self.traverses,
            &self.commanded_drives,
            &self.imported,
            &self.uploads,
            &self.digests,
        ];
        let folders = folders.map(PathBuf::clone);
        // Uploads of an earlier start are never completed.
        let _ = std::fs::remove_dir_all(&self.uploads);
        folders.iter().try_for_each(|folder| make_private(folder))?;
        let tidy = move || folders.iter().for_each(|folder| tidy(folder, DEPTH));
        std::thread::Builder::new().name("tidy".to_owned()).spawn(tidy).map(|_| ())
    }
}

/// Depth of the server's files below these folders: a drive, and its images.
const DEPTH: usize = 2;

/// Removes remains of killed programs from a folder and its subfolders.
fn tidy(folder: &Path, depth: usize) {
    remove_left_overs(folder, None);
    if depth == 0 {
        return;
    }
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    for entry in entries.filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_dir())) {
        tidy(&entry.path(), depth - 1);
    }
}

/// Creates a folder for its owner only, or removes the permissions of others from an existing one.
///
/// # Errors
/// Errors of the system.
pub(crate) fn make_private(folder: &Path) -> Result<()> {
    make(folder)?;
    restrict(folder, 0o700)
}

/// Creates a folder for its owner only; an existing one keeps its permissions.
///
/// # Errors
/// Errors of the system.
pub(crate) fn make(folder: &Path) -> Result<()> {
    let mut builder = std::fs::DirBuilder::new();
    builder.recursive(true);
    #[cfg(unix)]
    std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
    builder.create(folder)
}

/// Removes the permissions of others from a file.
///
/// # Errors
/// Errors of the system.
pub(crate) fn make_file_private(file: &Path) -> Result<()> {
    restrict(file, 0o600)
}

/// Removes all permissions that are not in `mode`.
#[cfg(unix)]
fn restrict(path: &Path, mode: u32) -> Result<()> {
    use std::os::unix::fs::PermissionsExt;
    let now = std::fs::metadata(path)?.permissions().mode() & 0o7777;
    if now & !mode == 0 {
        return Ok(());
    }
    std::fs::set_permissions(path, PermissionsExt::from_mode(now & mode))
}

#[cfg(not(unix))]
fn restrict(_path: &Path, _mode: u32) -> Result<()> {
    // On other systems, the folder of a user is already private.
    Ok(())
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::os::unix::fs::PermissionsExt;

    #[test]
    fn folders_and_files_are_accessible_to_their_owner_only() {
        let folder = tempfile::tempdir().unwrap();
        let mode = |path: &Path| std::fs::metadata(path).unwrap().permissions().mode() & 0o777;
        let (new, old) = (folder.path().join("new/below"), folder.path().join("old"));
        std::fs::create_dir(&old).unwrap();
        let file = old.join("file");
        std::fs::write(&file, "x").unwrap();
        for (path, wide) in [(&old, 0o755), (&file, 0o644)] {
            std::fs::set_permissions(path, PermissionsExt::from_mode(wide)).unwrap();
        }
        make(&old).unwrap();
        assert_eq!(mode(&old), 0o755, "a folder that is not the server's keeps its rights");
        make_private(&new).unwrap();
        make_private(&old).unwrap();
        make_file_private(&file).unwrap();
        let modes = [new.parent().unwrap(), &new, &old, &file].map(mode);
        assert_eq!(modes, [0o700, 0o700, 0o700, 0o600]);
    }
}
