//! Opening the database: a damaged file is moved aside, one of a newer version is not touched, and the JSON files of an
//! earlier version are imported once and kept.

use std::fs::OpenOptions;
use std::io::ErrorKind;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use redb::backends::FileBackend;
use redb::{
    Builder, ConcurrencyMode, Database, DatabaseError, ReadableTable, StorageError, TableHandle as _,
    WriteTransaction,
};
use sightline_geometry::error::{Error, Result};
use sightline_recordings::files::{PARTIAL, remove_left_overs, sync_folder};
use sightline_session::view::SavedSession;

use super::disk::{Disk, Outcome, io_error};
use super::record::{NAMED, NUMBERED, RUNS, RecordKey, RunKey, SESSIONS, encode, has_line, run_keys};
use super::salvage::Salvaged;
use super::{FILE_NAME, META, STORE_VERSION, Store, id_of, number_of, raise_last_session};
use crate::folders::{make_file_private, make_private};

/// Maximum wait for a database that another server in the same process is about to close.
const PATIENCE: Duration = Duration::from_secs(5);
/// Page cache of the database, bytes.
const CACHE_BYTES: usize = 16 << 20;

/// Options of the database: one program writes, others may read concurrently, and every page is checked on opening.
pub(super) fn builder() -> Builder {
    let mut builder = Builder::new();
    builder.set_cache_size(CACHE_BYTES).set_concurrency_mode(ConcurrencyMode::SingleWriter);
    builder.set_check_integrity_on_open(true);
    builder
}

/// Opens the database in `folder`; returns it with one sentence for each noteworthy event.
pub(super) fn open(folder: &Path) -> Result<(Disk, Vec<String>)> {
    let path = folder.join(FILE_NAME);
    let unwritable = |source| Error::Write { path: path.clone(), source };
    make_private(folder).map_err(unwritable)?;
    remove_left_overs(folder, None);
    let mut messages = Vec::new();
    match std::fs::metadata(&path) {
        Err(error) if error.kind() == ErrorKind::NotFound => create(&path, &Salvaged::default())?,
        Ok(about) if about.len() == 0 => {
            messages.push(format!(
                "{} was empty, without any session; sessions begin anew. If there were sessions, bring the file back from a \
                 copy",
                path.display()
            ));
            create(&path, &Salvaged::default())?;
        }
        _ => {}
    }
    let database = match attempt(&path)? {
        Ok(database) => database,
        Err(Damaged(why)) => {
            messages.push(salvage(&path, &why)?);
            attempt(&path)?.map_err(|Damaged(why)| failed(&path, &why))?
        }
    };
    make_file_private(&path).map_err(unwritable)?;
    let again = path.clone();
    let disk = Disk::new(path.clone(), database, Box::new(move || open_file(&again)));
    disk.map(|disk| (disk, messages)).map_err(|error| failed(&path, &error.to_string()))
}

/// Moves a damaged file aside and replaces it by its verifiable records; returns a sentence about the result. The file
/// exists at any moment.
fn salvage(path: &Path, why: &str) -> Result<String> {
    let unwritable = |source| Error::Write { path: path.to_owned(), source };
    let folder = path.parent().unwrap_or(Path::new("."));
    let bytes = std::fs::read(path).map_err(|source| Error::Read { path: path.to_owned(), source })?;
    let salvaged = Salvaged::of(&bytes);
    let to = free_name(folder, FILE_NAME, "damaged");
    std::fs::hard_link(path, &to).or_else(|_| std::fs::copy(path, &to).map(|_| ())).map_err(unwritable)?;
    make_file_private(&to).map_err(unwritable)?;
    create(path, &salvaged)?;
    let (from, to, summary) = (path.display(), to.display(), salvaged.summary());
    Ok(format!("{from} is damaged ({why}); it was moved to {to}; {summary}"))
}

/// Creates the database with these records and replaces an existing one, completely or not at all.
fn create(path: &Path, records: &Salvaged) -> Result<()> {
    let unwritable = |source: std::io::Error| Error::Write { path: path.to_owned(), source };
    let folder = path.parent().unwrap_or(Path::new("."));
    // Temporary files are accessible to the owner only.
    let prefix = format!(".{FILE_NAME}.");
    let file = tempfile::Builder::new().prefix(&prefix).suffix(PARTIAL).tempfile_in(folder);
    let file = file.map_err(unwritable)?;
    let make = || {
        let database = builder().create_with_backend(FileBackend::new(file.reopen()?)?)?;
        prepare(&database)?;
        records.fill(&database)?;
        Ok::<_, redb::Error>(database.close()?)
    };
    make().map_err(|error| unwritable(io_error(error)))?;
    file.as_file().sync_all().map_err(unwritable)?;
    file.persist(path).map_err(|error| unwritable(error.error))?;
    sync_folder(folder).map_err(unwritable)
}

fn open_file(path: &Path) -> std::result::Result<Database, DatabaseError> {
    let file = OpenOptions::new().read(true).write(true).open(path)?;
    builder().create_with_backend(FileBackend::new(file)?)
}

/// Describes the damage.
struct Damaged(String);

/// Opens the database; the inner error describes the damage.
fn attempt(path: &Path) -> Result<std::result::Result<Database, Damaged>> {
    let begun = Instant::now();
    loop {
        // redb panics at some kinds of damage.
        let opened = catch_unwind(AssertUnwindSafe(|| {
            let database = open_file(path)?;
            prepare(&database).map(|version| (database, version))
        }));
        return match opened {
            Err(_) => Ok(Err(Damaged("it cannot be checked".to_owned()))),
            Ok(Ok((_, version))) if version > STORE_VERSION => Err(Error::Request(format!(
                "{} was written by a newer version of this program (form {version}; this one reads {STORE_VERSION}); \
                 use that one, or another folder with --data-dir",
                path.display()
            ))),
            Ok(Ok((database, _))) => Ok(Ok(database)),
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
            Ok(Err(error)) => Ok(Err(Damaged(crate::printable::printable(&error.to_string())))),
        };
    }
}

/// Creates missing tables and adds verification lines to the records of an earlier version; returns the version. A database
/// of a newer version is not changed.
pub(super) fn prepare(database: &Database) -> Outcome<u64> {
    let transaction = database.begin_write()?;
    let version = {
        let mut meta = transaction.open_table(META)?;
        let known = meta.get("version")?.map(|value| value.value());
        if known.is_none_or(|known| known < STORE_VERSION) {
            meta.insert("version", STORE_VERSION)?;
        }
        known.unwrap_or(STORE_VERSION)
    };
    if version > STORE_VERSION {
        transaction.abort()?;
        return Ok(version);
    }
    for table in NUMBERED {
        transaction.open_table(table)?;
    }
    for table in NAMED {
        transaction.open_table(table)?;
    }
    transaction.open_table(RUNS)?;
    if version < STORE_VERSION {
        add_lines(&transaction)?;
    }
    transaction.commit()?;
    Ok(version)
}

/// Adds its verification line to every record, and the numbers of runs to every session.
fn add_lines(transaction: &WriteTransaction) -> Outcome<()> {
    let mut all = Vec::new();
    for table in NUMBERED {
        for entry in transaction.open_table(table)?.iter()? {
            let (key, value) = entry?;
            all.extend(
                RecordKey::numbered(table.name(), key.value())
                    .map(|record_key| (record_key, value.value().to_vec())),
            );
        }
    }
    for table in NAMED {
        for entry in transaction.open_table(table)?.iter()? {
            let (key, value) = entry?;
            all.extend(
                RecordKey::named(table.name(), key.value())
                    .map(|record_key| (record_key, value.value().to_vec())),
            );
        }
    }
    for entry in transaction.open_table(RUNS)?.iter()? {
        let (key, value) = entry?;
        all.push((RecordKey::Run(key.value()), value.value().to_vec()));
    }
    for (record_key, mut bytes) in all {
        if has_line(&bytes) {
            continue;
        }
        if let RecordKey::Session(number) = record_key {
            bytes = with_runs(&bytes, &run_keys(transaction, number)?);
        }
        record_key.set(transaction, Some(&encode(&record_key, 1, &bytes)))?;
    }
    Ok(())
}

/// Adds the numbers of runs to a session; a value that is not a session is unchanged.
fn with_runs(session: &[u8], runs: &[RunKey]) -> Vec<u8> {
    let Ok(saved) = serde_json::from_slice::<SavedSession>(session) else { return session.to_vec() };
    let count = |target: usize| runs.iter().filter(|(_, of, _)| *of == target as u64).count();
    let counts: Vec<usize> = (0..saved.targets.len()).map(count).collect();
    serde_json::to_vec(&(saved, counts)).unwrap_or_else(|_| session.to_vec())
}

impl Store {
    /// Imports the JSON files of an earlier version, one per session, and renames them.
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
                Err(Damaged(why)) => {
                    move_aside(&path, &id_of(number), "damaged", &format!("cannot be read ({why})"))
                }
            };
            self.messages.push(message);
        }
        self.write(|write| raise_last_session(write, last))
    }

    fn has(&self, number: u64) -> Result<bool> {
        use redb::ReadableDatabase as _;
        self.disk.read(|database| {
            let table = database.begin_read()?.open_table(SESSIONS)?;
            Ok(table.get(number)?.is_some())
        })
    }
}

fn read(path: &Path, id: &str) -> std::result::Result<SavedSession, Damaged> {
    let bytes = std::fs::read(path).map_err(|error| Damaged(error.to_string()))?;
    let saved: SavedSession = serde_json::from_slice(&bytes).map_err(|error| Damaged(error.to_string()))?;
    if saved.id == id {
        Ok(saved)
    } else {
        Err(Damaged(format!("it holds session {}", crate::printable::printable(&saved.id))))
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

/// A free name in `folder`: `name.ending`, `name.ending-2` and so on.
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

/// Converts an error of opening the database read-only.
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
