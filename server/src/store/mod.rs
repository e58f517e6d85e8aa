//! Persistent storage of the server: sessions with their runs, cursors and notes, studies, questions, and small documents,
//! in one embedded database (`redb`), a file in the folder of sessions.
//!
//! ```text
//! meta       name → number                      `version` of the format, `last_session`, `sequence` of the last transaction
//! sessions   number → [SavedSession, numbers of runs]    without runs and cursor
//! runs       (session, target, run) → SavedRun
//! cursors    number → Cursor                    at most `CURSOR_PERIOD` late
//! notes      number → Notes
//! studies    number → request, state and results
//! questions  session/target/run/step → Question
//! documents  name → Document
//! used       number → time of the last change or cursor movement, RFC 3339    deferred like cursors
//! drives     folder → scenario of a simulated drive opened from a page, as TOML
//! removed    place → number of the transaction that removed it
//! ```
//! Values are JSON, in which numbers are restored bit for bit, followed by a line that verifies them (`record.rs`).
//! Everything except cursors and times of use is on disk before the request is answered, in one transaction: after a crash
//! or a power loss, the last transaction is complete. Cursors are collected, because one moves with every key, and written
//! at most `CURSOR_PERIOD` after the first move; an orderly shutdown writes them. A failed write has no effect, and the next
//! one is attempted again (`disk.rs`). A damaged file is moved aside, never removed, and its verifiable records are
//! recovered (`salvage.rs`); an unreadable session is also moved aside.

mod deferred_writes;
mod disk;
mod open;
#[cfg(test)]
mod power_storage;
#[cfg(test)]
mod power_tests;
mod read;
mod record;
mod salvage;
mod small_records;
#[cfg(test)]
mod tests;

use std::path::Path;
use std::sync::Arc;

use redb::{ReadableTable, TableDefinition};
use sightline_geometry::error::{Error, Result};
use sightline_session::Cursor;
use sightline_session::notes::Notes;
use sightline_session::view::SavedSession;

use deferred_writes::DeferredWrites;
use disk::{Disk, Outcome, Write};
pub(crate) use read::{Found, read_only};
use record::{RecordKey, run_keys};
pub(crate) use small_records::Clash;

/// The database version written by this code; it can also read earlier versions.
pub(crate) const STORE_VERSION: u64 = 2;

/// The file name of the database.
pub(crate) const FILE_NAME: &str = "sessions.redb";

const META: TableDefinition<'_, &str, u64> = TableDefinition::new("meta");

/// The entry of [`META`] with the largest session number so far.
const LAST_SESSION: &str = "last_session";

/// The database.
pub struct Store {
    disk: Arc<Disk>,
    deferred: DeferredWrites,
    messages: Vec<String>,
}

impl Store {
    /// Opens the database in `folder`, or creates it; imports JSON files of an earlier version.
    ///
    /// # Errors
    /// [`Error::Write`] if it cannot be created; [`Error::Request`] if another program uses it or a newer version wrote it.
    pub fn open(folder: &Path) -> Result<Self> {
        let (disk, messages) = open::open(folder)?;
        let mut store = Self::on(disk, messages)?;
        store.read_in_files(folder)?;
        Ok(store)
    }

    /// The store on an open database.
    fn on(disk: Disk, messages: Vec<String>) -> Result<Self> {
        let disk = Arc::new(disk);
        let deferred = DeferredWrites::start(Arc::clone(&disk))?;
        Ok(Self { disk, deferred, messages })
    }

    /// Why changes cannot be saved, as one sentence; `None` after a successful write.
    pub(crate) fn trouble(&self) -> Option<String> {
        self.disk.trouble()
    }

    /// Performs one transaction; if it fails, the background thread tries to write again until it succeeds.
    fn write(&self, work: impl FnOnce(&Write) -> Outcome<()>) -> Result<()> {
        self.disk.write(work).inspect_err(|_| self.deferred.wake())
    }

    /// Writes a session with its runs and its cursor, without its notes.
    ///
    /// # Errors
    /// [`Error::Write`]; the database is then unchanged.
    pub fn save(&self, session: &SavedSession) -> Result<()> {
        self.save_with(session, None)
    }

    /// Writes a session, and its notes if given, in one transaction.
    ///
    /// # Errors
    /// [`Error::Write`]; the database is then unchanged.
    pub(crate) fn save_with(&self, session: &SavedSession, notes: Option<&Notes>) -> Result<()> {
        let number = number_of(&session.id).ok_or_else(|| {
            Error::Request(format!("{} is no name of a session", crate::printable::printable(&session.id)))
        })?;
        self.write(|write| {
            put_session(write, number, session)?;
            if let Some(notes) = notes {
                write.put(RecordKey::Notes(number), notes)?;
            }
            raise_last_session(write, number)
        })?;
        // A cursor that has moved since is written later.
        self.deferred.forget_if(&RecordKey::Cursor(number), &session.cursor);
        Ok(())
    }

    /// Sets the cursor of a session, with a deferred write.
    pub fn move_cursor(&self, session: &str, cursor: Cursor) {
        if let Some(number) = number_of(session) {
            self.deferred.set(RecordKey::Cursor(number), &cursor);
        }
    }

    /// Sets the time of last use of a session, with a deferred write.
    pub fn touch(&self, session: &str, now: String) {
        if let Some(number) = number_of(session) {
            self.deferred.set(RecordKey::Used(number), &now);
        }
    }

    /// Writes the pending records.
    ///
    /// # Errors
    /// [`Error::Write`]; the records then remain pending.
    pub fn flush(&self) -> Result<()> {
        self.deferred.flush(&self.disk)
    }

    /// Writes the notes of a session.
    ///
    /// # Errors
    /// [`Error::Write`]; the database is then unchanged.
    pub(crate) fn save_notes(&self, session: &str, notes: &Notes) -> Result<()> {
        let Some(number) = number_of(session) else { return Ok(()) };
        self.write(|write| write.put(RecordKey::Notes(number), notes).map(|_| ()))
    }

    /// Removes a session with all its records from the database.
    ///
    /// # Errors
    /// [`Error::Write`]; the database is then unchanged.
    pub(crate) fn remove(&self, session: &str) -> Result<()> {
        let Some(number) = number_of(session) else { return Ok(()) };
        self.write(|write| forget(write, number))?;
        self.deferred.forget_session(number);
        Ok(())
    }

    /// Loads everything; unreadable sessions are moved aside.
    ///
    /// # Errors
    /// [`Error::Read`] if the database cannot be read.
    pub fn load(&self) -> Result<Found> {
        let mut found = self.disk.read(read::read)?;
        for (id, why) in std::mem::take(&mut found.damaged) {
            found.messages.push(self.set_aside(&id, &why));
        }
        found.messages.splice(0..0, self.messages.iter().cloned());
        Ok(found)
    }

    /// Moves an unusable session into a file; returns a sentence about the result.
    pub(crate) fn set_aside(&self, id: &str, why: &str) -> String {
        let folder = self.disk.path.parent().unwrap_or(Path::new("."));
        let moved = number_of(id).ok_or_else(|| "it has no number".to_owned()).and_then(|number| {
            let to = open::free_name(folder, id, "damaged");
            let text = self.disk.read(|database| read::raw(database, number));
            let text = text.map_err(|error| error.to_string())?;
            sightline_recordings::files::write_atomically(&to, text.as_bytes())
                .map_err(|error| error.to_string())?;
            self.write(|write| forget(write, number)).map_err(|error| error.to_string())?;
            Ok(to)
        });
        match moved {
            Ok(to) => format!("session {id} cannot be read ({why}); it was moved to {}", to.display()),
            Err(error) => format!("session {id} cannot be read ({why}) and not be moved aside ({error})"),
        }
    }
}

/// Writes a session with its runs and its cursor.
fn put_session(write: &Write, number: u64, session: &SavedSession) -> Outcome<()> {
    write.put(RecordKey::Cursor(number), &session.cursor)?;
    for (target, record) in session.targets.iter().enumerate() {
        for (run, saved) in record.runs.iter().enumerate() {
            write.put(RecordKey::Run((number, target as u64, run as u64)), saved)?;
        }
    }
    for (session_number, target, run) in run_keys(&write.transaction, number)? {
        let record = session.targets.get(target as usize);
        if record.is_none_or(|record| run as usize >= record.runs.len()) {
            write.remove(&RecordKey::Run((session_number, target, run)))?;
        }
    }
    let runs: Vec<usize> = session.targets.iter().map(|target| target.runs.len()).collect();
    let mut head = session.clone();
    head.cursor = Cursor::default();
    head.targets.iter_mut().for_each(|target| target.runs.clear());
    write.put(RecordKey::Session(number), &(head, runs))?;
    Ok(())
}

/// Raises the stored largest session number to `number`.
fn raise_last_session(write: &Write, number: u64) -> Outcome<()> {
    let last = write.transaction.open_table(META)?.get(LAST_SESSION)?.map_or(0, |value| value.value());
    if last < number { write.put_meta(LAST_SESSION, number) } else { Ok(()) }
}

/// Removes a session from every table.
fn forget(write: &Write, number: u64) -> Outcome<()> {
    for record_key in [RecordKey::Cursor(number), RecordKey::Notes(number), RecordKey::Used(number)] {
        write.remove(&record_key)?;
    }
    for key in run_keys(&write.transaction, number)? {
        write.remove(&RecordKey::Run(key))?;
    }
    small_records::forget_questions(write, &format!("{}/", id_of(number)))?;
    write.remove_for_good(&RecordKey::Session(number))?;
    Ok(())
}

/// The name of the session with this number.
pub(crate) fn id_of(number: u64) -> String {
    format!("s{number}")
}

/// The number of a session's name.
pub(crate) fn number_of(id: &str) -> Option<u64> {
    let number = id.strip_prefix('s')?.parse().ok()?;
    (id == id_of(number)).then_some(number)
}
