//! How a value is stored: as JSON with a line behind it that names its place, its order and its digest.
//!
//! ```text
//! {"id":"s1", …}
//! #sightline sessions/1 1048577 842 9f86d081884c7d65
//! ```
//! The line has the place, the number of the transaction, the length of the JSON text in bytes, and the first digits of
//! the SHA-256 of all three. A record is therefore known and verified without the trees of the database: [`scan`] finds
//! the records in any bytes, also in those of a damaged file.

use std::collections::BTreeMap;
use std::fmt;
use std::str::FromStr;

use redb::{ReadTransaction, ReadableTable, TableDefinition, WriteTransaction};
use sha2::{Digest, Sha256};

use crate::naming::digits;

/// How the line behind a value begins.
const MARK: &[u8] = b"\n#sightline ";
/// Longest such line, bytes.
const LINE_BYTES: usize = 600;
/// Hexadecimal digits of the digest.
const DIGITS: usize = 16;

/// A table whose keys are numbers.
pub(super) type Numbered = TableDefinition<'static, u64, &'static [u8]>;
/// A table whose keys are names.
pub(super) type Named = TableDefinition<'static, &'static str, &'static [u8]>;
/// Session, target and run by their numbers.
pub(super) type RunKey = (u64, u64, u64);

pub(super) const SESSIONS: Numbered = TableDefinition::new("sessions");
pub(super) const RUNS: TableDefinition<'static, RunKey, &'static [u8]> = TableDefinition::new("runs");
pub(super) const CURSORS: Numbered = TableDefinition::new("cursors");
pub(super) const NOTES: Numbered = TableDefinition::new("notes");
pub(super) const STUDIES: Numbered = TableDefinition::new("studies");
pub(super) const USED: Numbered = TableDefinition::new("used");
pub(super) const DOCUMENTS: Named = TableDefinition::new("documents");
pub(super) const DRIVES: Named = TableDefinition::new("drives");
pub(super) const QUESTIONS: Named = TableDefinition::new("questions");
pub(super) const REMOVED: Named = TableDefinition::new("removed");

/// The tables with numbers as keys.
pub(super) const NUMBERED: [Numbered; 5] = [SESSIONS, CURSORS, NOTES, STUDIES, USED];
/// The tables with names as keys.
pub(super) const NAMED: [Named; 4] = [DOCUMENTS, DRIVES, QUESTIONS, REMOVED];

/// Where a record is: its table and its key. As text `sessions/1`, `runs/1/0/2` or `documents/layout`.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Place {
    Session(u64),
    Run(RunKey),
    Cursor(u64),
    Notes(u64),
    Used(u64),
    Study(u64),
    Document(String),
    Drive(String),
    Question(String),
    /// That the record at the place of this name was removed.
    Removed(String),
}

/// A place as the database has it.
enum Key<'a> {
    Number(Numbered, u64),
    Run(RunKey),
    Name(Named, &'a str),
}

impl Place {
    fn key(&self) -> Key<'_> {
        match self {
            Self::Session(number) => Key::Number(SESSIONS, *number),
            Self::Run(key) => Key::Run(*key),
            Self::Cursor(number) => Key::Number(CURSORS, *number),
            Self::Notes(number) => Key::Number(NOTES, *number),
            Self::Used(number) => Key::Number(USED, *number),
            Self::Study(number) => Key::Number(STUDIES, *number),
            Self::Document(name) => Key::Name(DOCUMENTS, name),
            Self::Drive(name) => Key::Name(DRIVES, name),
            Self::Question(name) => Key::Name(QUESTIONS, name),
            Self::Removed(name) => Key::Name(REMOVED, name),
        }
    }

    /// The bytes at this place.
    pub(super) fn get(
        &self,
        transaction: &WriteTransaction,
    ) -> std::result::Result<Option<Vec<u8>>, redb::Error> {
        Ok(match self.key() {
            Key::Number(table, key) => transaction.open_table(table)?.get(key)?.map(|v| v.value().to_vec()),
            Key::Run(key) => transaction.open_table(RUNS)?.get(key)?.map(|v| v.value().to_vec()),
            Key::Name(table, key) => transaction.open_table(table)?.get(key)?.map(|v| v.value().to_vec()),
        })
    }

    /// Writes bytes to this place, or removes what is there.
    pub(super) fn set(
        &self,
        transaction: &WriteTransaction,
        bytes: Option<&[u8]>,
    ) -> std::result::Result<(), redb::Error> {
        match (self.key(), bytes) {
            (Key::Number(table, key), Some(bytes)) => {
                transaction.open_table(table)?.insert(key, bytes)?;
            }
            (Key::Run(key), Some(bytes)) => {
                transaction.open_table(RUNS)?.insert(key, bytes)?;
            }
            (Key::Name(table, key), Some(bytes)) => {
                transaction.open_table(table)?.insert(key, bytes)?;
            }
            (Key::Number(table, key), None) => {
                transaction.open_table(table)?.remove(key)?;
            }
            (Key::Run(key), None) => {
                transaction.open_table(RUNS)?.remove(key)?;
            }
            (Key::Name(table, key), None) => {
                transaction.open_table(table)?.remove(key)?;
            }
        }
        Ok(())
    }

    /// The place of a key of a table with numbers; none for a table that has no records.
    pub(super) fn numbered(table: &str, number: u64) -> Option<Self> {
        Some(match table {
            "sessions" => Self::Session(number),
            "cursors" => Self::Cursor(number),
            "notes" => Self::Notes(number),
            "used" => Self::Used(number),
            "studies" => Self::Study(number),
            _ => return None,
        })
    }

    /// The place of a key of a table with names; none for a table that has no records.
    pub(super) fn named(table: &str, name: &str) -> Option<Self> {
        let name = name.to_owned();
        Some(match table {
            "documents" => Self::Document(name),
            "drives" => Self::Drive(name),
            "questions" => Self::Question(name),
            "removed" => Self::Removed(name),
            _ => return None,
        })
    }
}

impl fmt::Display for Place {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Session(number) => write!(out, "sessions/{number}"),
            Self::Run((session, target, run)) => write!(out, "runs/{session}/{target}/{run}"),
            Self::Cursor(number) => write!(out, "cursors/{number}"),
            Self::Notes(number) => write!(out, "notes/{number}"),
            Self::Used(number) => write!(out, "used/{number}"),
            Self::Study(number) => write!(out, "studies/{number}"),
            Self::Document(name) => write!(out, "documents/{name}"),
            Self::Drive(name) => write!(out, "drives/{name}"),
            Self::Question(name) => write!(out, "questions/{name}"),
            Self::Removed(name) => write!(out, "removed/{name}"),
        }
    }
}

/// A text that names no place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct NoPlace;

impl FromStr for Place {
    type Err = NoPlace;

    fn from_str(text: &str) -> std::result::Result<Self, NoPlace> {
        let (table, key) = text.split_once('/').ok_or(NoPlace)?;
        let number = |text: &str| text.parse::<u64>().map_err(|_| NoPlace);
        if table == "runs" {
            let mut parts = key.splitn(3, '/').map(number);
            let mut next = || parts.next().unwrap_or(Err(NoPlace));
            return Ok(Self::Run((next()?, next()?, next()?)));
        }
        match Self::named(table, key) {
            Some(place) => Ok(place),
            None => Self::numbered(table, number(key)?).ok_or(NoPlace),
        }
    }
}

/// A value as it is stored.
pub(super) fn encode(place: &Place, sequence: u64, json: &[u8]) -> Vec<u8> {
    let about = format!("{place} {sequence} {}", json.len());
    let mut bytes = Vec::with_capacity(json.len() + MARK.len() + about.len() + DIGITS + 2);
    bytes.extend_from_slice(json);
    bytes.extend_from_slice(MARK);
    bytes.extend_from_slice(format!("{about} {}\n", digest(&about, json)).as_bytes());
    bytes
}

/// The JSON text of a stored value; one without the line is of an earlier version, which had none.
///
/// # Errors
/// A value that was changed after it was written.
pub(super) fn decode<'a>(place: &Place, bytes: &'a [u8]) -> std::result::Result<&'a [u8], Altered> {
    let Some(at) = bytes.windows(MARK.len()).rposition(|window| window == MARK) else { return Ok(bytes) };
    match verified(bytes, at) {
        Some(record) if record.place == *place && record.json.len() == at => Ok(record.json),
        _ => Err(Altered),
    }
}

/// Whether a stored value has the line behind it.
pub(super) fn has_line(bytes: &[u8]) -> bool {
    bytes.ends_with(b"\n") && bytes.windows(MARK.len()).any(|window| window == MARK)
}

/// Bytes that were changed after they were written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Altered;

impl fmt::Display for Altered {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("its bytes were altered after they were written")
    }
}

/// A record that was found and verified.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Record<'a> {
    pub(super) place: Place,
    pub(super) sequence: u64,
    pub(super) json: &'a [u8],
}

/// The records in `bytes`, the newest of each place. What was removed is among them, beside the record of its removal.
pub(super) fn scan(bytes: &[u8]) -> BTreeMap<Place, Record<'_>> {
    let mut found = BTreeMap::<Place, Record<'_>>::new();
    let marks = bytes.windows(MARK.len()).enumerate().filter(|(_, window)| *window == MARK);
    for (at, _) in marks {
        let Some(record) = verified(bytes, at) else { continue };
        let known = found.get(&record.place).map(|known| known.sequence);
        if known.is_none_or(|known| known < record.sequence) {
            found.insert(record.place.clone(), record);
        }
    }
    found
}

/// The record whose line begins at `at`.
fn verified(bytes: &[u8], at: usize) -> Option<Record<'_>> {
    let line = &bytes[at + MARK.len()..];
    let end = line.iter().take(LINE_BYTES).position(|byte| *byte == b'\n')?;
    let (about, sum) = std::str::from_utf8(&line[..end]).ok()?.rsplit_once(' ')?;
    let mut parts = about.splitn(3, ' ');
    let (place, sequence) = (parts.next()?.parse().ok()?, parts.next()?.parse().ok()?);
    let json = &bytes[at.checked_sub(parts.next()?.parse().ok()?)?..at];
    (digest(about, json) == sum).then_some(Record { place, sequence, json })
}

fn digest(about: &str, json: &[u8]) -> String {
    let mut sum = Sha256::new();
    sum.update(about.as_bytes());
    sum.update(b"\n");
    sum.update(json);
    let mut text = digits(&sum.finalize());
    text.truncate(DIGITS);
    text
}

/// The keys of a session's runs.
pub(super) fn run_keys(
    transaction: &WriteTransaction,
    session: u64,
) -> std::result::Result<Vec<RunKey>, redb::Error> {
    let table = transaction.open_table(RUNS)?;
    let keys = table.range((session, 0, 0)..=(session, u64::MAX, u64::MAX))?;
    keys.map(|entry| Ok(entry.map(|(key, _)| key.value())?)).collect()
}

/// The records of a table with names, as JSON texts; a table that an earlier version has not made is empty.
pub(super) fn all_named(
    transaction: &ReadTransaction,
    table: Named,
) -> std::result::Result<Vec<(String, Vec<u8>)>, redb::Error> {
    let Ok(opened) = transaction.open_table(table) else { return Ok(Vec::new()) };
    let mut all = Vec::new();
    for entry in opened.iter()? {
        let (key, value) = entry?;
        let name = key.value().to_owned();
        let place = Place::named(redb::TableHandle::name(&table), &name);
        let json = place.and_then(|place| decode(&place, value.value()).ok().map(<[u8]>::to_vec));
        all.extend(json.map(|json| (name, json)));
    }
    Ok(all)
}

/// The records of a table with numbers, as JSON texts; a table that an earlier version has not made is empty.
pub(super) fn all_numbered(
    transaction: &ReadTransaction,
    table: Numbered,
) -> std::result::Result<Vec<(u64, Vec<u8>)>, redb::Error> {
    let Ok(opened) = transaction.open_table(table) else { return Ok(Vec::new()) };
    let mut all = Vec::new();
    for entry in opened.iter()? {
        let (key, value) = entry?;
        let number = key.value();
        let place = Place::numbered(redb::TableHandle::name(&table), number);
        let json = place.and_then(|place| decode(&place, value.value()).ok().map(<[u8]>::to_vec));
        all.extend(json.map(|json| (number, json)));
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_read_as_they_are_written() {
        let places = [
            Place::Session(12),
            Place::Run((1, 0, 2)),
            Place::Used(7),
            Place::Document("layout.mine".to_owned()),
            Place::Question("s1/0/0/3".to_owned()),
            Place::Removed("sessions/3".to_owned()),
        ];
        for place in places {
            assert_eq!(place.to_string().parse(), Ok(place));
        }
        for text in ["", "sessions", "sessions/x", "runs/1/2", "meta/1", "runs/1/2/3/4"] {
            assert_eq!(text.parse::<Place>(), Err(NoPlace), "{text}");
        }
    }

    #[test]
    fn every_altered_bit_of_a_record_is_detected() {
        let place = Place::Notes(3);
        let whole = encode(&place, 77, br#"{"text":"0.1 m"}"#);
        assert_eq!(decode(&place, &whole), Ok(br#"{"text":"0.1 m"}"#.as_slice()));
        assert_eq!(decode(&Place::Notes(4), &whole), Err(Altered), "another place");
        for bit in 0..8 * whole.len() {
            let mut altered = whole.clone();
            altered[bit / 8] ^= 1 << (bit % 8);
            let read = decode(&place, &altered).map(serde_json::from_slice::<serde_json::Value>);
            assert!(!matches!(read, Ok(Ok(_))), "bit {bit}: {}", String::from_utf8_lossy(&altered));
            assert!(scan(&altered).is_empty(), "bit {bit}");
        }
    }

    #[test]
    fn the_newest_records_are_found_in_any_bytes() {
        let place = Place::Session(1);
        let mut bytes = vec![0xa5; 100];
        for (sequence, json) in [(2, "[2]"), (9, "[9]"), (4, "[4]")] {
            bytes.extend(encode(&place, sequence, json.as_bytes()));
            bytes.extend([0; 33]);
        }
        bytes.extend(&encode(&Place::Session(2), 3, b"[]")[3..]);
        let found = scan(&bytes);
        assert_eq!(found.len(), 1);
        assert_eq!(found[&place].json, b"[9]");
    }
}
