//! A drive to two targets in a real browser: both are chosen on the page, a fault is injected, and the page reports the
//! result of each visit.

use sightline_geometry::frames::Pixel;
use sightline_tests::browser_fixture::{canvas_position, picked};
use sightline_tests::scenario::several_targets;

/// A rock beside the one of the first target, px of the first left image.
const SECOND: Pixel = Pixel::new(319.0, 243.0);

#[tokio::test(flavor = "multi_thread")]
async fn two_targets_are_visited_in_turn_and_a_hidden_one_is_dropped() {
    let (fixture, browser) = picked(&several_targets()).await;
    browser.resize(1600, 1200).await;
    browser.go_to("0", 0).await;
    let (x, y) = canvas_position(&browser, SECOND).await;
    browser.press("t").await;
    browser.wait_for_status("pick mode", "s.pick_mode").await;
    browser.click(x, y).await;
    browser.wait_for_status("the target, or advice", "s.target === 1 || s.advised_against").await;
    if browser.status().await["target"] != 1 {
        browser.click_on("button", "Pick anyway").await;
    }
    browser.wait_for_status("the second target", "s.target === 1 && !s.running").await;
    // The second target, which is selected, is visited first.
    browser.show_panel("Drive").await;
    browser.click_on("checkbox", "then visit target 1").await;
    browser.click_on("button", "inject faults").await;
    browser.click_on("button", "Add a fault").await;
    browser.control("spinbutton", "first stop of fault 1").await;
    browser.save_screenshot("visits-form").await;
    browser.click_on("button", "Drive").await;
    browser.wait_for_status("the drive", "s.session === 's2'").await;
    browser.wait_for_text("injected faults: occluder at stops 1 to 3").await;
    browser.wait_for_text("target 2: dropped, target lost at stop 3").await;
    browser.wait_for_status("the end", "s.drive !== 'drives' && s.drive !== 'waits' && s.target === 1").await;
    browser.wait_for_text("target 1: ").await;
    browser.save_screenshot("visits").await;
    let drive = fixture.json("/api/v1/sessions/s2/drive");
    let visits = drive["visits"].as_array().unwrap();
    assert_eq!((visits.len(), &visits[0]["reason"]), (2, &serde_json::json!("lost")), "{drive}");
    browser.end().await;
}
