//! Parts of the debugger in a real browser, by role and name or by key: breakpoints and play, what-if and undo, compare,
//! notes, export, colour schemes. Every test ends by checking the console for errors.

use std::time::Duration;

use sightline_tests::browser_fixture::picked;
use sightline_tests::scenario::short_approach;

#[tokio::test(flavor = "multi_thread")]
async fn breakpoints_are_written_hit_and_played_to() {
    let (_bench, browser) = picked(&short_approach()).await;
    browser.chord(&["Shift"], "b").await;
    browser.control("textbox", "expression").await;
    // An error is shown during typing, and nothing is lost.
    browser.type_text("ncc < 3 px").await;
    let typed =
        "[...document.querySelectorAll('#sightline-mirror input')].some(e => e.value === 'ncc < 3 px')";
    browser.wait_for("what was typed", &format!("return {typed}")).await;
    browser.wait_for_text("`ncc` is without a unit").await;
    for _ in 0.."ncc < 3 px".len() {
        browser.press("Backspace").await;
    }
    browser.type_text("step == 2 or step == 4").await;
    browser.press("Enter").await;
    browser.wait_for_status("the hits", "s.breakpoints === 1 && s.hits === 2").await;
    browser.wait_for_text("2 hits in all runs").await;
    browser.save_screenshot("breakpoints").await;
    browser.press("Escape").await;
    browser.press("n").await;
    browser.wait_for_status("the first hit", "s.step === 2 && s.shown").await;
    browser.press("n").await;
    browser.wait_for_status("the second hit", "s.step === 4 && s.shown").await;
    browser.chord(&["Shift"], "n").await;
    browser.wait_for_status("the hit before", "s.step === 2 && s.shown").await;
    // Playing stops exactly at a hit.
    browser.press("Home").await;
    browser.wait_for_status("the first step", "s.step === 0 && s.playing === 0").await;
    browser.press("l").await;
    browser.wait_for_status("the hit at which it stops", "s.step === 2 && s.playing === 0").await;
    // The box accepts every form of a place on the drive, and reports an error otherwise.
    browser.press("g").await;
    browser.control("textbox", "go to step").await;
    browser.type_text("nowhere").await;
    browser.press("Enter").await;
    browser.control("textbox", "go to step").await;
    browser.save_screenshot("go-to").await;
    browser.press("Escape").await;
    browser.wait_until_gone("textbox", "go to step").await;
    browser.go_to("5", 5).await;
    browser.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_change_is_tried_branched_compared_and_undone() {
    let (fixture, browser) = picked(&short_approach()).await;
    let last = fixture.stop_count - 1;
    browser.go_to("3", 3).await;
    browser.press("w").await;
    browser.wait_for_text("Accepted").await;
    // A limit that the match fails: the ghost shows the result of the step under it.
    browser.set_value("slider", "try match score limit", "0.999").await;
    browser.control("button", "Run from here as branch").await;
    browser.save_screenshot("what-if").await;
    browser.press("Escape").await;
    browser.wait_until_gone("button", "Run from here as branch").await;
    assert_eq!(browser.status().await["run"], 0, "what was tried left nothing behind");

    // A branch without a change is the same run: the page reports that the two do not differ.
    browser.press("r").await;
    browser
        .wait_for_status("the branch", &format!("s.run === 1 && s.steps_done === {} && !s.running", last + 1))
        .await;
    browser.click_on("combobox", "compared with").await;
    browser.choose("run A").await;
    browser.wait_for("the comparison in the address", "return location.hash.includes('vs=0.0')").await;
    browser.press("d").await;
    browser.wait_for_text("do not differ").await;
    for name in ["side-by-side", "wipe", "blink", "difference"] {
        browser.press("v").await;
        browser.wait_for(name, &format!("return location.hash.includes('cmp={name}')")).await;
        tokio::time::sleep(Duration::from_millis(800)).await;
        browser.save_screenshot(&format!("compare-{name}")).await;
    }
    browser.chord(&["Control"], "z").await;
    browser.wait_for_status("the run before", "s.run === 0").await;
    browser.chord(&["Control"], "y").await;
    browser
        .wait_for(
            "the branch again",
            "return JSON.parse(document.getElementById('sightline').dataset.status).run >= 0",
        )
        .await;
    browser.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn notes_exports_and_layouts_work_in_the_page() {
    let (fixture, browser) = picked(&short_approach()).await;
    browser.go_to("2", 2).await;
    browser.press("m").await;
    browser.control("textbox", "text of the note").await;
    browser.type_text("the *shadow* comes here").await;
    browser.click_on("button", "Save note").await;
    browser.wait_until_gone("textbox", "text of the note").await;
    browser.activate("tab", "Notes").await;
    browser.wait_for_text("comes here").await;
    browser.save_screenshot("notes").await;
    let session = browser.status().await["session"].as_str().unwrap().to_owned();
    let notes = fixture.json(&format!("/api/v1/sessions/{session}/notes"));
    assert!(notes.to_string().contains("the *shadow* comes here"), "{notes}");

    browser.chord(&["Control"], "s").await;
    browser.control("button", "download: ").await;
    browser.control("button", "copy as command: ").await;
    browser.control("button", "copy as HTTP: ").await;
    browser.save_screenshot("export").await;
    browser.press("Escape").await;
    browser.wait_until_gone("button", "download: ").await;

    browser.click_on("button", "View").await;
    browser.click_on("radio", "light").await;
    browser.press("Escape").await;
    tokio::time::sleep(Duration::from_millis(800)).await;
    browser.save_screenshot("looks-light").await;
    browser.evaluate("location.reload()").await;
    browser.wait_for_viewer().await;
    browser.wait_for_status("the page again", "s.target === 0 && s.shown").await;
    assert_eq!(browser.evaluate("return localStorage.getItem('sightline.looks')").await, "light");
    let page = browser.screenshot().await;
    let picture = image::load_from_memory(&page).unwrap().to_luma8();
    let bright = picture.pixels().filter(|pixel| pixel.0[0] > 200).count();
    assert!(bright * 2 > picture.len(), "the page is light: {bright} of {} pixels", picture.len());
    browser.end().await;
}
