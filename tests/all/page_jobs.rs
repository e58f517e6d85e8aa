//! Long computations and the tour in a real browser: a study is a job that is cancelled, survives a reload, and continues;
//! the tour is started again by its name and followed to its end by keys.

use std::time::{Duration, Instant};

use sightline_tests::browser_fixture::picked;
use sightline_tests::scenario::short_approach;

#[tokio::test(flavor = "multi_thread")]
async fn a_study_can_be_cancelled_reloaded_and_resumed() {
    let (_bench, browser) = picked(&short_approach()).await;
    browser.chord(&["Shift"], "6").await;
    browser.control("button", "Start the study").await;
    browser.click_on("button", "Start the study").await;
    // The target's run no longer has such a button, because it is complete.
    browser.control("button", "Cancel").await;
    browser.save_screenshot("study-running").await;
    let start = Instant::now();
    browser.activate("button", "Cancel").await;
    browser.control("button", "Resume").await;
    println!("from the cancel to its being on the page: {} ms", start.elapsed().as_millis());
    browser.evaluate("location.reload()").await;
    browser.wait_for_viewer().await;
    browser.wait_for_status("the page again", "s.phase === 'ready' && s.target === 0").await;
    browser.control("button", "Resume").await;
    browser.activate("button", "Resume").await;
    browser.wait_until_gone("button", "Resume").await;
    browser.activate("button", "Cancel").await;
    browser.control("button", "Resume").await;
    browser.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_tour_is_led_to_its_end_and_back_by_keys() {
    let (_bench, browser) = picked(&short_approach()).await;
    browser.chord(&["Control"], "k").await;
    browser.control("textbox", "palette").await;
    browser.type_text("tour").await;
    browser.control("option", "Tour").await;
    browser.press("Enter").await;
    for bubble in 1..=6 {
        browser.wait_for_text(&format!("{bubble} of 6")).await;
        browser.save_screenshot(&format!("tour-{bubble}")).await;
        if bubble == 3 {
            browser.press("Backspace").await;
            browser.wait_for_text("2 of 6").await;
            browser.press("Enter").await;
            browser.wait_for_text("3 of 6").await;
        }
        browser.press("Enter").await;
    }
    browser.wait_until_gone("button", "Done").await;
    // The tour does not block the page: the next key changes the step.
    browser.press("ArrowRight").await;
    browser.wait_for_status("the next step", "s.step === 1 && s.shown").await;
    tokio::time::sleep(Duration::from_millis(300)).await;
    browser.end().await;
}
