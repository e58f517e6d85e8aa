//! Time travel in a real browser, by key: steps, events, stages, exact places, loops, play and shuttle.

use std::time::Duration;

use sightline_tests::browser::Browser;
use sightline_tests::browser_fixture::picked;
use sightline_tests::scenario::short_approach;

async fn at(browser: &Browser, step: usize) {
    browser.wait_for_status("the step", &format!("s.step === {step} && s.shown")).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn steps_stages_and_places_are_reached_by_key() {
    let (fixture, browser) = picked(&short_approach()).await;
    let last = fixture.stop_count - 1;
    for (key, step) in [("ArrowRight", 1), ("End", last), ("ArrowLeft", last - 1), ("Home", 0)] {
        browser.press(key).await;
        at(&browser, step).await;
    }
    browser.chord(&["Shift"], "ArrowRight").await;
    at(&browser, last).await;
    browser.chord(&["Shift"], "ArrowLeft").await;
    at(&browser, 0).await;
    for (place, step) in [("3", 3), ("+1", 4), ("-2", 2), ("last", last), ("first", 0)] {
        browser.go_to(place, step).await;
    }

    // Down and Up select the stages of the step; the panel Inspector and the address follow.
    browser.go_to("2", 2).await;
    let before = browser.status().await["stage"].as_str().unwrap().to_owned();
    browser.press("ArrowDown").await;
    browser.wait_for_status("the next stage", &format!("s.stage !== '{before}' && s.step === 2")).await;
    let below = browser.status().await["stage"].as_str().unwrap().to_owned();
    browser
        .wait_for("the stage in the address", &format!("return location.hash.includes('stage={below}')"))
        .await;
    browser.wait_for_text(&below).await;
    browser.press("ArrowUp").await;
    browser.wait_for_status("the stage before", &format!("s.stage === '{before}'")).await;
    for _ in 0..12 {
        browser.press("ArrowDown").await;
    }
    browser.wait_for_status("the last stage", "s.stage === 'update' && s.step === 2").await;
    browser.save_screenshot("stage-update").await;
    browser.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn play_loops_both_ways_and_never_starts_by_itself() {
    let (fixture, browser) = picked(&short_approach()).await;
    assert_eq!(browser.status().await["playing"], 0, "nothing plays by itself");
    browser.go_to("1", 1).await;
    browser.press("[").await;
    browser.go_to("3", 3).await;
    browser.press("]").await;
    browser.wait_for_text("loop 1 to 3").await;
    browser.press("l").await;
    browser.wait_for_status("play", "s.playing === 1").await;
    let mut seen = std::collections::BTreeSet::new();
    // For some rounds at least, and on a busy machine until every step of the loop was seen.
    for round in 0..1200 {
        seen.insert(browser.status().await["step"].as_u64().unwrap());
        tokio::time::sleep(Duration::from_millis(50)).await;
        if round >= 80 && seen.len() >= 3 {
            break;
        }
    }
    assert!(seen.iter().all(|step| (1..=3).contains(step)) && seen.len() == 3, "{seen:?}");
    browser.press("l").await;
    browser.wait_for_status("twice as fast", "s.playing === 2").await;
    browser.save_screenshot("playing").await;
    browser.press("k").await;
    browser.wait_for_status("a stop", "s.playing === 0").await;
    browser.press("Backspace").await;
    browser.wait_until_gone("button", "no loop").await;
    // Backwards it stops at the first step, forwards at the last.
    browser.go_to("2", 2).await;
    browser.press("j").await;
    browser.wait_for_status("the beginning", "s.playing === 0 && s.step === 0").await;
    browser.press(" ").await;
    browser
        .wait_for_status("the end", &format!("s.playing === 0 && s.step === {}", fixture.stop_count - 1))
        .await;
    // A key pauses, and a button plays for a screen reader.
    browser.activate("button", "play backwards").await;
    browser.wait_for_status("backwards", "s.playing === -1").await;
    browser.press(" ").await;
    browser.wait_for_status("a pause", "s.playing === 0").await;
    browser.end().await;
}
