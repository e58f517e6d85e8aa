//! Numbers as links in a real browser: any number to its origin, metrics to their worst step, an expression to a plot, a run
//! to its comparison with three others.

use sightline_tests::browser::Browser;
use sightline_tests::browser_fixture::picked;
use sightline_tests::scenario::short_approach;

#[tokio::test(flavor = "multi_thread")]
async fn a_number_links_to_its_origin() {
    let (_bench, browser) = picked(&short_approach()).await;
    browser.go_to("3", 3).await;
    // The score in the top line: a link with a name.
    let link = browser.control("link", "0.").await;
    assert_eq!(link.region, "Status and actions");
    let (x, y) = link.centre();
    browser.click(x, y).await;
    browser.wait_for_text("WHY NCC, RUN A, STEP 3").await;
    browser.wait_for_text("match_template").await;
    browser.save_screenshot("why-ncc").await;
    // One of its inputs, and back.
    let inputs = browser.controls().await;
    let input =
        inputs.iter().find(|c| c.role == "link" && c.region == "Why" && !c.name.starts_with("match score"));
    let input = input.expect("the score has inputs").clone();
    browser.activate("link", &input.name).await;
    browser.control("button", "Back").await;
    browser.save_screenshot("why-input").await;
    browser.activate("button", "Back").await;
    browser.wait_for_text("WHY NCC, RUN A, STEP 3").await;
    // W explains the selected value, by keyboard alone: the tracking state, down to the user's pick.
    browser.activate("button", "Why this state?").await;
    browser.wait_for_text("WHY STATE, RUN A, STEP 3").await;
    browser.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn metrics_link_to_worst_steps_and_expressions_to_plots() {
    let (fixture, browser) = picked(&short_approach()).await;
    let metrics = fixture.json("/api/v1/sessions/s1/targets/0/runs/0/metrics");
    let found = metrics["metrics"].as_array().unwrap().iter().find(|m| m["name"] == "max_px").unwrap();
    let worst = found["worst_step"].as_u64().expect("an error has a worst step");
    browser
        .go_to(if worst == 0 { "last" } else { "first" }, if worst == 0 { fixture.stop_count - 1 } else { 0 })
        .await;
    browser.show_panel("Runs").await;
    let link = browser.control("link", "max_px ").await;
    assert!(link.name.ends_with(&format!("worst at step {worst}")), "{}", link.name);
    browser.activate("link", "max_px ").await;
    browser.wait_for_status("the worst step", &format!("s.step === {worst} && s.shown")).await;
    browser.save_screenshot("metrics").await;

    // An expression over recorded values is plotted immediately and is a column of the table; nothing is computed again.
    browser.chord(&["Shift"], "b").await;
    browser.control("textbox", "expression").await;
    browser.type_text("stereo_s").await;
    // Completion offers the rest of the name: by key, and for a screen reader in the list.
    browser.control("button", "stereo_score").await;
    browser.save_screenshot("completion").await;
    browser.press("Tab").await;
    browser.type_text(" - nc").await;
    browser.activate("button", "ncc Score of the match").await;
    browser.wait_until_gone("button", "ncc Score of the match").await;
    let written = "[...document.querySelectorAll('#sightline-mirror input')].some(e => e.value === 'stereo_score - ncc')";
    browser.wait_for("the whole expression", &format!("return {written}")).await;
    browser.wait_for_text("a number without a unit").await;
    browser.click_on("button", "Plot over the steps").await;
    browser.control("button", "remove plot stereo_score - ncc from the list").await;
    browser.show_panel("Over the steps").await;
    browser.control("img", "plot of stereo_score - ncc").await;
    browser.click_on("button", "Over the steps as table").await;
    browser.control("columnheader", "stereo_score - ncc").await;
    browser.save_screenshot("derived").await;
    assert_eq!(browser.status().await["run"], 0, "no run was made");
    browser.end().await;
}

/// Makes a branch at step 2 with another minimum score.
async fn branch(browser: &Browser, least: &str, number: usize) {
    browser.activate("button", "run A").await;
    browser.wait_for_status("run A", "s.run === 0").await;
    browser.go_to("2", 2).await;
    browser.press("w").await;
    browser.wait_for_text("Accepted").await;
    browser.set_value("slider", "try match score limit", least).await;
    browser.click_on("button", "Run from here as branch").await;
    browser
        .wait_for_status("the branch", &format!("s.run === {number} && !s.running && s.steps_done > s.step"))
        .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn four_runs_are_compared_in_plots_map_and_table() {
    let (_bench, browser) = picked(&short_approach()).await;
    for (number, least) in [(1, "0.99"), (2, "0.5"), (3, "0.6")] {
        branch(&browser, least, number).await;
    }
    browser.show_panel("Runs").await;
    for name in ["run A", "run B", "run C"] {
        let all = browser.controls().await;
        let check = all
            .iter()
            .find(|c| c.role == "checkbox" && c.name.starts_with("compare ") && c.name.ends_with(name));
        browser.activate("checkbox", &check.unwrap_or_else(|| panic!("no box for {name}")).name).await;
    }
    browser
        .wait_for("the comparison in the address", "return location.hash.includes('vs=0.0,0.1,0.2')")
        .await;
    browser.save_screenshot("four-runs").await;
    // Each run has a row with its metrics and its changes.
    browser.wait_for_text("ncc_min=0.99").await;
    browser.wait_for_text("ncc_min=0.5").await;
    browser.show_panel("Over the steps").await;
    for name in ["run A", "run B", "run C"] {
        browser.wait_for_text(name).await;
    }
    browser.save_screenshot("four-runs-plots").await;
    browser.end().await;
}
