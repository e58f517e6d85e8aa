//! Limits are settings: a refusal names the exceeded limit, slow clients cannot block the server, and memory is bounded.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use axum::http::Method;
use serde_json::{Value, json};
use sightline_recordings::{Traverse, create_simulated};
use sightline_server::app;
use sightline_server::limits::Limits;
use sightline_server::state::AppState;
use sightline_tests::server::{Answer, PIXEL, PORT, TOKEN, TestServer, access, small_drive, small_scenario};
use sightline_world::Scenario;

use crate::persistence::ServerProcess;

/// Maximum time for an operation that should be quick.
const PATIENCE: Duration = Duration::from_secs(120);

fn moved(limits: &[&str]) -> Limits {
    let mut all = Limits::default();
    limits.iter().for_each(|limit| all.set(limit).unwrap());
    all
}

fn state(drive: &Path, sessions: &Path, limits: &[&str]) -> Result<AppState, String> {
    let traverse = Traverse::open(drive).unwrap();
    AppState::with_limits(vec![traverse], sessions, access(PORT), moved(limits)).map_err(|e| e.to_string())
}

fn serve(drive: &Path, sessions: &Path, limits: &[&str]) -> TestServer {
    let state = state(drive, sessions, limits).unwrap();
    let traverse = state.traverses()[0].id.clone();
    TestServer { app: app(state.clone()), state, traverse }
}

/// Asserts that a response is a problem that names the limit and how to raise it.
fn names(answer: &Answer, status: u16, code: &str, raised: &str) {
    answer.problem(status, code);
    let hint = answer.json()["hint"].as_str().unwrap_or_default().to_owned();
    assert!(hint.contains(&format!("--limit {raised}")), "{hint}");
}

async fn usage(server: &TestServer, part: &str) -> u64 {
    server.get("health").await.expect(200)["usage"][part].as_u64().unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn exceeding_a_limit_is_rejected_by_its_name() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let limits =
        ["sessions=1", "targets=1", "runs=1", "drives=1", "body_bytes=3000", "file_bytes=4000", "stops=5"];
    let server = serve(drive.path(), folder.path(), &limits);
    let session = server.begin().await;
    server.pick(&session).await;
    server.ended(&session, 0, 0).await;
    let new = json!({ "traverse": server.traverse });
    names(&server.post("sessions", &new).await, 409, "conflict", "sessions=2");
    let [x, y] = PIXEL;
    let target = json!({ "step": 0, "pixel": { "x": x, "y": y } });
    let targets = format!("sessions/{session}/targets");
    names(&server.post(&targets, &target).await, 409, "conflict", "targets=2");
    let run = json!({ "run": 0, "from_step": 1, "settings": { "ncc_min": 0.9 } });
    names(&server.post(&format!("{targets}/0/runs"), &run).await, 409, "conflict", "runs=2");
    let scenario = |text: &str| json!({ "scenario": text });
    let long = scenario(&"#".repeat(3000));
    names(&server.post("traverses", &long).await, 413, "too_large", "body_bytes=6000");
    let file = json!({ "traverse": "x".repeat(4000) });
    names(&server.post("sessions/reproduced", &file).await, 413, "too_large", "file_bytes=8000");
    // A session file may be larger than other bodies.
    let file = json!({ "traverse": "x".repeat(3500) });
    server.post("sessions/reproduced", &file).await.problem(422, "field");
    let longer =
        "[drive]\ncourse = \"moves\"\n[[drive.moves]]\nkind = \"forward\"\ndistance_m = 0.1\nstops = 9\n";
    let refused = server.post("traverses", &scenario(longer)).await.problem(422, "request");
    assert!(refused.contains("--limit stops=10"), "{refused}");
    let limits = server.get("version").await.expect(200)["limits"].clone();
    assert_eq!(limits, json!({ "body_bytes": 3000, "targets": 1, "runs": 1 }));
}

#[test]
fn a_drive_beyond_the_limits_is_not_served() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let refused = |limit: &str| state(drive.path(), folder.path(), &[limit]).err().unwrap();
    assert!(refused("image_pixels=65535").contains("256 × 256 pixels"));
    assert!(refused("stops=4").contains("--limit stops=8"));
}

/// A drive whose first stop is rendered, and whose other stops take many seconds: 134 million samples each.
fn slow_to_render() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let mut scenario = small_scenario();
    (scenario.camera.image_size, scenario.camera.samples_per_axis) = (4 * 256, 1);
    let quick = tempfile::tempdir().unwrap();
    let rendered = create_simulated(&scenario, quick.path()).unwrap();
    rendered.render_step(0, &AtomicBool::new(false)).unwrap();
    scenario.camera.samples_per_axis = 8;
    let slow = create_simulated(&scenario, folder.path()).unwrap();
    let stop = &slow.index().stops[0];
    for view in [&stop.left, &stop.right] {
        let to = folder.path().join(&view.image);
        std::fs::create_dir_all(to.parent().unwrap()).unwrap();
        std::fs::copy(quick.path().join(&view.image), to).unwrap();
    }
    folder
}

#[tokio::test(flavor = "multi_thread")]
async fn a_step_that_takes_too_long_ends_its_run_with_a_reason() {
    let (drive, folder) = (slow_to_render(), tempfile::tempdir().unwrap());
    let slow = Traverse::open(drive.path()).unwrap();
    assert!(slow.is_ready(0) && !slow.is_ready(1));
    let server = serve(drive.path(), folder.path(), &["step_s=2"]);
    let session = server.begin().await;
    let [x, y] = PIXEL.map(|part| 4.0 * part);
    let new = json!({ "step": 0, "pixel": { "x": x, "y": y } });
    server.post(&format!("sessions/{session}/targets"), &new).await.expect(201);
    let run = server.ended(&session, 0, 0).await;
    let stopped = run["stopped"].as_str().unwrap();
    assert!(stopped.contains("longer than 2 s") && stopped.contains("--limit step_s=4"), "{run}");
    assert_eq!(run["rows"].as_array().unwrap().len(), 1);
    let answer = server.post(&format!("sessions/{session}/targets/0/runs/0/resume"), &json!({})).await;
    assert_eq!(answer.status.as_u16(), 202);
    server.json(Method::DELETE, &format!("sessions/{session}"), &json!({})).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn sessions_rest_when_the_steps_of_others_need_their_memory() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = serve(drive.path(), folder.path(), &["step_bytes=400KiB", "rest_s=0"]);
    let (one, other) = (server.begin().await, server.begin().await);
    server.pick(&one).await;
    let rows = server.ended(&one, 0, 0).await["rows"].clone();
    let of_one = usage(&server, "step_bytes").await;
    assert!((100_000..800_000).contains(&of_one), "{of_one} bytes for five steps");
    server.pick(&other).await;
    let same = |run: &Value| run["rows"] == rows;
    assert!(same(&server.ended(&other, 0, 0).await));
    assert!(usage(&server, "step_bytes").await < 2 * of_one, "the first session rests");
    // On request it is computed again, with the same bits.
    assert!(same(&server.ended(&one, 0, 0).await));
    server.json(Method::DELETE, &format!("sessions/{one}"), &json!({})).await;
    server.json(Method::DELETE, &format!("sessions/{other}"), &json!({})).await;
    assert_eq!(usage(&server, "step_bytes").await, 0);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_run_beyond_the_memory_for_steps_stops_with_a_reason() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = serve(drive.path(), folder.path(), &["step_bytes=100KiB"]);
    let session = server.begin().await;
    server.pick(&session).await;
    let run = server.ended(&session, 0, 0).await;
    let stopped = run["stopped"].as_str().unwrap();
    assert!(stopped.contains("--limit step_bytes=204800"), "{run}");
    assert!(run["rows"].as_array().unwrap().len() < 5, "{run}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_removed_drive_gives_its_images_back() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = serve(drive.path(), folder.path(), &[]);
    let other = Scenario { name: "other drive".to_owned(), seed: 77, ..small_scenario() };
    let entry = server.post("traverses", &json!({ "scenario": other.to_toml() })).await.expect(201);
    let id = entry["id"].as_str().unwrap();
    let image = server.get(&format!("traverses/{id}/steps/0/images/left.png")).await;
    assert_eq!(image.status.as_u16(), 200);
    let pair = 2 * 4 * 256 * 256;
    assert!(usage(&server, "cache_bytes").await >= pair);
    let removed = server.json(Method::DELETE, &format!("traverses/{id}"), &json!({})).await;
    assert_eq!(removed.status.as_u16(), 204);
    let begun = Instant::now();
    while usage(&server, "cache_bytes").await >= pair {
        assert!(begun.elapsed() < PATIENCE, "its images stay in memory");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn images_of_all_drives_share_one_ceiling() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = serve(drive.path(), folder.path(), &["cache_bytes=1200000"]);
    for step in 0..5 {
        let path = format!("traverses/{}/steps/{step}/images/left.png", server.traverse);
        assert_eq!(server.get(&path).await.status.as_u16(), 200);
        assert!(usage(&server, "cache_bytes").await <= 1_200_000, "step {step}");
    }
    assert!(usage(&server, "cache_bytes").await > 1_000_000, "two pairs fit");
}

/// Waits until a server has at most `most` connections, including the one of the request.
#[cfg(unix)]
fn until_connections(server: &ServerProcess, most: u64) {
    let begun = Instant::now();
    loop {
        let open = server.get("health")["usage"]["connections"].as_u64().unwrap();
        if open <= most {
            return;
        }
        assert!(begun.elapsed() < PATIENCE, "{open} connections stay open");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// Opens the WebSocket of events by hand.
#[cfg(unix)]
fn listen(server: &ServerProcess) -> TcpStream {
    let mut stream = TcpStream::connect(&server.address).unwrap();
    let head = format!(
        "GET /api/v1/events HTTP/1.1\r\nHost: {}\r\nAuthorization: Bearer {TOKEN}\r\nConnection: Upgrade\r\n\
         Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n",
        server.address
    );
    stream.write_all(head.as_bytes()).unwrap();
    let mut status = [0; 12];
    stream.read_exact(&mut status).unwrap();
    assert_eq!(&status, b"HTTP/1.1 101");
    stream
}

#[cfg(unix)]
#[test]
fn slow_connections_lock_nobody_out() {
    let (drive, data) = (small_drive(), tempfile::tempdir().unwrap());
    // With 140 descriptors permitted by the system, there are at most 44 connections.
    let server = ServerProcess::start_bounded(140, &["header_s=3"], drive.path(), data.path());
    let mut page = listen(&server);
    let mut slow: Vec<TcpStream> = Vec::new();
    for number in 0..200 {
        let mut stream = TcpStream::connect(&server.address).unwrap();
        stream.write_all(b"GET /api/v1/version HTTP/1.1\r\nX-Slow: ").unwrap();
        slow.push(stream);
        if number % 10 == 9 {
            server.get("version");
            let open = server.get("health")["usage"]["connections"].as_u64().unwrap();
            assert!(open <= 46, "{open} connections");
        }
    }
    // The page, and the connection of the request.
    until_connections(&server, 2);
    let traverse = server.get("traverses")[0]["id"].clone();
    server.json("POST", "sessions", &json!({ "traverse": traverse }));
    let mut received = Vec::new();
    page.set_read_timeout(Some(PATIENCE)).unwrap();
    while !String::from_utf8_lossy(&received).contains("session_changed") {
        let mut some = [0; 512];
        let count = page.read(&mut some).unwrap();
        assert_ne!(count, 0, "the page hears events still");
        received.extend_from_slice(&some[..count]);
    }
    for mut stream in slow {
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        // The end of the stream, a response with the reason, or a reset.
        let _ = stream.read_to_end(&mut Vec::new());
    }
}

#[test]
fn a_body_that_is_announced_as_too_large_is_refused_at_once() {
    let (drive, data) = (small_drive(), tempfile::tempdir().unwrap());
    let server = ServerProcess::start(drive.path(), data.path());
    let mut stream = TcpStream::connect(&server.address).unwrap();
    let head = format!(
        "POST /api/v1/sessions HTTP/1.1\r\nHost: {}\r\nAuthorization: Bearer {TOKEN}\r\n\
         Content-Type: application/json\r\nContent-Length: 100000000\r\n\r\n",
        server.address
    );
    stream.write_all(head.as_bytes()).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    // No byte of the body was sent: the server does not wait for it.
    let mut status = [0; 12];
    stream.read_exact(&mut status).unwrap();
    assert_eq!(&status, b"HTTP/1.1 413");
}

#[cfg(unix)]
#[test]
fn clients_that_read_no_answer_are_disconnected() {
    let (drive, data) = (small_drive(), tempfile::tempdir().unwrap());
    let server = ServerProcess::start_bounded(1024, &["send_s=1"], drive.path(), data.path());
    let traverse = server.get("traverses")[0]["id"].as_str().unwrap().to_owned();
    let path = format!("/api/v1/traverses/{traverse}/steps/0/images/left.png?bits=16");
    let request =
        format!("GET {path} HTTP/1.1\r\nHost: {}\r\nAuthorization: Bearer {TOKEN}\r\n\r\n", server.address);
    let mut deaf = TcpStream::connect(&server.address).unwrap();
    // More than fits into the buffers of the system.
    deaf.write_all(request.repeat(300).as_bytes()).unwrap();
    until_connections(&server, 1);
    drop(deaf);
}
