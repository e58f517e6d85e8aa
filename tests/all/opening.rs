//! Data that a page can send to the server: a scenario, which opens a drive, and `reproduce.json`, which opens a session.
//! The list of sessions has the time of last use, and every problem has the id of its request.

use axum::http::header;
use serde_json::{Value, json};
use sightline_session::reproduce::Opened;
use sightline_tests::server::{TestServer, small_drive, small_recording, small_scenario};
use sightline_world::Scenario;

/// A drive other than [`small_drive`].
fn other() -> Scenario {
    Scenario { name: "other drive".to_owned(), seed: 77, ..small_scenario() }
}

/// The code of a refusal, and the change that causes it.
type Change = (&'static str, fn(&mut Value));

/// The part of an exported file that the page sends.
fn reproduction_of(file: &Value) -> Value {
    serde_json::to_value(Opened::read(file).expect("a file of our own").reproduction).unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_scenario_drive_is_reopened_with_its_sessions() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let first = TestServer::open(drive.path(), folder.path());
    let new = json!({ "scenario": other().to_toml() });
    let entry = first.post("traverses", &new).await.expect(201);
    assert_eq!((&entry["name"], &entry["simulated"]), (&json!("other drive"), &json!(true)));
    assert_eq!(first.post("traverses", &new).await.expect(200), entry, "the same scenario is the same drive");
    let own = json!({ "scenario": small_scenario().to_toml() });
    assert_eq!(first.post("traverses", &own).await.expect(200)["id"], json!(first.traverse), "open before");
    assert_eq!(first.get("traverses").await.expect(200).as_array().map(Vec::len), Some(2));
    let begun = first.post("sessions", &json!({ "traverse": entry["id"] })).await.expect(201);
    drop(first);

    let again = TestServer::open(drive.path(), folder.path());
    let list = again.get("traverses").await.expect(200);
    assert_eq!(list[1], entry, "{list}");
    let session = again.get(&format!("sessions/{}", begun["id"].as_str().unwrap())).await.expect(200);
    assert_eq!(session["traverse"], entry["id"]);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_bad_scenario_is_refused_in_one_sentence_and_opens_nothing() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    for (text, named) in [
        ("seed = 2\n[sun]\nheight_deg = 3.0\n", "line 3: sun.height_deg: unknown field `height_deg`"),
        ("[sun]\nelevation_deg = -3.0\n", "sun.elevation_deg"),
        ("\u{0}\u{1}", "line 1"),
    ] {
        let sentence = server.post("traverses", &json!({ "scenario": text })).await.problem(422, "field");
        assert!(sentence.contains(named) && !sentence.contains('\n'), "{sentence}");
    }
    let unknown = json!({ "scenario": "", "folder": "/etc" });
    assert!(server.post("traverses", &unknown).await.problem(422, "field").contains("folder"));
    let large = json!({ "scenario": "#".repeat(2 << 20) });
    server.post("traverses", &large).await.problem(413, "too_large");
    assert_eq!(server.get("traverses").await.expect(200).as_array().map(Vec::len), Some(1));
}

#[tokio::test(flavor = "multi_thread")]
async fn an_exported_session_is_reproduced_on_another_server() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let session = server.begin().await;
    server.pick(&session).await;
    let before = server.ended(&session, 0, 0).await;
    let fork = json!({ "run": 0, "from_step": 2, "settings": { "search_window_px": 81 } });
    server.post(&format!("sessions/{session}/targets/0/runs"), &fork).await.expect(202);
    let branch = server.ended(&session, 0, 1).await;
    let breakpoint = json!({ "expression": "ncc < 0.99" });
    server.post(&format!("sessions/{session}/breakpoints"), &breakpoint).await.expect(201);
    let note = json!({ "target": 0, "step": 3, "text": "here" });
    server.post(&format!("sessions/{session}/notes"), &note).await.expect(201);
    let cursor = json!({ "target": 0, "run": 1, "step": 3 });
    server.json(axum::http::Method::PUT, &format!("sessions/{session}/cursor"), &cursor).await.expect(200);
    let file = server.get(&format!("sessions/{session}/exports/reproduce.json")).await.expect(200);

    // Another server, with another drive and without sessions.
    let (recording, elsewhere) = (small_recording(), tempfile::tempdir().unwrap());
    let other = TestServer::open(recording.path(), elsewhere.path());
    let view = other.post("sessions/reproduced", &reproduction_of(&file)).await.expect(201);
    let id = view["id"].as_str().unwrap();
    assert_eq!(
        (&view["traverse"], &view["cursor"]),
        (&file["traverse"]["id"], &cursor),
        "the drive came along"
    );
    assert_eq!(other.ended(id, 0, 0).await["rows"], before["rows"], "the same input gives the same bits");
    assert_eq!(other.ended(id, 0, 1).await["rows"], branch["rows"]);
    assert_eq!(
        other.get(&format!("sessions/{id}/breakpoints")).await.expect(200)[0]["expression"],
        "ncc < 0.99"
    );
    let notes = other.get(&format!("sessions/{id}/notes")).await.expect(200);
    assert_eq!((&notes[0]["text"], &notes[0]["step"]), (&json!("here"), &json!(3)));
}

#[tokio::test(flavor = "multi_thread")]
async fn an_exported_file_can_be_sent_as_it_is() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let session = server.begin().await;
    server.pick(&session).await;
    let rows = server.ended(&session, 0, 0).await["rows"].clone();
    let file = server.get(&format!("sessions/{session}/exports/reproduce.json")).await.expect(200);
    let parts = json!({ "traverse": file["traverse"], "session": file["session"], "notes": file["notes"] });
    for body in [&file, &parts] {
        let view = server.post("sessions/reproduced", body).await.expect(201);
        let id = view["id"].as_str().unwrap();
        assert_eq!(server.ended(id, 0, 0).await["rows"], rows);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_with_500_long_notes_can_be_brought_back() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let session = server.begin().await;
    server.pick(&session).await;
    server.ended(&session, 0, 0).await;
    server.post(&format!("sessions/{session}/notes"), &json!({ "step": 1, "text": "x" })).await.expect(201);
    let mut file = server.get(&format!("sessions/{session}/exports/reproduce.json")).await.expect(200);
    let note = file["notes"][0].clone();
    // Characters of four bytes each.
    let text = "𝛼".repeat(4000);
    let notes = (1..=500).map(|id| {
        let mut note = note.clone();
        (note["id"], note["text"]) = (json!(id), json!(text));
        note
    });
    file["notes"] = notes.collect();
    let size = file.to_string().len();
    assert!(size > 7 << 20 && size < sightline_api::program::FILE_BYTES, "{size} bytes");
    let view = server.post("sessions/reproduced", &file).await.expect(201);
    let notes_path = format!("sessions/{}/notes", view["id"].as_str().unwrap());
    let notes = server.get(&notes_path).await.expect(200);
    assert_eq!((notes.as_array().unwrap().len(), &notes[499]["text"]), (500, &json!(text)));
}

#[tokio::test(flavor = "multi_thread")]
async fn an_invalid_session_file_is_rejected_without_a_session() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let session = server.begin().await;
    server.pick(&session).await;
    server.ended(&session, 0, 0).await;
    let path = format!("sessions/{session}/exports/reproduce.json");
    let good = reproduction_of(&server.get(&path).await.expect(200));
    let changes: [Change; 7] = [
        ("traverse", |v| {
            v["traverse"] = json!({ "id": "mars-1", "name": "Mars", "scenario_toml": null });
        }),
        ("field", |v| v["session"]["targets"][0]["runs"][0]["settings"]["limits"]["ncc_min"] = json!(7.0)),
        ("field", |v| v["session"]["targets"][0]["label"] = json!("x".repeat(101))),
        ("field", |v| v["session"]["colour"] = json!("red")),
        ("request", |v| v["session"]["format"] = json!(9)),
        ("request", |v| v["session"]["targets"][0]["designation"]["step"] = json!(99)),
        ("field", |v| v["session"]["targets"] = json!("none")),
    ];
    for (code, change) in changes {
        let mut bad = good.clone();
        change(&mut bad);
        let sentence = server.post("sessions/reproduced", &bad).await.problem(422, code);
        assert!(!sentence.contains('\n'), "{sentence}");
    }
    let list = server.get("sessions").await.expect(200);
    assert_eq!(list.as_array().map(Vec::len), Some(1), "{list}");
    server.post("sessions/reproduced", &good).await.expect(201);
}

#[tokio::test(flavor = "multi_thread")]
async fn session_progress_and_last_use_survive_a_restart() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let session = server.begin().await;
    server.pick(&session).await;
    server.ended(&session, 0, 0).await;
    let cursor = json!({ "target": 0, "run": 0, "step": 4 });
    server.json(axum::http::Method::PUT, &format!("sessions/{session}/cursor"), &cursor).await.expect(200);
    let list = server.get("sessions").await.expect(200);
    let entry = &list[0];
    assert_eq!((&entry["traverse_name"], &entry["target_count"]), (&json!("small drive"), &json!(1)));
    assert_eq!(
        (&entry["run_count"], &entry["step"], &entry["stop_count"]),
        (&json!(1), &json!(4), &json!(5))
    );
    let idle_s = entry["idle_s"].as_f64().unwrap();
    assert!((0.0..60.0).contains(&idle_s), "used just now: {entry}");
    server.state.store().flush().unwrap();
    drop(server);
    let again = TestServer::open(drive.path(), folder.path());
    let list = again.get("sessions").await.expect(200);
    let used = |entry: &Value| entry["used"].as_str().unwrap()[..19].to_owned();
    assert_eq!((used(&list[0]), &list[0]["step"]), (used(entry), &json!(4)), "reading changes nothing");
}

#[tokio::test(flavor = "multi_thread")]
async fn problem_and_header_contain_request_id_and_time() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let first = server.get("sessions/s99").await;
    let second = server.post("sessions", &json!({ "traverse": 3 })).await;
    let name = |answer: &sightline_tests::server::Answer| {
        let problem = answer.json();
        let name = problem["request_id"].as_str().expect("a name").to_owned();
        assert_eq!(answer.headers["x-request-id"], name.as_str());
        assert_eq!(answer.headers[header::CONTENT_LENGTH], answer.bytes.len().to_string().as_str());
        assert!(problem["time"].as_str().unwrap().ends_with('Z'), "{problem}");
        name
    };
    assert_ne!(name(&first), name(&second));
    let wrong = json!({ "step": "two", "text": "a" });
    let session = server.begin().await;
    let sentence = server.post(&format!("sessions/{session}/notes"), &wrong).await.problem(422, "field");
    assert!(sentence.contains("two"), "{sentence}");
    assert!(!server.get("sessions").await.headers.contains_key("x-request-id"), "the same answer every time");
}
