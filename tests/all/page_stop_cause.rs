//! A drive that stops without a visible obstacle, in a real browser: the cause is read, the command changed with one click,
//! and a branch from before the stop arrives by another path.

use sightline_tests::browser_fixture::picked;
use sightline_tests::scenario::slope_beyond_the_limit;

#[tokio::test(flavor = "multi_thread")]
async fn a_blocked_drive_is_explained_and_a_branch_arrives() {
    let (fixture, browser) = picked(&slope_beyond_the_limit()).await;
    browser.resize(1600, 1200).await;
    browser.show_panel("Drive").await;
    browser.click_on("combobox", "navigator").await;
    browser.choose("hazard avoidance, gestalt").await;
    // Tracking in images of this size must not influence the path of the rover.
    browser.click_on("combobox", "goal").await;
    browser.choose("goal stays where it was").await;
    // One action: the drive starts, stops, and the panel shows the cause.
    browser.click_on("button", "Drive").await;
    browser.wait_for_status("the end of the drive", "s.session === 's2' && s.drive === 'no safe path'").await;
    browser.wait_for_text("WHY THE DRIVE STOPPED").await;
    browser.wait_for_text("No path is safe: the tilt of the ground vetoes").await;
    browser.click_on("button", "Evidence and changes").await;
    browser.wait_for_text("over the limit").await;
    browser.save_screenshot("stop-cause").await;
    let why = fixture.json("/api/v1/sessions/s2/drive")["why"].clone();
    assert_eq!(why["cause"], "no_safe_path", "{why}");

    // The whole drive is repeated with a change in the background; the page does not leave its drive.
    browser.click_on("button", "try the drive with navigator arcs instead of gestalt").await;
    browser.control("button", "cancel the drive with navigator arcs instead of gestalt").await;
    browser.wait_for_text("arrived:").await;
    browser.wait_until_gone("button", "cancel the drive with navigator arcs instead of gestalt").await;
    assert_eq!(browser.status().await["session"], "s2");
    browser.save_screenshot("stop-cause-tried").await;

    // The change is copied into the form, and a branch from before the stop drives with it.
    browser.click_on("button", "use navigator arcs instead of gestalt").await;
    browser.go_to("0", 0).await;
    browser.click_on("button", "Branch at stop 0").await;
    browser.wait_for_status("the branch", "s.session === 's4' && s.drive === 'arrived'").await;
    browser.save_screenshot("stop-cause-branch").await;
    browser.end().await;
}
