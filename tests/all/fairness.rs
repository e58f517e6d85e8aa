//! Runs take turns: a short one does not wait for long ones that started before it.

use axum::http::Method;
use serde_json::json;
use sightline_api::event::Event;
use sightline_tests::server::{PIXEL, TestServer, long_recording};

/// Stops of the drive; every eighth shows the first image.
const STOPS: usize = 2405;

#[tokio::test(flavor = "multi_thread")]
async fn short_run_ends_before_two_long_ones() {
    let (drive, sessions) = (long_recording(STOPS), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), sessions.path());
    let [x, y] = PIXEL;
    let mut begun = Vec::new();
    for step in [0, 0, STOPS - 5] {
        let session = server.begin().await;
        let new = json!({ "step": step, "pixel": { "x": x, "y": y } });
        server.post(&format!("sessions/{session}/targets"), &new).await.expect(201);
        begun.push(session);
    }
    assert_eq!(server.ended(&begun[2], 0, 0).await["rows"].as_array().unwrap().len(), 5);
    for session in &begun[..2] {
        let path = format!("sessions/{session}/targets/0/runs/0");
        let run = server.get(&path).await.expect(200);
        assert_eq!(
            (&run["complete"], &run["stopped"]),
            (&json!(false), &json!(null)),
            "{session} ended first"
        );
        server.post(&format!("{path}/cancel"), &json!({})).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_waiting_run_reports_its_queue_position() {
    let (drive, folder) = (long_recording(600), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let session = server.begin().await;
    server.pick(&session).await;
    server.pick(&session).await;
    let mut reports = Vec::new();
    // A new run may start at once between two steps of another one.
    while reports.len() < 5 && !reports.iter().any(|doing| doing == "waiting for 2 runs before it") {
        let mut events = server.state.events().subscribe();
        let next = server.pick(&session).await;
        reports.extend(std::iter::from_fn(|| events.try_recv().ok()).find_map(|event| match event {
            Event::RunProgress { target, doing, .. } if target as u64 == next => Some(doing),
            _ => None,
        }));
    }
    let waits = reports.iter().any(|doing| doing.starts_with("waiting for ") && doing.ends_with("before it"));
    assert!(waits, "{reports:?}");
    let removed = server.json(Method::DELETE, &format!("sessions/{session}"), &json!({})).await;
    assert_eq!(removed.status.as_u16(), 204, "the long runs end");
}
