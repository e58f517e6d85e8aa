//! Driving in a real browser: a target is picked, the rover drives, waits, continues with another setting, arrives, and
//! branches.

use std::time::Duration;

use sightline_tests::browser::Browser;
use sightline_tests::browser_fixture::{BrowserFixture, picked};
use sightline_tests::scenario::short_approach;

#[tokio::test(flavor = "multi_thread")]
async fn a_commanded_drive_pauses_resumes_arrives_and_branches() {
    let (fixture, browser) = picked(&short_approach()).await;
    // All buttons of the panel *Drive* are in view.
    browser.resize(1600, 1200).await;
    let planned = browser.status().await["session"].as_str().unwrap().to_owned();
    browser.show_panel("Drive").await;
    browser.save_screenshot("drive-form").await;
    browser.click_on("button", "Drive").await;
    // At the first stop no match exists that another limit could reject.
    let under_way = format!("s.session !== '{planned}' && s.drive === 'drives' && s.steps_done > 1");
    browser.wait_for_status("the drive", &under_way).await;
    pause_before_driving(&fixture, &browser).await;
    browser.save_screenshot("drive-waits").await;
    let waited = browser.status().await;
    let stops = waited["stop_count"].as_u64().unwrap();
    assert_eq!(waited["steps_done"], stops, "the target is located at the stop where it waits");

    // The last step again with another limit, on the same images; then one stop with that run, and to the end.
    browser.go_to(&format!("{}", stops - 1), (stops - 1) as usize).await;
    browser.press("w").await;
    browser.set_value("slider", "try match score limit", "0.6").await;
    browser.click_on("button", "Run from here as branch").await;
    browser
        .wait_for_status("the run", &format!("s.run === 1 && s.steps_done === {stops} && !s.running"))
        .await;
    browser.show_panel("Drive").await;
    browser.control("button", "Drive on with run B").await;
    browser.click_on("button", "One stop").await;
    browser
        .wait_for_status("one stop", &format!("s.drive === 'waits' && s.steps_done === {}", stops + 1))
        .await;
    browser.click_on("button", "Drive on").await;
    browser
        .wait_for_status("the goal", "s.drive === 'arrived' && s.step + 1 === s.stop_count && s.shown")
        .await;
    browser.wait_for_text("min on Mars").await;
    browser.save_screenshot("drive-arrived").await;

    // A branch from a stop before run B started, in a world of its own.
    let trunk = browser.status().await["session"].as_str().unwrap().to_owned();
    browser.go_to("1", 1).await;
    browser.click_on("button", "Branch at stop 1").await;
    browser.wait_for_status("the branch", &format!("s.session !== '{trunk}' && s.drive === 'arrived'")).await;
    browser.save_screenshot("drive-branch").await;
    browser.end().await;
}

/// Pauses the rover before it drives from a stop, and returns that stop. If the rover has already left the stop, it pauses
/// at the next one and continues there to the same stage.
async fn pause_before_driving(fixture: &BrowserFixture, browser: &Browser) -> u64 {
    browser.click_on("button", "Pause").await;
    browser.wait_for_status("a pause", "s.drive === 'waits' && s.paused_before !== null").await;
    if browser.status().await["paused_before"] != "drive" {
        browser.click_on("button", "Continue").await;
    }
    browser
        .wait_for_status("the pause before drive", "s.drive === 'waits' && s.paused_before === 'drive'")
        .await;
    let session = browser.status().await["session"].as_str().unwrap().to_owned();
    let paused = fixture.json(&format!("/api/v1/sessions/{session}/drive"))["paused"].clone();
    let stop = paused["stop"].as_u64().unwrap();
    browser.wait_for_status("its stop", &format!("s.stop_count === {} && s.shown", stop + 1)).await;
    stop
}

/// Chooses the stage of the pause in the list; the stage bar has a button of the same name.
async fn choose_stage(browser: &Browser, stage: &str) {
    let in_bar = browser.control("button", stage).await;
    browser.click_on("combobox", "stage of the pause").await;
    let (x, y) = loop {
        let all = browser.controls().await;
        let mut entries = all.iter().filter(|c| c.role == "button" && c.name == stage);
        if let Some(entry) = entries.find(|c| c.rect != in_bar.rect) {
            break entry.centre();
        }
        tokio::time::sleep(Duration::from_millis(100)).await;
    };
    browser.click(x, y).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_paused_stage_can_be_repeated_with_other_settings() {
    let (fixture, browser) = picked(&short_approach()).await;
    let planned = browser.status().await["session"].as_str().unwrap().to_owned();
    browser.show_panel("Drive").await;
    browser.click_on("button", "Drive").await;
    browser.wait_for_status("the drive", &format!("s.session !== '{planned}' && s.drive === 'drives'")).await;
    let stop = pause_before_driving(&fixture, &browser).await + 1;

    // At the next stop the drive is to pause after `locate`.
    browser.click_on("combobox", "pause before or after").await;
    browser.choose("after").await;
    choose_stage(&browser, "locate").await;
    browser.click_on("button", "Continue").await;
    let located = format!("s.paused_before === 'judge' && s.step === {stop} && s.shown && !s.running");
    browser.wait_for_status("the pause after locate", &located).await;
    browser.wait_for_text(&format!("paused at stop {stop}: after locate, before judge")).await;
    browser.wait_for_text("paused before judge").await;
    browser.click_on("button", "judge").await;
    browser.show_panel("Inspector").await;
    browser.wait_for_text("Not computed yet: the drive is paused before `judge`").await;
    browser.save_screenshot("drive-paused-judge").await;

    // The verdict, then again with a limit that this match fails: on the same images, up to the pause.
    browser.show_panel("Drive").await;
    browser.click_on("button", "Next stage").await;
    browser.wait_for_status("the verdict", "s.run === 0 && s.paused_before === 'update' && s.shown").await;
    browser.press("w").await;
    browser.set_value("slider", "try match score limit", "0.9999").await;
    browser.click_on("button", "Run from here as branch").await;
    let again = format!("s.run === 1 && s.steps_done === {} && !s.running && s.shown", stop + 1);
    browser.wait_for_status("the run", &again).await;
    assert_eq!(browser.status().await["state"], "tracking", "the update is not computed yet");
    browser.save_screenshot("drive-paused-update").await;
    browser.show_panel("Drive").await;
    browser.click_on("button", "Next stage").await;
    browser.wait_for_status("the update", "s.paused_before === 'set_goal' && s.state === 'lost'").await;
    browser.click_on("button", "Next stage").await;
    browser.wait_for_status("the goal", "s.paused_before === 'select_path'").await;
    browser.click_on("button", "set_goal").await;
    browser.show_panel("Inspector").await;
    browser.wait_for_text("ahead of the rover").await;
    browser.save_screenshot("drive-goal").await;

    // The rover drives, and pauses before an image is taken.
    browser.show_panel("Drive").await;
    browser.click_on("button", "Next stage").await;
    browser.wait_for_status("the motion", "s.paused_before === 'drive'").await;
    browser.click_on("button", "Next stage").await;
    let next = stop + 1;
    browser
        .wait_for_status("the next stop", &format!("s.paused_before === 'predict' && s.step === {next}"))
        .await;
    browser.wait_for_text(&format!("The left image of step {next} is not taken yet.")).await;
    browser.save_screenshot("drive-paused-predict").await;
    browser.click_on("button", "Continue").await;
    let located = format!("s.paused_before === 'judge' && s.step === {next} && s.shown");
    browser.wait_for_status("the pause after locate at the next stop", &located).await;
    browser.click_on("button", "Drive on").await;
    browser.wait_for_status("the end", "s.drive !== 'drives' && s.drive !== 'waits'").await;
    browser.end().await;
}
