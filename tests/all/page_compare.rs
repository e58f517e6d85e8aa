//! Comparing two runs and trying a change in a real browser: the divider of the wipe, blinking, the first divergence, the
//! handles in the image, and undo.

use std::time::Duration;

use image::RgbImage;
use sightline_tests::browser::Browser;
use sightline_tests::browser_fixture::{BrowserFixture, picked};
use sightline_tests::scenario::short_approach;

/// The step at which the branch starts.
const FORK: usize = 3;

/// A screenshot of the left image's area.
async fn left_image(browser: &Browser) -> RgbImage {
    tokio::time::sleep(Duration::from_millis(700)).await;
    let status = browser.status().await;
    let [x, y, width, height] = [0, 1, 2, 3].map(|k| status["left_image_rect"][k].as_f64().unwrap() as u32);
    let page = image::load_from_memory(&browser.screenshot().await).unwrap().to_rgb8();
    image::imageops::crop_imm(&page, x, y, width, height).to_image()
}

/// The share of pixels in which two screenshots differ by more than 24 of 255 in a channel.
fn differing(a: &RgbImage, b: &RgbImage) -> f64 {
    assert_eq!(a.dimensions(), b.dimensions());
    let differ =
        |(a, b): &(&image::Rgb<u8>, &image::Rgb<u8>)| a.0.iter().zip(b.0).any(|(a, b)| a.abs_diff(b) > 24);
    a.pixels().zip(b.pixels()).filter(differ).count() as f64 / f64::from(a.width() * a.height())
}

async fn divider(browser: &Browser) -> f64 {
    browser.control("slider", "wipe divider").await.value.parse().unwrap()
}

/// A page at [`FORK`] of a branch that loses the target there, compared with the run before.
async fn branched() -> (BrowserFixture, Browser) {
    let (fixture, browser) = picked(&short_approach()).await;
    for _ in 0..FORK {
        browser.press("ArrowRight").await;
    }
    browser.wait_for_status("the step", &format!("s.step === {FORK} && s.shown")).await;
    browser.press("w").await;
    browser.wait_for_text("Accepted").await;
    browser.set_value("slider", "try match score limit", "0.9999").await;
    browser.click_on("button", "Run from here as branch").await;
    browser.wait_for_status("the branch", "s.run === 1 && !s.running && s.steps_done > s.step").await;
    browser
        .wait_for_status("the loss", &format!("s.step === {FORK} && s.state !== 'tracking' && s.shown"))
        .await;
    browser.click_on("combobox", "compared with").await;
    browser.choose("run A").await;
    // The panels make room for the comparison.
    browser.control("button", "First divergence").await;
    (fixture, browser)
}

#[tokio::test(flavor = "multi_thread")]
async fn two_runs_can_be_wiped_blinked_and_their_divergence_found() {
    let (_bench, browser) = branched().await;
    browser.wait_for("the comparison in the address", "return location.hash.includes('vs=0.0')").await;
    browser.press("End").await;
    browser.press("d").await;
    browser
        .wait_for_status("the first divergence", &format!("s.step === {FORK} && s.stage === 'judge'"))
        .await;
    browser.save_screenshot("divergence").await;

    browser.press("v").await;
    browser.press("v").await;
    browser.wait_for("the wipe", "return location.hash.includes('cmp=wipe')").await;
    // A screen reader's value, the pointer and the keys move the divider.
    browser.set_value("slider", "wipe divider", "20").await;
    browser
        .wait_for(
            "the divider",
            "return [...document.querySelectorAll('#sightline-mirror input')].some(e => e.value === '20')",
        )
        .await;
    let few = left_image(&browser).await;
    let (x, y) = browser.control("slider", "wipe divider").await.centre();
    browser.drag((x, y), (x + 120.0, y)).await;
    tokio::time::sleep(Duration::from_millis(500)).await;
    let dragged = divider(&browser).await;
    assert!(dragged > 35.0, "{dragged} % after a drag to the right from 20 %");
    // After a drag the divider does not keep the keyboard focus: arrows change the step again.
    browser.press("ArrowLeft").await;
    browser.wait_for_status("the step before", &format!("s.step === {} && s.shown", FORK - 1)).await;
    browser.press("ArrowRight").await;
    browser.wait_for_status("the step", &format!("s.step === {FORK} && s.shown")).await;
    assert!((divider(&browser).await - dragged).abs() < 1e-9, "and the divider stays where it was put");
    assert!(differing(&few, &left_image(&browser).await) > 0.001, "the divider is somewhere else");
    browser.save_screenshot("wipe").await;

    browser.press("v").await;
    browser.wait_for("blinking", "return location.hash.includes('cmp=blink')").await;
    let own = left_image(&browser).await;
    browser.key_down("x").await;
    let other = left_image(&browser).await;
    browser.key_up("x").await;
    let again = left_image(&browser).await;
    assert!(differing(&own, &other) > 0.001, "held, X shows the other run: {}", differing(&own, &other));
    assert!(differing(&own, &again) < 0.001, "let go, it shows the own one: {}", differing(&own, &again));
    browser.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn handles_can_be_dragged_and_removed_branches_restored() {
    let (_bench, browser) = branched().await;
    // The corner enlarges the search window; the ghost is shown while the step is computed, and nothing is stored.
    let (x, y) = browser.control("slider", "search window size handle").await.centre();
    browser.drag((x, y), (x + 24.0, y + 24.0)).await;
    browser.control("button", "discard what if").await;
    browser.wait_for_text("search window").await;
    browser.save_screenshot("handle").await;
    let predicted = browser.control("button", "prediction handle").await;
    let (x, y) = predicted.centre();
    browser.drag((x, y), (x + 12.0, y)).await;
    let start = std::time::Instant::now();
    while browser.control("button", "prediction handle").await.name == predicted.name {
        assert!(start.elapsed().as_secs() < 30, "the prediction stays where it was: {}", predicted.name);
        tokio::time::sleep(Duration::from_millis(200)).await;
    }
    browser.press("Escape").await;
    browser.wait_until_gone("button", "discard what if").await;

    browser.activate("button", "remove run B").await;
    browser.wait_for_status("the run before", "s.run === 0").await;
    browser.save_screenshot("removed").await;
    browser.chord(&["Control"], "z").await;
    browser.control("button", "remove run B").await;
    browser.end().await;
}
