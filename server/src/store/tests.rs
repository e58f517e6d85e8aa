//! Tests of the database: contents after a restart, damaged files, and recovery.

use super::deferred_writes::CURSOR_PERIOD;
use super::*;
use redb::{Database, ReadableDatabase};
use sightline_session::documents::Document;
use sightline_session::notes::{NewNote, Pin};
use sightline_session::view::{SavedRun, SavedTarget};
use sightline_session::{Fork, Session};
use sightline_track::settings::TrackerKind;

/// A session with a target, a run and a fork of it.
pub(super) fn saved(id: &str) -> SavedSession {
    let mut saved = Session::new(id, "t", 9).saved();
    let run = |fork: Option<Fork>| {
        let settings = serde_json::to_value(sightline_track::settings::Settings::default()).unwrap();
        let run = serde_json::json!({ "fork": fork, "settings": settings });
        serde_json::from_value::<SavedRun>(run).unwrap()
    };
    let target = serde_json::json!({
        "label": "rock", "designation": { "step": 1, "pixel": { "x": 0.1 + 0.2, "y": 1.0 / 3.0 } },
        "removed": false, "runs": []
    });
    let mut target: SavedTarget = serde_json::from_value(target).unwrap();
    target.runs = vec![run(None), run(Some(Fork::new(0, 3)))];
    saved.targets.push(target);
    saved.cursor = Cursor { target: Some(0), run: 1, step: 4 };
    saved
}

fn sessions(folder: &Path) -> Found {
    Store::open(folder).unwrap().load().unwrap()
}

#[test]
fn a_session_round_trips_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let mut notes = Notes::default();
    {
        let store = Store::open(folder.path()).unwrap();
        store.save(&saved("s2")).unwrap();
        let new = NewNote { pin: Pin { step: 3, ..Pin::default() }, text: "moved".to_owned() };
        notes.add(new, &Session::new("s2", "t", 9), "2026-11-22T12:00:00Z").unwrap();
        store.save_notes("s2", &notes).unwrap();
        let mut moved = saved("s2").cursor;
        moved.step = 7;
        store.move_cursor("s2", moved);
    }
    let found = sessions(folder.path());
    let mut expected = saved("s2");
    expected.cursor.step = 7;
    assert_eq!((found.sessions, found.last_number), (vec![expected], 2));
    assert_eq!(found.notes[&2], notes);
    assert!(found.messages.is_empty(), "{:?}", found.messages);
}

#[test]
fn a_run_removed_from_a_session_is_removed_from_the_database() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).unwrap();
    store.save(&saved("s1")).unwrap();
    let mut shorter = saved("s1");
    shorter.targets[0].runs.pop();
    store.save(&shorter).unwrap();
    assert_eq!(store.load().unwrap().sessions, vec![shorter]);
}

#[test]
fn a_cursor_is_written_without_a_flush() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).unwrap();
    store.save(&saved("s1")).unwrap();
    for step in 0..6 {
        store.move_cursor("s1", Cursor { target: Some(0), run: 0, step });
    }
    assert_eq!(read_only(folder.path()).unwrap().sessions[0].cursor.step, 4, "not at once");
    std::thread::sleep(2 * CURSOR_PERIOD);
    assert_eq!(read_only(folder.path()).unwrap().sessions[0].cursor.step, 5);
}

#[test]
fn json_files_of_an_earlier_version_are_imported_once() {
    let folder = tempfile::tempdir().unwrap();
    let text = serde_json::to_vec_pretty(&saved("s2")).unwrap();
    std::fs::write(folder.path().join("s2.json"), &text).unwrap();
    std::fs::write(folder.path().join("s7.json"), b"{\"format\": 1, \"id\"").unwrap();
    std::fs::write(folder.path().join("notes.txt"), b"mine").unwrap();
    let found = sessions(folder.path());
    assert_eq!((found.sessions, found.last_number), (vec![saved("s2")], 7));
    let messages = found.messages.join("\n");
    assert!(messages.contains("s2.json") && messages.contains("s7.json"), "{messages}");
    assert_eq!(std::fs::read(folder.path().join("s2.imported")).unwrap(), text);
    assert_eq!(std::fs::read(folder.path().join("s7.damaged")).unwrap(), b"{\"format\": 1, \"id\"");
    assert!(folder.path().join("notes.txt").is_file());
    // A file of the same name that appears later does not replace newer data.
    let mut older = saved("s2");
    older.targets.clear();
    std::fs::write(folder.path().join("s2.json"), serde_json::to_vec(&older).unwrap()).unwrap();
    assert_eq!(sessions(folder.path()).sessions, vec![saved("s2")]);
    assert!(folder.path().join("s2.imported-2").is_file());
}

/// The database of version 0.1.0 of 2026-11-23 in format 1: a session with two targets, a fork of a run, a note, a
/// breakpoint and a cursor, another session whose only target was removed, and a document.
#[test]
fn a_database_of_form_1_opens_and_its_records_are_all_there() {
    let folder = tempfile::tempdir().unwrap();
    let kept = include_bytes!("form_1.redb.gz").as_slice();
    let mut file = std::fs::File::create(folder.path().join(FILE_NAME)).unwrap();
    std::io::copy(&mut flate2::read::GzDecoder::new(kept), &mut file).unwrap();
    drop(file);
    for opening in ["form 1", "form 2"] {
        let store = Store::open(folder.path()).unwrap();
        let found = store.load().unwrap();
        assert!(found.messages.is_empty(), "{opening}: {:?}", found.messages);
        let [first, second] = found.sessions.as_slice() else { panic!("{opening}: {:?}", found.sessions) };
        let runs: Vec<usize> = first.targets.iter().map(|target| target.runs.len()).collect();
        assert_eq!((first.id.as_str(), runs, found.last_number), ("s1", vec![2, 1], 2), "{opening}");
        assert_eq!(first.targets[0].label, "the face");
        assert_eq!(first.targets[0].runs[1].fork, Some(Fork::new(0, 2)));
        assert_eq!(first.targets[0].runs[1].settings.limits.ncc_min, 0.9999);
        assert_eq!(first.targets[1].runs[0].settings.tracker, TrackerKind::Features);
        assert_eq!(first.cursor, Cursor { target: Some(0), run: 1, step: 3 });
        assert_eq!(first.breakpoints.len(), 1);
        assert!(second.targets.iter().all(|target| target.removed), "{opening}");
        let note = found.notes[&1].get(1).unwrap();
        assert_eq!((note.text.as_str(), note.pin.step), ("Here it is lost.", 2), "{opening}");
        assert_eq!(store.documents().unwrap()[0].name, "layout");
        let version = |database: &Database| {
            let meta = database.begin_read()?.open_table(META)?;
            Ok(meta.get("version")?.map(|version| version.value()))
        };
        assert_eq!(store.disk.read(version).unwrap(), Some(STORE_VERSION), "{opening}");
    }
}

#[test]
fn a_file_without_a_whole_record_is_moved_aside() {
    let whole = tempfile::tempdir().unwrap();
    Store::open(whole.path()).unwrap().save(&saved("s1")).unwrap();
    let good = std::fs::read(whole.path().join(FILE_NAME)).unwrap();
    let mut flipped = good.clone();
    // Overwrites a few bytes of every non-empty page.
    flipped
        .chunks_mut(4096)
        .filter(|page| page.iter().any(|byte| *byte != 0))
        .for_each(|page| page[16..48].fill(0xa5));
    for (name, bytes) in
        [("garbage", b"not a database at all".to_vec()), ("flipped", flipped), ("cut", good[..5000].to_vec())]
    {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join(FILE_NAME), &bytes).unwrap();
        let store = Store::open(folder.path()).unwrap();
        let found = store.load().unwrap();
        assert!(found.sessions.is_empty(), "{name}");
        assert!(found.messages[0].contains("sessions.redb.damaged"), "{name}: {:?}", found.messages);
        let aside = std::fs::read(folder.path().join("sessions.redb.damaged")).unwrap();
        assert_eq!(aside.len(), bytes.len(), "{name}");
        store.save(&saved("s1")).unwrap();
        assert_eq!(store.load().unwrap().sessions.len(), 1, "{name}");
    }
}

/// Fills a store with six sessions and one or more of all other records.
fn fill(store: &Store) -> Found {
    for number in 1..=6 {
        let id = id_of(number);
        store.save(&saved(&id)).unwrap();
        let mut notes = Notes::default();
        for text in ["first", &"long ".repeat(300)] {
            let new = NewNote { pin: Pin { step: 3, ..Pin::default() }, text: text.to_owned() };
            notes.add(new, &Session::new(&id, "t", 9), "2026-11-22T12:00:00Z").unwrap();
        }
        store.save_notes(&id, &notes).unwrap();
        store.touch(&id, "2026-11-22T12:00:00Z".to_owned());
    }
    store.remove("s5").unwrap();
    for name in ["layout", "tour"] {
        store.put_document(name, serde_json::json!([name, 0.1 + 0.2]), None).unwrap().unwrap();
    }
    store.save_study(1, &serde_json::json!({ "rows": [1.0 / 3.0] })).unwrap();
    store.save_drive("drive-1", "name = \"one\"").unwrap();
    store.flush().unwrap();
    store.load().unwrap()
}

#[test]
fn one_flipped_bit_costs_at_most_one_session() {
    const FLIPS: u64 = 60;
    let whole = tempfile::tempdir().unwrap();
    let store = Store::open(whole.path()).unwrap();
    let expected = fill(&store);
    assert_eq!((expected.sessions.len(), expected.last_number), (5, 6));
    // The file after a crash, and after an orderly shutdown.
    let killed = std::fs::read(whole.path().join(FILE_NAME)).unwrap();
    drop(store);
    let ended = std::fs::read(whole.path().join(FILE_NAME)).unwrap();
    let (mut damaged, mut older, mut lost) = (0, 0, 0);
    for flip in 0..FLIPS {
        let mut bytes = [&killed, &ended][flip as usize % 2].clone();
        let pages = bytes.chunks(4096).enumerate().filter(|(_, page)| page.iter().any(|byte| *byte != 0));
        let used: Vec<usize> = pages.map(|(page, _)| page * 4096).collect();
        let page = used[(flip as usize * 7) % used.len()];
        let bit = (flip * 2_654_435_761 % (4096 * 8)) as usize;
        bytes[page + bit / 8] ^= 1 << (bit % 8);
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join(FILE_NAME), &bytes).unwrap();
        let store = Store::open(folder.path()).unwrap();
        let found = store.load().unwrap();
        let context = format!("flip {flip}, page {page}, bit {bit}: {:?}", found.messages);
        damaged += u32::from(!found.messages.is_empty());
        let same = |saved: &&SavedSession| expected.sessions.contains(saved);
        let intact = found.sessions.iter().filter(same).count();
        assert!(intact >= 4, "{intact} of 5 sessions, {context}");
        assert!(found.sessions.iter().all(|saved| saved.id != "s5"), "a removed one came back, {context}");
        let is_whole = intact == 5 && found.notes == expected.notes;
        assert!(is_whole || !found.messages.is_empty(), "damage that nobody is told, {context}");
        older += usize::from(found.sessions.len() == 5 && !is_whole);
        lost += usize::from(found.sessions.len() < 5);
        assert!(store.documents().unwrap().len() + 1 >= 2, "{context}");
        // The store remains usable.
        store.save(&saved("s9")).unwrap();
        drop(store);
        assert!(Store::open(folder.path()).unwrap().load().unwrap().sessions.contains(&saved("s9")));
    }
    println!(
        "drill | {:<44} | {FLIPS} flips: {damaged} detected, all sessions lost 0 times, one session {lost} times, a part of \
         one {older} times",
        "one flipped bit"
    );
}

#[test]
fn an_empty_database_gives_a_notice() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join(FILE_NAME), b"").unwrap();
    let found = sessions(folder.path());
    assert!(found.messages[0].contains("was empty"), "{:?}", found.messages);
    assert!(sessions(folder.path()).messages.is_empty());
    assert!(sessions(tempfile::tempdir().unwrap().path()).messages.is_empty(), "a new folder is none");
}

#[test]
fn an_unreadable_session_is_moved_into_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).unwrap();
    store.save(&saved("s1")).unwrap();
    store.save(&saved("s2")).unwrap();
    store.disk.write(|write| write.put(RecordKey::Run((2, 0, 1)), &"nonsense").map(|_| ())).unwrap();
    let found = store.load().unwrap();
    assert_eq!(found.sessions, vec![saved("s1")]);
    assert!(found.messages[0].contains("session s2") && found.messages[0].contains("run 1 of target 0"));
    let aside = std::fs::read_to_string(folder.path().join("s2.damaged")).unwrap();
    assert!(aside.contains("nonsense") && aside.contains("rock"), "{aside}");
    let again = store.load().unwrap();
    assert_eq!((again.messages.len(), again.last_number), (0, 2));
}

#[test]
fn a_database_of_a_newer_version_is_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    {
        let store = Store::open(folder.path()).unwrap();
        let newer = |write: &Write| write.put_meta("version", STORE_VERSION + 1);
        store.disk.write(newer).unwrap();
    }
    let refused = Store::open(folder.path()).err().unwrap().to_string();
    assert!(refused.contains("newer version"), "{refused}");
    assert!(!folder.path().join("sessions.redb.damaged").exists());
}

#[test]
fn a_document_is_replaced_only_at_its_current_revision() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).unwrap();
    let put = |value: i32, revision| store.put_document("layout", value.into(), revision).unwrap();
    assert_eq!(put(1, Some(0)).unwrap().revision, 1);
    assert_eq!(put(2, Some(0)), Err(Clash::Changed(Some(1))));
    assert_eq!(
        put(3, Some(1)).unwrap(),
        Document { name: "layout".to_owned(), revision: 2, value: 3.into() }
    );
    assert_eq!(store.remove_document("layout", Some(1)).unwrap(), Err(Clash::Changed(Some(2))));
    assert_eq!(store.remove_document("layout", None).unwrap(), Ok(true));
    assert_eq!((store.documents().unwrap().len(), put(4, Some(2))), (0, Err(Clash::Changed(None))));
}

#[test]
fn only_canonical_session_names_are_accepted() {
    assert_eq!(number_of("s12"), Some(12));
    for id in ["", "s", "s01", "s+1", "s-1", "S1", "s1/", "../s1"] {
        assert_eq!(number_of(id), None, "{id}");
    }
}
