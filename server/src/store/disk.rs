//! The open database: reading, and writing so that a failure leaves nothing behind.
//!
//! After a failed read or write the library refuses all work until the file is opened again, so that is what happens. A
//! transaction that failed while it was committed may be on disk or not; the number of the last transaction in the file
//! tells, and one that is there although it was refused is undone before anything else is written.

use std::cell::{Cell, RefCell};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError, RwLock};

use redb::{Database, DatabaseError, ReadableDatabase, WriteTransaction};
use serde::Serialize;
use sightline_geometry::error::{Error, Result};

use super::META;
use super::record::{Place, decode, encode};
use crate::jobs::lock;
use crate::printable::printable;

/// The entry of [`META`] with the number of the last transaction.
pub(super) const SEQUENCE: &str = "sequence";
/// What the numbers of transactions skip at each start, so that one that was cut off shares its number with no other one.
const SEQUENCE_GAP: u64 = 1 << 20;
/// Bytes that are written to find out whether writing works again: as many as a long note.
const PROBE_BYTES: usize = 64 << 10;

/// What opens the database: the file of a server, or in tests a storage that fails.
pub(super) type Opener = Box<dyn Fn() -> std::result::Result<Database, DatabaseError> + Send + Sync>;

/// A result of the library.
pub(super) type Outcome<T> = std::result::Result<T, redb::Error>;

/// The open database.
pub(super) struct Disk {
    pub(super) path: PathBuf,
    opener: Opener,
    /// None after a failure, until it is opened again.
    database: RwLock<Option<Database>>,
    writing: Mutex<Writing>,
    trouble: Mutex<Option<String>>,
}

/// What only one writer at a time may use.
struct Writing {
    /// The number of the next transaction.
    next: u64,
    /// The transaction that failed last, if it may be on disk, with what undoes it.
    in_doubt: Option<(u64, Vec<Earlier>)>,
}

/// What was at a place before a transaction.
type Earlier = (Place, Option<Vec<u8>>);

impl Disk {
    /// A database that is open, and what opens it again.
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

    /// Why changes cannot be saved now; none after one was saved.
    pub(super) fn trouble(&self) -> Option<String> {
        lock(&self.trouble).clone()
    }

    /// Reads.
    ///
    /// # Errors
    /// [`Error::Read`].
    pub(super) fn read<T>(&self, work: impl FnOnce(&Database) -> Outcome<T>) -> Result<T> {
        if self.shared().is_none() {
            let ready = self.ready(&mut lock(&self.writing));
            // A refused change that cannot be undone now is no reason to read nothing.
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

    /// Carries out one transaction, which is dropped unless `work` changed something.
    ///
    /// # Errors
    /// [`Error::Write`]; nothing of it is kept.
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

    /// Finds out, while saving fails, whether it works again, by writing what nobody needs.
    pub(super) fn probe_in_trouble(&self) -> Result<()> {
        if self.trouble().is_none() {
            return Ok(());
        }
        let place = Place::Removed("probe".to_owned());
        self.write(|write| write.put(place.clone(), &"x".repeat(PROBE_BYTES)).map(|_| ()))?;
        self.write(|write| write.remove(&place).map(|_| ()))
    }

    /// One transaction; whether it changed something.
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
            // Where this fails, too, the next one tries again; the first error is the one to report.
            let _ = self.ready(writing);
        }
        outcome
    }

    /// Opens the database where it is closed, and undoes what was refused but is on disk.
    fn ready(&self, writing: &mut Writing) -> Outcome<()> {
        if self.shared().is_none() {
            // The library panics at some damage.
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
    // A page of the last transaction that is damaged later is then told from one that was never written.
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

/// Writes what was there before a transaction. The records get new numbers, so that they count as the newest.
fn undo(database: &Database, sequence: u64, earlier: &[Earlier]) -> Outcome<()> {
    let mut transaction = database.begin_write()?;
    transaction.set_two_phase_commit(true);
    for (place, bytes) in earlier.iter().rev() {
        let json = bytes.as_ref().map(|bytes| decode(place, bytes).unwrap_or(bytes));
        place.set(&transaction, json.map(|json| encode(place, sequence, json)).as_deref())?;
    }
    transaction.open_table(META)?.insert(SEQUENCE, sequence)?;
    Ok(transaction.commit()?)
}

/// The number of the last transaction of a database.
fn last_sequence(database: &Database) -> Outcome<u64> {
    let meta = database.begin_read()?.open_table(META)?;
    Ok(meta.get(SEQUENCE)?.map_or(0, |value| value.value()))
}

/// Whether an error means that the database has to be opened again.
fn is_of_the_storage(error: &redb::Error) -> bool {
    matches!(error, redb::Error::Io(_) | redb::Error::PreviousIo | redb::Error::DatabaseClosed)
}

pub(super) fn io_error(error: redb::Error) -> std::io::Error {
    match error {
        redb::Error::Io(source) => source,
        other => std::io::Error::other(other),
    }
}

/// A transaction that writes.
pub(super) struct Write {
    pub(super) transaction: WriteTransaction,
    sequence: u64,
    earlier: RefCell<Vec<Earlier>>,
    is_changed: Cell<bool>,
}

impl Write {
    /// A number of [`META`]; it is not undone.
    pub(super) fn put_meta(&self, name: &str, value: u64) -> Outcome<()> {
        self.transaction.open_table(META)?.insert(name, value)?;
        self.is_changed.set(true);
        Ok(())
    }

    /// Writes a value where it differs from what is there; whether it did.
    pub(super) fn put(&self, place: Place, value: &impl Serialize) -> Outcome<bool> {
        let json = serde_json::to_vec(value).map_err(|error| redb::Error::Corrupted(error.to_string()))?;
        self.put_json(place, &json)
    }

    /// As [`Self::put`], for a value that is JSON already.
    pub(super) fn put_json(&self, place: Place, json: &[u8]) -> Outcome<bool> {
        let before = place.get(&self.transaction)?;
        if before.as_ref().is_some_and(|bytes| decode(&place, bytes) == Ok(json)) {
            return Ok(false);
        }
        place.set(&self.transaction, Some(&encode(&place, self.sequence, json)))?;
        self.note(place, before);
        Ok(true)
    }

    /// The JSON text at a place, unless it was altered.
    pub(super) fn get(&self, place: &Place) -> Outcome<Option<Vec<u8>>> {
        let bytes = place.get(&self.transaction)?;
        Ok(bytes.and_then(|bytes| decode(place, &bytes).ok().map(<[u8]>::to_vec)))
    }

    /// Removes what is at a place; whether it was there.
    pub(super) fn remove(&self, place: &Place) -> Outcome<bool> {
        let Some(before) = place.get(&self.transaction)? else { return Ok(false) };
        place.set(&self.transaction, None)?;
        self.note(place.clone(), Some(before));
        Ok(true)
    }

    fn note(&self, place: Place, before: Option<Vec<u8>>) {
        self.earlier.borrow_mut().push((place, before));
        self.is_changed.set(true);
    }

    /// As [`Self::remove`], and records the removal, so that an older copy in a damaged file is not taken for the present.
    pub(super) fn remove_for_good(&self, place: &Place) -> Outcome<bool> {
        if !self.remove(place)? {
            return Ok(false);
        }
        self.put(Place::Removed(place.to_string()), &self.sequence)
    }
}
