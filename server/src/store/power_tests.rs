//! Power losses and failing disks: all writes of real sessions to a storage are recorded; then the power is cut at any
//! operation, or the storage refuses one.
//!
//! Before a sync, a storage may have executed all, some or none of its operations, in any order, and any sectors of a write.
//! `SIGHTLINE_POWER_LOSS_POINTS` is the number of cuts.

use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::path::Path;

use serde_json::{Value, json};
use sightline_session::counterfactual::wire::Question;
use sightline_session::notes::{NewNote, Pin};

use super::power_storage::{Op, Storage};
use super::tests::saved;
use super::*;
use crate::jobs::lock;

/// Number of cuts in ordinary tests.
const POINTS: usize = 60;
/// Number of requests in the recorded sessions.
const REQUESTS: u64 = 120;
/// The number of cuts.
fn points() -> usize {
    std::env::var("SIGHTLINE_POWER_LOSS_POINTS").map_or(POINTS, |text| text.parse().expect("a number"))
}

/// The expected contents of the store: user input and computed data.
#[derive(Clone, Debug, Default, PartialEq)]
struct Contents {
    sessions: BTreeMap<u64, SavedSession>,
    notes: BTreeMap<u64, Notes>,
    documents: BTreeMap<String, Value>,
    studies: BTreeMap<u64, Value>,
    questions: Vec<Question>,
    drives: BTreeMap<String, String>,
}

impl Contents {
    fn in_store(store: &Store) -> Self {
        let found = store.load().unwrap();
        assert!(found.messages.is_empty(), "{:?}", found.messages);
        let number = |saved: &SavedSession| number_of(&saved.id).unwrap();
        Self {
            sessions: found.sessions.into_iter().map(|saved| (number(&saved), saved)).collect(),
            notes: found.notes,
            documents: store.documents().unwrap().into_iter().map(|one| (one.name, one.value)).collect(),
            studies: store.studies().unwrap().into_iter().collect(),
            questions: store.questions().unwrap(),
            drives: store.drives().unwrap().into_iter().collect(),
        }
    }

    /// Performs one request, of another kind than the previous one; the expected contents change only when it is
    /// acknowledged.
    fn request(&mut self, number: u64, store: &Store) -> Result<()> {
        let mut after = self.clone();
        match number % 10 {
            0 | 1 | 2 | 5 | 9 => after.change_session(number, store)?,
            _ => after.change_small_records(number, store)?,
        }
        *self = after;
        Ok(())
    }

    /// Changes a session, its notes or its cursor.
    fn change_session(&mut self, number: u64, store: &Store) -> Result<()> {
        let session = session_of(number);
        let id = id_of(session);
        match number % 10 {
            0 | 5 => {
                let contents = self.sessions.entry(session).or_insert_with(|| saved(&id));
                let another = contents.targets[0].clone();
                contents.targets.push(another);
                store.save(contents)
            }
            1 => {
                let notes = self.notes.entry(session).or_default();
                let text = format!("note {number} {}", "x".repeat((number as usize * 97) % 3900));
                let new = NewNote { pin: Pin::default(), text };
                notes.add(new, &sightline_session::Session::new(&id, "t", 9), "2026-11-24T12:00:00Z")?;
                store.save_notes(&id, notes)
            }
            2 => {
                let contents = self.sessions.get_mut(&session).expect("a session");
                contents.cursor = Cursor { target: Some(0), run: 0, step: number as usize };
                store.move_cursor(&id, contents.cursor);
                store.flush()
            }
            _ => {
                // Removes the previous or the current session, with its questions and notes.
                let gone = session.saturating_sub(1 - number / 10 % 2);
                self.sessions.remove(&gone);
                self.notes.remove(&gone);
                self.questions.retain(|question| question.session != id_of(gone));
                store.remove(&id_of(gone))
            }
        }
    }

    /// Changes documents, studies, questions and drives.
    fn change_small_records(&mut self, number: u64, store: &Store) -> Result<()> {
        match number % 10 {
            3 => {
                let (name, value) = (format!("layout-{}", number % 3), json!([number, 0.1]));
                store.put_document(&name, value.clone(), None)?.expect("room");
                self.documents.insert(name, value);
            }
            4 => {
                let value = json!({ "state": number, "rows": vec![1.0 / 3.0; number as usize] });
                store.save_study(number / 20, &value)?;
                self.studies.insert(number / 20, value);
            }
            6 => {
                let session = id_of(session_of(number));
                let question = json!({ "session": session, "target": 0, "run": 0, "step": 3,
                    "state": "waiting", "answer": null, "problem": number.to_string() });
                let question: Question = serde_json::from_value(question).expect("a question");
                store.save_question(&question)?;
                self.questions.retain(|other| other.session != question.session);
                self.questions.push(question);
            }
            7 => {
                let (name, text) = (format!("drive-{number}"), format!("name = \"{number}\""));
                store.save_drive(&name, &text)?;
                self.drives.insert(name, text);
            }
            _ if number.is_multiple_of(3) => {
                let name = format!("drive-{}", number - 1);
                store.remove_drive(&name)?;
                self.drives.remove(&name);
            }
            _ => {
                let name = format!("layout-{}", number % 3);
                store.remove_document(&name, None)?.expect("any revision");
                self.documents.remove(&name);
            }
        }
        Ok(())
    }
}

/// The session of a request.
fn session_of(number: u64) -> u64 {
    1 + number / 30
}

/// A new database, complete when it gets its name.
fn new_database(folder: &Path) -> Vec<u8> {
    let storage = Storage::default();
    drop(storage.store(folder).unwrap());
    let content = lock(&storage.0);
    content.bytes.clone()
}

/// The recorded sessions: the initial bytes, every operation, and the expected contents after each request. The server is
/// restarted a few times.
fn recorded(folder: &Path) -> (Vec<u8>, Vec<Op>, Vec<Contents>) {
    let begin = new_database(folder);
    let storage = Storage::of(begin.clone());
    let mut states = vec![Contents::default()];
    for part in 0..4 {
        let store = storage.store(folder).unwrap();
        for number in part * REQUESTS / 4..(part + 1) * REQUESTS / 4 {
            let mut contents = states[states.len() - 1].clone();
            contents.request(number, &store).unwrap();
            assert_eq!(Contents::in_store(&store), contents, "request {number}");
            states.push(contents);
            lock(&storage.0).ops.push(Op::Acknowledged);
        }
    }
    let ops = std::mem::take(&mut lock(&storage.0).ops);
    (begin, ops, states)
}

/// A pseudo-random generator with a fixed sequence.
struct Rng(u64);

impl Rng {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        self.0 >> 33
    }
}

/// The storage after a power cut that follows `ops`. Variant 0 contains all operations, 1 none after the last sync, 2 some
/// of them, and others some of the sectors.
fn after_a_cut(begin: &[u8], ops: &[Op], variant: usize, rng: &mut Rng) -> Vec<u8> {
    let mut bytes = begin.to_vec();
    let synced = ops.iter().rposition(|op| matches!(op, Op::Sync)).map_or(0, |last| last + 1);
    ops[..synced].iter().for_each(|op| op.apply(&mut bytes, |_| true));
    for op in &ops[synced..] {
        match variant {
            0 => op.apply(&mut bytes, |_| true),
            1 => {}
            2 if rng.next().is_multiple_of(2) => {}
            2 => op.apply(&mut bytes, |_| true),
            _ => {
                let sectors = rng.next();
                op.apply(&mut bytes, |sector| sectors >> (sector % 31) & 1 == 1);
            }
        }
    }
    bytes
}

#[test]
fn power_losses_at_any_write_lose_nothing_that_was_acknowledged() {
    let folder = tempfile::tempdir().unwrap();
    let (begin, ops, states) = recorded(folder.path());
    let (points, mut rng) = (points(), Rng(7));
    let mut in_flight = 0;
    for point in 0..points {
        let cut = 1 + point * (ops.len() - 1) / points;
        let acknowledged = ops[..cut].iter().filter(|op| matches!(op, Op::Acknowledged)).count();
        let bytes = after_a_cut(&begin, &ops[..cut], point % 4, &mut rng);
        let store = Storage::of(bytes).store(folder.path());
        let store = store.unwrap_or_else(|why| panic!("cut {cut}, variant {}: {why}", point % 4));
        let contents = Contents::in_store(&store);
        let is_next = states.get(acknowledged + 1) == Some(&contents);
        in_flight += usize::from(is_next);
        assert!(
            is_next || contents == states[acknowledged],
            "cut {cut}, variant {}: {contents:#?}",
            point % 4
        );
        // The interrupted request does not affect later ones.
        let mut contents = contents;
        contents.request(REQUESTS, &store).unwrap();
        assert_eq!(Contents::in_store(&store), contents, "cut {cut}");
    }
    let writes = ops.iter().filter(|op| !matches!(op, Op::Acknowledged)).count();
    println!(
        "drill | {:<44} | {points} cuts in {writes} operations of {REQUESTS} requests: 0 of {} acknowledged lost, 0 invented, \
         {in_flight} in flight kept whole",
        "power loss",
        states.len() - 1
    );
}

/// Runs the sessions on a failing storage, and returns the number of refused requests.
fn with_failure(begin: &[u8], folder: &Path, failure: (usize, usize, ErrorKind)) -> usize {
    let storage = Storage::of(begin.to_vec());
    let store = storage.store(folder).unwrap();
    lock(&storage.0).failure = Some(failure);
    let (mut contents, mut refused) = (Contents::default(), 0);
    for number in 0..REQUESTS {
        // Skips the cursor of a session whose creation was refused.
        if number % 10 == 2 && !contents.sessions.contains_key(&session_of(number)) {
            continue;
        }
        let failed_before = lock(&storage.0).failed;
        let outcome = contents.request(number, &store);
        let has_failed = lock(&storage.0).failed > failed_before;
        assert!(outcome.is_ok() || has_failed, "request {number} of {failure:?}: {outcome:?}");
        assert!(outcome.is_ok() || store.trouble().is_some(), "request {number} of {failure:?}");
        refused += usize::from(outcome.is_err());
    }
    lock(&storage.0).failure = None;
    // A pending cursor is written, and the next change ends the failure.
    store.flush().unwrap();
    contents.change_small_records(REQUESTS + 3, &store).unwrap();
    assert_eq!(store.trouble(), None, "{failure:?}");
    let in_memory = Contents::in_store(&store);
    drop(store);
    let again = Contents::in_store(&storage.store(folder).unwrap());
    assert_eq!(again, in_memory, "{failure:?}");
    let without_cursors = |mut contents: Contents| {
        contents.sessions.values_mut().for_each(|saved| saved.cursor = Cursor::default());
        contents
    };
    assert_eq!(without_cursors(again), without_cursors(contents), "{failure:?}");
    refused
}

#[test]
fn power_full_and_failing_disks_refuse_and_later_writes_succeed() {
    let folder = tempfile::tempdir().unwrap();
    let (begin, ops, _) = recorded(folder.path());
    let writes = ops.iter().filter(|op| !matches!(op, Op::Acknowledged)).count();
    let points = points();
    let mut refused = 0;
    for point in 0..points {
        let at = point * writes / points;
        let kind = [ErrorKind::StorageFull, ErrorKind::Other][point % 2];
        // A single failure, or several as on a full disk.
        refused += with_failure(&begin, folder.path(), (at, [1, 1, 25][point % 3], kind));
    }
    assert!(refused > points / 2, "{refused}");
    println!(
        "drill | {:<44} | {points} failures at {writes} operations: {refused} requests refused and taken back, all others kept",
        "ENOSPC and EIO"
    );
}
