//! Picking a target in a real browser: the map of good and poor places, advice against a place with its ways on, the aim by keys; and
//! the plain page of a step for whom the viewer cannot run.

use sightline_geometry::frames::Pixel;
use sightline_tests::bench::{Bench, picked, place};
use sightline_tests::browser::Browser;
use sightline_tests::scenario::short_approach;

#[tokio::test(flavor = "multi_thread")]
async fn a_poor_place_gives_its_reason_and_the_nearest_good_one_is_taken() {
    let bench = Bench::start(&short_approach()).await;
    let browser = Browser::start().await;
    bench.open(&browser).await;
    browser.press("t").await;
    browser.wait_status("pick mode", "s.pick_mode").await;
    // The map comes by itself.
    browser.says("Map made with the default limits").await;
    browser.says("% good").await;
    browser.shot("trackability").await;
    // Over the sky it says why not, before anything is clicked; a click there gives the same reason and two ways on.
    let (x, y) = place(&browser, Pixel::new(250.0, 20.0)).await;
    browser.point_at(x, y).await;
    browser.says(": Poor: ").await;
    browser.shot("trackability-hover").await;
    browser.click(x, y).await;
    browser.control("button", "Use (").await;
    browser.control("button", "Pick anyway").await;
    assert_eq!(browser.status().await["targets"], 0);
    browser.shot("refused").await;
    browser.click_on("button", "Use (").await;
    browser
        .wait_status(
            "the target",
            &format!("s.target === 0 && s.steps_done === {} && !s.running", bench.stop_count),
        )
        .await;
    assert!(!browser.status().await["pick_mode"].as_bool().unwrap());

    // A second one by keys alone: arrows move the aim from the middle, Enter takes it; a refusal offers, and Enter takes that.
    browser.press("t").await;
    browser.wait_status("pick mode", "s.pick_mode").await;
    browser.says("% good").await;
    for key in ["ArrowDown", "ArrowRight", "ArrowLeft"] {
        browser.chord(&["Shift"], key).await;
    }
    browser.says("; at 256.0, 257.0").await;
    browser.press("ArrowUp").await;
    browser.says("; at 256.0, 256.9").await;
    browser.press("Enter").await;
    let told = "!s.designating && (s.targets === 2 || s.advised_against || s.problem !== null)";
    browser.wait_status("an answer", told).await;
    if browser.status().await["targets"] != 2 {
        browser.press("Enter").await;
    }
    browser.wait_status("the second target", "s.targets === 2 && s.target === 1").await;
    // Esc leaves without a target.
    browser.press("t").await;
    browser.wait_status("pick mode", "s.pick_mode").await;
    browser.press("Escape").await;
    browser.wait_status("no pick mode", "!s.pick_mode && s.targets === 2").await;
    browser.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn without_the_viewer_a_plain_page_of_the_same_step_is_offered() {
    let (bench, browser) = picked(&short_approach()).await;
    browser.press("End").await;
    browser.wait_status("the last step", &format!("s.step === {} && s.shown", bench.stop_count - 1)).await;
    // The viewer stops as it does at a fault in it: the page says so and leads on.
    browser
        .evaluate("window.dispatchEvent(new CustomEvent('sightline-panic', {detail: 'a test of the page'}))")
        .await;
    browser
        .wait_for(
            "the sentence",
            "return document.getElementById('message-text').innerText.includes('stopped')",
        )
        .await;
    browser.shot("stopped").await;
    let link = browser.evaluate("return document.querySelector('#message-plain a').href").await;
    assert!(link.as_str().unwrap().ends_with("/api/v1/sessions/s1/page"), "{link}");
    browser.goto(link.as_str().unwrap()).await;
    browser.evaluate("[...document.links].find(link => link.text.startsWith('Current step')).click()").await;
    browser
        .wait_for("the step", "return document.title.includes('tep ') && document.images.length > 0")
        .await;
    let told = browser.evaluate("return document.body.innerText").await;
    let told = told.as_str().unwrap();
    for words in ["tracking", "target 1"] {
        assert!(told.contains(words), "the plain page does not say {words}: {told}");
    }
    let count = |what: &'static str| {
        let browser = &browser;
        async move {
            browser
                .evaluate(&format!("return document.querySelectorAll('{what}').length"))
                .await
                .as_u64()
                .unwrap()
        }
    };
    assert!(count("table").await >= 1 && count("h1").await == 1 && count("script").await == 0);
    let described = "return [...document.images].every(i => i.alt.length > 10 && i.naturalWidth > 0)";
    browser.wait_for("every image, described", described).await;
    browser.shot("plain").await;
    browser.end().await;
}
