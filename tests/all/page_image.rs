//! Share of the page that the left image covers, in windows of many sizes, on the drive of a new user.

use std::time::Duration;

use sightline_tests::browser::Browser;
use sightline_tests::browser_fixture::first_page;

/// Width and height of a window, px, and the minimum share of the left image in *Overview* and in *Image*.
const WINDOWS: [(u32, u32, [f64; 2]); 6] = [
    (820, 1180, [0.1, 0.1]),
    (1280, 720, [0.1, 0.2]),
    (1440, 900, [0.15, 0.3]),
    (1920, 1080, [0.15, 0.3]),
    (2560, 1440, [0.15, 0.3]),
    // 1440 × 900 at a zoom of 150 %.
    (960, 600, [0.07, 0.15]),
];

/// Area of the image on the screen as a fraction of the page's area.
const SHARE: &str = "return (() => { const s = JSON.parse(document.querySelector('canvas').dataset.status); \
     if (!s.image_to_screen) return null; const [w, h] = s.left_image_size; const [, , pw, ph] = s.left_image_rect; \
     const k = s.image_to_screen.scale; return Math.min(w * k, pw) * Math.min(h * k, ph) / (innerWidth * innerHeight) })()";

/// Waits up to 20 s until the left image covers at least the share `least` of the page, because a large page is painted
/// late. Returns the last share measured.
async fn share_of_the_image(browser: &Browser, least: f64) -> f64 {
    let mut share = 0.0;
    for _ in 0..100 {
        tokio::time::sleep(Duration::from_millis(200)).await;
        share = browser.evaluate(SHARE).await.as_f64().unwrap_or(0.0);
        if share >= least {
            break;
        }
    }
    share
}

#[tokio::test(flavor = "multi_thread")]
async fn the_left_image_has_most_of_the_page() {
    let (_bench, browser) = first_page(&[]).await;
    browser.click_on("button", "Skip").await;
    let mut too_small = Vec::new();
    for (width, height, least) in WINDOWS {
        browser.resize(width, height).await;
        for (digit, name, least) in [("1", "overview", least[0]), ("8", "image", least[1])] {
            browser.chord(&["Shift"], digit).await;
            browser.wait_for_status("the image", "s.shown && s.complete && s.image_to_screen !== null").await;
            let share = share_of_the_image(&browser, least).await;
            println!("{width} × {height}, {name}: {:.1} %", 100.0 * share);
            browser.save_screenshot(&format!("image-{width}-{name}")).await;
            if share < least {
                too_small.push((width, height, name, share));
            }
        }
    }
    assert!(too_small.is_empty(), "{too_small:?}");
    browser.end().await;
}
