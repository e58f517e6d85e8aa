//! The page in a real Chromium with a real server: pick a rock, step to the end and back, export.
//!
//! The server runs in this process on a free port, with a simulated approach of its own; every click and key goes through
//! the browser, and the results are read through the API.

use std::path::Path;
use std::time::Duration;

use sightline_geometry::frames::Pixel;
use sightline_server::rerun_log::{Rows, documented_entities};
use sightline_session::step::RunStep;
use sightline_tests::browser::Browser;
use sightline_tests::browser_fixture::{BrowserFixture, picked};
use sightline_tests::rrd;
use sightline_tests::scenario::short_approach;
use sightline_world::Scenario;

#[tokio::test(flavor = "multi_thread")]
async fn a_person_picks_a_rock_steps_to_the_end_and_back_and_exports() {
    let (fixture, browser) = picked(&short_approach()).await;

    for step in 1..fixture.stop_count {
        browser.press("ArrowRight").await;
        browser
            .wait_for_status(
                "the next step",
                &format!("s.step === {step} && s.shown && s.state === 'tracking'"),
            )
            .await;
    }
    browser.press("ArrowRight").await;
    browser.press("Home").await;
    browser.wait_for_status("the first step", "s.step === 0 && s.shown").await;
    browser.press("End").await;
    browser.wait_for_status("the last step", &format!("s.step === {}", fixture.stop_count - 1)).await;
    browser.press("ArrowLeft").await;
    browser.wait_for_status("the step before", &format!("s.step === {}", fixture.stop_count - 2)).await;

    let session = browser.status().await["session"].as_str().unwrap().to_owned();
    let run = fixture.json(&format!("/api/v1/sessions/{session}/targets/0/runs/0"));
    let rows = run["rows"].as_array().unwrap();
    assert_eq!(rows.len(), fixture.stop_count);
    for row in rows {
        assert_eq!((&row["state"], &row["tracked"]), (&"tracking".into(), &true.into()), "{row}");
    }
    let designated =
        &fixture.json(&format!("/api/v1/sessions/{session}"))["targets"][0]["designation"]["pixel"];
    let clicked = Pixel::new(designated["x"].as_f64().unwrap(), designated["y"].as_f64().unwrap());
    // A click is at a whole pixel of the screen.
    let scale = browser.status().await["image_to_screen"]["scale"].as_f64().unwrap();
    assert!(clicked.distance(fixture.rock) * scale < 1.0, "clicked {clicked:?} for {:?}", fixture.rock);
    let error_m = run["summary"]["final_err_m"].as_f64().unwrap();
    println!("at the last stop {error_m:.4} m, {} px", run["summary"]["final_err_px"]);
    // The camera has half the resolution: one pixel of disparity is 8.5 cm at 3.2 m.
    assert!(error_m < 0.06, "{error_m} m");

    check_export(&fixture, &session);
    browser.end().await;
}

/// Reads the exported recording: every documented entity exists, with as many rows as the steps imply.
fn check_export(fixture: &BrowserFixture, session: &str) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("session.rrd");
    std::fs::write(&path, fixture.get(&format!("/api/v1/sessions/{session}/exports/recording.rrd"))).unwrap();
    let recording = rrd::read(&path);
    let read = |step: usize| -> RunStep {
        let path = format!("/api/v1/sessions/{session}/targets/0/runs/0/steps/{step}");
        serde_json::from_slice(&fixture.get(&path)).unwrap()
    };
    let traces: Vec<RunStep> = (0..fixture.stop_count).map(read).collect();
    let mut checked = 0;
    for doc in documented_entities(1) {
        let found =
            recording.entities.get(&doc.path).unwrap_or_else(|| panic!("{} is not in the file", doc.path));
        let expected = match doc.rows {
            Rows::Once => 0,
            Rows::EachStop => fixture.stop_count,
            Rows::EachStep { .. } | Rows::EachScore { .. } => {
                traces.iter().filter(|t| doc.has_data_at(t)).count()
            }
        };
        assert_eq!(found.data.len(), expected, "rows of {}", doc.path);
        checked += 1;
    }
    assert!(checked > 30 && recording.blueprint_activated, "{checked} entities");
}

/// Takes the image of the README if `SIGHTLINE_SCREENSHOT` names a file: the demonstration after a few stops.
#[tokio::test(flavor = "multi_thread")]
async fn screenshot_of_the_demonstration() {
    let Some(path) = std::env::var_os("SIGHTLINE_SCREENSHOT") else {
        println!("left out: SIGHTLINE_SCREENSHOT names no file (cargo xtask screenshot sets it)");
        return;
    };
    let fixture = BrowserFixture::start(&Scenario::demo()).await;
    let browser = Browser::start().await;
    fixture.pick(&browser).await;
    for step in 1..=9 {
        browser.press("ArrowRight").await;
        browser.wait_for_status("the next step", &format!("s.step === {step} && s.shown")).await;
    }
    // The template strip and the score map are loaded after the step itself.
    tokio::time::sleep(Duration::from_secs(5)).await;
    std::fs::write(Path::new(&path), browser.screenshot().await).unwrap();
    browser.close().await;
}
