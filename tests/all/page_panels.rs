//! Snapshot tests of every panel at a fixed step of a fixed drive.
//!
//! `SIGHTLINE_SNAPSHOTS=write` writes the snapshots: inspect every one before it is committed. Otherwise a panel that
//! differs fails the test, and its actual image is left in the system's temporary folder.

use std::path::{Path, PathBuf};
use std::time::Duration;

use image::RgbImage;
use sightline_tests::browser::Browser;
use sightline_tests::browser_fixture::BrowserFixture;
use sightline_tests::scenario::short_approach;

/// The step of the snapshots.
const STEP: usize = 3;

/// Share of the pixels of a snapshot that may differ, per mille: another version of the browser smooths the edges of
/// letters differently.
const DIFFERENT_MAX: f64 = 4.0;

/// Largest difference of a channel, of 255, at which a pixel counts as equal.
const NEAR: u8 = 24;

/// Panels whose contents depend on the machine or the clock.
const LEFT_OUT: [&str; 1] = ["Messages"];

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("snapshots")
}

/// The file name of a panel's snapshot.
fn file_name(panel: &str) -> String {
    let plain = panel.to_lowercase().replace(|c: char| !c.is_ascii_alphanumeric(), " ");
    format!("{}.png", plain.split_whitespace().collect::<Vec<_>>().join("-"))
}

/// A screenshot of the maximised panel, once it has stopped changing.
async fn picture(browser: &Browser, panel: &str) -> RgbImage {
    let [x, y, width, height] = browser.control("region", panel).await.rect.map(|v| v.max(0.0) as u32);
    let mut before: Option<RgbImage> = None;
    for _ in 0..40 {
        let page = image::load_from_memory(&browser.screenshot().await).expect("a PNG").to_rgb8();
        let (width, height) = (width.min(page.width() - x), height.min(page.height() - y));
        let now = image::imageops::crop_imm(&page, x, y, width, height).to_image();
        if before.as_ref() == Some(&now) {
            return now;
        }
        before = Some(now);
        tokio::time::sleep(Duration::from_millis(400)).await;
    }
    panic!("{panel} does not come to rest");
}

/// Share of the pixels that differ, per mille; all of them if the sizes differ.
fn difference(a: &RgbImage, b: &RgbImage) -> f64 {
    if a.dimensions() != b.dimensions() {
        return 1000.0;
    }
    let is_far =
        |(a, b): (&image::Rgb<u8>, &image::Rgb<u8>)| a.0.iter().zip(b.0).any(|(a, b)| a.abs_diff(b) > NEAR);
    let far = a.pixels().zip(b.pixels()).filter(|pair| is_far(*pair)).count();
    far as f64 * 1000.0 / f64::from(a.width() * a.height()).max(1.0)
}

/// Brings one panel to the front and maximises it.
async fn fill_page(browser: &Browser, panel: &str) {
    browser.show_panel(panel).await;
    browser.press("`").await;
    browser.control("button", "Restore").await;
    // The pointer rests where it has no effect.
    browser.point_at(3.0, 3.0).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn every_panel_matches_its_snapshot() {
    let fixture = BrowserFixture::start(&short_approach()).await;
    let browser = Browser::start().await;
    browser.resize(1100, 621).await;
    fixture.pick(&browser).await;
    for step in 1..=STEP {
        browser.press("ArrowRight").await;
        browser.wait_for_status("the next step", &format!("s.step === {step} && s.shown")).await;
    }
    let writes = std::env::var("SIGHTLINE_SNAPSHOTS").is_ok_and(|word| word == "write");
    let all = browser.controls().await;
    let panels: Vec<String> = all.into_iter().filter(|c| c.role == "tab").map(|c| c.name).collect();
    assert!(panels.len() >= 19, "the overview has every panel: {panels:?}");
    let mut wrong = Vec::new();
    for panel in panels.iter().filter(|panel| !LEFT_OUT.contains(&panel.as_str())) {
        fill_page(&browser, panel).await;
        let now = picture(&browser, panel).await;
        let snapshot = folder().join(file_name(panel));
        if writes {
            std::fs::create_dir_all(folder()).expect("the folder of pictures");
            now.save(&snapshot).expect("a picture");
        }
        let known = image::open(&snapshot).map(|known| known.to_rgb8()).unwrap_or_default();
        let difference = difference(&now, &known);
        if difference > DIFFERENT_MAX {
            let left = std::env::temp_dir().join(format!("sightline-{}", file_name(panel)));
            now.save(&left).expect("a picture");
            wrong.push(format!(
                "{panel}: {difference:.1} ‰ differ from {}, see {}",
                snapshot.display(),
                left.display()
            ));
        }
        browser.press("`").await;
        browser.wait_until_gone("button", "Restore").await;
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    browser.end().await;
}

#[test]
fn a_changed_mark_is_distinguished_from_antialiasing() {
    let plain = RgbImage::from_pixel(200, 100, image::Rgb([24, 27, 32]));
    let mut smoothed = plain.clone();
    smoothed.pixels_mut().step_by(7).for_each(|pixel| pixel.0[1] += 9);
    assert_eq!(difference(&plain, &smoothed), 0.0);
    let mut marked = plain.clone();
    for k in 0..90 {
        marked.put_pixel(20 + k, 50, image::Rgb([230, 159, 0]));
    }
    assert!(difference(&plain, &marked) > DIFFERENT_MAX);
    assert_eq!(difference(&plain, &RgbImage::new(10, 10)), 1000.0);
}
