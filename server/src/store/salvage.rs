//! What can be verified in a damaged file: its records, found without its trees by the lines behind them.
//!
//! Of each place the newest record counts. One that was altered is left out; then an older copy of it may be found, which
//! the database had not overwritten yet. What was removed stays removed.

use std::collections::{BTreeMap, BTreeSet};

use redb::backends::InMemoryBackend;
use redb::{ConcurrencyMode, Database};

use super::disk::{Outcome, SEQUENCE};
use super::open::{builder, prepare};
use super::read::head_of;
use super::record::{Place, Record, encode, scan};
use super::{LAST_SESSION, META, id_of, number_of};

/// Records for a new database.
#[derive(Debug, Default)]
pub(super) struct Salvaged {
    /// JSON texts by their places.
    records: BTreeMap<Place, Vec<u8>>,
    /// Sessions of which parts were found, but not the session itself.
    lost: BTreeSet<u64>,
    last_session: u64,
    last_sequence: u64,
}

impl Salvaged {
    /// What is found in the bytes of a file.
    pub(super) fn of(bytes: &[u8]) -> Self {
        let found = scan(bytes);
        let removed_at = |place: &Place| {
            let removal = found.get(&Place::Removed(place.to_string()));
            removal.map_or(0, |record| record.sequence)
        };
        let is_there = |record: &Record<'_>| {
            let session = session_of(&record.place).map_or(0, |number| removed_at(&Place::Session(number)));
            record.sequence > removed_at(&record.place).max(session)
        };
        let mut salvaged = Self::default();
        for record in found.values() {
            salvaged.last_sequence = salvaged.last_sequence.max(record.sequence);
            let session = match &record.place {
                Place::Removed(name) => name.parse().ok().and_then(|place| session_of(&place)),
                place => session_of(place),
            };
            salvaged.last_session = salvaged.last_session.max(session.unwrap_or(0));
            if matches!(record.place, Place::Removed(_)) || !is_there(record) {
                continue;
            }
            // A session with its parts, or something by itself.
            let runs = session.map(|number| {
                let head = found.get(&Place::Session(number)).filter(|head| is_there(head));
                head.map(|head| head_of(&head.place, head.json).ok().and_then(|(_, runs)| runs))
            });
            match (runs, &record.place) {
                (Some(None), _) => salvaged.lost.extend(session),
                // Of a run that the session has no more an older copy was found.
                (Some(Some(Some(runs))), Place::Run((_, target, run)))
                    if runs.get(*target as usize).is_none_or(|count| *count as u64 <= *run) => {}
                _ => {
                    salvaged.records.insert(record.place.clone(), record.json.to_vec());
                }
            }
        }
        salvaged
    }

    /// Writes the records into a new database.
    pub(super) fn fill(&self, database: &Database) -> Outcome<()> {
        let transaction = database.begin_write()?;
        for (place, json) in &self.records {
            place.set(&transaction, Some(&encode(place, self.last_sequence, json)))?;
        }
        {
            let mut meta = transaction.open_table(META)?;
            meta.insert(LAST_SESSION, self.last_session)?;
            meta.insert(SEQUENCE, self.last_sequence)?;
        }
        Ok(transaction.commit()?)
    }

    /// A database in memory with the records.
    pub(super) fn in_memory(&self) -> Outcome<Database> {
        let mut builder = builder();
        // Nobody shares the memory.
        builder.set_concurrency_mode(ConcurrencyMode::ExclusiveWriter);
        let database = builder.create_with_backend(InMemoryBackend::new())?;
        prepare(&database)?;
        self.fill(&database)?;
        Ok(database)
    }

    /// What was found, half a sentence.
    pub(super) fn summary(&self) -> String {
        let count = |is_one: fn(&Place) -> bool, one: &str, more: &str| {
            let count = self.records.keys().filter(|place| is_one(place)).count();
            format!("{count} {}", if count == 1 { one } else { more })
        };
        let sessions = count(|place| matches!(place, Place::Session(_)), "session", "sessions");
        let documents = count(|place| matches!(place, Place::Document(_)), "document", "documents");
        let studies = count(|place| matches!(place, Place::Study(_)), "study", "studies");
        let mut text = format!("{sessions}, {documents} and {studies} were taken over from it");
        if !self.lost.is_empty() {
            let lost: Vec<String> = self.lost.iter().map(|number| id_of(*number)).collect();
            let (noun, verb) = if lost.len() == 1 { ("session", "is") } else { ("sessions", "are") };
            text.push_str(&format!(", and {noun} {} {verb} lost", lost.join(", ")));
        }
        text
    }
}

/// The session to which a place belongs.
fn session_of(place: &Place) -> Option<u64> {
    match place {
        Place::Session(number) | Place::Cursor(number) | Place::Notes(number) | Place::Used(number) => {
            Some(*number)
        }
        Place::Run((session, _, _)) => Some(*session),
        Place::Question(name) => number_of(name.split('/').next().unwrap_or_default()),
        Place::Study(_) | Place::Document(_) | Place::Drive(_) | Place::Removed(_) => None,
    }
}
