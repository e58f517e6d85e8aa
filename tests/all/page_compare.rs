//! Comparing two runs and trying a change in a real browser: the divider of the wipe, blinking, the first divergence, the
//! handles in the image, and taking back.

use std::time::Duration;

use image::RgbImage;
use sightline_tests::bench::{Bench, picked};
use sightline_tests::browser::Browser;
use sightline_tests::scenario::short_approach;

/// The step from which the branch goes.
const FORK: usize = 3;

/// What the page shows where the left image is.
async fn left_image(browser: &Browser) -> RgbImage {
    tokio::time::sleep(Duration::from_millis(700)).await;
    let status = browser.status().await;
    let [x, y, width, height] = [0, 1, 2, 3].map(|k| status["left_image_rect"][k].as_f64().unwrap() as u32);
    let page = image::load_from_memory(&browser.screenshot().await).unwrap().to_rgb8();
    image::imageops::crop_imm(&page, x, y, width, height).to_image()
}

/// The share of pixels in which two pictures differ clearly.
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
async fn branched() -> (Bench, Browser) {
    let (bench, browser) = picked(&short_approach()).await;
    for _ in 0..FORK {
        browser.press("ArrowRight").await;
    }
    browser.wait_status("the step", &format!("s.step === {FORK} && s.shown")).await;
    browser.press("w").await;
    browser.says("Accepted").await;
    browser.set_value("slider", "try match score limit", "0.9999").await;
    browser.click_on("button", "Run from here as branch").await;
    browser.wait_status("the branch", "s.run === 1 && !s.running && s.steps_done > s.step").await;
    browser.wait_status("the loss", &format!("s.step === {FORK} && s.state !== 'tracking' && s.shown")).await;
    browser.click_on("combobox", "compared with").await;
    browser.choose("run A").await;
    // The panels make room for what compares.
    browser.control("button", "First divergence").await;
    (bench, browser)
}

#[tokio::test(flavor = "multi_thread")]
async fn two_runs_are_wiped_and_blinked_and_their_first_divergence_is_found() {
    let (_bench, browser) = branched().await;
    browser.wait_for("the comparison in the address", "return location.hash.includes('vs=0.0')").await;
    browser.press("End").await;
    browser.press("d").await;
    browser.wait_status("the first divergence", &format!("s.step === {FORK} && s.stage === 'judge'")).await;
    browser.shot("divergence").await;

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
    let (x, y) = browser.control("slider", "wipe divider").await.middle();
    browser.drag((x, y), (x + 120.0, y)).await;
    tokio::time::sleep(Duration::from_millis(500)).await;
    let dragged = divider(&browser).await;
    assert!(dragged > 35.0, "{dragged} % after a drag to the right from 20 %");
    // What the pointer let go has not kept the keyboard: arrows are steps again.
    browser.press("ArrowLeft").await;
    browser.wait_status("the step before", &format!("s.step === {} && s.shown", FORK - 1)).await;
    browser.press("ArrowRight").await;
    browser.wait_status("the step", &format!("s.step === {FORK} && s.shown")).await;
    assert!((divider(&browser).await - dragged).abs() < 1e-9, "and the divider stays where it was put");
    assert!(differing(&few, &left_image(&browser).await) > 0.001, "the divider is somewhere else");
    browser.shot("wipe").await;

    browser.press("v").await;
    browser.wait_for("blinking", "return location.hash.includes('cmp=blink')").await;
    let own = left_image(&browser).await;
    browser.hold("x").await;
    let other = left_image(&browser).await;
    browser.let_go("x").await;
    let again = left_image(&browser).await;
    assert!(differing(&own, &other) > 0.001, "held, X shows the other run: {}", differing(&own, &other));
    assert!(differing(&own, &again) < 0.001, "let go, it shows the own one: {}", differing(&own, &again));
    browser.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_handle_is_dragged_and_a_removed_branch_comes_back() {
    let (_bench, browser) = branched().await;
    // The window is drawn larger by its corner; the ghost is there while the step is computed, and nothing is kept.
    let (x, y) = browser.control("slider", "search window size handle").await.middle();
    browser.drag((x, y), (x + 24.0, y + 24.0)).await;
    browser.control("button", "discard what if").await;
    browser.says("search window").await;
    browser.shot("handle").await;
    let predicted = browser.control("button", "prediction handle").await;
    let (x, y) = predicted.middle();
    browser.drag((x, y), (x + 12.0, y)).await;
    let start = std::time::Instant::now();
    while browser.control("button", "prediction handle").await.name == predicted.name {
        assert!(start.elapsed().as_secs() < 30, "the prediction stays where it was: {}", predicted.name);
        tokio::time::sleep(Duration::from_millis(200)).await;
    }
    browser.press("Escape").await;
    browser.gone("button", "discard what if").await;

    browser.activate("button", "remove run B").await;
    browser.wait_status("the run before", "s.run === 0").await;
    browser.shot("removed").await;
    browser.chord(&["Control"], "z").await;
    browser.control("button", "remove run B").await;
    browser.end().await;
}
