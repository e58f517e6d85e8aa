//! A drive that avoids hazards in a real browser: the navigator is chosen, a rock blocks the path, and the page shows the
//! ground and the path of each decision.

use std::time::Duration;

use serde_json::Value;
use sightline_tests::browser_fixture::picked;
use sightline_tests::scenario::rock_on_the_way;

#[tokio::test(flavor = "multi_thread")]
async fn the_page_shows_goodness_paths_and_votes() {
    let (fixture, browser) = picked(&rock_on_the_way()).await;
    browser.show_panel("Drive").await;
    browser.click_on("combobox", "navigator").await;
    browser.choose("hazard avoidance, gestalt").await;
    // The map uses the pair that is chosen here; its box is below the open part of the form. An approach follows the goal.
    browser.resize(1600, 1200).await;
    browser.click_on("button", "tracked stops, odometry, offset, limits").await;
    browser.activate("checkbox", "front_hazcam").await;
    browser.click_on("checkbox", "approach on arrival").await;
    browser.set_value("spinbutton", "final standoff", "1.6").await;
    browser.save_screenshot("hazards-form").await;
    browser.click_on("button", "tracked stops, odometry, offset, limits").await;
    browser.click_on("button", "Drive").await;
    browser.wait_for_status("the drive", "s.session === 's2' && s.drive === 'drives'").await;
    let is_vetoed = |cycle: &Value| {
        let candidates = cycle["choice"]["candidates"].as_array();
        candidates.is_some_and(|all| all.iter().any(|one| one["veto"]["term"] == "step"))
    };
    // Up to the first stop at which the rock rejects a path.
    let step = loop {
        let drive = fixture.json("/api/v1/sessions/s2/drive");
        assert_eq!(drive["summary"]["collisions"], 0, "{}", drive["summary"]);
        if let Some(step) = drive["cycles"].as_array().unwrap().iter().position(is_vetoed) {
            break step;
        }
        assert!(
            drive["summary"]["reason"].is_null(),
            "the drive ends without a vetoed path: {}",
            drive["summary"]
        );
        tokio::time::sleep(Duration::from_millis(300)).await;
    };
    browser.click_on("button", "Pause").await;
    browser.wait_for_status("the rover waits", "s.drive === 'waits'").await;
    browser.go_to(&step.to_string(), step).await;
    browser.show_panel("Map, site frame").await;
    browser.wait_for_text("good ground").await;
    browser.wait_for_text("vetoed path").await;
    browser.click_on("button", "select_path").await;
    browser.show_panel("Inspector").await;
    browser.wait_for_text("paths are not vetoed").await;
    browser.wait_for_text("(chosen)").await;
    browser.save_screenshot("hazards").await;
    // The same ground as a layer of the left image.
    browser.click_on("button", "legend").await;
    browser.click_on("checkbox", "goodness of the ground, red is bad").await;
    browser.save_screenshot("hazards-layer").await;
    browser.click_on("checkbox", "goodness of the ground, red is bad").await;
    browser.click_on("button", "legend").await;

    // The drive continues around the rock, to 2 m from the target. There a rock blocks the approach, and the drive ends with
    // this reason; without the approach it has arrived.
    browser.show_panel("Drive").await;
    browser.click_on("button", "Drive on").await;
    browser.wait_for_status("the end", "s.drive === 'no safe path'").await;
    browser.wait_for_text("the way of the approach is not clear").await;
    browser.save_screenshot("hazards-approach").await;
    let drive = fixture.json("/api/v1/sessions/s2/drive");
    let command = &drive["steering"]["command"];
    assert_eq!(command["hazard_cameras"], serde_json::json!(["front_hazcam"]), "{command}");
    assert_eq!(command["on_arrival"], serde_json::json!(["approach"]), "{command}");
    assert_eq!(command["final_standoff_m"], 1.6, "{command}");
    browser.click_on("button", "tracked stops, odometry, offset, limits").await;
    browser.click_on("checkbox", "approach on arrival").await;
    browser.click_on("button", "tracked stops, odometry, offset, limits").await;
    browser.click_on("button", "Drive on").await;
    browser.wait_for_status("the arrival", "s.drive === 'arrived'").await;
    browser.wait_for_text("arrived: ").await;
    browser.save_screenshot("hazards-arrived").await;
    let drive = fixture.json("/api/v1/sessions/s2/drive");
    let summary = &drive["summary"];
    assert_eq!(summary["collisions"], 0, "{summary}");
    assert!(summary["target_error_m"].as_f64().unwrap() < 0.05, "{summary}");
    browser.end().await;
}
