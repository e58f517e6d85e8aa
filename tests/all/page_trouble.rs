//! A page in trouble, in a real browser: an image that is missing, a server that is gone and comes back.

use std::time::Duration;

use sightline_geometry::frames::Pixel;
use sightline_recordings::Traverse;
use sightline_tests::bench::{Bench, place};
use sightline_tests::browser::Browser;
use sightline_tests::server::{PIXEL, TOKEN, small_drive, small_recording};

use crate::keeping::Killable;

/// The step whose left image is missing.
const MISSING: usize = 2;

/// What the console received, without what is part of a test.
async fn unexpected(browser: &Browser, expected: &[&str]) -> Vec<String> {
    let errors = browser.console_errors().await.into_iter();
    errors.filter(|error| !expected.iter().any(|part| error.contains(part))).collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_missing_image_hatches_its_step_and_is_there_once_it_is_put_back() {
    let folder = small_recording();
    let name = Traverse::open(folder.path()).unwrap().index().stops[MISSING].left.image.clone();
    let (file, away) = (folder.path().join(&name), folder.path().join("away.png"));
    std::fs::rename(&file, &away).unwrap();
    let [x, y] = PIXEL;
    let bench = Bench::recording(folder, Pixel::new(x, y)).await;
    let browser = Browser::start().await;
    bench.pick(&browser).await;
    for _ in 0..MISSING {
        browser.press("ArrowRight").await;
    }
    browser.wait_status("the step without an image", &format!("s.step === {MISSING}")).await;
    // The file at fault and what to do stand where the image would be; the other eye is there.
    browser.says(&format!("The left image of step {MISSING} cannot be shown")).await;
    browser.says(&name).await;
    browser.says("Put the file back").await;
    browser.shot("missing-image").await;
    // Stepping goes on, and the tracker went on behind it.
    browser.press("ArrowRight").await;
    browser.wait_status("the step behind it", &format!("s.step === {} && s.shown", MISSING + 1)).await;
    browser.press("ArrowLeft").await;
    let again = format!("try the left image of step {MISSING} again");
    browser.control("button", &again).await;
    std::fs::rename(&away, &file).unwrap();
    browser.activate("button", &again).await;
    browser.wait_status("the image", &format!("s.step === {MISSING} && s.left_image_rect !== null")).await;
    // That the image cannot be read is an answer which the browser itself writes into its console.
    assert_eq!(unexpected(&browser, &["images/left.png"]).await, Vec::<String>::new());
    browser.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn while_the_server_is_gone_loaded_steps_stay_and_then_all_goes_on() {
    let (drive, data) = (small_drive(), tempfile::tempdir().unwrap());
    let server = Killable::start_at("0", drive.path(), data.path());
    let address = server.address.clone();
    let port = address.rsplit(':').next().unwrap().to_owned();
    let browser = Browser::start().await;
    browser.goto(&format!("http://{address}/#token={TOKEN}")).await;
    browser.wait_for_viewer().await;
    browser
        .wait_status("the first image", "s.phase === 'ready' && s.shown && s.image_to_screen !== null")
        .await;
    let [x, y] = PIXEL;
    let (x, y) = place(&browser, Pixel::new(x, y)).await;
    browser.press("t").await;
    browser.wait_status("pick mode", "s.pick_mode").await;
    browser.click(x, y).await;
    browser.wait_status("the target, or advice", "s.target === 0 || s.advised_against").await;
    if browser.status().await["target"] != 0 {
        browser.click_on("button", "Pick anyway").await;
    }
    browser.wait_status("the run", "s.target === 0 && s.steps_done === s.stop_count && !s.running").await;
    for step in 1..=2 {
        browser.press("ArrowRight").await;
        browser.wait_status("the step", &format!("s.step === {step} && s.shown")).await;
    }
    // A cursor may be lost that moved within the last second.
    tokio::time::sleep(Duration::from_millis(1500)).await;

    server.kill();
    browser.wait_status("the loss of the server", "s.connection === 'gone'").await;
    browser.says("The server is gone. Steps that are loaded stay browsable").await;
    browser.press("ArrowLeft").await;
    browser.wait_status("a step that is loaded", "s.step === 1 && s.shown && s.state !== null").await;
    browser.shot("server-gone").await;

    // Asked again at once it is still gone; once it is there the page finds it by itself.
    browser.activate("button", "Retry now").await;
    browser.wait_status("the server still gone", "s.connection === 'gone'").await;
    let server = Killable::start_at(&port, drive.path(), data.path());
    browser.wait_status("the server again", "s.connection === 'live'").await;
    browser.gone("button", "Retry now").await;
    browser
        .wait_status("the same step, and all of the run", "s.step === 1 && s.steps_done === s.stop_count")
        .await;
    browser.press("End").await;
    browser.wait_status("a step that was not loaded", "s.step === s.stop_count - 1 && s.shown").await;
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
