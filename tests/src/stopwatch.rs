//! A stopwatch in the page: what the page itself computes for a key or a drag, and what it waits for.
//!
//! Chromium paints WebGL in software where there is no graphics card, which takes longer than everything the page
//! computes, and the next animation frame only comes when that is done. So three times are told apart:
//!
//! - **own**: the time spent in the page's animation frames, from the key to the end of the frame that shows the step;
//!   everything the page computes for a step happens in them;
//! - **loading**: how long at least one request was on its way, as the browser's own resource timing says;
//! - **painted**: from the key to the frame after the painted one, with all waiting for the software.

use serde_json::Value;

use crate::browser::Browser;

/// Wraps the animation frames, and watches keys and the page's status.
const SCRIPT: &str = "\
    if (!window.stopwatch) { \
        const watch = window.stopwatch = {frames: [], laps: []}; \
        const raf = window.requestAnimationFrame.bind(window); \
        window.requestAnimationFrame = f => raf(t => { \
            const start = performance.now(); \
            try { f(t); } finally { watch.frames.push([start, performance.now() - start]); } }); \
        const canvas = document.getElementById('sightline'); let began = null; \
        window.addEventListener('keydown', e => { if (e.key !== 'Shift') began = performance.now(); }, true); \
        new MutationObserver(() => { \
            const s = JSON.parse(canvas.dataset.status); \
            if (began === null || !s.shown) return; \
            const key = began, frames = watch.frames; began = null; \
            const own = frames.filter(f => f[0] >= key).reduce((sum, f) => sum + f[1], 0); \
            const asked = performance.getEntriesByType('resource').filter(e => e.startTime >= key); \
            let loading = 0, until = 0; \
            for (const e of asked.sort((a, b) => a.startTime - b.startTime)) { \
                loading += Math.max(0, e.responseEnd - Math.max(e.startTime, until)); \
                until = Math.max(until, e.responseEnd); } \
            raf(() => raf(() => watch.laps.push([own, loading, performance.now() - key]))); \
        }).observe(canvas, {attributes: true, attributeFilter: ['data-status']}); \
    } \
    window.stopwatch.frames = []; window.stopwatch.laps = []; performance.clearResourceTimings();";

/// From a key to the step that it leads to, ms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lap {
    /// The page's own work.
    pub own_ms: f64,
    /// Waiting for the server's answers.
    pub loading_ms: f64,
    /// Until it was painted.
    pub painted_ms: f64,
}

/// Median and 95th percentile; none of nothing.
pub fn spread(values: impl IntoIterator<Item = f64>) -> Option<(f64, f64)> {
    let mut values: Vec<f64> = values.into_iter().collect();
    values.sort_by(f64::total_cmp);
    let last = values.len().checked_sub(1)?;
    let at = |share: f64| values[(last as f64 * share).round() as usize];
    Some((at(0.5), at(0.95)))
}

/// Sets the stopwatch to nothing; the first time it is put into the page.
pub async fn begin(browser: &Browser) {
    browser.evaluate(SCRIPT).await;
    // The frame that was already asked for still goes by the browser's own function.
    tokio::time::sleep(std::time::Duration::from_millis(300)).await;
}

/// The laps since the beginning, one for each key that led to a step.
pub async fn laps(browser: &Browser) -> Vec<Lap> {
    let read = |lap: &Value| {
        let number = |index: usize| lap[index].as_f64().unwrap_or(f64::NAN);
        Lap { own_ms: number(0), loading_ms: number(1), painted_ms: number(2) }
    };
    let laps = browser.evaluate("return window.stopwatch.laps").await;
    laps.as_array().map(|laps| laps.iter().map(read).collect()).unwrap_or_default()
}

/// How long the page worked in each animation frame since the beginning, ms.
pub async fn frames(browser: &Browser) -> Vec<f64> {
    let frames = browser.evaluate("return window.stopwatch.frames.map(f => f[1])").await;
    frames.as_array().map(|all| all.iter().filter_map(Value::as_f64).collect()).unwrap_or_default()
}
