//! The open database: reads, and writes without partial effects.
//!
//! After a failed read or write, redb refuses all work until the file is reopened, which happens here. A transaction that
//! failed during its commit may be on disk or not. The number of the last transaction in the file decides; if a failed
//! transaction is on disk, it is undone before anything else is written.

use std::cell::{Cell, RefCell};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError, RwLock};

use redb::{Database, DatabaseError, ReadableDatabase, WriteTransaction};
use serde::Serialize;
use sightline_geometry::error::{Error, Result};

use super::META;
use super::record::{RecordKey, decode, encode};
use crate::jobs::lock;
use crate::printable::printable;

/// The entry of [`META`] with the number of the last transaction.
pub(super) const SEQUENCE: &str = "sequence";
/// Gap in the transaction numbers at each start, so that the number of an interrupted transaction is never reused.
const SEQUENCE_GAP: u64 = 1 << 20;
/// Size of a test write after a failure, bytes: as large as a long note.
const PROBE_BYTES: usize = 64 << 10;

/// Opens the database: the file of a server, or in tests a storage that fails.
pub(super) type Opener = Box<dyn Fn() -> std::result::Result<Database, DatabaseError> + Send + Sync>;

/// A result of redb.
pub(super) type Outcome<T> = std::result::Result<T, redb::Error>;

/// The open database.
pub(super) struct Disk {
    pub(super) path: PathBuf,
    opener: Opener,
    /// `None` after a failure, until it is reopened.
    database: RwLock<Option<Database>>,
    writing: Mutex<Writing>,
    trouble: Mutex<Option<String>>,
}

/// State of the single writer.
struct Writing {
    /// The number of the next transaction.
    next: u64,
    /// The last failed transaction, if it may be on disk, with the values that undo it.
    in_doubt: Option<(u64, Vec<Earlier>)>,
}

/// The value at a place before a transaction.
type Earlier = (RecordKey, Option<Vec<u8>>);

impl Disk {
    /// An open database, with the function that reopens it.
    pub(super) fn new(path: PathBuf, database: Database, opener: Opener) -> Outcome<Self> {
        let next = last_sequence(&database)? + SEQUENCE_GAP;
        Ok(Self {
            path,
            opener,
            database: RwLock::new(Some(database)),
            writing: Mutex::new(Writing { next, in_doubt: None }),
            trouble: Mutex::default(),
        })
    }

    /// Why changes cannot be saved; `None` after a successful write.
    pub(super) fn trouble(&self) -> Option<String> {
        lock(&self.trouble).clone()
    }

    /// Reads from the database, which is reopened after a failure.
    ///
    /// # Errors
    /// [`Error::Read`].
    pub(super) fn read<T>(&self, work: impl FnOnce(&Database) -> Outcome<T>) -> Result<T> {
        if self.shared().is_none() {
            let ready = self.ready(&mut lock(&self.writing));
            // Reading is possible even if a failed change cannot be undone.
            if self.shared().is_none() {
                ready.map_err(|error| self.failed(error))?;
            }
        }
        let outcome = match self.shared().as_ref() {
            Some(database) => work(database),
            None => Err(redb::Error::PreviousIo),
        };
        outcome.map_err(|error| {
            if is_of_the_storage(&error) {
                let _writing = lock(&self.writing);
                self.close();
            }
            self.failed(error)
        })
    }

    /// Performs one transaction, which is aborted if `work` changes nothing.
    ///
    /// # Errors
    /// [`Error::Write`]; the transaction then has no effect.
    pub(super) fn write(&self, work: impl FnOnce(&Write) -> Outcome<()>) -> Result<()> {
        let outcome = self.attempt(&mut lock(&self.writing), work);
        let mut trouble = lock(&self.trouble);
        match outcome {
            Ok(true) => {
                if trouble.take().is_some() {
                    tracing::info!("changes are saved again");
                }
                Ok(())
            }
            Ok(false) => Ok(()),
            Err(error) => {
                let why = printable(&error.to_string());
                if trouble.is_none() {
                    tracing::error!("changes are not saved: {why}");
                }
                *trouble = Some(format!(
                    "changes cannot be saved in {} ({why}); they are refused until there is room on the disk and the \
                     folder can be written. Cursors are remembered and saved then",
                    self.path.display()
                ));
                Err(Error::Write { path: self.path.clone(), source: io_error(error) })
            }
        }
    }

    /// Tests whether saving works again after a failure, by writing test data.
    pub(super) fn probe_in_trouble(&self) -> Result<()> {
        if self.trouble().is_none() {
            return Ok(());
        }
        let record_key = RecordKey::Removed("probe".to_owned());
        self.write(|write| write.put(record_key.clone(), &"x".repeat(PROBE_BYTES)).map(|_| ()))?;
        self.write(|write| write.remove(&record_key).map(|_| ()))
    }

    /// Performs one transaction; returns whether it changed anything.
    fn attempt(&self, writing: &mut Writing, work: impl FnOnce(&Write) -> Outcome<()>) -> Outcome<bool> {
        self.ready(writing)?;
        let sequence = writing.next;
        writing.next += 1;
        let mut earlier = Vec::new();
        let outcome = match self.shared().as_ref() {
            Some(database) => carry_out(database, sequence, &mut earlier, work),
            None => Err(redb::Error::PreviousIo),
        };
        if outcome.is_err() {
            writing.in_doubt = Some((sequence, earlier));
            self.close();
            // If this fails, too, the next operation tries again; the first error is reported.
            let _ = self.ready(writing);
        }
        outcome
    }

    /// Reopens the database if it is closed, and undoes a failed transaction that is on disk.
    fn ready(&self, writing: &mut Writing) -> Outcome<()> {
        if self.shared().is_none() {
            // redb panics at some kinds of damage.
            let opened = catch_unwind(AssertUnwindSafe(&self.opener));
            let opened =
                opened.map_err(|_| redb::Error::Corrupted("it cannot be opened again".to_owned()))?;
            *self.database.write().unwrap_or_else(PoisonError::into_inner) = Some(opened?);
        }
        let Some((sequence, earlier)) = &writing.in_doubt else { return Ok(()) };
        let undone = {
            let shared = self.shared();
            let Some(database) = shared.as_ref() else { return Ok(()) };
            let number = writing.next;
            match last_sequence(database) {
                Ok(last) if last == *sequence => undo(database, number, earlier),
                Ok(_) => Ok(()),
                Err(error) => Err(error),
            }
        };
        writing.next += 1;
        match undone {
            Ok(()) => writing.in_doubt = None,
            Err(error) => {
                self.close();
                return Err(error);
            }
        }
        Ok(())
    }

    fn shared(&self) -> std::sync::RwLockReadGuard<'_, Option<Database>> {
        self.database.read().unwrap_or_else(PoisonError::into_inner)
    }

    fn close(&self) {
        *self.database.write().unwrap_or_else(PoisonError::into_inner) = None;
    }

    fn failed(&self, error: redb::Error) -> Error {
        Error::Read { path: self.path.clone(), source: io_error(error) }
    }
}

fn carry_out(
    database: &Database,
    sequence: u64,
    earlier: &mut Vec<Earlier>,
    work: impl FnOnce(&Write) -> Outcome<()>,
) -> Outcome<bool> {
    let mut transaction = database.begin_write()?;
    // Later, a damaged page of the last transaction can then be distinguished from one that was never written.
    transaction.set_two_phase_commit(true);
    let write = Write { transaction, sequence, earlier: RefCell::default(), is_changed: Cell::new(false) };
    let worked = work(&write);
    let Write { transaction, earlier: before, is_changed, .. } = write;
    *earlier = before.into_inner();
    worked?;
    if !is_changed.get() {
        transaction.abort()?;
        return Ok(false);
    }
    transaction.open_table(META)?.insert(SEQUENCE, sequence)?;
    transaction.commit()?;
    Ok(true)
}

/// Restores the values before a transaction. The records get new numbers, so that they count as the newest.
fn undo(database: &Database, sequence: u64, earlier: &[Earlier]) -> Outcome<()> {
    let mut transaction = database.begin_write()?;
    transaction.set_two_phase_commit(true);
    for (record_key, bytes) in earlier.iter().rev() {
        let json = bytes.as_ref().map(|bytes| decode(record_key, bytes).unwrap_or(bytes));
        record_key.set(&transaction, json.map(|json| encode(record_key, sequence, json)).as_deref())?;
    }
    transaction.open_table(META)?.insert(SEQUENCE, sequence)?;
    Ok(transaction.commit()?)
}

/// The number of the last transaction of a database.
fn last_sequence(database: &Database) -> Outcome<u64> {
    let meta = database.begin_read()?.open_table(META)?;
    Ok(meta.get(SEQUENCE)?.map_or(0, |value| value.value()))
}

/// Whether an error requires the database to be reopened.
fn is_of_the_storage(error: &redb::Error) -> bool {
    matches!(error, redb::Error::Io(_) | redb::Error::PreviousIo | redb::Error::DatabaseClosed)
}

pub(super) fn io_error(error: redb::Error) -> std::io::Error {
    match error {
        redb::Error::Io(source) => source,
        other => std::io::Error::other(other),
    }
}

/// A write transaction.
pub(super) struct Write {
    pub(super) transaction: WriteTransaction,
    sequence: u64,
    earlier: RefCell<Vec<Earlier>>,
    is_changed: Cell<bool>,
}

impl Write {
    /// Sets a number in [`META`]; it is not undone.
    pub(super) fn put_meta(&self, name: &str, value: u64) -> Outcome<()> {
        self.transaction.open_table(META)?.insert(name, value)?;
        self.is_changed.set(true);
        Ok(())
    }

    /// Writes a value if it differs from the stored one; returns whether it did.
    pub(super) fn put(&self, record_key: RecordKey, value: &impl Serialize) -> Outcome<bool> {
        let json = serde_json::to_vec(value).map_err(|error| redb::Error::Corrupted(error.to_string()))?;
        self.put_json(record_key, &json)
    }

    /// As [`Self::put`], for a value that is already JSON.
    pub(super) fn put_json(&self, record_key: RecordKey, json: &[u8]) -> Outcome<bool> {
        let before = record_key.get(&self.transaction)?;
        if before.as_ref().is_some_and(|bytes| decode(&record_key, bytes) == Ok(json)) {
            return Ok(false);
        }
        record_key.set(&self.transaction, Some(&encode(&record_key, self.sequence, json)))?;
        self.note(record_key, before);
        Ok(true)
    }

    /// The JSON text at a place, if it is not corrupted.
    pub(super) fn get(&self, record_key: &RecordKey) -> Outcome<Option<Vec<u8>>> {
        let bytes = record_key.get(&self.transaction)?;
        Ok(bytes.and_then(|bytes| decode(record_key, &bytes).ok().map(<[u8]>::to_vec)))
    }

    /// Removes the value at a place; returns whether there was one.
    pub(super) fn remove(&self, record_key: &RecordKey) -> Outcome<bool> {
        let Some(before) = record_key.get(&self.transaction)? else { return Ok(false) };
        record_key.set(&self.transaction, None)?;
        self.note(record_key.clone(), Some(before));
        Ok(true)
    }

    fn note(&self, record_key: RecordKey, before: Option<Vec<u8>>) {
        self.earlier.borrow_mut().push((record_key, before));
        self.is_changed.set(true);
    }

    /// As [`Self::remove`], and records the removal, so that an older copy in a damaged file is not restored.
    pub(super) fn remove_for_good(&self, record_key: &RecordKey) -> Outcome<bool> {
        if !self.remove(record_key)? {
            return Ok(false);
        }
        self.put(RecordKey::Removed(record_key.to_string()), &self.sequence)
    }
}
