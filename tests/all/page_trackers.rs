//! The other trackers in a real browser: a run by features and one by shape beside the one by template, with their own data:
//! features, motion, surfaces and meshes; and the message in a run that has none of them.

use sightline_tests::browser::Browser;
use sightline_tests::browser_fixture::{BrowserFixture, picked};
use sightline_tests::scenario::short_approach;

/// Runs the target again from its pick with a preset.
async fn run_by(browser: &Browser, fixture: &BrowserFixture, preset: &str, number: usize) {
    browser.press("Home").await;
    browser.wait_for_status("the first step", "s.step === 0 && s.shown").await;
    browser.show_panel("Settings").await;
    browser.click_on("combobox", "configuration preset").await;
    // The list is longer than the window: it scrolls to the entry that a screen reader chooses.
    browser.control("button", preset).await;
    browser.activate("button", preset).await;
    browser.wait_for_text("changes against run").await;
    browser.activate("button", "Run from here").await;
    let done = format!("s.run === {number} && !s.running && s.steps_done === {}", fixture.stop_count);
    browser.wait_for_status(preset, &done).await;
}

/// Shows a panel as tables, one of which has the column `column`, and switches back.
async fn read_as_table(browser: &Browser, panel: &str, column: &str) {
    let switch = format!("{panel} as table");
    browser.activate("button", &switch).await;
    browser.control("columnheader", column).await;
    browser.save_screenshot(&format!("{}-table", panel.to_lowercase())).await;
    browser.activate("button", &switch).await;
    browser.wait_until_gone("columnheader", column).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn runs_of_all_trackers_are_shown_side_by_side() {
    let (fixture, browser) = picked(&short_approach()).await;
    browser.show_panel("Features").await;
    browser
        .wait_for_text("Choose the preset “features” in Settings and press “Run from here” at the pick.")
        .await;

    run_by(&browser, &fixture, "features", 1).await;
    browser.press("ArrowRight").await;
    browser.wait_for_status("a step by features", "s.step === 1 && s.shown && s.state === 'tracking'").await;
    browser.show_panel("Features").await;
    browser.wait_for_text("shown: ").await;
    browser.wait_for_text("inliers").await;
    browser.save_screenshot("features").await;
    read_as_table(&browser, "Features", "iteration").await;
    browser.show_panel("Match scores").await;
    browser.wait_for_text("follows the features of the whole scene and matches no template").await;
    // The stages are those of this tracker.
    browser.activate("button", "fit_motion").await;
    browser.wait_for_status("the stage", "s.stage === 'fit_motion'").await;
    browser.save_screenshot("features-motion").await;

    run_by(&browser, &fixture, "shape", 2).await;
    browser.press("ArrowRight").await;
    browser.wait_for_status("a step by shape", "s.step === 1 && s.shown && s.state !== null").await;
    browser.show_panel("Shape").await;
    browser.wait_for_text("registered to step 0").await;
    for part in ["Surface", "Sensor", "Search", "Meshes", "Hand-off"] {
        browser.activate("button", part).await;
        tokio::time::sleep(std::time::Duration::from_millis(900)).await;
        browser.save_screenshot(&format!("shape-{}", part.to_lowercase().replace(' ', "-"))).await;
    }

    read_as_table(&browser, "Shape", "pixels at the end").await;

    // All three side by side, and their divergence.
    browser.show_panel("Runs").await;
    for name in ["run A", "run B"] {
        let all = browser.controls().await;
        let check = all
            .iter()
            .find(|c| c.role == "checkbox" && c.name.starts_with("compare ") && c.name.ends_with(name));
        browser.activate("checkbox", &check.unwrap_or_else(|| panic!("no box for {name}")).name).await;
    }
    browser.wait_for("the comparison in the address", "return location.hash.includes('vs=0.0,0.1')").await;
    browser.wait_for_text("tracker=").await;
    browser.save_screenshot("trackers").await;
    browser.press("d").await;
    browser.wait_for_status("where they part", "s.step <= 1 && s.shown").await;
    browser.end().await;
}
