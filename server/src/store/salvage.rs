//! Recovers the verifiable records of a damaged file, found by their verification lines instead of its trees.
//!
//! The newest record of each place is used. If it is corrupted, an older copy may be found that the database has not
//! overwritten yet. Removed records stay removed.

use std::collections::{BTreeMap, BTreeSet};

use redb::backends::InMemoryBackend;
use redb::{ConcurrencyMode, Database};

use super::disk::{Outcome, SEQUENCE};
use super::open::{builder, prepare};
use super::read::head_of;
use super::record::{Record, RecordKey, encode, scan};
use super::{LAST_SESSION, META, id_of, number_of};

/// Recovered records for a new database.
#[derive(Debug, Default)]
pub(super) struct Salvaged {
    /// JSON texts by place.
    records: BTreeMap<RecordKey, Vec<u8>>,
    /// Sessions with recovered parts, but without the session record itself.
    lost: BTreeSet<u64>,
    last_session: u64,
    last_sequence: u64,
}

impl Salvaged {
    /// Recovers the records in the bytes of a file.
    pub(super) fn of(bytes: &[u8]) -> Self {
        let found = scan(bytes);
        let removed_at = |record_key: &RecordKey| {
            let removal = found.get(&RecordKey::Removed(record_key.to_string()));
            removal.map_or(0, |record| record.sequence)
        };
        let is_there = |record: &Record<'_>| {
            let session = session_of(&record.key).map_or(0, |number| removed_at(&RecordKey::Session(number)));
            record.sequence > removed_at(&record.key).max(session)
        };
        let mut salvaged = Self::default();
        for record in found.values() {
            salvaged.last_sequence = salvaged.last_sequence.max(record.sequence);
            let session = match &record.key {
                RecordKey::Removed(name) => name.parse().ok().and_then(|record_key| session_of(&record_key)),
                record_key => session_of(record_key),
            };
            salvaged.last_session = salvaged.last_session.max(session.unwrap_or(0));
            if matches!(record.key, RecordKey::Removed(_)) || !is_there(record) {
                continue;
            }
            // A session with its parts, or an independent record.
            let runs = session.map(|number| {
                let head = found.get(&RecordKey::Session(number)).filter(|head| is_there(head));
                head.map(|head| head_of(&head.key, head.json).ok().and_then(|(_, runs)| runs))
            });
            match (runs, &record.key) {
                (Some(None), _) => salvaged.lost.extend(session),
                // Ignores an older copy of a run that is not part of the session.
                (Some(Some(Some(runs))), RecordKey::Run((_, target, run)))
                    if runs.get(*target as usize).is_none_or(|count| *count as u64 <= *run) => {}
                _ => {
                    salvaged.records.insert(record.key.clone(), record.json.to_vec());
                }
            }
        }
        salvaged
    }

    /// Writes the records to a new database.
    pub(super) fn fill(&self, database: &Database) -> Outcome<()> {
        let transaction = database.begin_write()?;
        for (record_key, json) in &self.records {
            record_key.set(&transaction, Some(&encode(record_key, self.last_sequence, json)))?;
        }
        {
            let mut meta = transaction.open_table(META)?;
            meta.insert(LAST_SESSION, self.last_session)?;
            meta.insert(SEQUENCE, self.last_sequence)?;
        }
        Ok(transaction.commit()?)
    }

    /// An in-memory database with the records.
    pub(super) fn in_memory(&self) -> Outcome<Database> {
        let mut builder = builder();
        // The memory is not shared.
        builder.set_concurrency_mode(ConcurrencyMode::ExclusiveWriter);
        let database = builder.create_with_backend(InMemoryBackend::new())?;
        prepare(&database)?;
        self.fill(&database)?;
        Ok(database)
    }

    /// A summary of the recovered records, as part of a sentence.
    pub(super) fn summary(&self) -> String {
        let count = |is_one: fn(&RecordKey) -> bool, one: &str, more: &str| {
            let count = self.records.keys().filter(|record_key| is_one(record_key)).count();
            format!("{count} {}", if count == 1 { one } else { more })
        };
        let sessions = count(|record_key| matches!(record_key, RecordKey::Session(_)), "session", "sessions");
        let documents =
            count(|record_key| matches!(record_key, RecordKey::Document(_)), "document", "documents");
        let studies = count(|record_key| matches!(record_key, RecordKey::Study(_)), "study", "studies");
        let mut text = format!("{sessions}, {documents} and {studies} were taken over from it");
        if !self.lost.is_empty() {
            let lost: Vec<String> = self.lost.iter().map(|number| id_of(*number)).collect();
            let (noun, verb) = if lost.len() == 1 { ("session", "is") } else { ("sessions", "are") };
            text.push_str(&format!(", and {noun} {} {verb} lost", lost.join(", ")));
        }
        text
    }
}

/// The session that a place is part of.
fn session_of(record_key: &RecordKey) -> Option<u64> {
    match record_key {
        RecordKey::Session(number)
        | RecordKey::Cursor(number)
        | RecordKey::Notes(number)
        | RecordKey::Used(number) => Some(*number),
        RecordKey::Run((session, _, _)) => Some(*session),
        RecordKey::Question(name) => number_of(name.split('/').next().unwrap_or_default()),
        RecordKey::Study(_) | RecordKey::Document(_) | RecordKey::Drive(_) | RecordKey::Removed(_) => None,
    }
}
