//! The location under the pointer in a real browser: marked in all panels at once, before and after a pick.

use serde_json::Value;
use sightline_geometry::frames::Pixel;
use sightline_tests::browser::Browser;
use sightline_tests::browser_fixture::{BrowserFixture, canvas_position, picked};
use sightline_tests::scenario::short_approach;
use sightline_vision::image::{GrayImage, npy, npz};

/// Moves the pointer as near to a pixel of the left image as the screen permits. Returns the pixel under the pointer.
async fn point_at(browser: &Browser, pixel: Pixel) -> Pixel {
    let (x, y) = canvas_position(browser, pixel).await;
    browser.point_at(x.round(), y.round()).await;
    let scale = browser.status().await["image_to_screen"]["scale"].as_f64().unwrap();
    pixel.offset((x.round() - x) / scale, (y.round() - y) / scale)
}

/// The score map of a step, the pixel of its peak and the pixel of its first score.
fn scores(fixture: &BrowserFixture, step: usize) -> (GrayImage, Pixel, Pixel) {
    let path = format!("/api/v1/sessions/s1/targets/0/runs/0/steps/{step}");
    let matched = fixture.json(&path)["locate"]["evidence"]["match_template"].clone();
    let arrays = npz::decode(&fixture.get(&format!("{path}/arrays.npz")), "the arrays").unwrap();
    let (_, surface) = arrays.into_iter().find(|(name, _)| name == "surface").unwrap();
    let surface = npy::decode(&surface, "the scores").unwrap();
    let number = |value: &Value| value.as_f64().unwrap();
    let peak = matched["peak"]["integer"].clone();
    let window = matched["search_window"].clone();
    let first = |at: &str, side: &str, inner: u32| {
        number(&window[at]) + (number(&window[side]) - f64::from(inner)) / 2.0
    };
    let corner = Pixel::new(first("x", "width", surface.width()), first("y", "height", surface.height()));
    (surface, Pixel::new(number(&peak[0]), number(&peak[1])), corner)
}

/// The score at the pointer, from the last field of the status strip.
async fn score_at_pointer(browser: &Browser) -> f64 {
    let patch = browser.control("img", "at the pointer: ncc").await;
    patch.name.rsplit(' ').next().unwrap().parse().unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_hovered_position_is_marked_in_every_panel() {
    let (fixture, browser) = picked(&short_approach()).await;
    browser.go_to("2", 2).await;
    browser.point_at(3.0, 3.0).await;
    browser.control("img", "at the pointer: point at the scores or at the left image").await;
    let (surface, peak, corner) = scores(&fixture, 2);

    // On the match, and twelve pixels beside it: the shown score is that of the score map at the nearest pixel.
    for aside_px in [0.0, 12.0] {
        let there = point_at(&browser, peak.offset(aside_px, 0.0)).await;
        browser.wait_for_text("of the left image").await;
        let (x, y) = ((there.x - corner.x).round() as u32, (there.y - corner.y).round() as u32);
        let expected = f64::from(surface.get_pixel(x, y).0[0]);
        let start = std::time::Instant::now();
        while (score_at_pointer(&browser).await - expected).abs() > 0.006 {
            assert!(start.elapsed().as_secs() < 30, "the score at {there:?} is {expected}");
        }
        browser.save_screenshot(&format!("linked-left-{aside_px}")).await;
    }

    // Conversely, a pixel of the right image has its curve in the left one, and a score its window.
    let (x, y) = browser.control("region", "Right image").await.centre();
    browser.point_at(x, y).await;
    browser.wait_for_text("of the right image").await;
    browser.save_screenshot("linked-right").await;
    browser.show_panel("Match scores").await;
    let (x, y) = browser.control("region", "Match scores").await.centre();
    browser.point_at(x, y).await;
    browser.wait_for_text("template at x ").await;
    browser.wait_for_text("of the left image").await;
    score_at_pointer(&browser).await;
    browser.save_screenshot("linked-scores").await;
    // Hiding the marks hides this one, too, and it disappears when the pointer leaves.
    browser.press("h").await;
    browser.control("img", "at the pointer: point at").await;
    browser.press("h").await;
    browser.control("img", "at the pointer: ncc").await;
    browser.point_at(3.0, 3.0).await;
    browser.control("img", "at the pointer: point at").await;
    browser.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn hovering_in_pick_mode_shows_the_match_curve() {
    let fixture = BrowserFixture::start(&short_approach()).await;
    let browser = Browser::start().await;
    fixture.open(&browser).await;
    browser.press("t").await;
    browser.wait_for_status("pick mode", "s.pick_mode").await;
    point_at(&browser, fixture.rock).await;
    browser.wait_for_text("of the left image").await;
    browser.save_screenshot("linked-pick").await;
    browser.end().await;
}
