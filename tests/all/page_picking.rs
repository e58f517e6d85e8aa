//! Picking a target in a real browser: the trackability map, the advice against a poor pixel with its alternatives, the aim
//! by keys; and the plain page of a step if the viewer cannot run.

use sightline_geometry::frames::Pixel;
use sightline_tests::browser::Browser;
use sightline_tests::browser_fixture::{BrowserFixture, canvas_position, picked};
use sightline_tests::scenario::short_approach;

#[tokio::test(flavor = "multi_thread")]
async fn a_poor_pixel_gives_its_reason_and_the_nearest_good_one() {
    let fixture = BrowserFixture::start(&short_approach()).await;
    let browser = Browser::start().await;
    fixture.open(&browser).await;
    browser.press("t").await;
    browser.wait_for_status("pick mode", "s.pick_mode").await;
    // The map is computed without a request.
    browser.wait_for_text("Map made with the default limits").await;
    browser.wait_for_text("% good").await;
    browser.save_screenshot("trackability").await;
    // Over the sky the reason is shown before a click; a click there shows the same reason and two alternatives.
    let (x, y) = canvas_position(&browser, Pixel::new(250.0, 20.0)).await;
    browser.point_at(x, y).await;
    browser.wait_for_text(": Poor: ").await;
    browser.save_screenshot("trackability-hover").await;
    browser.click(x, y).await;
    browser.control("button", "Use (").await;
    browser.control("button", "Pick anyway").await;
    assert_eq!(browser.status().await["targets"], 0);
    browser.save_screenshot("refused").await;
    browser.click_on("button", "Use (").await;
    browser
        .wait_for_status(
            "the target",
            &format!("s.target === 0 && s.steps_done === {} && !s.running", fixture.stop_count),
        )
        .await;
    assert!(!browser.status().await["pick_mode"].as_bool().unwrap());

    // A second target by keys alone: arrows move the aim from the centre, Enter picks; a refusal offers a pixel that Enter
    // picks.
    browser.press("t").await;
    browser.wait_for_status("pick mode", "s.pick_mode").await;
    browser.wait_for_text("% good").await;
    for key in ["ArrowDown", "ArrowRight", "ArrowLeft"] {
        browser.chord(&["Shift"], key).await;
    }
    browser.wait_for_text("; at 256.0, 257.0").await;
    browser.press("ArrowUp").await;
    browser.wait_for_text("; at 256.0, 256.9").await;
    browser.press("Enter").await;
    let answered = "!s.designating && (s.targets === 2 || s.advised_against || s.problem !== null)";
    browser.wait_for_status("an answer", answered).await;
    if browser.status().await["targets"] != 2 {
        browser.press("Enter").await;
    }
    browser.wait_for_status("the second target", "s.targets === 2 && s.target === 1").await;
    // Esc leaves without a target.
    browser.press("t").await;
    browser.wait_for_status("pick mode", "s.pick_mode").await;
    browser.press("Escape").await;
    browser.wait_for_status("no pick mode", "!s.pick_mode && s.targets === 2").await;
    browser.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn without_the_viewer_a_plain_page_of_the_same_step_is_offered() {
    let (fixture, browser) = picked(&short_approach()).await;
    browser.press("End").await;
    browser
        .wait_for_status("the last step", &format!("s.step === {} && s.shown", fixture.stop_count - 1))
        .await;
    // The viewer stops as after a fault in its code: the page reports it and links to the plain page.
    browser
        .evaluate("window.dispatchEvent(new CustomEvent('sightline-panic', {detail: 'a test of the page'}))")
        .await;
    browser
        .wait_for(
            "the sentence",
            "return document.getElementById('message-text').innerText.includes('stopped')",
        )
        .await;
    browser.save_screenshot("stopped").await;
    let link = browser.evaluate("return document.querySelector('#message-plain a').href").await;
    assert!(link.as_str().unwrap().ends_with("/api/v1/sessions/s1/page"), "{link}");
    browser.goto(link.as_str().unwrap()).await;
    browser.evaluate("[...document.links].find(link => link.text.startsWith('Current step')).click()").await;
    browser
        .wait_for("the step", "return document.title.includes('tep ') && document.images.length > 0")
        .await;
    let text = browser.evaluate("return document.body.innerText").await;
    let text = text.as_str().unwrap();
    for words in ["tracking", "target 1"] {
        assert!(text.contains(words), "the plain page does not say {words}: {text}");
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
    browser.save_screenshot("plain").await;
    browser.end().await;
}
