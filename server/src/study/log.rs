//! The file of results: one line of JSON per unit, appended and synced as soon as the unit is done.
//!
//! After a crash, at most the last line is incomplete. Unreadable lines are reported and removed by rewriting the file;
//! their units are computed again.

use std::collections::HashMap;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use sightline_geometry::error::{Error, Result};
use sightline_recordings::files::write_atomically;
use sightline_study::plan::Unit;

use crate::jobs::lock;

/// The file name.
const NAME: &str = "results.jsonl";

/// The results of a study's folder, open for appending.
pub(crate) struct ResultLog {
    path: PathBuf,
    file: Mutex<File>,
    units: HashMap<String, Unit>,
    /// Problems found in the file, one sentence each.
    pub notices: Vec<String>,
    /// Prevents other programs from writing while the log is open.
    _lock: File,
}

impl ResultLog {
    /// Opens the results in `folder`, which is created if necessary.
    ///
    /// # Errors
    /// A folder that cannot be read or written, or is in use by another program.
    pub(crate) fn open(folder: &Path) -> Result<Self> {
        std::fs::create_dir_all(folder).map_err(|source| Error::Write { path: folder.to_owned(), source })?;
        let lock = lock_folder(folder)?;
        let path = folder.join(NAME);
        let text = match std::fs::read(&path) {
            Ok(bytes) => String::from_utf8_lossy(&bytes).into_owned(),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => String::new(),
            Err(source) => return Err(Error::Read { path, source }),
        };
        let (units, notices) = read(&path, &text);
        if !notices.is_empty() || !(text.is_empty() || text.ends_with('\n')) {
            let lines: Vec<String> =
                text.lines().filter(|line| parse(line).is_some()).map(|l| format!("{l}\n")).collect();
            write_atomically(&path, lines.concat().as_bytes())?;
        }
        let file = OpenOptions::new()
            .create(true)
            .append(true)
            .open(&path)
            .map_err(|source| Error::Write { path: path.clone(), source })?;
        Ok(Self { path, file: Mutex::new(file), units, notices, _lock: lock })
    }

    /// The cached unit with this key.
    pub(crate) fn get(&self, key: &str) -> Option<&Unit> {
        self.units.get(key)
    }

    /// Appends a unit.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub(crate) fn add(&self, unit: &Unit) -> Result<()> {
        let mut line = serde_json::to_vec(unit).map_err(|error| Error::Request(error.to_string()))?;
        line.push(b'\n');
        let mut file = lock(&self.file);
        let written = file.write_all(&line).and_then(|()| file.sync_data());
        written.map_err(|source| Error::Write { path: self.path.clone(), source })
    }
}

fn lock_folder(folder: &Path) -> Result<File> {
    let path = folder.join("lock");
    let unwritable = |source| Error::Write { path: path.clone(), source };
    let file = File::create(&path).map_err(unwritable)?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::Error(source)) => Err(unwritable(source)),
        Err(TryLockError::WouldBlock) => Err(Error::Request(format!(
            "another program carries out a study in {}; wait for it or choose another folder",
            folder.display()
        ))),
    }
}

fn parse(line: &str) -> Option<Unit> {
    serde_json::from_str(line).ok()
}

fn read(path: &Path, text: &str) -> (HashMap<String, Unit>, Vec<String>) {
    let (mut units, mut notices) = (HashMap::new(), Vec::new());
    for (number, line) in text.lines().enumerate() {
        match parse(line) {
            Some(unit) => {
                units.insert(unit.key.clone(), unit);
            }
            None => notices.push(format!(
                "{}: line {} cannot be read and is dropped; its unit is done again",
                path.display(),
                number + 1
            )),
        }
    }
    (units, notices)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sightline_study::point::Point;

    fn unit(key: &str) -> Unit {
        Unit {
            key: key.to_owned(),
            scenario: "s".to_owned(),
            seed: 1,
            configuration: "ncc".to_owned(),
            point: Point::plain("s", "n_skip", 0),
            odometry: None,
            runs: Vec::new(),
        }
    }

    #[test]
    fn added_units_are_read_back_without_a_torn_line() {
        let folder = tempfile::tempdir().unwrap();
        {
            let log = ResultLog::open(folder.path()).unwrap();
            log.add(&unit("a")).unwrap();
            log.add(&unit("b")).unwrap();
        }
        let path = folder.path().join(NAME);
        let whole = std::fs::read(&path).unwrap();
        std::fs::write(&path, &whole[..whole.len() - 20]).unwrap();
        {
            let log = ResultLog::open(folder.path()).unwrap();
            assert_eq!((log.get("a"), log.get("b")), (Some(&unit("a")), None));
            assert!(log.notices.len() == 1 && log.notices[0].contains("line 2"), "{:?}", log.notices);
            log.add(&unit("b")).unwrap();
        }
        assert_eq!(std::fs::read(&path).unwrap(), whole);
        assert!(ResultLog::open(folder.path()).unwrap().notices.is_empty());
    }

    #[test]
    fn two_programs_cannot_write_the_same_results() {
        let folder = tempfile::tempdir().unwrap();
        let _first = ResultLog::open(folder.path()).unwrap();
        let refusal = ResultLog::open(folder.path()).map(|_| ()).unwrap_err().to_string();
        assert!(refusal.contains("another program"), "{refusal}");
    }
}
