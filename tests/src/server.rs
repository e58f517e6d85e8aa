//! A server in this process: requests are passed to the router as function calls, without a network.

use std::path::Path;
use std::sync::OnceLock;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use axum::Router;
use axum::body::Body;
use axum::http::{HeaderMap, Method, Request, StatusCode, header};
use serde_json::{Value, json};
use sightline_recordings::{Traverse, create_simulated};
use sightline_server::access::{Access, Token};
use sightline_server::app;
use sightline_server::hosts::Hosts;
use sightline_server::state::AppState;
use sightline_world::Scenario;
use sightline_world::scenario::{PlacedRock, RockShape};
use sightline_world::traverse::Stop;
use tempfile::TempDir;
use tower::ServiceExt;

/// The access token of every server of the tests.
pub const TOKEN: &str = "token-of-the-tests";

/// The port in the server's own address.
pub const PORT: u16 = 7700;

/// A pixel on the face of the large rock in the first image of the small drive.
pub const PIXEL: [f64; 2] = [128.0, 150.0];

/// Maximum time for an operation that should be quick.
const PATIENCE: Duration = Duration::from_secs(120);

/// A server with its folders.
pub struct TestServer {
    /// The router.
    pub app: Router,
    /// Its state.
    pub state: AppState,
    /// The name of its only traverse.
    pub traverse: String,
}

/// A complete response.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// Its status.
    pub status: StatusCode,
    /// Its headers.
    pub headers: HeaderMap,
    /// Its body.
    pub bytes: Vec<u8>,
}

impl Answer {
    /// The body as JSON.
    pub fn json(&self) -> Value {
        serde_json::from_slice(&self.bytes).unwrap_or_else(|_| panic!("no JSON: {}", self.text()))
    }

    /// The body as text.
    pub fn text(&self) -> String {
        String::from_utf8_lossy(&self.bytes).into_owned()
    }

    /// Asserts the status, and returns the body as JSON.
    pub fn expect(&self, status: u16) -> Value {
        assert_eq!(self.status.as_u16(), status, "{}", self.text());
        self.json()
    }

    /// Asserts that the response is a problem with that status and code, and returns its sentence.
    pub fn problem(&self, status: u16, code: &str) -> String {
        assert_eq!(self.headers[header::CONTENT_TYPE], "application/problem+json", "{}", self.text());
        let problem = self.expect(status);
        assert_eq!((&problem["status"], &problem["code"]), (&json!(status), &json!(code)), "{problem}");
        problem["detail"].as_str().expect("a sentence").to_owned()
    }
}

impl TestServer {
    /// A server with the traverse of `drive` that keeps its sessions in `sessions`.
    pub fn open(drive: &Path, sessions: &Path) -> Self {
        let traverse = Traverse::open(drive).expect("a traverse");
        let state = AppState::new(vec![traverse], sessions, access(PORT)).expect("a server");
        let traverse = state.traverses()[0].id.clone();
        Self { app: app(state.clone()), state, traverse }
    }

    /// Sends a request unchanged.
    pub async fn send(&self, request: Request<Body>) -> Answer {
        let response = self.app.clone().oneshot(request).await.expect("the router never fails");
        let (parts, body) = response.into_parts();
        let bytes = axum::body::to_bytes(body, 1 << 28).await.expect("a whole body");
        Answer { status: parts.status, headers: parts.headers, bytes: bytes.to_vec() }
    }

    /// GETs a path below `/api/v1/`.
    pub async fn get(&self, path: &str) -> Answer {
        self.send(request(Method::GET, path).body(Body::empty()).expect("a request")).await
    }

    /// Sends JSON to a path below `/api/v1/`.
    pub async fn post(&self, path: &str, body: &Value) -> Answer {
        self.json(Method::POST, path, body).await
    }

    /// Sends JSON with any method.
    pub async fn json(&self, method: Method, path: &str, body: &Value) -> Answer {
        let request = request(method, path).header(header::CONTENT_TYPE, "application/json");
        self.send(request.body(Body::from(body.to_string())).expect("a request")).await
    }

    /// Creates a session and returns its name.
    pub async fn begin(&self) -> String {
        let view = self.post("sessions", &json!({ "traverse": self.traverse })).await.expect(201);
        view["id"].as_str().expect("a name").to_owned()
    }

    /// Designates [`PIXEL`] at the first stop and returns the target's number.
    pub async fn pick(&self, session: &str) -> u64 {
        let [x, y] = PIXEL;
        let new = json!({ "step": 0, "pixel": { "x": x, "y": y } });
        let designated = self.post(&format!("sessions/{session}/targets"), &new).await.expect(201);
        designated["target"].as_u64().expect("a number")
    }

    /// Waits until a run has ended, and returns its view.
    pub async fn ended(&self, session: &str, target: u64, run: u64) -> Value {
        let path = format!("sessions/{session}/targets/{target}/runs/{run}");
        let begun = std::time::Instant::now();
        loop {
            let view = self.get(&path).await.expect(200);
            if view["complete"] == json!(true) || view["stopped"] != json!(null) {
                return view;
            }
            assert!(begun.elapsed() < PATIENCE, "the run does not end: {view}");
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    }
}

/// Access rules of a test server at that port: [`TOKEN`] is required.
pub fn access(port: u16) -> Access {
    Access::with_token(Hosts::new(port, &[]), Token::chosen(TOKEN).expect("a token"))
}

/// A request to a path below `/api/v1/`, as a script with the token sends it.
pub fn request(method: Method, path: &str) -> axum::http::request::Builder {
    let uri = format!("/api/v1/{path}");
    let request =
        Request::builder().method(method).uri(uri).header(header::HOST, format!("127.0.0.1:{PORT}"));
    request.header(header::AUTHORIZATION, format!("Bearer {TOKEN}"))
}

/// The scenario of the small drive: five stops of 256 × 256 pixels.
pub fn small_scenario() -> Scenario {
    let mut scenario = Scenario { name: "small drive".to_owned(), ..Scenario::demo() };
    (scenario.camera.image_size, scenario.camera.samples_per_axis) = (256, 1);
    (scenario.drive.start_distance_m, scenario.drive.end_distance_m) = (6.0, 4.0);
    let (diameter_m, height_m, shape) = (1.2, 0.9, RockShape::Block);
    scenario.rocks.placed =
        vec![PlacedRock { x_m: 0.0, y_m: 0.0, diameter_m, height_m, yaw_deg: 180.0, shape }];
    scenario
}

/// A folder with the rendered small drive; a copy, so that tests may damage it.
pub fn small_drive() -> TempDir {
    static RENDERED: OnceLock<TempDir> = OnceLock::new();
    let rendered = RENDERED.get_or_init(|| {
        let folder = tempfile::tempdir().expect("a folder");
        let traverse = create_simulated(&small_scenario(), folder.path()).expect("a drive");
        for step in 0..traverse.stop_count() {
            traverse.render_step(step, &AtomicBool::new(false)).expect("a rendered stop");
        }
        folder
    });
    let copy = tempfile::tempdir().expect("a folder");
    copy_folder(rendered.path(), copy.path());
    copy
}

/// The small drive as a recording: without the scenario, so that a missing image is not rendered again.
pub fn small_recording() -> TempDir {
    let folder = small_drive();
    let index = folder.path().join("traverse.toml");
    let text = std::fs::read_to_string(&index).expect("an index");
    let recorded: String =
        text.lines().filter(|line| !line.starts_with("scenario")).map(|l| format!("{l}\n")).collect();
    std::fs::write(&index, recorded).expect("an index");
    folder
}

/// A recording of `stop_count` stops: the rover drives to and fro over the stops of the small drive, with its images.
pub fn long_recording(stop_count: usize) -> TempDir {
    let folder = small_recording();
    let traverse = Traverse::open(folder.path()).expect("the small recording");
    let mut index = traverse.index().clone();
    let there = std::mem::take(&mut index.stops);
    let there_and_back: Vec<&Stop> = there.iter().chain(there[1..there.len() - 1].iter().rev()).collect();
    let stop_at = |step: usize| Stop {
        time_s: 60.0 * step as f64,
        ..there_and_back[step % there_and_back.len()].clone()
    };
    index.stops = (0..stop_count).map(stop_at).collect();
    index.name = format!("to and fro, {stop_count} stops");
    let text = serde_json::to_vec(&index).expect("an index");
    std::fs::write(folder.path().join("traverse.json"), text).expect("an index");
    std::fs::remove_file(folder.path().join("traverse.toml")).expect("the index before");
    folder
}

/// Copies a folder with all its contents.
pub fn copy_folder(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).expect("a folder");
    for entry in std::fs::read_dir(from).expect("a folder") {
        let path = entry.expect("an entry").path();
        let copy = to.join(path.file_name().expect("a name"));
        if path.is_dir() {
            copy_folder(&path, &copy);
        } else {
            std::fs::copy(&path, &copy).expect("a copy");
        }
    }
}

/// The rows of one run as the command line writes them, from the exported `rows.jsonl`: without target, label and run.
pub fn rows_of_run(exported: &str) -> String {
    let own = |line: &str| {
        let (_, row) = line.split_once(",\"step\":").unwrap();
        format!("{{\"step\":{row}\n")
    };
    exported.lines().map(own).collect()
}
