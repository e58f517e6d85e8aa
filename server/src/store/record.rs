//! The format of stored values: JSON followed by a line with place, order and digest.
//!
//! ```text
//! {"id":"s1", …}
//! #sightline sessions/1 1048577 842 9f86d081884c7d65
//! ```
//! The line contains the place, the number of the transaction, the length of the JSON text in bytes, and the first digits of
//! the SHA-256 of all three. A record can therefore be identified and verified without the trees of the database: [`scan`]
//! finds the records in any bytes, including those of a damaged file.

use std::collections::BTreeMap;
use std::fmt;
use std::str::FromStr;

use redb::{ReadTransaction, ReadableTable, TableDefinition, WriteTransaction};
use sha2::{Digest, Sha256};

use crate::naming::digits;

/// The start of the line after a value.
const MARK: &[u8] = b"\n#sightline ";
/// Maximum length of this line, bytes.
const LINE_BYTES: usize = 600;
/// Hexadecimal digits of the digest.
const DIGITS: usize = 16;

/// A table with numeric keys.
pub(super) type Numbered = TableDefinition<'static, u64, &'static [u8]>;
/// A table with string keys.
pub(super) type Named = TableDefinition<'static, &'static str, &'static [u8]>;
/// Numbers of session, target and run.
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

/// The tables with numeric keys.
pub(super) const NUMBERED: [Numbered; 5] = [SESSIONS, CURSORS, NOTES, STUDIES, USED];
/// The tables with string keys.
pub(super) const NAMED: [Named; 4] = [DOCUMENTS, DRIVES, QUESTIONS, REMOVED];

/// The place of a record: its table and its key. Displayed as `sessions/1`, `runs/1/0/2` or `documents/layout`.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum RecordKey {
    Session(u64),
    Run(RunKey),
    Cursor(u64),
    Notes(u64),
    Used(u64),
    Study(u64),
    Document(String),
    Drive(String),
    Question(String),
    /// A removal of the record at the place with this name.
    Removed(String),
}

/// Table and key in the database.
enum TableKey<'a> {
    Number(Numbered, u64),
    Run(RunKey),
    Name(Named, &'a str),
}

impl RecordKey {
    fn table_key(&self) -> TableKey<'_> {
        match self {
            Self::Session(number) => TableKey::Number(SESSIONS, *number),
            Self::Run(key) => TableKey::Run(*key),
            Self::Cursor(number) => TableKey::Number(CURSORS, *number),
            Self::Notes(number) => TableKey::Number(NOTES, *number),
            Self::Used(number) => TableKey::Number(USED, *number),
            Self::Study(number) => TableKey::Number(STUDIES, *number),
            Self::Document(name) => TableKey::Name(DOCUMENTS, name),
            Self::Drive(name) => TableKey::Name(DRIVES, name),
            Self::Question(name) => TableKey::Name(QUESTIONS, name),
            Self::Removed(name) => TableKey::Name(REMOVED, name),
        }
    }

    /// The bytes at this place.
    pub(super) fn get(
        &self,
        transaction: &WriteTransaction,
    ) -> std::result::Result<Option<Vec<u8>>, redb::Error> {
        Ok(match self.table_key() {
            TableKey::Number(table, key) => {
                transaction.open_table(table)?.get(key)?.map(|v| v.value().to_vec())
            }
            TableKey::Run(key) => transaction.open_table(RUNS)?.get(key)?.map(|v| v.value().to_vec()),
            TableKey::Name(table, key) => {
                transaction.open_table(table)?.get(key)?.map(|v| v.value().to_vec())
            }
        })
    }

    /// Writes bytes to this place, or removes its value.
    pub(super) fn set(
        &self,
        transaction: &WriteTransaction,
        bytes: Option<&[u8]>,
    ) -> std::result::Result<(), redb::Error> {
        match (self.table_key(), bytes) {
            (TableKey::Number(table, key), Some(bytes)) => {
                transaction.open_table(table)?.insert(key, bytes)?;
            }
            (TableKey::Run(key), Some(bytes)) => {
                transaction.open_table(RUNS)?.insert(key, bytes)?;
            }
            (TableKey::Name(table, key), Some(bytes)) => {
                transaction.open_table(table)?.insert(key, bytes)?;
            }
            (TableKey::Number(table, key), None) => {
                transaction.open_table(table)?.remove(key)?;
            }
            (TableKey::Run(key), None) => {
                transaction.open_table(RUNS)?.remove(key)?;
            }
            (TableKey::Name(table, key), None) => {
                transaction.open_table(table)?.remove(key)?;
            }
        }
        Ok(())
    }

    /// The place of a key in a table with numeric keys; `None` for a table without records.
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

    /// The place of a key in a table with string keys; `None` for a table without records.
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

impl fmt::Display for RecordKey {
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

/// A text that is not a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct InvalidRecordKey;

impl FromStr for RecordKey {
    type Err = InvalidRecordKey;

    fn from_str(text: &str) -> std::result::Result<Self, InvalidRecordKey> {
        let (table, key) = text.split_once('/').ok_or(InvalidRecordKey)?;
        let number = |text: &str| text.parse::<u64>().map_err(|_| InvalidRecordKey);
        if table == "runs" {
            let mut parts = key.splitn(3, '/').map(number);
            let mut next = || parts.next().unwrap_or(Err(InvalidRecordKey));
            return Ok(Self::Run((next()?, next()?, next()?)));
        }
        match Self::named(table, key) {
            Some(record_key) => Ok(record_key),
            None => Self::numbered(table, number(key)?).ok_or(InvalidRecordKey),
        }
    }
}

/// Encodes a value for storage.
pub(super) fn encode(record_key: &RecordKey, sequence: u64, json: &[u8]) -> Vec<u8> {
    let about = format!("{record_key} {sequence} {}", json.len());
    let mut bytes = Vec::with_capacity(json.len() + MARK.len() + about.len() + DIGITS + 2);
    bytes.extend_from_slice(json);
    bytes.extend_from_slice(MARK);
    bytes.extend_from_slice(format!("{about} {}\n", digest(&about, json)).as_bytes());
    bytes
}

/// The JSON text of a stored value; values of an earlier version have no line.
///
/// # Errors
/// A value that was corrupted after it was written.
pub(super) fn decode<'a>(record_key: &RecordKey, bytes: &'a [u8]) -> std::result::Result<&'a [u8], Altered> {
    let Some(at) = bytes.windows(MARK.len()).rposition(|window| window == MARK) else { return Ok(bytes) };
    match verified(bytes, at) {
        Some(record) if record.key == *record_key && record.json.len() == at => Ok(record.json),
        _ => Err(Altered),
    }
}

/// Whether a stored value has the verification line.
pub(super) fn has_line(bytes: &[u8]) -> bool {
    bytes.ends_with(b"\n") && bytes.windows(MARK.len()).any(|window| window == MARK)
}

/// Bytes that were corrupted after they were written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Altered;

impl fmt::Display for Altered {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("its bytes were altered after they were written")
    }
}

/// A verified record.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Record<'a> {
    pub(super) key: RecordKey,
    pub(super) sequence: u64,
    pub(super) json: &'a [u8],
}

/// The newest record of each place in `bytes`, including removed ones and the records of their removal.
pub(super) fn scan(bytes: &[u8]) -> BTreeMap<RecordKey, Record<'_>> {
    let mut found = BTreeMap::<RecordKey, Record<'_>>::new();
    let marks = bytes.windows(MARK.len()).enumerate().filter(|(_, window)| *window == MARK);
    for (at, _) in marks {
        let Some(record) = verified(bytes, at) else { continue };
        let known = found.get(&record.key).map(|known| known.sequence);
        if known.is_none_or(|known| known < record.sequence) {
            found.insert(record.key.clone(), record);
        }
    }
    found
}

/// Verifies the record whose line starts at `at`.
fn verified(bytes: &[u8], at: usize) -> Option<Record<'_>> {
    let line = &bytes[at + MARK.len()..];
    let end = line.iter().take(LINE_BYTES).position(|byte| *byte == b'\n')?;
    let (about, sum) = std::str::from_utf8(&line[..end]).ok()?.rsplit_once(' ')?;
    let mut parts = about.splitn(3, ' ');
    let (record_key, sequence) = (parts.next()?.parse().ok()?, parts.next()?.parse().ok()?);
    let json = &bytes[at.checked_sub(parts.next()?.parse().ok()?)?..at];
    (digest(about, json) == sum).then_some(Record { key: record_key, sequence, json })
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

/// The records of a table with string keys, as JSON texts; empty if an earlier version did not create the table.
pub(super) fn all_named(
    transaction: &ReadTransaction,
    table: Named,
) -> std::result::Result<Vec<(String, Vec<u8>)>, redb::Error> {
    let Ok(opened) = transaction.open_table(table) else { return Ok(Vec::new()) };
    let mut all = Vec::new();
    for entry in opened.iter()? {
        let (key, value) = entry?;
        let name = key.value().to_owned();
        let record_key = RecordKey::named(redb::TableHandle::name(&table), &name);
        let json =
            record_key.and_then(|record_key| decode(&record_key, value.value()).ok().map(<[u8]>::to_vec));
        all.extend(json.map(|json| (name, json)));
    }
    Ok(all)
}

/// The records of a table with numeric keys, as JSON texts; empty if an earlier version did not create the table.
pub(super) fn all_numbered(
    transaction: &ReadTransaction,
    table: Numbered,
) -> std::result::Result<Vec<(u64, Vec<u8>)>, redb::Error> {
    let Ok(opened) = transaction.open_table(table) else { return Ok(Vec::new()) };
    let mut all = Vec::new();
    for entry in opened.iter()? {
        let (key, value) = entry?;
        let number = key.value();
        let record_key = RecordKey::numbered(redb::TableHandle::name(&table), number);
        let json =
            record_key.and_then(|record_key| decode(&record_key, value.value()).ok().map(<[u8]>::to_vec));
        all.extend(json.map(|json| (number, json)));
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn record_keys_are_read_as_they_are_written() {
        let record_keys = [
            RecordKey::Session(12),
            RecordKey::Run((1, 0, 2)),
            RecordKey::Used(7),
            RecordKey::Document("layout.mine".to_owned()),
            RecordKey::Question("s1/0/0/3".to_owned()),
            RecordKey::Removed("sessions/3".to_owned()),
        ];
        for record_key in record_keys {
            assert_eq!(record_key.to_string().parse(), Ok(record_key));
        }
        for text in ["", "sessions", "sessions/x", "runs/1/2", "meta/1", "runs/1/2/3/4"] {
            assert_eq!(text.parse::<RecordKey>(), Err(InvalidRecordKey), "{text}");
        }
    }

    #[test]
    fn every_altered_bit_of_a_record_is_detected() {
        let record_key = RecordKey::Notes(3);
        let whole = encode(&record_key, 77, br#"{"text":"0.1 m"}"#);
        assert_eq!(decode(&record_key, &whole), Ok(br#"{"text":"0.1 m"}"#.as_slice()));
        assert_eq!(decode(&RecordKey::Notes(4), &whole), Err(Altered), "another place");
        for bit in 0..8 * whole.len() {
            let mut altered = whole.clone();
            altered[bit / 8] ^= 1 << (bit % 8);
            let read = decode(&record_key, &altered).map(serde_json::from_slice::<serde_json::Value>);
            assert!(!matches!(read, Ok(Ok(_))), "bit {bit}: {}", String::from_utf8_lossy(&altered));
            assert!(scan(&altered).is_empty(), "bit {bit}");
        }
    }

    #[test]
    fn the_newest_records_are_found_in_any_bytes() {
        let record_key = RecordKey::Session(1);
        let mut bytes = vec![0xa5; 100];
        for (sequence, json) in [(2, "[2]"), (9, "[9]"), (4, "[4]")] {
            bytes.extend(encode(&record_key, sequence, json.as_bytes()));
            bytes.extend([0; 33]);
        }
        bytes.extend(&encode(&RecordKey::Session(2), 3, b"[]")[3..]);
        let found = scan(&bytes);
        assert_eq!(found.len(), 1);
        assert_eq!(found[&record_key].json, b"[9]");
    }
}
