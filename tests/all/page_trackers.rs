//! The other trackers in a real browser: a run by features and one by shape beside the one by its window, with what only
//! they have: features, motion, surfaces and meshes; and what is said where a run has nothing of the kind.

use sightline_tests::bench::{Bench, picked};
use sightline_tests::browser::Browser;
use sightline_tests::scenario::short_approach;

/// Runs the target anew from its pick by a named configuration.
async fn run_by(browser: &Browser, bench: &Bench, preset: &str, number: usize) {
    browser.press("Home").await;
    browser.wait_status("the first step", "s.step === 0 && s.shown").await;
    browser.show_panel("Settings").await;
    browser.click_on("combobox", "configuration preset").await;
    // The list is longer than the window: it scrolls to what a screen reader chooses.
    browser.control("button", preset).await;
    browser.activate("button", preset).await;
    browser.says("changes against run").await;
    browser.activate("button", "Run from here").await;
    let done = format!("s.run === {number} && !s.running && s.steps_done === {}", bench.stop_count);
    browser.wait_status(preset, &done).await;
}

/// Looks at a panel as tables, one of which has such a column, and back.
async fn read_as_table(browser: &Browser, panel: &str, column: &str) {
    let switch = format!("{panel} as table");
    browser.activate("button", &switch).await;
    browser.control("columnheader", column).await;
    browser.shot(&format!("{}-table", panel.to_lowercase())).await;
    browser.activate("button", &switch).await;
    browser.gone("columnheader", column).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn runs_by_features_and_by_shape_stand_beside_the_one_by_its_window() {
    let (bench, browser) = picked(&short_approach()).await;
    browser.show_panel("Features").await;
    browser.says("Choose the preset “features” in Settings and press “Run from here” at the pick.").await;

    run_by(&browser, &bench, "features", 1).await;
    browser.press("ArrowRight").await;
    browser.wait_status("a step by features", "s.step === 1 && s.shown && s.state === 'tracking'").await;
    browser.show_panel("Features").await;
    browser.says("shown: ").await;
    browser.says("inliers").await;
    browser.shot("features").await;
    read_as_table(&browser, "Features", "matches that agree").await;
    browser.show_panel("Match scores").await;
    browser.says("follows the features of the whole scene and matches no template").await;
    // The stages are those of this tracker.
    browser.activate("button", "fit_motion").await;
    browser.wait_status("the stage", "s.stage === 'fit_motion'").await;
    browser.shot("features-motion").await;

    run_by(&browser, &bench, "shape", 2).await;
    browser.press("ArrowRight").await;
    browser.wait_status("a step by shape", "s.step === 1 && s.shown && s.state !== null").await;
    browser.show_panel("Shape").await;
    browser.says("registered to step 0").await;
    for part in ["Surface", "Sensor", "Search", "Meshes", "Hand-off"] {
        browser.activate("button", part).await;
        tokio::time::sleep(std::time::Duration::from_millis(900)).await;
        browser.shot(&format!("shape-{}", part.to_lowercase().replace(' ', "-"))).await;
    }

    read_as_table(&browser, "Shape", "pixels at the end").await;

    // All three side by side, and where they part.
    browser.show_panel("Runs").await;
    for name in ["run A", "run B"] {
        let all = browser.controls().await;
        let check = all
            .iter()
            .find(|c| c.role == "checkbox" && c.name.starts_with("compare ") && c.name.ends_with(name));
        browser.activate("checkbox", &check.unwrap_or_else(|| panic!("no box for {name}")).name).await;
    }
    browser.wait_for("the comparison in the address", "return location.hash.includes('vs=0.0,0.1')").await;
    browser.says("tracker=").await;
    browser.shot("trackers").await;
    browser.press("d").await;
    browser.wait_status("where they part", "s.step <= 1 && s.shown").await;
    browser.end().await;
}
