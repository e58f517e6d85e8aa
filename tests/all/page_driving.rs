//! Driving in a real browser: a target is picked, the rover drives, waits, goes on with another setting, arrives, and branches.

use sightline_tests::bench::picked;
use sightline_tests::scenario::short_approach;

#[tokio::test(flavor = "multi_thread")]
async fn the_rover_drives_waits_goes_on_with_another_setting_arrives_and_branches() {
    let (_bench, browser) = picked(&short_approach()).await;
    let planned = browser.status().await["session"].as_str().unwrap().to_owned();
    browser.show_panel("Drive").await;
    browser.shot("drive-form").await;
    browser.click_on("button", "Drive").await;
    browser.wait_status("the drive", &format!("s.session !== '{planned}' && s.drive === 'drives'")).await;
    browser.click_on("button", "Pause").await;
    browser.wait_status("the rover waits", "s.drive === 'waits' && s.shown").await;
    browser.shot("drive-waits").await;
    let waited = browser.status().await;
    let stops = waited["stop_count"].as_u64().unwrap();
    assert_eq!(waited["steps_done"], stops, "the target is located at the stop where it waits");

    // The last step again with another limit, on the same images; then one stop with that run, and on to the end.
    browser.go_to(&format!("{}", stops - 1), (stops - 1) as usize).await;
    browser.press("w").await;
    browser.set_value("slider", "try ncc_min", "0.6").await;
    browser.click_on("button", "Run from here as branch").await;
    browser.wait_status("the run", &format!("s.run === 1 && s.steps_done === {stops} && !s.running")).await;
    browser.show_panel("Drive").await;
    browser.control("button", "Drive on with run B").await;
    browser.click_on("button", "One stop").await;
    browser.wait_status("one stop", &format!("s.drive === 'waits' && s.steps_done === {}", stops + 1)).await;
    browser.click_on("button", "Drive on").await;
    browser.wait_status("the goal", "s.drive === 'arrived' && s.step + 1 === s.stop_count && s.shown").await;
    browser.says("min on Mars").await;
    browser.shot("drive-arrived").await;

    // From an earlier stop in a world of its own.
    let trunk = browser.status().await["session"].as_str().unwrap().to_owned();
    browser.go_to("1", 1).await;
    browser.click_on("button", "Branch at stop 1").await;
    browser.wait_status("the branch", &format!("s.session !== '{trunk}' && s.drive === 'arrived'")).await;
    browser.shot("drive-branch").await;
    browser.end().await;
}
