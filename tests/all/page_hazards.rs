//! A drive that avoids hazards in a real browser: the navigator is chosen, the rover goes round a rock, and the page shows on which
//! ground it chose which path.

use sightline_tests::bench::picked;
use sightline_tests::scenario::rock_on_the_way;

#[tokio::test(flavor = "multi_thread")]
async fn the_rover_goes_round_a_rock_and_the_page_shows_map_and_votes() {
    let (bench, browser) = picked(&rock_on_the_way()).await;
    browser.show_panel("Drive").await;
    browser.click_on("combobox", "navigator").await;
    browser.choose("avoids hazards as gestalt").await;
    browser.click_on("combobox", "goal").await;
    browser.choose("goal stays where it was").await;
    browser.click_on("button", "Drive").await;
    browser.wait_status("the goal", "s.drive === 'arrived' && s.step + 1 === s.stop_count && s.shown").await;

    let session = browser.status().await["session"].as_str().unwrap().to_owned();
    let drive = bench.json(&format!("/api/v1/sessions/{session}/drive"));
    assert_eq!(drive["summary"]["collisions"], 0, "{}", drive["summary"]);
    let cycles = drive["cycles"].as_array().unwrap();
    let is_vetoed = |cycle: &serde_json::Value| {
        let candidates = cycle["choice"]["candidates"].as_array();
        candidates.is_some_and(|all| all.iter().any(|one| !one["veto"].is_null()))
    };
    let step = cycles.iter().position(is_vetoed).expect("a stop with a vetoed path");
    browser.go_to(&step.to_string(), step).await;
    browser.show_panel("Map, site frame").await;
    browser.says("good ground").await;
    browser.says("vetoed path").await;
    browser.click_on("button", "select_path").await;
    browser.show_panel("Inspector").await;
    browser.says("paths are open").await;
    browser.says("(chosen)").await;
    browser.shot("hazards").await;
    browser.end().await;
}
