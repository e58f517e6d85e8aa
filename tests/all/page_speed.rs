//! How quick the page is in a real browser: printed, not judged, since a busy machine is no fault of the page's. What is
//! judged does not depend on the clock: what is downloaded, that an idle page paints nothing, that memory is bounded.
//!
//! Chromium paints WebGL in software here, which costs more than everything the page computes; so the time from the
//! key to the end of the page's own work is told apart from the time to the painted frame.

use std::time::Duration;

use serde_json::Value;
use sightline_tests::bench::Bench;
use sightline_tests::browser::Browser;
use sightline_tests::scenario::short_approach;

/// The largest download of the page, compressed.
const DOWNLOAD_LIMIT: u64 = 5 << 20;

/// How many steps are walked for the memory.
const WALKED: usize = 500;

/// The largest growth of the page's process over that walk: what the cache may hold, and as much again.
const GROWTH_LIMIT: u64 = 2 * (256 << 20);

/// Watches keys and the page's status: times from a key to the end of the work for it, and to the frame after, ms.
const WATCH: &str = "window.times = []; \
    const canvas = document.getElementById('sightline'); let began = null; \
    window.addEventListener('keydown', () => { began = performance.now(); }, true); \
    new MutationObserver(() => { \
        const s = JSON.parse(canvas.dataset.status); \
        if (began === null || !s.shown) return; \
        const key = began, worked = performance.now(); began = null; \
        requestAnimationFrame(() => requestAnimationFrame(() => \
            window.times.push([worked - key, performance.now() - key]))); \
    }).observe(canvas, {attributes: true, attributeFilter: ['data-status']});";

/// Median and 95th percentile.
fn spread(mut values: Vec<f64>) -> (f64, f64) {
    values.sort_by(f64::total_cmp);
    let at = |share: f64| values[((values.len() - 1) as f64 * share).round() as usize];
    (at(0.5), at(0.95))
}

/// The times that were watched: own work, and to the painted frame, ms.
async fn times(browser: &Browser) -> (Vec<f64>, Vec<f64>) {
    let pairs = browser.evaluate("const t = window.times; window.times = []; return t").await;
    let number = |pair: &Value, index: usize| pair[index].as_f64().unwrap_or(f64::NAN);
    let pairs = pairs.as_array().cloned().unwrap_or_default();
    (pairs.iter().map(|p| number(p, 0)).collect(), pairs.iter().map(|p| number(p, 1)).collect())
}

/// Steps from stop to stop along these, each awaited.
async fn walk(browser: &Browser, along: &[usize]) {
    for pair in along.windows(2) {
        let (mut step, to) = (pair[0], pair[1]);
        while step != to {
            let (next, key) = if to > step { (step + 1, "ArrowRight") } else { (step - 1, "ArrowLeft") };
            browser.press(key).await;
            browser.wait_status("the next step", &format!("s.step === {next} && s.shown")).await;
            step = next;
        }
    }
    // The frame after the last one is painted, too.
    tokio::time::sleep(Duration::from_millis(500)).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn steps_are_quick_an_idle_page_rests_and_memory_is_bounded() {
    let bench = Bench::start(&short_approach()).await;
    let browser = Browser::start().await;
    bench.pick(&browser).await;
    let last = bench.stop_count - 1;

    // What was downloaded, and how long the first picture took.
    let told = browser
        .evaluate(
            "const all = performance.getEntriesByType('resource').filter(e => !e.name.includes('/api/')); \
             return [all.reduce((sum, e) => sum + e.transferSize, 0), \
                     performance.getEntriesByName('sightline-painted')[0]?.startTime ?? null]",
        )
        .await;
    let downloaded = told[0].as_f64().unwrap() as u64;
    println!(
        "download {:.2} MiB compressed; the viewer is painted after {} ms",
        downloaded as f64 / f64::from(1 << 20),
        told[1]
    );
    assert!(downloaded > 0 && downloaded <= DOWNLOAD_LIMIT, "{downloaded} bytes are downloaded");

    // There and back once, so that everything is cached; then there and back again, watched.
    walk(&browser, &[0, last, 0]).await;
    browser.evaluate(WATCH).await;
    walk(&browser, &[0, last, 0]).await;
    let (own, painted) = times(&browser).await;
    assert!(own.len() >= last, "{} of {} steps were seen", own.len(), 2 * last);
    let ((own_mid, own_95), (painted_mid, painted_95)) = (spread(own), spread(painted));
    println!(
        "cached step: own work {own_mid:.0} ms, 95 % {own_95:.0}; painted {painted_mid:.0} ms, 95 % {painted_95:.0}"
    );

    // An idle page computes nothing: no status changes, and next to no processor time.
    tokio::time::sleep(Duration::from_secs(2)).await;
    let before = browser.taken();
    browser
        .evaluate(
            "window.frames0 = 0; const c = document.getElementById('sightline'); \
        const gl = c.getContext('webgl2') ?? c.getContext('webgl'); const draw = gl.drawElements.bind(gl); \
        gl.drawElements = (...a) => { window.frames0++; draw(...a); };",
        )
        .await;
    tokio::time::sleep(Duration::from_secs(5)).await;
    let drawn = browser.evaluate("return window.frames0").await;
    if let (Some(before), Some(after)) = (before, browser.taken()) {
        let share = (after.cpu_s - before.cpu_s) / 5.0 * 100.0;
        println!("idle: {share:.1} % of a processor, all of the browser's processes; {drawn} draws");
    }
    assert_eq!(drawn, 0, "an idle page draws");

    // Five hundred steps, and what the page's process holds after them.
    let start = browser.taken();
    for walked in 0..WALKED {
        let key = if (walked / last) % 2 == 0 { "ArrowRight" } else { "ArrowLeft" };
        browser.press(key).await;
    }
    tokio::time::sleep(Duration::from_secs(2)).await;
    if let (Some(start), Some(end)) = (start, browser.taken()) {
        let mib = |bytes: u64| bytes as f64 / f64::from(1 << 20);
        println!(
            "memory of the page's process: {:.0} MiB, after {WALKED} steps {:.0} MiB",
            mib(start.page_bytes),
            mib(end.page_bytes)
        );
        assert!(end.page_bytes < start.page_bytes + GROWTH_LIMIT, "the page grows without end");
    }
    assert_eq!(browser.console_errors().await, Vec::<String>::new());
    browser.close().await;
}
