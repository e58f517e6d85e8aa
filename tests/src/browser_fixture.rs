//! A server with one simulated traverse for browser tests, and the first steps on its page.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use serde_json::Value;
use sightline_geometry::frames::Pixel;
use sightline_recordings::{Traverse, create_simulated};
use sightline_server::first_session;
use sightline_server::limits::Limits;
use sightline_server::state::AppState;
use sightline_world::Scenario;

use tempfile::TempDir;

use crate::browser::Browser;
use crate::server::{TOKEN, access, copy_folder};

/// A server with one traverse, and the pixel of a rock in the first left image.
pub struct BrowserFixture {
    /// The server's port.
    pub port: u16,
    /// The rock, px.
    pub rock: Pixel,
    /// Number of stops.
    pub stop_count: usize,
    _folder: TempDir,
}

impl BrowserFixture {
    /// Serves an approach over `scenario`.
    pub async fn start(scenario: &Scenario) -> Self {
        let folder = rendered(scenario);
        let traverse = Traverse::open(&folder.path().join("approach")).unwrap();
        let rock = rock(scenario, &traverse);
        Self::serve(traverse, rock, folder, &[]).await
    }

    /// Like [`Self::start`], but the page may open the recordings below a folder.
    pub async fn with_recordings(scenario: &Scenario, recordings: PathBuf) -> Self {
        let folder = rendered(scenario);
        let traverse = Traverse::open(&folder.path().join("approach")).unwrap();
        let rock = rock(scenario, &traverse);
        Self::serve(traverse, rock, folder, &[recordings]).await
    }

    /// Serves the recording in a folder; `rock` is a pixel on a rock in the first left image.
    pub async fn recording(folder: TempDir, rock: Pixel) -> Self {
        Self::serve(Traverse::open(folder.path()).unwrap(), rock, folder, &[]).await
    }

    async fn serve(traverse: Traverse, rock: Pixel, folder: TempDir, recordings: &[PathBuf]) -> Self {
        let stop_count = traverse.stop_count();
        let (port, _) = listen(traverse, &folder, recordings).await;
        Self { port, rock, stop_count, _folder: folder }
    }

    /// Serves the drive of a new user, whose first target is already being tracked.
    async fn first_drive(recordings: &[PathBuf]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let scenario = first_session::scenario().unwrap();
        let traverse = create_simulated(&scenario, &folder.path().join("first")).unwrap();
        let (rock, stop_count) = (rock(&scenario, &traverse), traverse.stop_count());
        let (port, state) = listen(traverse, &folder, recordings).await;
        first_session::begin(&state, &scenario).unwrap();
        Self { port, rock, stop_count, _folder: folder }
    }

    /// The URL of the page.
    pub fn url(&self) -> String {
        format!("http://127.0.0.1:{}/", self.port)
    }

    /// Returns the body of a GET. The request is HTTP/1.0, so that the body is not chunked.
    pub fn get(&self, path: &str) -> Vec<u8> {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(300))).unwrap();
        let port = self.port;
        let token = format!("Authorization: Bearer {TOKEN}");
        write!(stream, "GET {path} HTTP/1.0\r\nHost: 127.0.0.1:{port}\r\n{token}\r\n\r\n").unwrap();
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).unwrap();
        let end = answer.windows(4).position(|w| w == b"\r\n\r\n").unwrap();
        let head = String::from_utf8_lossy(&answer[..end]);
        assert!(head.starts_with("HTTP/1.0 200"), "{path}: {head}");
        answer.split_off(end + 4)
    }

    /// Returns the JSON of a GET.
    pub fn json(&self, path: &str) -> Value {
        serde_json::from_slice(&self.get(path)).unwrap()
    }

    /// Opens the page and waits for the first image.
    pub async fn open(&self, browser: &Browser) {
        // A URL that differs only in its fragment does not reload the page.
        browser.goto("about:blank").await;
        browser.goto(&format!("{}#token={TOKEN}", self.url())).await;
        browser.wait_for_viewer().await;
        let shown = "s.phase === 'ready' && s.shown && s.image_to_screen !== null";
        browser.wait_for_status("the first image", shown).await;
    }

    /// Opens the page, picks the rock, and waits until its run has reached the last stop.
    pub async fn pick(&self, browser: &Browser) {
        self.open(browser).await;
        let (x, y) = canvas_position(browser, self.rock).await;
        browser.press("t").await;
        browser.wait_for_status("pick mode", "s.pick_mode").await;
        browser.click(x, y).await;
        browser
            .wait_for_status("the target, or advice against the place", "s.target === 0 || s.advised_against")
            .await;
        if browser.status().await["target"] != 0 {
            browser.click_on("button", "Pick anyway").await;
        }
        browser.wait_for_status("the target", "s.target === 0").await;
        browser
            .wait_for_status("the run", &format!("s.steps_done === {} && !s.running", self.stop_count))
            .await;
    }
}

/// A page with a target on the rock of `scenario` whose run has reached the last stop.
pub async fn picked(scenario: &Scenario) -> (BrowserFixture, Browser) {
    let fixture = BrowserFixture::start(scenario).await;
    let browser = Browser::start().await;
    fixture.pick(&browser).await;
    (fixture, browser)
}

/// The page of a new user: the first card of the tour over the drive of sixty stops, whose run has ended. The page may open
/// the recordings below `recordings`.
pub async fn first_page(recordings: &[PathBuf]) -> (BrowserFixture, Browser) {
    let fixture = BrowserFixture::first_drive(recordings).await;
    let browser = Browser::start().await;
    browser.goto(&format!("{}#token={TOKEN}", fixture.url())).await;
    browser.wait_for_viewer().await;
    browser.wait_for_status("the first target", "s.target === 0 && s.shown").await;
    browser.wait_for_status("the run", "s.steps_done > 1 && !s.running").await;
    (fixture, browser)
}

/// Serves a traverse on a free port; its sessions are stored in the folder.
async fn listen(traverse: Traverse, folder: &TempDir, recordings: &[PathBuf]) -> (u16, AppState) {
    let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.unwrap();
    let port = listener.local_addr().unwrap().port();
    let (sessions, limits) = (folder.path().join("sessions"), Limits::default());
    let state = AppState::with_recordings(vec![traverse], &sessions, access(port), limits, recordings);
    let state = state.unwrap();
    let app = sightline_server::app(state.clone());
    tokio::spawn(async move { axum::serve(listener, app).await });
    (port, state)
}

/// A folder with the drive of a scenario in `approach`: a copy of one that all tests share and that is rendered once.
fn rendered(scenario: &Scenario) -> TempDir {
    static KEPT: Mutex<Vec<(String, TempDir)>> = Mutex::new(Vec::new());
    // A panic leaves the list valid, because a drive is added only when it is complete.
    let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    let text = scenario.to_toml();
    if !kept.iter().any(|(known, _)| *known == text) {
        let folder = tempfile::tempdir().unwrap();
        let traverse = create_simulated(scenario, &folder.path().join("approach")).unwrap();
        for step in 0..traverse.stop_count() {
            traverse.render_step(step, &AtomicBool::new(false)).unwrap();
        }
        kept.push((text.clone(), folder));
    }
    let copy = tempfile::tempdir().unwrap();
    let known = kept.iter().find(|(known, _)| *known == text);
    copy_folder(known.expect("it was added").1.path(), copy.path());
    copy
}

/// The first target that the scenario's rule chooses: on a rock, lit, visible up to the last stop.
fn rock(scenario: &Scenario, traverse: &Traverse) -> Pixel {
    sightline_world::choose_targets(traverse.world().unwrap(), scenario, traverse.index())[0]
}

/// Returns the position of a pixel of the left image on the canvas, CSS px.
pub async fn canvas_position(browser: &Browser, pixel: Pixel) -> (f64, f64) {
    let status = browser.status().await;
    let map = &status["image_to_screen"];
    let number =
        |value: &Value| value.as_f64().unwrap_or_else(|| panic!("no map of the left image: {status}"));
    let scale = number(&map["scale"]);
    (number(&map["origin"][0]) + scale * pixel.x, number(&map["origin"][1]) + scale * pixel.y)
}
