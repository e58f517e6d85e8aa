//! A page with faults, in a real browser: a missing image, and a server that stops and is started again.

use std::time::Duration;

use sightline_geometry::frames::Pixel;
use sightline_recordings::Traverse;
use sightline_tests::browser::Browser;
use sightline_tests::browser_fixture::{BrowserFixture, canvas_position};
use sightline_tests::server::{PIXEL, TOKEN, small_drive, small_recording};

use crate::persistence::ServerProcess;

/// The step whose left image is missing.
const MISSING: usize = 2;

/// The errors of the console, without those that the test expects.
async fn unexpected(browser: &Browser, expected: &[&str]) -> Vec<String> {
    let errors = browser.console_errors().await.into_iter();
    errors.filter(|error| !expected.iter().any(|part| error.contains(part))).collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_missing_image_hatches_its_step_until_it_returns() {
    let folder = small_recording();
    let name = Traverse::open(folder.path()).unwrap().index().stops[MISSING].left.image.clone();
    let (file, away) = (folder.path().join(&name), folder.path().join("away.png"));
    std::fs::rename(&file, &away).unwrap();
    let [x, y] = PIXEL;
    let fixture = BrowserFixture::recording(folder, Pixel::new(x, y)).await;
    let browser = Browser::start().await;
    fixture.pick(&browser).await;
    for _ in 0..MISSING {
        browser.press("ArrowRight").await;
    }
    browser.wait_for_status("the step without an image", &format!("s.step === {MISSING}")).await;
    // The file at fault and a remedy are shown in place of the image; the other image exists.
    browser.wait_for_text(&format!("The left image of step {MISSING} cannot be shown")).await;
    browser.wait_for_text(&name).await;
    browser.wait_for_text("Put the file back").await;
    browser.save_screenshot("missing-image").await;
    // Stepping is possible, and the tracker continued after that step.
    browser.press("ArrowRight").await;
    browser.wait_for_status("the step behind it", &format!("s.step === {} && s.shown", MISSING + 1)).await;
    browser.press("ArrowLeft").await;
    let again = format!("try the left image of step {MISSING} again");
    browser.control("button", &again).await;
    std::fs::rename(&away, &file).unwrap();
    browser.activate("button", &again).await;
    browser
        .wait_for_status("the image", &format!("s.step === {MISSING} && s.left_image_rect !== null"))
        .await;
    // The browser logs the failed request of the image in its console.
    assert_eq!(unexpected(&browser, &["images/left.png"]).await, Vec::<String>::new());
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn loaded_steps_remain_while_the_server_is_down() {
    let (drive, data) = (small_drive(), tempfile::tempdir().unwrap());
    let server = ServerProcess::start_at("0", drive.path(), data.path());
    let address = server.address.clone();
    let port = address.rsplit(':').next().unwrap().to_owned();
    let browser = Browser::start().await;
    browser.goto(&format!("http://{address}/#token={TOKEN}")).await;
    browser.wait_for_viewer().await;
    browser
        .wait_for_status("the first image", "s.phase === 'ready' && s.shown && s.image_to_screen !== null")
        .await;
    let [x, y] = PIXEL;
    let (x, y) = canvas_position(&browser, Pixel::new(x, y)).await;
    browser.press("t").await;
    browser.wait_for_status("pick mode", "s.pick_mode").await;
    browser.click(x, y).await;
    browser.wait_for_status("the target, or advice", "s.target === 0 || s.advised_against").await;
    if browser.status().await["target"] != 0 {
        browser.click_on("button", "Pick anyway").await;
    }
    browser.wait_for_status("the run", "s.target === 0 && s.steps_done === s.stop_count && !s.running").await;
    for step in 1..=2 {
        browser.press("ArrowRight").await;
        browser.wait_for_status("the step", &format!("s.step === {step} && s.shown")).await;
    }
    // A cursor move of the last second may be lost.
    tokio::time::sleep(Duration::from_millis(1500)).await;

    server.kill();
    browser.wait_for_status("the loss of the server", "s.connection === 'gone'").await;
    browser.wait_for_text("The server is gone. Steps that are loaded stay browsable").await;
    browser.press("ArrowLeft").await;
    browser.wait_for_status("a step that is loaded", "s.step === 1 && s.shown && s.state !== null").await;
    browser.save_screenshot("server-gone").await;

    // A manual retry fails while the server is down; once it runs, the page reconnects by itself.
    browser.activate("button", "Retry now").await;
    browser.wait_for_status("the server still gone", "s.connection === 'gone'").await;
    let server = ServerProcess::start_at(&port, drive.path(), data.path());
    browser.wait_for_status("the server again", "s.connection === 'live'").await;
    browser.wait_until_gone("button", "Retry now").await;
    browser
        .wait_for_status("the same step, and all of the run", "s.step === 1 && s.steps_done === s.stop_count")
        .await;
    browser.press("End").await;
    browser.wait_for_status("a step that was not loaded", "s.step === s.stop_count - 1 && s.shown").await;
    let expected = [
        "ERR_CONNECTION_REFUSED",
        "ERR_CONNECTION_RESET",
        "ERR_INCOMPLETE_CHUNKED",
        "ERR_EMPTY_RESPONSE",
        "WebSocket",
    ];
    assert_eq!(unexpected(&browser, &expected).await, Vec::<String>::new());
    browser.close().await;
    server.kill();
}
