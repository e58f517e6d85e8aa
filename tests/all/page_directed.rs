//! Directed driving in a real browser: motions are typed and driven in their order, the target is handed off to the hazcams,
//! and the panel “Data flow” shows the messages between the components.

use sightline_tests::browser_fixture::picked;
use sightline_tests::scenario::rock_on_the_way;

#[tokio::test(flavor = "multi_thread")]
async fn typed_motions_are_driven_and_the_target_is_handed_off() {
    let (fixture, browser) = picked(&rock_on_the_way()).await;
    browser.resize(1600, 1200).await;
    browser.show_panel("Drive").await;
    browser.click_on("button", "tracked stops, odometry, offset, limits").await;
    browser.click_on("textbox", "motions").await;
    browser.type_text("0.3, left 20").await;
    browser.wait_for_text("`left 20` is not a motion").await;
    browser.chord(&["Control"], "a").await;
    browser.type_text("0.3, turn 10").await;
    browser.click_on("checkbox", "hand off on arrival").await;
    browser.save_screenshot("directed-form").await;
    // The button is below the open part of the form.
    browser.click_on("button", "tracked stops, odometry, offset, limits").await;
    browser.click_on("button", "Drive").await;
    browser
        .wait_for_status("the end", "s.session === 's2' && s.drive === 'all motions driven' && s.shown")
        .await;
    let drive = fixture.json("/api/v1/sessions/s2/drive");
    let command = &drive["steering"]["command"];
    assert_eq!(command["motions"].as_array().map(Vec::len), Some(2), "{command}");
    assert_eq!(command["on_arrival"], serde_json::json!(["look", "hand_off"]), "the box adds a look");
    let actions: Vec<_> = drive["cycles"].as_array().unwrap().iter().map(|cycle| &cycle["action"]).collect();
    assert_eq!(actions.iter().filter(|action| **action == "hand_off").count(), 1, "{actions:?}");

    browser.go_to("1", 1).await;
    browser.show_panel("Data flow").await;
    browser.wait_for_text("→ locomotor: turn").await;
    browser.wait_for_text("→ pose estimate: 0.30 m by the wheels from stop 0").await;
    browser.save_screenshot("data-flow").await;
    browser.click_on("link", "goal").await;
    browser.wait_for_status("its stage", "s.stage === 'set_goal'").await;
    browser.end().await;
}
