//! The page in a real Chromium, against a real server: pick a rock, step to the end and back, export.
//!
//! The server runs in this process on a free port, over a simulated approach of its own; every click and key
//! goes through the browser, and what came of it is read back through the interface.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::time::Duration;

use serde_json::Value;
use sightline_core::frames::Pixel;
use sightline_core::sim::{self, Scenario};
use sightline_core::trace::StepTrace;
use sightline_core::traverse::{Traverse, create_simulated};
use sightline_server::guard::Hosts;
use sightline_server::rerun_log::{Rows, documented_entities};
use sightline_server::state::AppState;
use sightline_tests::browser::Browser;
use sightline_tests::rrd;
use sightline_tests::scenario::short_approach;

/// A server with one traverse, and a rock's pixel in its first left image.
struct Bench {
    port: u16,
    rock: Pixel,
    stop_count: usize,
    _folder: tempfile::TempDir,
}

impl Bench {
    /// Serves an approach over `scenario`.
    async fn start(scenario: &Scenario) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let traverse = create_simulated(scenario, &folder.path().join("approach")).unwrap();
        let rock = rock(scenario, &traverse);
        let stop_count = traverse.stop_count();
        let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.unwrap();
        let port = listener.local_addr().unwrap().port();
        let hosts = Hosts::new(port, &[]);
        let state = AppState::new(vec![traverse], &folder.path().join("sessions"), hosts).unwrap();
        tokio::spawn(async move { axum::serve(listener, sightline_server::app(state)).await });
        Self { port, rock, stop_count, _folder: folder }
    }

    /// The body of a GET, read as an old browser would, so that it comes in one piece.
    fn get(&self, path: &str) -> Vec<u8> {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(300))).unwrap();
        write!(stream, "GET {path} HTTP/1.0\r\nHost: 127.0.0.1:{}\r\n\r\n", self.port).unwrap();
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).unwrap();
        let end = answer.windows(4).position(|w| w == b"\r\n\r\n").unwrap();
        let head = String::from_utf8_lossy(&answer[..end]);
        assert!(head.starts_with("HTTP/1.0 200"), "{path}: {head}");
        answer.split_off(end + 4)
    }

    fn json(&self, path: &str) -> Value {
        serde_json::from_slice(&self.get(path)).unwrap()
    }
}

/// The first target that the scenario's rule chooses: on a rock, lit, seen to the end.
fn rock(scenario: &Scenario, traverse: &Traverse) -> Pixel {
    sim::choose_targets(traverse.world().unwrap(), scenario, traverse.index())[0]
}

/// What the page says of itself.
async fn status(browser: &Browser) -> Value {
    let text = browser.evaluate("return document.getElementById('sightline').dataset.status || '{}'").await;
    serde_json::from_str(text.as_str().unwrap_or("{}")).unwrap()
}

/// Waits until a condition over the page's status `s` holds; long enough for rendering on a busy machine.
async fn wait(browser: &Browser, what: &str, condition: &str) {
    let script = format!(
        "const s = JSON.parse(document.getElementById('sightline').dataset.status || '{{}}'); return {condition}"
    );
    for _ in 0..2400 {
        if browser.evaluate(&script).await == Value::Bool(true) {
            return;
        }
        tokio::time::sleep(Duration::from_millis(250)).await;
    }
    panic!("waited ten minutes for {what}; the page says {}", status(browser).await);
}

/// Where an image pixel of the left image lies on the canvas, CSS px.
async fn place(browser: &Browser, pixel: Pixel) -> (f64, f64) {
    let status = status(browser).await;
    let map = &status["image_to_screen"];
    let number =
        |value: &Value| value.as_f64().unwrap_or_else(|| panic!("no map of the left image: {status}"));
    let scale = number(&map["scale"]);
    (number(&map["origin"][0]) + scale * pixel.x, number(&map["origin"][1]) + scale * pixel.y)
}

/// Opens the page, picks the rock, and waits until its run has reached the last stop.
async fn pick(bench: &Bench, browser: &Browser) {
    browser.goto(&format!("http://127.0.0.1:{}/", bench.port)).await;
    browser.wait_for_viewer().await;
    wait(browser, "the first image", "s.phase === 'ready' && s.shown && s.image_to_screen !== null").await;
    let (x, y) = place(browser, bench.rock).await;
    browser.press("t").await;
    wait(browser, "pick mode", "s.pick_mode").await;
    browser.click(x, y).await;
    wait(browser, "the target", "s.target === 0").await;
    wait(browser, "the run", &format!("s.steps_done === {} && !s.running", bench.stop_count)).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_person_picks_a_rock_steps_to_the_end_and_back_and_exports() {
    let bench = Bench::start(&short_approach()).await;
    let browser = Browser::start().await;
    pick(&bench, &browser).await;

    for step in 1..bench.stop_count {
        browser.press("ArrowRight").await;
        wait(&browser, "the next step", &format!("s.step === {step} && s.shown && s.state === 'tracking'"))
            .await;
    }
    browser.press("ArrowRight").await;
    browser.press("Home").await;
    wait(&browser, "the first step", "s.step === 0 && s.shown").await;
    browser.press("End").await;
    wait(&browser, "the last step", &format!("s.step === {}", bench.stop_count - 1)).await;
    browser.press("ArrowLeft").await;
    wait(&browser, "the step before", &format!("s.step === {}", bench.stop_count - 2)).await;

    let session = status(&browser).await["session"].as_str().unwrap().to_owned();
    let run = bench.json(&format!("/api/v1/sessions/{session}/targets/0/runs/0"));
    let rows = run["rows"].as_array().unwrap();
    assert_eq!(rows.len(), bench.stop_count);
    for row in rows {
        assert_eq!((&row["state"], &row["tracked"]), (&"tracking".into(), &true.into()), "{row}");
    }
    let designated =
        &bench.json(&format!("/api/v1/sessions/{session}"))["targets"][0]["designation"]["pixel"];
    let clicked = Pixel::new(designated["x"].as_f64().unwrap(), designated["y"].as_f64().unwrap());
    // A click is a whole pixel of the screen.
    let scale = status(&browser).await["image_to_screen"]["scale"].as_f64().unwrap();
    assert!(clicked.distance(bench.rock) * scale < 1.0, "clicked {clicked:?} for {:?}", bench.rock);
    let error_m = run["summary"]["final_err_m"].as_f64().unwrap();
    println!("at the last stop {error_m:.4} m, {} px", run["summary"]["final_err_px"]);
    // The camera has half the resolution: a pixel of disparity at 3.2 m is 8.5 cm.
    assert!(error_m < 0.06, "{error_m} m");

    check_export(&bench, &session);
    assert_eq!(browser.console_errors().await, Vec::<String>::new());
    browser.close().await;
}

/// Reads the exported recording back: every documented entity is there with as many rows as the steps promise.
fn check_export(bench: &Bench, session: &str) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("session.rrd");
    std::fs::write(&path, bench.get(&format!("/api/v1/sessions/{session}/export.rrd"))).unwrap();
    let recording = rrd::read(&path);
    let read = |step: usize| -> StepTrace {
        let path = format!("/api/v1/sessions/{session}/targets/0/runs/0/steps/{step}");
        serde_json::from_slice(&bench.get(&path)).unwrap()
    };
    let traces: Vec<StepTrace> = (0..bench.stop_count).map(read).collect();
    let mut checked = 0;
    for doc in documented_entities(1) {
        let found =
            recording.entities.get(&doc.path).unwrap_or_else(|| panic!("{} is not in the file", doc.path));
        let expected = match doc.rows {
            Rows::Once => 0,
            Rows::EachStop => bench.stop_count,
            Rows::EachStep { .. } | Rows::EachScore { .. } => {
                traces.iter().filter(|t| doc.has_data_at(t)).count()
            }
        };
        assert_eq!(found.data.len(), expected, "rows of {}", doc.path);
        checked += 1;
    }
    assert!(checked > 30 && recording.blueprint_activated, "{checked} entities");
}

/// Takes the README's picture where `SIGHTLINE_SCREENSHOT` names a file: the demonstration, a few stops in.
#[tokio::test(flavor = "multi_thread")]
async fn screenshot_of_the_demonstration() {
    let Some(path) = std::env::var_os("SIGHTLINE_SCREENSHOT") else {
        println!("left out: SIGHTLINE_SCREENSHOT names no file (cargo xtask screenshot sets it)");
        return;
    };
    let bench = Bench::start(&Scenario::demo()).await;
    let browser = Browser::start().await;
    pick(&bench, &browser).await;
    for step in 1..=9 {
        browser.press("ArrowRight").await;
        wait(&browser, "the next step", &format!("s.step === {step} && s.shown")).await;
    }
    // The strip and the surface come after the step itself.
    tokio::time::sleep(Duration::from_secs(5)).await;
    std::fs::write(Path::new(&path), browser.screenshot().await).unwrap();
    browser.close().await;
}
