//! Repeated requests: with a key they create once, and an unchanged run is not sent again.

use std::sync::Arc;

use axum::body::Body;
use axum::http::{Method, header};
use serde_json::{Value, json};
use sightline_tests::server::{Answer, PIXEL, TestServer, request, small_drive};

async fn with_key(server: &TestServer, path: &str, key: &str, body: &Value) -> Answer {
    let request = request(Method::POST, path)
        .header(header::CONTENT_TYPE, "application/json")
        .header("Idempotency-Key", key)
        .body(Body::from(body.to_string()));
    server.send(request.unwrap()).await
}

/// The response without the headers that differ for each request.
fn same(answer: &Answer) -> (u16, Option<String>, Vec<u8>) {
    let location = answer.headers.get(header::LOCATION).map(|value| value.to_str().unwrap().to_owned());
    (answer.status.as_u16(), location, answer.bytes.clone())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_request_with_a_key_creates_once() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let [x, y] = PIXEL;
    let new_session = json!({ "traverse": server.traverse });
    let target = json!({ "step": 0, "pixel": { "x": x, "y": y } });
    let note = json!({ "target": 0, "run": 0, "step": 0, "text": "once" });
    let run = json!({ "run": 0, "from_step": 1, "settings": { "ncc_min": 0.9 } });
    let breakpoint = json!({ "expression": "ncc < 0.9" });
    for (path, body) in [
        ("sessions", &new_session),
        ("sessions/s1/targets", &target),
        ("sessions/s1/targets/0/runs", &run),
        ("sessions/s1/notes", &note),
        ("sessions/s1/breakpoints", &breakpoint),
    ] {
        if path.ends_with("runs") {
            server.ended("s1", 0, 0).await;
        }
        let first = with_key(&server, path, path, body).await;
        assert!(first.status.is_success(), "{path}: {}", first.text());
        let again = with_key(&server, path, path, body).await;
        assert_eq!(same(&again), same(&first), "{path}");
    }
    let view = server.get("sessions/s1").await.expect(200);
    assert_eq!(server.get("sessions").await.expect(200).as_array().unwrap().len(), 1);
    assert_eq!(view["targets"].as_array().unwrap().len(), 1);
    assert_eq!(view["targets"][0]["runs"].as_array().unwrap().len(), 2);
    assert_eq!(server.get("sessions/s1/notes").await.expect(200).as_array().unwrap().len(), 1);
    // Without a key every request counts.
    server.post("sessions", &new_session).await.expect(201);
    server.post("sessions", &new_session).await.expect(201);
    assert_eq!(server.get("sessions").await.expect(200).as_array().unwrap().len(), 3);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_key_is_of_one_request() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let body = json!({ "traverse": server.traverse });
    with_key(&server, "sessions", "k", &body).await.expect(201);
    let other = json!({ "traverse": server.traverse, "more": 1 });
    with_key(&server, "sessions", "k", &other).await.problem(422, "idempotency_key");
    with_key(&server, "sessions/s1/notes", "k", &body).await.problem(422, "idempotency_key");
    for wrong in ["", "two words", &"x".repeat(256)] {
        with_key(&server, "sessions", wrong, &body).await.problem(422, "idempotency_key");
    }
    // A refused request creates nothing and may be repeated.
    let missing = json!({ "traverse": "nowhere" });
    with_key(&server, "sessions", "later", &missing).await.problem(422, "field");
    with_key(&server, "sessions", "later", &body).await.expect(201);
}

#[tokio::test(flavor = "multi_thread")]
async fn requests_with_one_key_at_once_create_once() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = Arc::new(TestServer::open(drive.path(), folder.path()));
    let body = json!({ "traverse": server.traverse });
    let ask = || {
        let (server, body) = (Arc::clone(&server), body.clone());
        tokio::spawn(async move { same(&with_key(&server, "sessions", "k", &body).await) })
    };
    let all: Vec<_> = (0..16).map(|_| ask()).collect();
    let mut answers = Vec::new();
    for one in all {
        answers.push(one.await.unwrap());
    }
    assert!(answers.iter().all(|answer| *answer == answers[0] && answer.0 == 201));
    assert_eq!(server.get("sessions").await.expect(200).as_array().unwrap().len(), 1);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_run_is_sent_again_only_when_it_changed() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let session = server.begin().await;
    server.pick(&session).await;
    server.ended(&session, 0, 0).await;
    let path = format!("sessions/{session}/targets/0/runs/0");
    let first = server.get(&path).await;
    let tag = first.headers[header::ETAG].to_str().unwrap().to_owned();
    let ask = || request(Method::GET, &path).header(header::IF_NONE_MATCH, &tag).body(Body::empty()).unwrap();
    let again = server.send(ask()).await;
    assert_eq!((again.status.as_u16(), again.bytes.len()), (304, 0));
    assert_eq!(again.headers[header::ETAG], tag.as_str());
    let tail = server.get(&format!("{path}?from_row=3")).await;
    assert_ne!(tail.headers[header::ETAG], tag.as_str());
    assert_eq!(server.send(ask()).await.status.as_u16(), 304);
    server.post(&format!("{path}/cancel"), &json!({})).await.problem(409, "conflict");
    let fork = json!({ "run": 0, "from_step": 0, "settings": { "ncc_min": 0.999 } });
    server.post(&format!("sessions/{session}/targets/0/runs"), &fork).await.expect(202);
    assert_eq!(server.send(ask()).await.status.as_u16(), 304, "another run is another thing");
}
