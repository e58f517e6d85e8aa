//! Directed driving in a real browser: motions are typed, driven one after the other, the target is handed off to the hazcams, and the
//! panel “Data flow” shows what the components told each other.

use sightline_tests::bench::picked;
use sightline_tests::scenario::rock_on_the_way;

#[tokio::test(flavor = "multi_thread")]
async fn typed_motions_are_driven_and_the_target_is_handed_off() {
    let (bench, browser) = picked(&rock_on_the_way()).await;
    browser.resize(1600, 1200).await;
    browser.show_panel("Drive").await;
    browser.click_on("button", "tracked stops, odometry, offset, limits").await;
    browser.click_on("textbox", "motions").await;
    browser.type_text("0.3, left 20").await;
    browser.says("`left 20` is not a motion").await;
    browser.chord(&["Control"], "a").await;
    browser.type_text("0.3, turn 10").await;
    browser.click_on("checkbox", "hand off on arrival").await;
    browser.shot("directed-form").await;
    // The button lies below the open part of the form.
    browser.click_on("button", "tracked stops, odometry, offset, limits").await;
    browser.click_on("button", "Drive").await;
    browser.wait_status("the end", "s.session === 's2' && s.drive === 'all motions driven' && s.shown").await;
    let drive = bench.json("/api/v1/sessions/s2/drive");
    let command = &drive["steering"]["command"];
    assert_eq!(command["motions"].as_array().map(Vec::len), Some(2), "{command}");
    assert_eq!(command["on_arrival"], serde_json::json!(["look", "hand_off"]), "the box adds a look");
    let actions: Vec<_> = drive["cycles"].as_array().unwrap().iter().map(|cycle| &cycle["action"]).collect();
    assert_eq!(actions.iter().filter(|action| **action == "hand_off").count(), 1, "{actions:?}");

    browser.go_to("1", 1).await;
    browser.show_panel("Data flow").await;
    browser.says("→ locomotor: turn").await;
    browser.says("→ pose estimate: 0.30 m by the wheels from stop 0").await;
    browser.shot("data-flow").await;
    browser.click_on("link", "goal").await;
    browser.wait_status("its stage", "s.stage === 'set_goal'").await;
    browser.end().await;
}
