//! How quick the page is in a real browser: printed, not judged, since a busy machine is no fault of the page's. What is
//! judged does not depend on the clock: what is downloaded, that an idle page paints nothing, that memory is bounded.
//!
//! [`sightline_tests::stopwatch`] says which times are told apart, and why.

use std::time::Duration;

use sightline_geometry::frames::Pixel;
use sightline_tests::bench::Bench;
use sightline_tests::browser::Browser;
use sightline_tests::scenario::short_approach;
use sightline_tests::server::{PIXEL, long_recording};
use sightline_tests::stopwatch::{self, Lap, Painting, spread};

/// The largest download of the page, compressed.
const DOWNLOAD_LIMIT: u64 = 5 << 20;

/// The steps of the long recording.
const LONG: usize = 10_000;

/// How many steps are walked for the memory.
const WALKED: usize = 500;

/// The largest growth of the page's process over that walk: what the cache may hold, and as much again.
const GROWTH_LIMIT: u64 = 2 * (256 << 20);

/// Steps from stop to stop along these, each awaited.
async fn walk(browser: &Browser, along: &[usize]) {
    for pair in along.windows(2) {
        let (mut step, to) = (pair[0], pair[1]);
        while step != to {
            let (next, key) = if to > step { (step + 1, "ArrowRight") } else { (step - 1, "ArrowLeft") };
            browser.press(key).await;
            browser.wait_status("the next step", &format!("s.step === {next} && s.shown")).await;
            // The frame is painted, too.
            tokio::time::sleep(Duration::from_millis(500)).await;
            step = next;
        }
    }
}

/// Goes ten steps on, so many times, each awaited.
async fn stride(browser: &Browser, times: std::ops::RangeInclusive<usize>) {
    for step in times.map(|time| 10 * time) {
        browser.chord(&["Shift"], "ArrowRight").await;
        browser.wait_status("ten steps on", &format!("s.step === {step} && s.complete")).await;
        tokio::time::sleep(Duration::from_millis(400)).await;
    }
}

/// Prints the laps of one kind, most of which must have been seen.
fn tell(what: &str, laps: &[Lap], of: usize) {
    assert!(3 * laps.len() >= 2 * of, "{what}: {} of {of} were seen", laps.len());
    let ms = |of: fn(&Lap) -> f64| {
        let (middle, high) = spread(laps.iter().map(of)).unwrap_or((f64::NAN, f64::NAN));
        format!("{middle:.0} ms (95 %: {high:.0})")
    };
    println!(
        "{what}, {} of them: own work {}; with loading {}, until the step is complete {}; \
         with all waiting shown after {}, complete after {}; painted after {}",
        laps.len(),
        ms(|l| l.own_ms),
        ms(|l| l.busy_ms),
        ms(|l| l.all_ms),
        ms(|l| l.shown_ms),
        ms(|l| l.complete_ms),
        ms(|l| l.painted_ms)
    );
}

#[tokio::test(flavor = "multi_thread")]
async fn steps_are_quick_an_idle_page_rests_and_memory_is_bounded() {
    let bench = Bench::start(&short_approach()).await;
    let browser = Browser::start().await;
    // A browser that starts with a new profile works for seconds, which would count as the page's.
    tokio::time::sleep(Duration::from_secs(5)).await;
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
    stopwatch::begin(&browser, Painting::On).await;
    walk(&browser, &[0, last, 0]).await;
    tell("cached steps", &stopwatch::laps(&browser).await, 2 * last);
    stopwatch::begin(&browser, Painting::Off).await;
    walk(&browser, &[0, last, 0]).await;
    tell("cached steps, nothing painted", &stopwatch::laps(&browser).await, 2 * last);
    stopwatch::begin(&browser, Painting::On).await;

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
    browser.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_long_recording_is_scrubbed_and_its_steps_come_when_they_are_asked_for() {
    let bench = Bench::recording(long_recording(LONG), Pixel::new(PIXEL[0], PIXEL[1])).await;
    let browser = Browser::start().await;
    let start = std::time::Instant::now();
    bench.pick(&browser).await;
    println!("{LONG} steps are tracked and on the page after {:.0} s", start.elapsed().as_secs_f64());
    // The first steps are cached by the pick; those ten apart are not.
    stopwatch::begin(&browser, Painting::On).await;
    stride(&browser, 1..=30).await;
    tell("uncached steps", &stopwatch::laps(&browser).await, 30);
    stopwatch::begin(&browser, Painting::Off).await;
    stride(&browser, 31..=60).await;
    tell("uncached steps, nothing painted", &stopwatch::laps(&browser).await, 30);

    // The pointer is drawn along the whole timeline and back.
    let band = browser.control("slider", "timeline").await.rect;
    let (left, right, y) = (band[0] + 2.0, band[0] + band[2] - 2.0, band[1] + band[3] / 2.0);
    stopwatch::begin(&browser, Painting::On).await;
    let start = std::time::Instant::now();
    browser.drag((left, y), (right, y)).await;
    browser.wait_status("the last steps", &format!("s.step > {}", LONG * 9 / 10)).await;
    browser.drag((right, y), (left, y)).await;
    browser.wait_status("the first steps", &format!("s.step < {}", LONG / 10)).await;
    let took_s = start.elapsed().as_secs_f64();
    let frames = stopwatch::frames(&browser).await;
    let (middle, high) = spread(frames.iter().copied()).unwrap();
    println!(
        "scrubbing {LONG} steps: own work a frame {middle:.1} ms, 95 % {high:.1}; {} frames in {took_s:.1} s",
        frames.len()
    );
    browser.shot("scrubbed").await;
    browser.end().await;
}
