//! Opening files: recognition, refusals, and effects.

use serde_json::{Value, json};
use sightline_api::endpoint::Call;
use sightline_api::endpoints::{
    AddBreakpoint, AddTraverse, BringSession, ListSessions, RemoveSession, ShowSession,
};
use sightline_api::event::Event;
use sightline_api::location::{Anywhere, AtSession};
use sightline_api::wire::{NewTraverse, Problem, SessionEntry, TraverseEntry};
use sightline_rover::version::tracker_version;
use sightline_session::reproduce::{FORMAT, FORMAT_VERSION};
use sightline_track::settings::Settings;
use sightline_world::Scenario;

use crate::command::Command;
use crate::command::keys;
use crate::files::FilesCommand;
use crate::files::documents::{Document, TEXT_LIMIT, before_reading, only_one, read, shown};
use crate::files::inbox::Arrival;
use crate::files::window;
use crate::panels::pane::Pane;
use crate::state::State;
use crate::state::effect::Effect;
use crate::state::messages::Weight;
use crate::tests::calls::{answer, bodies, calls, calls_of, refuse};
use crate::tests::{Shown, fixture};

fn reproduce() -> Value {
    let session = fixture::without_target().session.unwrap();
    json!({
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "program": { "tracker": tracker_version() },
        "traverse": { "id": "drive", "name": "Six stops", "scenario_toml": null },
        "session": { "format": 1, "id": session.id, "traverse": "drive", "cursor": session.cursor, "targets": [] },
        "notes": [],
    })
}

/// The refusal of a file, which must be one sentence that names it.
fn refused(name: &str, bytes: &[u8]) -> String {
    let said = before_reading(name, bytes.len() as u64, false).and_then(|()| read(name, bytes).map(|_| ()));
    let said = said.expect_err("a refusal");
    assert!(said.starts_with(&shown(name)) && said.ends_with('.') && !said.contains('\n'), "{said}");
    said
}

#[test]
fn every_kind_of_file_that_can_be_opened_is_recognised_by_its_contents() {
    let scenario = Scenario::demo().to_toml();
    assert_eq!(read("drive.toml", scenario.as_bytes()), Ok(Document::Drive(scenario.clone())));
    assert_eq!(read("drive.txt", b"seed = 4"), Ok(Document::Drive("seed = 4".to_owned())));
    let changed = |document: Result<Document, String>| match document {
        Ok(Document::Settings(changes)) => serde_json::to_value(changes).unwrap(),
        other => panic!("{other:?}"),
    };
    let two = json!({ "ncc_min": 0.6, "search_window_px": 81 });
    assert_eq!(changed(read("a.toml", b"ncc_min = 0.6\nsearch_window_px = 81\n")), two);
    assert_eq!(changed(read("a.json", two.to_string().as_bytes())), two);
    let whole = Settings::default().with(&serde_json::from_value(two.clone()).unwrap()).unwrap();
    assert_eq!(changed(read("a.json", &serde_json::to_vec(&whole).unwrap())), two, "group by group");
    assert!(matches!(read("r.json", reproduce().to_string().as_bytes()), Ok(Document::Session(_))));
    let list =
        json!([{ "number": 3, "expression": "ncc < 0.5", "on": false, "count": 2, "hits": [] }, "step == 4"]);
    let both = vec![("ncc < 0.5".to_owned(), false), ("step == 4".to_owned(), true)];
    assert_eq!(read("b.json", list.to_string().as_bytes()), Ok(Document::Breakpoints(both)));
}

#[test]
fn an_unsupported_file_is_refused_with_its_name_and_a_fix() {
    let json = |value: Value| value.to_string().into_bytes();
    for (name, bytes, fix) in [
        ("log.rrd", b"RRF2".to_vec(), "rerun FILE"),
        ("left_0001.png", vec![137, 80, 78, 71], "press Open (Ctrl+O) and choose its folder"),
        ("calib.txt", b"P0: 1 0 0".to_vec(), "is one file of a KITTI recording: press Open (Ctrl+O)"),
        ("poses.txt", b"1 0 0 0".to_vec(), "sightline serve --recordings FOLDER"),
        ("notes.txt", b"P0: 1 0 0".to_vec(), "sightline scenarios"),
        ("rows.csv", b"step,ncc".to_vec(), "reproduce.json"),
        ("drive.zip", b"PK".to_vec(), "unpack it"),
        ("traverse.toml", b"format = 1".to_vec(), "sightline serve --recordings FOLDER"),
        ("index.toml", b"[[stops]]\ntime_s = 0".to_vec(), "sightline serve --recordings FOLDER"),
        ("empty.toml", Vec::new(), "export it again"),
        ("blank.toml", b"\n  \n".to_vec(), "export it again"),
        ("folder", Vec::new(), "sightline serve --recordings FOLDER"),
        ("core", vec![0x7f, b'E', b'L', b'F', 0, 0xff, 0xfe], "no text"),
        ("nul.toml", b"seed = 4\0".to_vec(), "no text"),
        (
            "drive.toml",
            b"[sun]\nheight_deg = 3.0\n".to_vec(),
            "line 2: sun.height_deg: unknown field `height_deg`",
        ),
        ("drive.toml", b"[sun]\nelevation_deg = -3.0\n".to_vec(), "sun.elevation_deg"),
        ("drive.toml", b"seed = = 4\n".to_vec(), "no TOML: line 1"),
        ("other.toml", b"colour = 3\n".to_vec(), "`colour`"),
        ("a.toml", b"ncc_min = 7.0\n".to_vec(), "ncc_min"),
        ("a.toml", b"ncc_min = 0.6\nncc_mim = 0.5\n".to_vec(), "ncc_mim"),
        ("a.toml", b"preset = \"none\"\n".to_vec(), "use one of"),
        ("a.json", b"{\"a\": ".to_vec(), "no JSON"),
        ("a.json", json(json!({ "colour": 3 })), "neither"),
        ("b.json", json(json!([])), "no breakpoint"),
        ("b.json", json(json!([{ "expression": "ncc <" }])), "breakpoint 1"),
        ("b.json", json(json!([3])), "entry 1"),
    ] {
        let said = refused(name, &bytes);
        assert!(said.contains(fix), "{said}");
    }
    let mut newer = reproduce();
    newer["format_version"] = json!(9);
    assert!(refused("reproduce.json", &json(newer)).contains("version 9"));
    let mut odd = reproduce();
    odd["session"]["cursor"]["step"] = json!("two");
    assert!(refused("reproduce.json", &json(odd)).contains("session.cursor.step"));
}

#[test]
fn size_number_and_kind_are_judged_before_anything_is_read() {
    let said = before_reading("huge.toml", 1 << 30, false).unwrap_err();
    assert!(said.contains("1074 MB") && said.contains("huge.toml"), "{said}");
    assert!(before_reading("a.toml", TEXT_LIMIT, false).is_ok());
    assert!(before_reading("a.toml", TEXT_LIMIT + 1, false).is_err());
    assert!(before_reading("a.json", TEXT_LIMIT + 1, false).is_ok(), "a session may be larger");
    assert!(before_reading("drive", 4096, true).unwrap_err().contains("is a folder"));
    let two = only_one(&["a.toml".to_owned(), "b.toml".to_owned()]).unwrap_err();
    assert!(two.contains("“a.toml”") && two.contains("one at a time"), "{two}");
    assert!(only_one(&["a.toml".to_owned()]).is_ok());
    let long = shown(&"x".repeat(500));
    assert!(long.chars().count() <= 62, "{long}");
    assert_eq!(shown("a\nb"), "“a b”");
}

fn drop_file(state: &mut State, name: &str, bytes: &[u8]) {
    state.file_arrived(Arrival::Read { name: name.to_owned(), bytes: bytes.to_vec() });
}

fn newest(state: &State) -> (Weight, String) {
    let message = state.messages.newest().expect("a message");
    (message.weight, message.text.clone())
}

#[test]
fn a_scenario_is_sent_and_its_drive_is_opened_and_a_refusal_leaves_everything_as_it_was() {
    let mut state = fixture::at_step(&egui::Context::default(), 2);
    state.take_requests();
    let send = |state: &mut State| {
        drop_file(state, "hill.toml", b"seed = 4");
        bodies::<AddTraverse>(state)
    };
    assert_eq!(send(&mut state), [NewTraverse { scenario: "seed = 4".to_owned() }]);
    assert_eq!(state.files.opening.as_deref(), Some("“hill.toml”"));
    let problem = Problem::new(409, "conflict", "", "There are 64 drives already.");
    refuse::<AddTraverse>(&mut state, problem);
    assert_eq!(newest(&state).1, "“hill.toml” cannot be opened: There are 64 drives already.");
    assert_eq!((state.files.opening.as_deref(), state.cursor.step), (None, 2));
    let entry = sightline_api::wire::TraverseEntry { id: "hill-1".to_owned(), ..fixture::entry() };
    send(&mut state);
    answer::<AddTraverse>(&mut state, &entry);
    let sessions = Call::to::<ListSessions>(&Anywhere {});
    assert_eq!(calls(&mut state), [sessions], "its latest session, or a new one");
    assert_eq!(state.traverses.as_ref().unwrap().len(), 2);
}

#[test]
fn a_reproduced_session_is_opened_at_its_cursor() {
    let mut state = fixture::at_step(&egui::Context::default(), 2);
    state.take_requests();
    drop_file(&mut state, "reproduce.json", reproduce().to_string().as_bytes());
    let mut view = state.session.clone().unwrap();
    (view.id, view.cursor.step) = ("s9".to_owned(), 4);
    answer::<BringSession>(&mut state, &view);
    assert_eq!((state.session.as_ref().unwrap().id.as_str(), state.cursor.step), ("s9", 4));
    let mut other = reproduce();
    other["program"]["tracker"] = json!("0.0.1");
    drop_file(&mut state, "reproduce.json", other.to_string().as_bytes());
    assert!(state.messages.all().iter().any(|message| message.text.contains("made with tracker 0.0.1")));
}

#[test]
fn a_configuration_becomes_the_draft_that_takes_the_run_to_it_and_can_be_taken_back() {
    let mut state = fixture::at_step(&egui::Context::default(), 2);
    drop_file(&mut state, "a.toml", b"ncc_min = 0.6\n");
    assert_eq!(serde_json::to_value(&state.draft).unwrap(), json!({ "ncc_min": 0.6 }));
    assert!(state.take_effects().contains(&Effect::reveal(Pane::Settings)));
    state.perform(Command::Why(crate::why::WhyCommand::Undo));
    assert!(state.draft.is_empty());
    drop_file(&mut state, "a.toml", b"ncc_min = 0.7\n");
    assert!(newest(&state).1.contains("of this very run"), "{}", newest(&state).1);
    let mut without = fixture::without_target();
    drop_file(&mut without, "a.toml", b"ncc_min = 0.6\n");
    assert!(newest(&without).1.contains("pick a target (T)"), "{}", newest(&without).1);
}

#[test]
fn breakpoints_of_a_file_are_set_and_those_that_are_off_are_switched_off() {
    let mut state = fixture::at_step(&egui::Context::default(), 2);
    state.take_requests();
    let list = json!([{ "expression": "ncc < 0.5", "on": false }, "step == 4"]);
    drop_file(&mut state, "b.json", list.to_string().as_bytes());
    let added = bodies::<AddBreakpoint>(&mut state).into_iter().filter_map(|new| new.expression);
    assert_eq!(added.collect::<Vec<_>>(), ["ncc < 0.5", "step == 4"]);
    assert_eq!(newest(&state).1, "2 breakpoints of “b.json” set.");
}

fn entry(id: &str, idle_s: Option<f64>) -> SessionEntry {
    SessionEntry {
        id: id.to_owned(),
        traverse: "drive".to_owned(),
        target_count: 1,
        traverse_name: "Six stops".to_owned(),
        run_count: 3,
        step: 4,
        stop_count: 6,
        used: None,
        idle_s,
    }
}

#[test]
fn recent_sessions_are_listed_by_their_use_and_one_click_opens_one() {
    let window = |context: &egui::Context| {
        let mut state = fixture::at_step(context, 2);
        let ctrl = egui::Modifiers::CTRL;
        let open = keys::command(egui::Key::O, ctrl, &state).unwrap();
        state.perform(open);
        let list =
            [entry("s1", Some(10.0)), entry("s2", None), entry("s3", Some(7200.0)), entry("s4", Some(90.0))];
        answer::<ListSessions>(&mut state, &list);
        state.take_requests();
        state
    };
    let ids = window(&egui::Context::default()).files.recent.unwrap();
    assert_eq!(ids.iter().map(|entry| entry.id.as_str()).collect::<Vec<_>>(), ["s1", "s4", "s3", "s2"]);
    let mut shown = Shown::new([1000.0, 800.0], window, window::show);
    shown.says("scenario (.toml)").says("new session on Six stops");
    let name = "session s3 on Six stops: 1 target, 3 runs, at step 4 of 5, used 2 hours ago";
    assert_eq!(shown.click(name), vec![Command::Files(FilesCommand::Resume("s3".to_owned()))]);
    let mut state = window(&egui::Context::default());
    state.perform(Command::Files(FilesCommand::Resume("s3".to_owned())));
    let read = Call::to::<ShowSession>(&AtSession { session: "s3".to_owned() });
    assert_eq!((calls(&mut state), state.files.is_open), (vec![read], false));
    state.perform(Command::Files(FilesCommand::Open));
    state.perform(Command::Files(FilesCommand::Resume("s1".to_owned())));
    assert_eq!(newest(&state).1, "That session is open already.");
}

#[test]
fn a_listed_session_is_removed_and_restored_with_one_click_each() {
    let window = |context: &egui::Context| {
        let mut state = fixture::at_step(context, 2);
        (state.files.is_open, state.files.recent) = (true, Some(vec![entry("s1", None), entry("s3", None)]));
        state.files.removed = vec![entry("s2", None)];
        state
    };
    let mut shown = Shown::new([1000.0, 800.0], window, window::show);
    let removed = Command::Files(FilesCommand::RemoveSession(Box::new(entry("s3", None))));
    assert_eq!(shown.click("remove session s3"), vec![removed.clone()]);
    assert_eq!(
        shown.click("restore session s2"),
        vec![Command::Files(FilesCommand::RestoreSession("s2".to_owned()))]
    );

    let mut state = window(&egui::Context::default());
    state.take_requests();
    state.perform(removed);
    let expected = Call::to::<RemoveSession>(&AtSession { session: "s3".to_owned() });
    assert_eq!(calls_of::<RemoveSession>(&mut state), [expected]);
    answer::<RemoveSession>(&mut state, &());
    assert_eq!(state.files.removed.last().unwrap().id, "s3");
    state.apply_event(Event::SessionRemoved { session: "s1".to_owned() });
    assert!(newest(&state).1.contains("s1 was removed"), "the open one, by another page");
}

#[test]
fn a_drive_is_removed_after_a_question() {
    let window = |context: &egui::Context| {
        let mut state = fixture::at_step(context, 2);
        let hill = TraverseEntry { id: "hill-1".to_owned(), name: "hill".to_owned(), ..fixture::entry() };
        state.files.is_open = true;
        state.traverses = Some(vec![fixture::entry(), TraverseEntry { removable: true, ..hill }]);
        state
    };
    let asked = Command::Files(FilesCommand::ConfirmDrive(Some("hill-1".to_owned())));
    let mut shown = Shown::new([1000.0, 800.0], window, window::show);
    assert_eq!(shown.click("remove the drive hill"), vec![asked.clone()]);
    let confirming = move |context: &egui::Context| {
        let mut state = window(context);
        state.perform(asked.clone());
        state
    };
    let mut shown = Shown::new([1000.0, 800.0], confirming, window::show);
    let really = Command::Files(FilesCommand::RemoveDrive("hill-1".to_owned()));
    assert_eq!(shown.click("really remove the drive hill"), vec![really]);
    let mut state = window(&egui::Context::default());
    state.apply_event(Event::TraverseRemoved { traverse: "hill-1".to_owned() });
    assert_eq!(state.traverses.unwrap().len(), 1);
}

#[test]
fn the_veil_says_what_can_be_dropped_and_the_empty_list_how_it_fills() {
    let hovered = |_: &egui::Context| {
        let mut state = fixture::without_target();
        state.files.is_hovered = true;
        state
    };
    Shown::new([1000.0, 700.0], hovered, |ui, state, _| window::veil(ui, state))
        .says("Drop one file to open it. a scenario (.toml) opens the simulated drive");
    let empty = |_: &egui::Context| {
        let mut state = fixture::nothing();
        (state.files.is_open, state.files.recent, state.traverses) =
            (true, Some(Vec::new()), Some(Vec::new()));
        state
    };
    Shown::new([1000.0, 700.0], empty, window::show).says("No session yet").says("The server has no drive");
}
