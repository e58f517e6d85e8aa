//! Reads the database: everything when a server starts, and for commands without write access.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use redb::backends::InMemoryBackend;
use redb::{
    ConcurrencyMode, DatabaseError, ReadTransaction, ReadableDatabase, ReadableTable, StorageBackend as _,
    StorageError,
};
use serde::de::DeserializeOwned;
use serde_json::Value;
use sightline_geometry::error::{Error, Result};
use sightline_session::Cursor;
use sightline_session::notes::Notes;
use sightline_session::view::SavedSession;

use super::disk::Outcome;
use super::open::{builder, failed, refused};
use super::record::{CURSORS, NOTES, RUNS, RecordKey, SESSIONS, USED, all_numbered, decode};
use super::salvage::Salvaged;
use super::{FILE_NAME, LAST_SESSION, META, id_of};

/// Number of copies that are tried while a starting server may be changing the file.
const COPIES: u32 = 3;

/// The contents of the database.
#[derive(Debug, Default)]
pub struct Found {
    /// The sessions that can be read.
    pub sessions: Vec<SavedSession>,
    /// Their notes, by session number.
    pub notes: BTreeMap<u64, Notes>,
    /// Times of last use, RFC 3339, by session number.
    pub used: BTreeMap<u64, String>,
    /// Messages for the user, one sentence each.
    pub messages: Vec<String>,
    /// The largest session number so far.
    pub last_number: u64,
    /// Unreadable sessions, with the reason.
    pub(super) damaged: Vec<(String, String)>,
}

/// Reads the database of a folder without changing it, even while a server uses it or after a crash.
///
/// # Errors
/// The database is missing or cannot be read.
pub(crate) fn read_only(folder: &Path) -> Result<Found> {
    let path = folder.join(FILE_NAME);
    let mut builder = builder();
    // The integrity check would write.
    builder.set_check_integrity_on_open(false);
    for _ in 0..COPIES {
        match builder.open_read_only(&path) {
            Ok(database) => {
                return read(&database).map_err(|error| failed(&path, &error.to_string()));
            }
            // No server is running, and the last one crashed: the file is repaired in memory.
            Err(DatabaseError::RepairAborted) => {}
            // The verifiable records of a damaged file are recovered below.
            Err(DatabaseError::Storage(StorageError::Corrupted(_))) => {}
            Err(error) => return Err(refused(&path, &error)),
        }
        let bytes = std::fs::read(&path).map_err(|source| Error::Read { path: path.clone(), source })?;
        if let Some(found) = repaired(&bytes) {
            return Ok(found);
        }
        // A server may have started during the copy.
    }
    let bytes = std::fs::read(&path).map_err(|source| Error::Read { path: path.clone(), source })?;
    let salvaged = Salvaged::of(&bytes);
    let whole = salvaged.in_memory().and_then(|database| read(&database));
    let mut found = whole.map_err(|error| failed(&path, &error.to_string()))?;
    found.messages.push(format!("{} is damaged: {}", path.display(), salvaged.summary()));
    Ok(found)
}

/// Repairs the bytes of a database in memory and reads it; `None` if the damage is too severe.
fn repaired(bytes: &[u8]) -> Option<Found> {
    let open = || {
        let storage = InMemoryBackend::new();
        storage.set_len(bytes.len() as u64)?;
        storage.write(0, bytes)?;
        let mut builder = builder();
        // The memory is not shared.
        builder.set_concurrency_mode(ConcurrencyMode::ExclusiveWriter);
        read(&builder.create_with_backend(storage)?)
    };
    // redb panics at some kinds of damage.
    catch_unwind(AssertUnwindSafe(open)).ok()?.ok()
}

/// Reads everything.
pub(super) fn read(database: &impl ReadableDatabase) -> Outcome<Found> {
    let transaction = database.begin_read()?;
    let last_number = transaction.open_table(META)?.get(LAST_SESSION)?.map_or(0, |value| value.value());
    let mut found = Found { last_number, ..Found::default() };
    for entry in transaction.open_table(SESSIONS)?.iter()? {
        let (key, value) = entry?;
        let number = key.value();
        found.last_number = found.last_number.max(number);
        match session(&transaction, number, value.value())? {
            Ok(saved) => found.sessions.push(saved),
            Err(why) => found.damaged.push((id_of(number), why.to_string())),
        }
    }
    for entry in transaction.open_table(NOTES)?.iter()? {
        let (key, value) = entry?;
        match parsed(&RecordKey::Notes(key.value()), value.value()) {
            Ok(notes) => {
                found.notes.insert(key.value(), notes);
            }
            Err(why) => found.damaged.push((id_of(key.value()), format!("its notes: {why}"))),
        }
    }
    // An unreadable time must not cause the loss of other data.
    for (number, json) in all_numbered(&transaction, USED)? {
        found.used.extend(serde_json::from_slice(&json).map(|time: String| (number, time)));
    }
    // A session with any unreadable part is moved aside once, as a whole.
    found.damaged.sort();
    found.damaged.dedup_by(|later, earlier| later.0 == earlier.0);
    let is_damaged = |id: &str| found.damaged.iter().any(|(damaged, _)| damaged == id);
    found.sessions.retain(|saved| !is_damaged(&saved.id));
    Ok(found)
}

/// Why a record cannot be read.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Unreadable(String);

impl std::fmt::Display for Unreadable {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        out.write_str(&self.0)
    }
}

/// Assembles a session from its records.
fn session(
    transaction: &ReadTransaction,
    number: u64,
    head: &[u8],
) -> Outcome<std::result::Result<SavedSession, Unreadable>> {
    let (mut saved, runs) = match head_of(&RecordKey::Session(number), head) {
        Ok(head) => head,
        Err(why) => return Ok(Err(why)),
    };
    if saved.id != id_of(number) {
        return Ok(Err(Unreadable(format!("it holds session {}", crate::printable::printable(&saved.id)))));
    }
    if let Some(cursor) = transaction.open_table(CURSORS)?.get(number)? {
        // An unreadable cursor must not cause the loss of the session.
        saved.cursor = parsed::<Cursor>(&RecordKey::Cursor(number), cursor.value()).unwrap_or_default();
    }
    let range = (number, 0, 0)..=(number, u64::MAX, u64::MAX);
    for entry in transaction.open_table(RUNS)?.range(range)? {
        let (key, value) = entry?;
        let (_, target, run) = key.value();
        let slot = saved.targets.get_mut(target as usize).filter(|record| record.runs.len() as u64 == run);
        match (slot, parsed(&RecordKey::Run(key.value()), value.value())) {
            (Some(record), Ok(read)) => record.runs.push(read),
            (None, _) => return Ok(Err(Unreadable(format!("run {run} of target {target} has no place")))),
            (_, Err(why)) => return Ok(Err(Unreadable(format!("run {run} of target {target}: {why}")))),
        }
    }
    let has: Vec<usize> = saved.targets.iter().map(|target| target.runs.len()).collect();
    if runs.is_some_and(|runs| runs != has) {
        return Ok(Err(Unreadable("a run is missing".to_owned())));
    }
    Ok(Ok(saved))
}

/// A stored session with the number of runs of each target; `None` in the format of an earlier version.
pub(super) fn head_of(
    record_key: &RecordKey,
    bytes: &[u8],
) -> std::result::Result<(SavedSession, Option<Vec<usize>>), Unreadable> {
    if bytes.starts_with(b"[") {
        parsed::<(SavedSession, Vec<usize>)>(record_key, bytes).map(|(saved, runs)| (saved, Some(runs)))
    } else {
        parsed(record_key, bytes).map(|saved| (saved, None))
    }
}

/// All records of a session as one JSON text, readable or not.
pub(super) fn raw(database: &impl ReadableDatabase, number: u64) -> Outcome<String> {
    let transaction = database.begin_read()?;
    let text = |record_key: RecordKey, bytes: &[u8]| {
        let lossy = || Value::String(String::from_utf8_lossy(bytes).into_owned());
        let json = decode(&record_key, bytes).unwrap_or(bytes);
        serde_json::from_slice(json).unwrap_or_else(|_| lossy())
    };
    let mut whole = serde_json::Map::new();
    for (name, table) in [("session", SESSIONS), ("cursor", CURSORS), ("notes", NOTES)] {
        if let Some(value) = transaction.open_table(table)?.get(number)? {
            let record_key = RecordKey::numbered(redb::TableHandle::name(&table), number);
            whole.extend(record_key.map(|record_key| (name.to_owned(), text(record_key, value.value()))));
        }
    }
    let mut runs = Vec::new();
    let range = (number, 0, 0)..=(number, u64::MAX, u64::MAX);
    for entry in transaction.open_table(RUNS)?.range(range)? {
        let (key, value) = entry?;
        let (_, target, run) = key.value();
        let saved = text(RecordKey::Run(key.value()), value.value());
        runs.push(serde_json::json!({ "target": target, "run": run, "saved": saved }));
    }
    whole.insert("runs".to_owned(), runs.into());
    Ok(format!("{:#}", Value::Object(whole)))
}

fn parsed<T: DeserializeOwned>(record_key: &RecordKey, bytes: &[u8]) -> std::result::Result<T, Unreadable> {
    let json = decode(record_key, bytes).map_err(|altered| Unreadable(altered.to_string()))?;
    serde_json::from_slice(json).map_err(|error| Unreadable(error.to_string()))
}
