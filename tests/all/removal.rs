//! Removing sessions, drives and targets: memory is released, other pages are notified, and removals can be undone.

use std::sync::{Arc, Weak};
use std::time::{Duration, Instant};

use axum::http::Method;
use serde_json::{Value, json};
use sightline_tests::server::{TestServer, small_drive, small_scenario};
use sightline_world::Scenario;

async fn delete(server: &TestServer, path: &str) -> u16 {
    server.json(Method::DELETE, path, &json!({})).await.status.as_u16()
}

/// Opens a drive other than the server's first one, and returns its name.
async fn other_drive(server: &TestServer) -> String {
    let other = Scenario { name: "other drive".to_owned(), seed: 77, ..small_scenario() };
    let entry = server.post("traverses", &json!({ "scenario": other.to_toml() })).await.expect(201);
    assert_eq!(entry["removable"], json!(true));
    entry["id"].as_str().unwrap().to_owned()
}

/// Waits until a value has no owner.
async fn freed<T>(weak: Weak<T>) {
    let begun = Instant::now();
    while weak.upgrade().is_some() {
        assert!(begun.elapsed() < Duration::from_secs(60), "its memory is given back");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_removed_session_can_be_restored_until_it_is_discarded() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let session = server.begin().await;
    server.pick(&session).await;
    let rows = server.ended(&session, 0, 0).await["rows"].clone();
    let note = json!({ "target": 0, "run": 0, "step": 1, "text": "kept" });
    server.post(&format!("sessions/{session}/notes"), &note).await.expect(201);
    let path = format!("sessions/{session}");
    let mut events = server.state.events().subscribe();
    assert_eq!(delete(&server, &path).await, 204);
    // On a busy machine events of the run may arrive after its end.
    let mut sent =
        std::iter::from_fn(|| events.try_recv().ok()).map(|event| serde_json::to_value(event).unwrap());
    assert!(sent.any(|event| event == json!({ "event": "session_removed", "session": session })));
    server.get(&path).await.problem(404, "not_found");
    assert_eq!(delete(&server, &path).await, 404);
    assert_eq!(server.get("sessions").await.expect(200), json!([]));

    server.post(&format!("{path}/restore"), &json!({})).await.expect(200);
    assert_eq!(server.ended(&session, 0, 0).await["rows"], rows);
    let notes = server.get(&format!("{path}/notes")).await.expect(200);
    assert_eq!(notes[0]["text"], json!("kept"));
    server.post(&format!("{path}/restore"), &json!({})).await.problem(404, "not_found");

    assert_eq!(delete(&server, &path).await, 204);
    drop(server);
    let server = TestServer::open(drive.path(), folder.path());
    assert_eq!(server.get("sessions").await.expect(200), json!([]));
    server.post(&format!("{path}/restore"), &json!({})).await.problem(404, "not_found");
    assert_ne!(server.begin().await, session, "its name is not used again");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_removed_while_computing_frees_its_memory() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let session = server.begin().await;
    server.pick(&session).await;
    let live = Arc::downgrade(&server.state.session(&session).unwrap());
    assert_eq!(delete(&server, &format!("sessions/{session}")).await, 204);
    freed(live).await;
    assert!(server.state.store().load().unwrap().sessions.is_empty(), "nothing is written any more");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_drive_without_sessions_is_removed_with_its_folder() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let id = other_drive(&server).await;
    let (path, made) = (format!("traverses/{id}"), folder.path().join("traverses"));
    let view = server.post("sessions", &json!({ "traverse": id })).await.expect(201);
    let session = view["id"].as_str().unwrap();
    let refused = server.json(Method::DELETE, &path, &json!({})).await;
    assert!(refused.problem(409, "conflict").contains("1 session"));
    let given = format!("traverses/{}", server.traverse);
    server.json(Method::DELETE, &given, &json!({})).await.problem(409, "conflict");

    assert_eq!(delete(&server, &format!("sessions/{session}")).await, 204);
    assert_eq!(std::fs::read_dir(&made).unwrap().count(), 1);
    let open = Arc::downgrade(&server.state.traverse(&id).unwrap());
    let mut events = server.state.events().subscribe();
    assert_eq!(delete(&server, &path).await, 204);
    let sent: Vec<Value> = std::iter::from_fn(|| events.try_recv().ok())
        .map(|event| serde_json::to_value(event).unwrap())
        .collect();
    assert!(sent.contains(&json!({ "event": "traverse_removed", "traverse": id })), "{sent:?}");
    assert_eq!(std::fs::read_dir(&made).unwrap().count(), 0);
    freed(open).await;
    server.get(&path).await.problem(404, "not_found");
    let restore = server.post(&format!("sessions/{session}/restore"), &json!({})).await;
    restore.problem(404, "not_found");
    drop(server);
    let server = TestServer::open(drive.path(), folder.path());
    assert_eq!(server.get("traverses").await.expect(200).as_array().unwrap().len(), 1);
    // Images without an index, as left by an interrupted removal, do not block the drive.
    assert_eq!(other_drive(&server).await, id);
    let own = std::fs::read_dir(&made).unwrap().next().unwrap().unwrap().path();
    assert_eq!(delete(&server, &path).await, 204);
    std::fs::create_dir_all(own.join("images")).unwrap();
    std::fs::write(own.join("images/left_0000.png"), "half").unwrap();
    assert_eq!(other_drive(&server).await, id);
}

#[tokio::test(flavor = "multi_thread")]
async fn removed_targets_do_not_count() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let session = server.begin().await;
    // The session of a user who picked and removed a target 300 times.
    server.pick(&session).await;
    server.ended(&session, 0, 0).await;
    let mut saved = server.state.store().load().unwrap().sessions.remove(0);
    let mut removed = saved.targets[0].clone();
    removed.removed = true;
    removed.runs.clear();
    saved.targets.extend(std::iter::repeat_n(removed, 300));
    server.state.store().save(&saved).unwrap();
    drop(server);
    let server = TestServer::open(drive.path(), folder.path());
    assert_eq!(server.pick(&session).await, 301);
    let path = format!("sessions/{session}/targets/5/restore");
    let sentence = server.post(&path, &json!({})).await.problem(404, "not_found");
    assert!(sentence.contains("too long ago"), "{sentence}");
}

#[tokio::test(flavor = "multi_thread")]
async fn scenarios_that_would_slow_every_start_are_refused() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let moves = "[[drive.moves]]\nkind = \"forward\"\ndistance_m = 0.1\nstops = 200\n".repeat(200);
    for (text, named) in [
        (format!("[drive]\ncourse = \"moves\"\n{moves}"), "2000"),
        ("name = \"\"\n".to_owned(), "name"),
        ("name = \"a\\u0000b\"\n".to_owned(), "control character"),
        (format!("name = \"{}\"\n", "n".repeat(201)), "200"),
    ] {
        let sentence = server.post("traverses", &json!({ "scenario": text })).await.problem(422, "field");
        assert!(sentence.contains(named) && !sentence.contains('\n'), "{sentence}");
    }
}
