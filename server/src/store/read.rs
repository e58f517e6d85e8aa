//! Reading what is in the database: all of it when a server starts, and for commands that only look.

use std::collections::BTreeMap;
use std::path::Path;

use redb::{ReadTransaction, ReadableDatabase, ReadableTable};
use serde::de::DeserializeOwned;
use serde_json::Value;
use sightline_geometry::error::Result;
use sightline_session::Cursor;
use sightline_session::notes::Notes;
use sightline_session::view::SavedSession;

use super::open::{builder, failed, refused};
use super::{CURSORS, FILE_NAME, LAST_SESSION, META, NOTES, RUNS, SESSIONS, USED, id_of};

/// What was found.
#[derive(Debug, Default)]
pub struct Found {
    /// The sessions that can be read.
    pub sessions: Vec<SavedSession>,
    /// Their notes, by the sessions' numbers.
    pub notes: BTreeMap<u64, Notes>,
    /// When they were used last, RFC 3339, by the sessions' numbers.
    pub used: BTreeMap<u64, String>,
    /// One sentence for everything that a person should know.
    pub messages: Vec<String>,
    /// The largest number that a session ever had here.
    pub last_number: u64,
    /// Sessions that cannot be read, and why.
    pub(super) damaged: Vec<(String, String)>,
}

/// What a folder holds, without changing it, also while a server works in it.
///
/// # Errors
/// No database there, or one that cannot be read.
pub(crate) fn read_only(folder: &Path) -> Result<Found> {
    let path = folder.join(FILE_NAME);
    let mut builder = builder();
    // The check would write.
    builder.set_check_integrity_on_open(false);
    let database = builder.open_read_only(&path).map_err(|error| refused(&path, &error))?;
    read(&database, &path)
}

/// Reads everything.
pub(super) fn read(database: &impl ReadableDatabase, path: &Path) -> Result<Found> {
    let attempt = || {
        let transaction = database.begin_read()?;
        let last_number = transaction.open_table(META)?.get(LAST_SESSION)?.map_or(0, |value| value.value());
        let mut found = Found { last_number, ..Found::default() };
        let sessions = transaction.open_table(SESSIONS)?;
        for entry in sessions.iter()? {
            let (key, value) = entry?;
            let number = key.value();
            found.last_number = found.last_number.max(number);
            match session(&transaction, number, value.value())? {
                Ok(saved) => found.sessions.push(saved),
                Err(why) => found.damaged.push((id_of(number), why)),
            }
        }
        for entry in transaction.open_table(NOTES)?.iter()? {
            let (key, value) = entry?;
            match parsed(value.value()) {
                Ok(notes) => {
                    found.notes.insert(key.value(), notes);
                }
                Err(why) => found.damaged.push((id_of(key.value()), format!("its notes: {why}"))),
            }
        }
        // Another program may have the database open for writing in an earlier form, which has no such table.
        if let Ok(table) = transaction.open_table(USED) {
            for entry in table.iter()? {
                let (key, value) = entry?;
                // A time that cannot be read is no reason to lose anything.
                found.used.extend(parsed(value.value()).map(|time: String| (key.value(), time)));
            }
        }
        // A session of which one thing cannot be read is moved aside once, with everything.
        found.damaged.dedup_by(|later, earlier| later.0 == earlier.0);
        let is_damaged = |id: &str| found.damaged.iter().any(|(damaged, _)| damaged == id);
        found.sessions.retain(|saved| !is_damaged(&saved.id));
        Ok::<_, redb::Error>(found)
    };
    attempt().map_err(|error| failed(path, &error.to_string()))
}

/// A session put together from its parts.
fn session(
    transaction: &ReadTransaction,
    number: u64,
    head: &[u8],
) -> std::result::Result<std::result::Result<SavedSession, String>, redb::Error> {
    let mut saved: SavedSession = match parsed(head) {
        Ok(saved) => saved,
        Err(why) => return Ok(Err(why)),
    };
    if saved.id != id_of(number) {
        return Ok(Err(format!("it holds session {}", crate::printable::printable(&saved.id))));
    }
    if let Some(cursor) = transaction.open_table(CURSORS)?.get(number)? {
        // A cursor that cannot be read is no reason to lose the session.
        saved.cursor = parsed::<Cursor>(cursor.value()).unwrap_or_default();
    }
    let range = (number, 0, 0)..=(number, u64::MAX, u64::MAX);
    for entry in transaction.open_table(RUNS)?.range(range)? {
        let (key, value) = entry?;
        let (_, target, run) = key.value();
        let place = saved.targets.get_mut(target as usize).filter(|record| record.runs.len() as u64 == run);
        match (place, parsed(value.value())) {
            (Some(record), Ok(read)) => record.runs.push(read),
            (None, _) => return Ok(Err(format!("run {run} of target {target} has no place"))),
            (_, Err(why)) => return Ok(Err(format!("run {run} of target {target}: {why}"))),
        }
    }
    Ok(Ok(saved))
}

/// Everything of a session as one JSON text, whether or not it can be understood.
pub(super) fn raw(database: &impl ReadableDatabase, number: u64) -> std::result::Result<String, redb::Error> {
    let transaction = database.begin_read()?;
    let text = |bytes: &[u8]| {
        let lossy = || Value::String(String::from_utf8_lossy(bytes).into_owned());
        serde_json::from_slice(bytes).unwrap_or_else(|_| lossy())
    };
    let mut whole = serde_json::Map::new();
    for (name, table) in [("session", SESSIONS), ("cursor", CURSORS), ("notes", NOTES)] {
        if let Some(value) = transaction.open_table(table)?.get(number)? {
            whole.insert(name.to_owned(), text(value.value()));
        }
    }
    let mut runs = Vec::new();
    let range = (number, 0, 0)..=(number, u64::MAX, u64::MAX);
    for entry in transaction.open_table(RUNS)?.range(range)? {
        let (key, value) = entry?;
        let (_, target, run) = key.value();
        runs.push(serde_json::json!({ "target": target, "run": run, "saved": text(value.value()) }));
    }
    whole.insert("runs".to_owned(), runs.into());
    Ok(format!("{:#}", Value::Object(whole)))
}

fn parsed<T: DeserializeOwned>(bytes: &[u8]) -> std::result::Result<T, String> {
    serde_json::from_slice(bytes).map_err(|error| error.to_string())
}
