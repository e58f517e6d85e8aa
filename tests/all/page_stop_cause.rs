//! A drive that stops without a visible obstacle, in a real browser: the cause is read, the command changed in one click, and a branch
//! before the stop arrives another way.

use sightline_tests::bench::picked;
use sightline_tests::scenario::slope_beyond_the_limit;

#[tokio::test(flavor = "multi_thread")]
async fn a_drive_without_a_safe_path_is_explained_and_a_branch_arrives_another_way() {
    let (bench, browser) = picked(&slope_beyond_the_limit()).await;
    browser.resize(1600, 1200).await;
    browser.show_panel("Drive").await;
    browser.click_on("combobox", "navigator").await;
    browser.choose("hazard avoidance, gestalt").await;
    // Tracking in images of this size is to have no influence on where the rover goes.
    browser.click_on("combobox", "goal").await;
    browser.choose("goal stays where it was").await;
    // One action: the drive begins, stops, and the panel says why.
    browser.click_on("button", "Drive").await;
    browser.wait_status("the end of the drive", "s.session === 's2' && s.drive === 'no safe path'").await;
    browser.says("WHY THE DRIVE STOPPED").await;
    browser.says("No path is safe: the tilt of the ground vetoes").await;
    browser.click_on("button", "Evidence and changes").await;
    browser.says("over the limit").await;
    browser.shot("stop-cause").await;
    let why = bench.json("/api/v1/sessions/s2/drive")["why"].clone();
    assert_eq!(why["cause"], "no_safe_path", "{why}");

    // The whole drive is tried with a change, in the background, while the page stays where it is.
    browser.click_on("button", "try the drive with navigator arcs instead of gestalt").await;
    browser.control("button", "cancel the drive with navigator arcs instead of gestalt").await;
    browser.says("arrived:").await;
    browser.gone("button", "cancel the drive with navigator arcs instead of gestalt").await;
    assert_eq!(browser.status().await["session"], "s2");
    browser.shot("stop-cause-tried").await;

    // The change is put into the form, and a branch before the stop drives under it.
    browser.click_on("button", "use navigator arcs instead of gestalt").await;
    browser.go_to("0", 0).await;
    browser.click_on("button", "Branch at stop 0").await;
    browser.wait_status("the branch", "s.session === 's4' && s.drive === 'arrived'").await;
    browser.shot("stop-cause-branch").await;
    browser.end().await;
}
