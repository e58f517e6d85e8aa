//! What survives the server: sessions with their runs, cursors and notes, studies, and small documents, in one embedded
//! database (`redb`), a file in the folder of sessions.
//!
//! ```text
//! meta       name → number                      `version` of this form, `last_session`
//! sessions   number → SavedSession              without runs and cursor
//! runs       (session, target, run) → SavedRun
//! cursors    number → Cursor                    at most `CURSOR_PERIOD` late
//! notes      number → Notes
//! studies    number → what was ordered and how it stands
//! documents  name → Document
//! used       number → when it was changed or stepped through last, RFC 3339    as late as cursors
//! drives     folder → scenario of a simulated drive that was opened from a page, as TOML
//! ```
//! Values are JSON, in which numbers come back bit for bit. Everything but cursors and times of use is on disk before the request is
//! answered, in one transaction: a server that is killed leaves the last transaction whole. Cursors are gathered, because
//! one moves with every key, and written `CURSOR_PERIOD` after the first move at the latest; an orderly end writes them.
//! A file that is damaged, or a session that cannot be read, is moved aside under a name that says so, never removed.

mod cursors;
mod open;
mod read;
mod small;
#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use redb::{Database, ReadableTable, TableDefinition, WriteTransaction};
use serde::Serialize;
use sightline_geometry::error::{Error, Result};
use sightline_session::Cursor;
use sightline_session::notes::Notes;
use sightline_session::view::SavedSession;

use cursors::Cursors;
pub(crate) use read::{Found, read_only};
pub(crate) use small::Clash;

/// The version of the database that this code reads and writes.
pub(crate) const STORE_VERSION: u64 = 1;

/// The name of the database in its folder.
pub(crate) const FILE_NAME: &str = "sessions.redb";

const META: TableDefinition<'_, &str, u64> = TableDefinition::new("meta");
const SESSIONS: TableDefinition<'_, u64, &[u8]> = TableDefinition::new("sessions");
const RUNS: TableDefinition<'_, RunKey, &[u8]> = TableDefinition::new("runs");
const CURSORS: TableDefinition<'_, u64, &[u8]> = TableDefinition::new("cursors");
const NOTES: TableDefinition<'_, u64, &[u8]> = TableDefinition::new("notes");
const STUDIES: TableDefinition<'_, u64, &[u8]> = TableDefinition::new("studies");
const DOCUMENTS: TableDefinition<'_, &str, &[u8]> = TableDefinition::new("documents");
const USED: TableDefinition<'_, u64, &[u8]> = TableDefinition::new("used");
const DRIVES: TableDefinition<'_, &str, &[u8]> = TableDefinition::new("drives");

/// The entry of [`META`] with the largest number that a session ever had.
const LAST_SESSION: &str = "last_session";

/// Session, target and run by their numbers.
type RunKey = (u64, u64, u64);

/// The database.
pub struct Store {
    disk: Arc<Disk>,
    cursors: Cursors,
    messages: Vec<String>,
}

/// The open file.
struct Disk {
    database: Database,
    path: PathBuf,
}

impl Store {
    /// The database in `folder`, which is made where it is missing; what an earlier version kept in JSON files is read in.
    ///
    /// # Errors
    /// [`Error::Write`] when it cannot be made; [`Error::Request`] when another program has it or a newer one wrote it.
    pub fn open(folder: &Path) -> Result<Self> {
        let (disk, messages) = open::open(folder)?;
        let disk = Arc::new(disk);
        let cursors = Cursors::start(Arc::clone(&disk))?;
        let mut store = Self { disk, cursors, messages };
        store.read_in_files(folder)?;
        Ok(store)
    }

    /// Writes a session with its runs and its cursor, without its notes.
    ///
    /// # Errors
    /// [`Error::Write`]; the database is then as it was.
    pub fn save(&self, session: &SavedSession) -> Result<()> {
        let number = number_of(&session.id).ok_or_else(|| {
            Error::Request(format!("{} is no name of a session", crate::printable::printable(&session.id)))
        })?;
        self.cursors.forget(number);
        self.disk.write(|transaction| {
            let mut is_changed = put(transaction, CURSORS, number, &session.cursor)?;
            is_changed |= put_runs(transaction, number, session)?;
            let mut head = session.clone();
            head.cursor = Cursor::default();
            head.targets.iter_mut().for_each(|target| target.runs.clear());
            is_changed |= put(transaction, SESSIONS, number, &head)?;
            let mut meta = transaction.open_table(META)?;
            let last = meta.get(LAST_SESSION)?.map_or(0, |value| value.value());
            if last < number {
                meta.insert(LAST_SESSION, number)?;
            }
            Ok(is_changed || last < number)
        })
    }

    /// Remembers where a session's cursor is; it is written soon.
    pub fn move_cursor(&self, session: &str, cursor: Cursor) {
        if let Some(number) = number_of(session) {
            self.cursors.set(number, cursor);
        }
    }

    /// Remembers when a session was used last; it is written soon.
    pub fn touch(&self, session: &str, now: String) {
        if let Some(number) = number_of(session) {
            self.cursors.touch(number, now);
        }
    }

    /// Writes the cursors that are remembered only.
    ///
    /// # Errors
    /// [`Error::Write`]; they are then remembered still.
    pub fn flush(&self) -> Result<()> {
        self.cursors.flush(&self.disk)
    }

    /// Writes the notes of a session.
    ///
    /// # Errors
    /// [`Error::Write`]; the database is then as it was.
    pub(crate) fn save_notes(&self, session: &str, notes: &Notes) -> Result<()> {
        let Some(number) = number_of(session) else { return Ok(()) };
        self.disk.write(|transaction| put(transaction, NOTES, number, notes))
    }

    /// Takes a session with all that belongs to it out of the database.
    ///
    /// # Errors
    /// [`Error::Write`]; the database is then as it was.
    pub(crate) fn remove(&self, session: &str) -> Result<()> {
        let Some(number) = number_of(session) else { return Ok(()) };
        self.cursors.forget_session(number);
        self.disk.write(|transaction| forget(transaction, number))
    }

    /// Reads everything; sessions that cannot be read are moved aside.
    ///
    /// # Errors
    /// [`Error::Read`] when the database cannot be read.
    pub fn load(&self) -> Result<Found> {
        let mut found = read::read(&self.disk.database, &self.disk.path)?;
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
            let text = read::raw(&self.disk.database, number).map_err(|error| error.to_string())?;
            sightline_recordings::files::write_atomically(&to, text.as_bytes())
                .map_err(|error| error.to_string())?;
            self.disk.write(|transaction| forget(transaction, number)).map_err(|error| error.to_string())?;
            Ok(to)
        });
        match moved {
            Ok(to) => format!("session {id} cannot be read ({why}); it was moved to {}", to.display()),
            Err(error) => format!("session {id} cannot be read ({why}) and not be moved aside ({error})"),
        }
    }
}

impl Disk {
    /// Carries out one transaction; `work` says whether it changed anything.
    fn write(
        &self,
        work: impl FnOnce(&WriteTransaction) -> std::result::Result<bool, redb::Error>,
    ) -> Result<()> {
        let attempt = || {
            let transaction = self.database.begin_write()?;
            if work(&transaction)? {
                transaction.commit()?;
            } else {
                transaction.abort()?;
            }
            Ok::<_, redb::Error>(())
        };
        attempt()
            .map_err(|error| Error::Write { path: self.path.clone(), source: std::io::Error::other(error) })
    }
}

/// Writes a value where it differs from what is there; says whether it did.
fn put<'k, K: redb::Key>(
    transaction: &WriteTransaction,
    table: TableDefinition<'_, K, &'static [u8]>,
    key: impl std::borrow::Borrow<K::SelfType<'k>>,
    value: &impl Serialize,
) -> std::result::Result<bool, redb::Error> {
    let json = serde_json::to_vec(value).map_err(|error| redb::Error::Corrupted(error.to_string()))?;
    let mut table = transaction.open_table(table)?;
    let is_same = table.get(key.borrow())?.is_some_and(|present| present.value() == json.as_slice());
    if !is_same {
        table.insert(key.borrow(), json.as_slice())?;
    }
    Ok(!is_same)
}

/// Writes the runs that changed, and takes out those that are not there any more.
fn put_runs(
    transaction: &WriteTransaction,
    number: u64,
    session: &SavedSession,
) -> std::result::Result<bool, redb::Error> {
    let mut is_changed = false;
    for (target, record) in session.targets.iter().enumerate() {
        for (run, saved) in record.runs.iter().enumerate() {
            is_changed |= put(transaction, RUNS, (number, target as u64, run as u64), saved)?;
        }
    }
    let has = |(_, target, run): RunKey| {
        session.targets.get(target as usize).is_some_and(|record| (run as usize) < record.runs.len())
    };
    let gone: Vec<RunKey> = {
        let table = transaction.open_table(RUNS)?;
        let keys = table.range((number, 0, 0)..=(number, u64::MAX, u64::MAX))?;
        let keys: std::result::Result<Vec<RunKey>, _> =
            keys.map(|entry| entry.map(|(key, _)| key.value())).collect();
        keys?.into_iter().filter(|key| !has(*key)).collect()
    };
    let mut table = transaction.open_table(RUNS)?;
    for key in &gone {
        table.remove(*key)?;
    }
    Ok(is_changed || !gone.is_empty())
}

/// Takes a session out of every table.
fn forget(transaction: &WriteTransaction, number: u64) -> std::result::Result<bool, redb::Error> {
    transaction.open_table(SESSIONS)?.remove(number)?;
    transaction.open_table(CURSORS)?.remove(number)?;
    transaction.open_table(NOTES)?.remove(number)?;
    transaction.open_table(USED)?.remove(number)?;
    let range = (number, 0, 0)..=(number, u64::MAX, u64::MAX);
    transaction.open_table(RUNS)?.retain_in(range, |_, _| false)?;
    Ok(true)
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
