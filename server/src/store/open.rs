//! Opening the database: a damaged file is moved aside, one of a newer version is left alone, and the JSON files of an
//! earlier version are read in once and kept.

use std::io::ErrorKind;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use redb::{Builder, ConcurrencyMode, Database, DatabaseError, ReadableTable, StorageError};
use sightline_geometry::error::{Error, Result};
use sightline_session::view::SavedSession;

use super::{
    CURSORS, DOCUMENTS, DRIVES, Disk, FILE_NAME, LAST_SESSION, META, NOTES, RUNS, SESSIONS, STORE_VERSION,
    STUDIES, Store, USED, id_of, number_of,
};

/// How long a database is waited for that a server in this very process is about to let go of.
const PATIENCE: Duration = Duration::from_secs(5);
/// Memory for pages of the database, bytes.
const CACHE_BYTES: usize = 16 << 20;

/// How the database is opened: one program writes, others may read meanwhile, and every page is checked first.
pub(super) fn builder() -> Builder {
    let mut builder = Builder::new();
    builder.set_cache_size(CACHE_BYTES).set_concurrency_mode(ConcurrencyMode::SingleWriter);
    builder.set_check_integrity_on_open(true);
    builder
}

/// The database in `folder`, and what happened on the way, one sentence each.
pub(super) fn open(folder: &Path) -> Result<(Disk, Vec<String>)> {
    let path = folder.join(FILE_NAME);
    let unwritable = |source| Error::Write { path: folder.to_owned(), source };
    std::fs::create_dir_all(folder).map_err(unwritable)?;
    match attempt(&path)? {
        Ok(disk) => Ok((disk, Vec::new())),
        Err(why) => {
            let to = free_name(folder, FILE_NAME, "damaged");
            std::fs::rename(&path, &to).map_err(|source| Error::Write { path: path.clone(), source })?;
            let (from, to) = (path.display(), to.display());
            let message = format!("{from} is damaged ({why}); it was moved to {to}, and sessions begin anew");
            let disk = attempt(&path)?.map_err(|why| failed(&path, &why))?;
            Ok((disk, vec![message]))
        }
    }
}

/// Opens or makes the database; the inner error says what is damaged.
fn attempt(path: &Path) -> Result<std::result::Result<Disk, String>> {
    let begun = Instant::now();
    loop {
        // Some damage is met by the library with a panic.
        let opened = catch_unwind(AssertUnwindSafe(|| {
            let database = builder().create(path)?;
            prepare(&database).map(|version| (database, version))
        }));
        return match opened {
            Err(_) => Ok(Err("it cannot be checked".to_owned())),
            Ok(Ok((_, version))) if version > STORE_VERSION => Err(Error::Request(format!(
                "{} was written by a newer version of this program (form {version}; this one reads {STORE_VERSION}); \
                 use that one, or another folder with --data-dir",
                path.display()
            ))),
            Ok(Ok((database, _))) => Ok(Ok(Disk { database, path: path.to_owned() })),
            Ok(Err(redb::Error::DatabaseAlreadyOpen)) if begun.elapsed() < PATIENCE => {
                std::thread::sleep(Duration::from_millis(20));
                continue;
            }
            Ok(Err(redb::Error::DatabaseAlreadyOpen | redb::Error::LockProtocolMismatch)) => {
                Err(Error::Request(format!("another program uses {}", path.display())))
            }
            Ok(Err(redb::Error::Io(source)))
                if !matches!(source.kind(), ErrorKind::InvalidData | ErrorKind::UnexpectedEof) =>
            {
                Err(Error::Write { path: path.to_owned(), source })
            }
            Ok(Err(error)) => Ok(Err(crate::printable::printable(&error.to_string()))),
        };
    }
}

/// Makes the tables that are missing; returns the version.
fn prepare(database: &Database) -> std::result::Result<u64, redb::Error> {
    let transaction = database.begin_write()?;
    let version = {
        let mut meta = transaction.open_table(META)?;
        let known = meta.get("version")?.map(|value| value.value());
        if known.is_none() {
            meta.insert("version", STORE_VERSION)?;
        }
        known.unwrap_or(STORE_VERSION)
    };
    if version > STORE_VERSION {
        transaction.abort()?;
        return Ok(version);
    }
    transaction.open_table(SESSIONS)?;
    transaction.open_table(RUNS)?;
    transaction.open_table(CURSORS)?;
    transaction.open_table(NOTES)?;
    transaction.open_table(STUDIES)?;
    transaction.open_table(DOCUMENTS)?;
    transaction.open_table(USED)?;
    transaction.open_table(DRIVES)?;
    transaction.commit()?;
    Ok(version)
}

impl Store {
    /// Reads in the JSON files of an earlier version, one a session; they are kept under another name.
    pub(super) fn read_in_files(&mut self, folder: &Path) -> Result<()> {
        let unreadable = |source| Error::Read { path: folder.to_owned(), source };
        let entries: std::io::Result<Vec<_>> = std::fs::read_dir(folder).map_err(unreadable)?.collect();
        let mut paths: Vec<_> = entries.map_err(unreadable)?.iter().map(std::fs::DirEntry::path).collect();
        paths.sort();
        let mut last = 0;
        for path in paths {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let Some(number) = number_of(name.split('.').next().unwrap_or_default()) else { continue };
            last = last.max(number);
            if name != format!("{}.json", id_of(number)) {
                continue;
            }
            let message = match read(&path, &id_of(number)) {
                Ok(session) => {
                    if !self.has(number)? {
                        self.save(&session)?;
                    }
                    move_aside(&path, &id_of(number), "imported", "was read into the database")
                }
                Err(why) => move_aside(&path, &id_of(number), "damaged", &format!("cannot be read ({why})")),
            };
            self.messages.push(message);
        }
        self.disk.write(|transaction| {
            let mut meta = transaction.open_table(META)?;
            let known = meta.get(LAST_SESSION)?.map_or(0, |value| value.value());
            if known < last {
                meta.insert(LAST_SESSION, last)?;
            }
            Ok(known < last)
        })
    }

    fn has(&self, number: u64) -> Result<bool> {
        let find = || {
            use redb::ReadableDatabase as _;
            let table = self.disk.database.begin_read()?.open_table(SESSIONS)?;
            Ok::<_, redb::Error>(table.get(number)?.is_some())
        };
        find().map_err(|error| failed(&self.disk.path, &error.to_string()))
    }
}

fn read(path: &Path, id: &str) -> std::result::Result<SavedSession, String> {
    let bytes = std::fs::read(path).map_err(|error| error.to_string())?;
    let saved: SavedSession = serde_json::from_slice(&bytes).map_err(|error| error.to_string())?;
    if saved.id == id {
        Ok(saved)
    } else {
        Err(format!("it holds session {}", crate::printable::printable(&saved.id)))
    }
}

fn move_aside(path: &Path, id: &str, ending: &str, what: &str) -> String {
    let to = free_name(path.parent().unwrap_or(Path::new(".")), id, ending);
    let (from, name) = (path.display(), to.display());
    match std::fs::rename(path, &to) {
        Ok(()) => format!("{from} {what}; it was moved to {name}"),
        Err(error) => format!("{from} {what} and cannot be moved aside ({error})"),
    }
}

/// A name in `folder` that nothing has yet: `name.ending`, `name.ending-2` and so on.
pub(super) fn free_name(folder: &Path, name: &str, ending: &str) -> PathBuf {
    let of = |number: u32| match number {
        1 => folder.join(format!("{name}.{ending}")),
        _ => folder.join(format!("{name}.{ending}-{number}")),
    };
    (1..1000).map(of).find(|path| !path.exists()).unwrap_or_else(|| of(1000))
}

pub(super) fn failed(path: &Path, problem: &str) -> Error {
    Error::Read { path: path.to_owned(), source: std::io::Error::other(problem.to_owned()) }
}

/// What opening for reading alone said.
pub(super) fn refused(path: &Path, error: &DatabaseError) -> Error {
    match error {
        DatabaseError::DatabaseAlreadyOpen | DatabaseError::LockProtocolMismatch => {
            Error::Request(format!("another program uses {} alone", path.display()))
        }
        DatabaseError::Storage(StorageError::Io(source)) if source.kind() == ErrorKind::NotFound => {
            Error::Request(format!("there are no sessions in {}", path.display()))
        }
        error => failed(path, &error.to_string()),
    }
}
