//! Undo in a real browser: Ctrl+Z restores removals, Ctrl+Y repeats them. And the appearance of the page and its panels,
//! which is chosen once and stored.

use sightline_tests::browser::Browser;
use sightline_tests::browser_fixture::picked;
use sightline_tests::scenario::short_approach;

async fn undo(browser: &Browser) {
    browser.chord(&["Control"], "z").await;
}

async fn redo(browser: &Browser) {
    browser.chord(&["Control"], "y").await;
}

#[tokio::test(flavor = "multi_thread")]
async fn removed_breakpoints_plots_notes_and_targets_come_back() {
    let (_bench, browser) = picked(&short_approach()).await;
    browser.go_to("2", 2).await;
    browser.chord(&["Shift"], "b").await;
    browser.control("textbox", "expression").await;
    browser.type_text("ncc > 0.2").await;
    browser.click_on("button", "Plot over the steps").await;
    browser.control("button", "remove plot ncc > 0.2 from the list").await;
    browser.click_on("textbox", "expression").await;
    browser.press("Enter").await;
    browser.wait_for_status("the breakpoint", "s.breakpoints === 1 && s.hits > 0").await;
    let hits = browser.status().await["hits"].as_u64().unwrap();

    browser.activate("button", "remove breakpoint ncc > 0.2").await;
    browser.wait_for_status("no breakpoint", "s.breakpoints === 0").await;
    browser.press("Escape").await;
    undo(&browser).await;
    browser
        .wait_for_status("the breakpoint again", &format!("s.breakpoints === 1 && s.hits === {hits}"))
        .await;
    redo(&browser).await;
    browser.wait_for_status("no breakpoint again", "s.breakpoints === 0").await;
    undo(&browser).await;
    browser.wait_for_status("the breakpoint once more", "s.breakpoints === 1").await;

    browser.activate("button", "remove plot ncc > 0.2 from the list").await;
    browser.wait_until_gone("button", "remove plot ncc > 0.2 from the list").await;
    undo(&browser).await;
    browser.control("button", "remove plot ncc > 0.2 from the list").await;

    browser.press("m").await;
    browser.control("textbox", "text of the note").await;
    browser.type_text("a dark edge").await;
    browser.click_on("button", "Save note").await;
    browser.wait_until_gone("textbox", "text of the note").await;
    browser.show_panel("Notes").await;
    browser.control("button", "go to note 1: step 2").await;
    browser.activate("button", "remove note 1").await;
    browser.wait_until_gone("button", "go to note 1").await;
    browser.save_screenshot("note-removed").await;
    undo(&browser).await;
    browser.control("button", "go to note 1: step 2").await;
    browser.wait_for_text("a dark edge").await;

    browser.activate("button", "Remove").await;
    browser.wait_for_status("no target", "s.targets === 0").await;
    undo(&browser).await;
    browser.wait_for_status("the target again", "s.targets === 1 && s.target === 0").await;
    browser.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn panel_positions_and_colours_survive_a_reload() {
    let (_bench, browser) = picked(&short_approach()).await;
    // A tab is dragged from the group on the right to the group of the images.
    let (x, y) = browser.control("tab", "Inspector").await.centre();
    let left = browser.control("region", "Left image").await;
    let (to_x, to_y) = left.centre();
    assert!(x > to_x + 300.0, "the inspector begins on the right");
    browser.drag((x, y), (to_x, to_y)).await;
    let start = std::time::Instant::now();
    while browser.control("region", "Inspector").await.centre().0 > to_x + 250.0 {
        assert!(start.elapsed().as_secs() < 20, "the panel stays where it was");
    }
    browser.save_screenshot("moved").await;
    let moved = browser.control("region", "Inspector").await.rect;

    for looks in ["high contrast", "light", "high contrast"] {
        browser.click_on("button", "View").await;
        browser.click_on("radio", looks).await;
        browser.press("Escape").await;
        browser.wait_until_gone("radio", looks).await;
        tokio::time::sleep(std::time::Duration::from_millis(600)).await;
        browser.save_screenshot(&format!("looks-{}", looks.replace(' ', "-"))).await;
    }
    let page = image::load_from_memory(&browser.screenshot().await).unwrap().to_rgb8();
    let black = page.pixels().filter(|pixel| pixel.0 == [0, 0, 0]).count();
    assert!(black * 4 > page.pixels().len(), "high contrast stands on black");
    tokio::time::sleep(std::time::Duration::from_millis(1500)).await;
    browser.evaluate("location.reload()").await;
    browser.wait_for_viewer().await;
    browser.wait_for_status("the page again", "s.phase === 'ready' && s.target === 0").await;
    assert_eq!(browser.control("region", "Inspector").await.rect, moved, "the panel is where it was put");
    let again = image::load_from_memory(&browser.screenshot().await).unwrap().to_rgb8();
    let black = again.pixels().filter(|pixel| pixel.0 == [0, 0, 0]).count();
    assert!(black * 4 > again.pixels().len(), "and so are the colours");
    browser.end().await;
}

/// The percentage of good pixels of the map, once the page shows it.
async fn good_percent(browser: &Browser) -> Option<f64> {
    let all = browser.controls().await.into_iter();
    let words = all.map(|control| control.name + &control.value).find(|words| words.contains("% good"))?;
    let before = words.split("% good").next()?.trim_end();
    before.rsplit(|c: char| !(c.is_ascii_digit() || c == '.')).next()?.parse().ok()
}

#[tokio::test(flavor = "multi_thread")]
async fn keys_that_write_a_character_can_be_switched_off() {
    let (_bench, browser) = picked(&short_approach()).await;
    browser.click_on("button", "View").await;
    browser.click_on("checkbox", "Keys act without Ctrl").await;
    browser.press("Escape").await;
    browser.wait_until_gone("checkbox", "Keys act without Ctrl").await;
    browser.press("t").await;
    browser.press("l").await;
    // An arrow still changes the step; by then the letter keys would have acted.
    browser.press("ArrowRight").await;
    browser.wait_for_status("a step", "s.step === 1 && s.shown && !s.pick_mode && s.playing === 0").await;
    // Their actions are in the palette.
    browser.chord(&["Control"], "k").await;
    browser.control("textbox", "palette").await;
    browser.type_text("pick a target").await;
    browser.control("option", "Pick a target").await;
    browser.press("Enter").await;
    browser.wait_for_status("pick mode", "s.pick_mode").await;
    browser.press("Escape").await;
    browser.evaluate("location.reload()").await;
    browser.wait_for_viewer().await;
    browser.wait_for_status("the page again", "s.phase === 'ready' && s.target === 0 && s.shown").await;
    browser.press("t").await;
    browser.press("ArrowRight").await;
    browser.wait_for_status("a step after the reload", "s.step === 2 && !s.pick_mode").await;
    browser.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn changed_trackability_limits_change_the_map() {
    let (_bench, browser) = picked(&short_approach()).await;
    browser.press("t").await;
    browser.wait_for_status("pick mode", "s.pick_mode").await;
    browser.wait_for_text("% good").await;
    let before = good_percent(&browser).await.expect("a share");
    browser.click_on("button", "limits of trackability").await;
    browser.control("textbox", "edge_bad_px").await;
    // An invalid value is reported immediately, with the name of the field, and nothing is lost.
    browser.set_value("textbox", "edge_risky_focus", "many").await;
    browser.activate("button", "Apply").await;
    browser.wait_for_text("edge_risky_focus: must be a number").await;
    browser.save_screenshot("limits-wrong").await;
    browser.set_value("textbox", "edge_risky_focus", "0").await;
    browser.set_value("textbox", "edge_bad_px", "0").await;
    browser.activate("button", "Apply").await;
    browser.wait_until_gone("textbox", "edge_bad_px").await;
    let start = std::time::Instant::now();
    loop {
        let now = good_percent(&browser).await.unwrap_or(before);
        if now > before {
            println!("{before} % of the places are good by the defaults, {now} % by the changed limits");
            break;
        }
        assert!(
            start.elapsed().as_secs() < 90,
            "{before} % good by the defaults, {now} % without limits of edges"
        );
        tokio::time::sleep(std::time::Duration::from_millis(300)).await;
    }
    browser.save_screenshot("limits").await;
    browser.end().await;
}
