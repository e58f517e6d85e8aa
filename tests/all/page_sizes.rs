//! The page in windows of many sizes and in both colour schemes, in six situations: no control is cut off or covered.
//!
//! With `SIGHTLINE_SIZES=all` every size is tested in both schemes; otherwise two sizes. `SIGHTLINE_SHOTS` keeps
//! screenshots.

use std::collections::BTreeSet;
use std::time::Duration;

use sightline_tests::browser::Browser;
use sightline_tests::browser_fixture::first_page;
use sightline_tests::controls::Control;
use sightline_tests::data;

/// Width and height of a window, px; the last one is 1440 × 900 at a zoom of 150 %.
const WINDOWS: [(u32, u32); 6] =
    [(820, 1180), (1280, 720), (1440, 900), (1920, 1080), (2560, 1440), (960, 600)];

/// The windows of the short test.
const FEW_WINDOWS: [(u32, u32); 2] = [(820, 1180), (960, 600)];

/// Roles of controls that are clicked; tabs are left out, because a strip of tabs scrolls.
const CLICKED: [&str; 4] = ["button", "checkbox", "combobox", "textbox"];

/// Share of the smaller of two controls that may be covered by the other one.
const COVERED_MAX: f64 = 0.3;

/// Screenshots and defects of one situation.
struct Tour<'a> {
    browser: &'a Browser,
    defects: BTreeSet<String>,
}

impl Tour<'_> {
    /// Checks the current situation in every window, in the current colour scheme.
    async fn check(&mut self, situation: &str, scheme: &str) {
        let all = std::env::var("SIGHTLINE_SIZES").is_ok_and(|sizes| sizes == "all");
        let windows: &[(u32, u32)] = if all { &WINDOWS } else { &FEW_WINDOWS };
        for &(width, height) in windows {
            self.browser.resize(width, height).await;
            let controls = settled(self.browser).await;
            self.browser.save_screenshot(&format!("size-{situation}-{width}-{scheme}")).await;
            let at = format!("{situation}, {width} × {height}");
            self.defects.extend(
                cut_off(&controls, f64::from(width), f64::from(height)).map(|c| format!("{at}: {c}")),
            );
            self.defects.extend(covered(&controls).into_iter().map(|c| format!("{at}: {c}")));
        }
    }
}

/// The controls, once two consecutive reads are equal. On a busy machine a frame takes longer than the pause, and an open
/// window has its final size in the frame after the resize.
async fn settled(browser: &Browser) -> Vec<Control> {
    let mut before = Vec::new();
    for _ in 0..40 {
        tokio::time::sleep(Duration::from_millis(250)).await;
        browser.frames().await;
        let now = browser.controls().await;
        if now == before {
            break;
        }
        before = now;
    }
    before
}

fn clicked(controls: &[Control]) -> impl Iterator<Item = &Control> {
    controls.iter().filter(|c| CLICKED.contains(&c.role.as_str()) && c.rect[2] > 0.0 && c.rect[3] > 0.0)
}

/// Controls that begin inside the window and end beyond its right edge.
fn cut_off(controls: &[Control], width: f64, height: f64) -> impl Iterator<Item = String> {
    let is_cut = move |c: &&Control| {
        let [x, y, w, _] = c.rect;
        x < width && y < height && x + w > width + 1.0
    };
    clicked(controls).filter(is_cut).map(|c| format!("{} “{}” is cut off at {:?}", c.role, c.name, c.rect))
}

/// Pairs of controls of one panel that partly cover each other; a control inside another one is part of it.
fn covered(controls: &[Control]) -> Vec<String> {
    // The top bar scrolls, so that clipped controls overlap its buttons. A unit test of the viewer covers it.
    let all: Vec<&Control> = clicked(controls).filter(|c| c.region != "Status and actions").collect();
    let mut pairs = Vec::new();
    for (index, a) in all.iter().enumerate() {
        for b in all[index + 1..].iter().filter(|b| b.region == a.region) {
            let overlap = |k: usize| {
                let end = (a.rect[k] + a.rect[k + 2]).min(b.rect[k] + b.rect[k + 2]);
                (end - a.rect[k].max(b.rect[k])).max(0.0)
            };
            let area = |c: &Control| c.rect[2] * c.rect[3];
            let share = overlap(0) * overlap(1) / area(a).min(area(b));
            if share > COVERED_MAX && share < 0.99 {
                pairs.push(format!("“{}” and “{}” of “{}” overlap", a.name, b.name, a.region));
            }
        }
    }
    pairs
}

/// Chooses the colour scheme through the palette.
async fn choose_colour_scheme(browser: &Browser, scheme: &str) {
    browser.chord(&["Control"], "k").await;
    browser.control("textbox", "palette").await;
    browser.type_text(&format!("looks {scheme}")).await;
    browser.press("Enter").await;
    browser.wait_until_gone("textbox", "palette").await;
}

#[tokio::test(flavor = "multi_thread")]
async fn no_control_is_cut_off_or_covered_in_any_window() {
    let kitti = data::set("kitti-seq1-frames-0-19", "the pictures of an own recording");
    let recordings: Vec<_> = kitti.iter().filter_map(|set| set.parent()).map(Into::into).collect();
    let (_bench, browser) = first_page(&recordings).await;

    let mut tour = Tour { browser: &browser, defects: BTreeSet::new() };
    tour.check("open", "dark").await;
    browser.click_on("button", "Skip").await;
    browser.wait_until_gone("button", "Skip").await;
    browser.press("PageDown").await;
    browser.wait_for_status("the loss", "s.state === 'lost' && s.shown").await;
    for scheme in ["light", "dark"] {
        choose_colour_scheme(&browser, scheme).await;
        browser.resize(1440, 900).await;
        browser.press("w").await;
        browser.wait_for_text("The heading estimate jumped by").await;
        tour.check("why", scheme).await;
        browser.press("t").await;
        browser.wait_for_status("pick mode", "s.pick_mode").await;
        tour.check("pick", scheme).await;
        browser.press("Escape").await;
        browser.wait_for_status("no pick mode", "!s.pick_mode").await;
        browser.chord(&["Shift"], "6").await;
        tour.check("study", scheme).await;
        browser.chord(&["Shift"], "1").await;
        browser.chord(&["Control"], "o").await;
        if kitti.is_some() {
            browser.click_on("button", "recording kitti-seq1-frames-0-19").await;
            browser.control("button", "Back").await;
        }
        tour.check("recording", scheme).await;
        if kitti.is_some() {
            browser.click_on("button", "Back").await;
            browser.control("button", "recording kitti-seq1-frames-0-19").await;
        }
        browser.press("Escape").await;
    }
    browser.resize(1440, 900).await;
    browser.press("r").await;
    browser.wait_for_status("the branch", "s.run === 1 && !s.running && s.steps_done > s.step").await;
    browser.click_on("combobox", "compared with").await;
    browser.choose("run A").await;
    browser.control("button", "First divergence").await;
    for scheme in ["light", "dark"] {
        choose_colour_scheme(&browser, scheme).await;
        tour.check("compare", scheme).await;
    }
    let defects: Vec<String> = tour.defects.into_iter().collect();
    assert!(defects.is_empty(), "{}", defects.join("\n"));
    browser.end().await;
}
