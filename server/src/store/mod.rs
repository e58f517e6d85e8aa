//! What survives the server: sessions with their runs, cursors and notes, studies, questions, and small documents, in one
//! embedded database (`redb`), a file in the folder of sessions.
//!
//! ```text
//! meta       name → number                      `version` of this form, `last_session`, `sequence` of the last transaction
//! sessions   number → [SavedSession, numbers of runs]    without runs and cursor
//! runs       (session, target, run) → SavedRun
//! cursors    number → Cursor                    at most `CURSOR_PERIOD` late
//! notes      number → Notes
//! studies    number → what was ordered and how it stands
//! questions  session/target/run/step → Question
//! documents  name → Document
//! used       number → when it was changed or stepped through last, RFC 3339    as late as cursors
//! drives     folder → scenario of a simulated drive that was opened from a page, as TOML
//! removed    place → number of the transaction that removed it
//! ```
//! Values are JSON, in which numbers come back bit for bit, with a line that verifies them (`record.rs`). Everything but
//! cursors and times of use is on disk before the request is answered, in one transaction: a server that is killed, or a
//! power loss, leaves the last transaction whole. Cursors are gathered, because one moves with every key, and written
//! `CURSOR_PERIOD` after the first move at the latest; an orderly end writes them. A write that fails leaves nothing, and
//! the next one is tried again (`disk.rs`). A damaged file is moved aside, never removed, and what can be verified in it is
//! taken over (`salvage.rs`); so is a session that cannot be read.

mod cursors;
mod disk;
mod open;
#[cfg(test)]
mod power_storage;
#[cfg(test)]
mod power_tests;
mod read;
mod record;
mod salvage;
mod small;
#[cfg(test)]
mod tests;

use std::path::Path;
use std::sync::Arc;

use redb::{ReadableTable, TableDefinition};
use sightline_geometry::error::{Error, Result};
use sightline_session::Cursor;
use sightline_session::notes::Notes;
use sightline_session::view::SavedSession;

use cursors::Waiting;
use disk::{Disk, Outcome, Write};
pub(crate) use read::{Found, read_only};
use record::{Place, run_keys};
pub(crate) use small::Clash;

/// The version of the database that this code writes; it reads earlier ones, too.
pub(crate) const STORE_VERSION: u64 = 2;

/// The name of the database in its folder.
pub(crate) const FILE_NAME: &str = "sessions.redb";

const META: TableDefinition<'_, &str, u64> = TableDefinition::new("meta");

/// The entry of [`META`] with the largest number that a session ever had.
const LAST_SESSION: &str = "last_session";

/// The database.
pub struct Store {
    disk: Arc<Disk>,
    waiting: Waiting,
    messages: Vec<String>,
}

impl Store {
    /// The database in `folder`, which is made where it is missing; what an earlier version kept in JSON files is read in.
    ///
    /// # Errors
    /// [`Error::Write`] when it cannot be made; [`Error::Request`] when another program has it or a newer one wrote it.
    pub fn open(folder: &Path) -> Result<Self> {
        let (disk, messages) = open::open(folder)?;
        let mut store = Self::on(disk, messages)?;
        store.read_in_files(folder)?;
        Ok(store)
    }

    /// The store on an open database.
    fn on(disk: Disk, messages: Vec<String>) -> Result<Self> {
        let disk = Arc::new(disk);
        let waiting = Waiting::start(Arc::clone(&disk))?;
        Ok(Self { disk, waiting, messages })
    }

    /// Why changes cannot be saved now, one sentence; none after one was saved.
    pub(crate) fn trouble(&self) -> Option<String> {
        self.disk.trouble()
    }

    /// Carries out one transaction; where it fails, writing is tried again in the background until it works.
    fn write(&self, work: impl FnOnce(&Write) -> Outcome<()>) -> Result<()> {
        self.disk.write(work).inspect_err(|_| self.waiting.wake())
    }

    /// Writes a session with its runs and its cursor, without its notes.
    ///
    /// # Errors
    /// [`Error::Write`]; the database is then as it was.
    pub fn save(&self, session: &SavedSession) -> Result<()> {
        self.save_with(session, None)
    }

    /// Writes a session, and its notes if there are any to be written, both or nothing.
    ///
    /// # Errors
    /// [`Error::Write`]; the database is then as it was.
    pub(crate) fn save_with(&self, session: &SavedSession, notes: Option<&Notes>) -> Result<()> {
        let number = number_of(&session.id).ok_or_else(|| {
            Error::Request(format!("{} is no name of a session", crate::printable::printable(&session.id)))
        })?;
        self.write(|write| {
            put_session(write, number, session)?;
            if let Some(notes) = notes {
                write.put(Place::Notes(number), notes)?;
            }
            raise_last_session(write, number)
        })?;
        // One that moved since is written soon.
        self.waiting.forget_if(&Place::Cursor(number), &session.cursor);
        Ok(())
    }

    /// Remembers where a session's cursor is; it is written soon.
    pub fn move_cursor(&self, session: &str, cursor: Cursor) {
        if let Some(number) = number_of(session) {
            self.waiting.set(Place::Cursor(number), &cursor);
        }
    }

    /// Remembers when a session was used last; it is written soon.
    pub fn touch(&self, session: &str, now: String) {
        if let Some(number) = number_of(session) {
            self.waiting.set(Place::Used(number), &now);
        }
    }

    /// Writes what is remembered only.
    ///
    /// # Errors
    /// [`Error::Write`]; it is then remembered still.
    pub fn flush(&self) -> Result<()> {
        self.waiting.flush(&self.disk)
    }

    /// Writes the notes of a session.
    ///
    /// # Errors
    /// [`Error::Write`]; the database is then as it was.
    pub(crate) fn save_notes(&self, session: &str, notes: &Notes) -> Result<()> {
        let Some(number) = number_of(session) else { return Ok(()) };
        self.write(|write| write.put(Place::Notes(number), notes).map(|_| ()))
    }

    /// Takes a session with all that belongs to it out of the database.
    ///
    /// # Errors
    /// [`Error::Write`]; the database is then as it was.
    pub(crate) fn remove(&self, session: &str) -> Result<()> {
        let Some(number) = number_of(session) else { return Ok(()) };
        self.write(|write| forget(write, number))?;
        self.waiting.forget_session(number);
        Ok(())
    }

    /// Reads everything; sessions that cannot be read are moved aside.
    ///
    /// # Errors
    /// [`Error::Read`] when the database cannot be read.
    pub fn load(&self) -> Result<Found> {
        let mut found = self.disk.read(read::read)?;
        for (id, why) in std::mem::take(&mut found.damaged) {
            found.messages.push(self.set_aside(&id, &why));
        }
        found.messages.splice(0..0, self.messages.iter().cloned());
        Ok(found)
    }

    /// Moves a session aside, into a file, that cannot be worked on any more; says what happened.
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
    write.put(Place::Cursor(number), &session.cursor)?;
    for (target, record) in session.targets.iter().enumerate() {
        for (run, saved) in record.runs.iter().enumerate() {
            write.put(Place::Run((number, target as u64, run as u64)), saved)?;
        }
    }
    for (session_number, target, run) in run_keys(&write.transaction, number)? {
        let record = session.targets.get(target as usize);
        if record.is_none_or(|record| run as usize >= record.runs.len()) {
            write.remove(&Place::Run((session_number, target, run)))?;
        }
    }
    let runs: Vec<usize> = session.targets.iter().map(|target| target.runs.len()).collect();
    let mut head = session.clone();
    head.cursor = Cursor::default();
    head.targets.iter_mut().for_each(|target| target.runs.clear());
    write.put(Place::Session(number), &(head, runs))?;
    Ok(())
}

/// Remembers the largest number that a session ever had.
fn raise_last_session(write: &Write, number: u64) -> Outcome<()> {
    let last = write.transaction.open_table(META)?.get(LAST_SESSION)?.map_or(0, |value| value.value());
    if last < number { write.put_meta(LAST_SESSION, number) } else { Ok(()) }
}

/// Takes a session out of every table.
fn forget(write: &Write, number: u64) -> Outcome<()> {
    for place in [Place::Cursor(number), Place::Notes(number), Place::Used(number)] {
        write.remove(&place)?;
    }
    for key in run_keys(&write.transaction, number)? {
        write.remove(&Place::Run(key))?;
    }
    small::forget_questions(write, &format!("{}/", id_of(number)))?;
    write.remove_for_good(&Place::Session(number))?;
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
