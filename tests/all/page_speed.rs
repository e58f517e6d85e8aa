//! Speed of the page in a real browser: times are printed, not asserted, because the machine may be busy. The assertions do
//! not depend on the clock: size of the download, no painting in an idle page, bounded memory.
//!
//! [`sightline_tests::stopwatch`] defines the measured times.

use std::time::Duration;

use sightline_geometry::frames::Pixel;
use sightline_tests::browser::Browser;
use sightline_tests::browser_fixture::BrowserFixture;
use sightline_tests::scenario::short_approach;
use sightline_tests::server::{PIXEL, long_recording};
use sightline_tests::stopwatch::{self, Lap, Painting, spread};

/// Maximum download of the page, compressed, bytes.
const DOWNLOAD_LIMIT: u64 = 5 << 20;

/// Number of steps of the long recording.
const LONG: usize = 10_000;

/// Number of steps taken for the measurement of memory.
const WALKED: usize = 500;

/// Maximum growth of the page's process during these steps: twice the capacity of the cache, bytes.
const GROWTH_LIMIT: u64 = 2 * (256 << 20);

/// Goes to each of these steps and waits for it.
async fn walk(browser: &Browser, along: &[usize]) {
    for pair in along.windows(2) {
        let (mut step, to) = (pair[0], pair[1]);
        while step != to {
            let (next, key) = if to > step { (step + 1, "ArrowRight") } else { (step - 1, "ArrowLeft") };
            browser.press(key).await;
            browser.wait_for_status("the next step", &format!("s.step === {next} && s.shown")).await;
            // The frame is painted, too.
            tokio::time::sleep(Duration::from_millis(500)).await;
            step = next;
        }
    }
}

/// Goes ten steps forward, once for each of `times`, and waits for each.
async fn jump_forward(browser: &Browser, times: std::ops::RangeInclusive<usize>) {
    for step in times.map(|time| 10 * time) {
        browser.chord(&["Shift"], "ArrowRight").await;
        browser.wait_for_status("ten steps on", &format!("s.step === {step} && s.complete")).await;
        tokio::time::sleep(Duration::from_millis(400)).await;
    }
}

/// Prints the laps of one kind; most of the `of` expected ones must exist.
fn print_row(what: &str, laps: &[Lap], of: usize) {
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
    let fixture = BrowserFixture::start(&short_approach()).await;
    let browser = Browser::start().await;
    // A browser with a new profile computes for seconds after its start, which would be attributed to the page.
    tokio::time::sleep(Duration::from_secs(5)).await;
    fixture.pick(&browser).await;
    let last = fixture.stop_count - 1;

    // Size of the download, and time to the first frame.
    let reported = browser
        .evaluate(
            "const all = performance.getEntriesByType('resource').filter(e => !e.name.includes('/api/')); \
             return [all.reduce((sum, e) => sum + e.transferSize, 0), \
                     performance.getEntriesByName('sightline-painted')[0]?.startTime ?? null]",
        )
        .await;
    let downloaded = reported[0].as_f64().unwrap() as u64;
    println!(
        "download {:.2} MiB compressed; the viewer is painted after {} ms",
        downloaded as f64 / f64::from(1 << 20),
        reported[1]
    );
    assert!(downloaded > 0 && downloaded <= DOWNLOAD_LIMIT, "{downloaded} bytes are downloaded");

    // There and back once, so that everything is cached; then there and back again with the stopwatch.
    walk(&browser, &[0, last, 0]).await;
    stopwatch::begin(&browser, Painting::On).await;
    walk(&browser, &[0, last, 0]).await;
    print_row("cached steps", &stopwatch::laps(&browser).await, 2 * last);
    stopwatch::begin(&browser, Painting::Off).await;
    walk(&browser, &[0, last, 0]).await;
    print_row("cached steps, nothing painted", &stopwatch::laps(&browser).await, 2 * last);
    stopwatch::begin(&browser, Painting::On).await;

    // An idle page computes nothing: no status changes, and almost no processor time.
    tokio::time::sleep(Duration::from_secs(2)).await;
    let before = browser.resource_use();
    browser
        .evaluate(
            "window.frames0 = 0; const c = document.getElementById('sightline'); \
        const gl = c.getContext('webgl2') ?? c.getContext('webgl'); const draw = gl.drawElements.bind(gl); \
        gl.drawElements = (...a) => { window.frames0++; draw(...a); };",
        )
        .await;
    tokio::time::sleep(Duration::from_secs(5)).await;
    let drawn = browser.evaluate("return window.frames0").await;
    if let (Some(before), Some(after)) = (before, browser.resource_use()) {
        let share = (after.cpu_s - before.cpu_s) / 5.0 * 100.0;
        println!("idle: {share:.1} % of a processor, all of the browser's processes; {drawn} draws");
    }
    assert_eq!(drawn, 0, "an idle page draws");

    // Five hundred steps, then the memory of the page's process.
    let start = browser.resource_use();
    for walked in 0..WALKED {
        let key = if (walked / last) % 2 == 0 { "ArrowRight" } else { "ArrowLeft" };
        browser.press(key).await;
    }
    tokio::time::sleep(Duration::from_secs(2)).await;
    if let (Some(start), Some(end)) = (start, browser.resource_use()) {
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
async fn a_long_recording_loads_steps_on_demand_while_scrubbing() {
    let fixture = BrowserFixture::recording(long_recording(LONG), Pixel::new(PIXEL[0], PIXEL[1])).await;
    let browser = Browser::start().await;
    let start = std::time::Instant::now();
    fixture.pick(&browser).await;
    println!("{LONG} steps are tracked and on the page after {:.0} s", start.elapsed().as_secs_f64());
    // The first steps are cached by the pick; those ten apart are not.
    stopwatch::begin(&browser, Painting::On).await;
    jump_forward(&browser, 1..=30).await;
    print_row("uncached steps", &stopwatch::laps(&browser).await, 30);
    stopwatch::begin(&browser, Painting::Off).await;
    jump_forward(&browser, 31..=60).await;
    print_row("uncached steps, nothing painted", &stopwatch::laps(&browser).await, 30);

    // The pointer is dragged along the whole timeline and back.
    let band = browser.control("slider", "timeline").await.rect;
    let (left, right, y) = (band[0] + 2.0, band[0] + band[2] - 2.0, band[1] + band[3] / 2.0);
    stopwatch::begin(&browser, Painting::On).await;
    let start = std::time::Instant::now();
    browser.drag((left, y), (right, y)).await;
    browser.wait_for_status("the last steps", &format!("s.step > {}", LONG * 9 / 10)).await;
    browser.drag((right, y), (left, y)).await;
    browser.wait_for_status("the first steps", &format!("s.step < {}", LONG / 10)).await;
    let took_s = start.elapsed().as_secs_f64();
    let frames = stopwatch::frames(&browser).await;
    let (middle, high) = spread(frames.iter().copied()).unwrap();
    println!(
        "scrubbing {LONG} steps: own work a frame {middle:.1} ms, 95 % {high:.1}; {} frames in {took_s:.1} s",
        frames.len()
    );
    browser.save_screenshot("scrubbed").await;
    browser.end().await;
}
