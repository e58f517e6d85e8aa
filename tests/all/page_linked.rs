//! What the pointer rests on, in a real browser: the same place in all panels at once, before and after a pick.

use serde_json::Value;
use sightline_geometry::frames::Pixel;
use sightline_tests::bench::{Bench, picked, place};
use sightline_tests::browser::Browser;
use sightline_tests::scenario::short_approach;
use sightline_vision::image::{GrayImage, npy, npz};

/// Rests the pointer as near to a pixel of the left image as the screen allows. Returns the pixel on which it rests.
async fn point_at(browser: &Browser, pixel: Pixel) -> Pixel {
    let (x, y) = place(browser, pixel).await;
    browser.point_at(x.round(), y.round()).await;
    let scale = browser.status().await["image_to_screen"]["scale"].as_f64().unwrap();
    pixel.offset((x.round() - x) / scale, (y.round() - y) / scale)
}

/// The scores of a step, with the pixel at which its peak is and the one of the first score.
fn scores(bench: &Bench, step: usize) -> (GrayImage, Pixel, Pixel) {
    let path = format!("/api/v1/sessions/s1/targets/0/runs/0/steps/{step}");
    let matched = bench.json(&path)["locate"]["evidence"]["match_template"].clone();
    let arrays = npz::decode(&bench.get(&format!("{path}/arrays.npz")), "the arrays").unwrap();
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

/// The score that the last place of the strip tells.
async fn score_at_pointer(browser: &Browser) -> f64 {
    let patch = browser.control("img", "at the pointer: ncc").await;
    patch.name.rsplit(' ').next().unwrap().parse().unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_place_that_is_pointed_at_is_shown_by_every_panel() {
    let (bench, browser) = picked(&short_approach()).await;
    browser.go_to("2", 2).await;
    browser.point_at(3.0, 3.0).await;
    browser.control("img", "at the pointer: point at the scores or at the left image").await;
    let (surface, peak, corner) = scores(&bench, 2);

    // On the match and twelve pixels beside it: the score is that of the surface at the pixel next to the pointer.
    for aside_px in [0.0, 12.0] {
        let there = point_at(&browser, peak.offset(aside_px, 0.0)).await;
        browser.says("of the left image").await;
        let (x, y) = ((there.x - corner.x).round() as u32, (there.y - corner.y).round() as u32);
        let expected = f64::from(surface.get_pixel(x, y).0[0]);
        let start = std::time::Instant::now();
        while (score_at_pointer(&browser).await - expected).abs() > 0.006 {
            assert!(start.elapsed().as_secs() < 30, "the score at {there:?} is {expected}");
        }
        browser.shot(&format!("linked-left-{aside_px}")).await;
    }

    // The other way round: a place of the right image has its curve in the left one, one of the scores its window.
    let (x, y) = browser.control("region", "Right image").await.middle();
    browser.point_at(x, y).await;
    browser.says("of the right image").await;
    browser.shot("linked-right").await;
    browser.show_panel("Match scores").await;
    let (x, y) = browser.control("region", "Match scores").await.middle();
    browser.point_at(x, y).await;
    browser.says("template at x ").await;
    browser.says("of the left image").await;
    score_at_pointer(&browser).await;
    browser.shot("linked-scores").await;
    // Hidden marks hide it, and whoever leaves takes it along.
    browser.press("h").await;
    browser.control("img", "at the pointer: point at").await;
    browser.press("h").await;
    browser.control("img", "at the pointer: ncc").await;
    browser.point_at(3.0, 3.0).await;
    browser.control("img", "at the pointer: point at").await;
    browser.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn before_the_pick_the_other_eye_shows_the_curve_at_once() {
    let bench = Bench::start(&short_approach()).await;
    let browser = Browser::start().await;
    bench.open(&browser).await;
    browser.press("t").await;
    browser.wait_status("pick mode", "s.pick_mode").await;
    point_at(&browser, bench.rock).await;
    browser.says("of the left image").await;
    browser.shot("linked-pick").await;
    browser.end().await;
}
