//! A stopwatch in the page: computing time of the page for a key or a drag, and waiting time.
//!
//! Without a graphics card, Chromium paints WebGL in software, which takes longer than all computations of the page, and the
//! next animation frame starts only after that. These times are therefore measured separately:
//!
//! - **own**: time spent in the animation frames of the page, from the key to the end of the frame that shows the step;
//!   they contain all computations of the page for a step;
//! - **busy**: time during which the page worked or at least one request was in progress, by the browser's resource timing;
//!   simultaneous intervals count once;
//! - **shown**: from the key to the end of the frame that shows the step, with all waiting; with [`Painting::Off`] the page
//!   draws nothing, so that it contains no software rendering;
//! - **complete**: the same, until the last panel has its data;
//! - **painted**: from the key to the frame after the painted one.

use serde_json::Value;

use crate::browser::Browser;

/// Wraps the animation frames and the drawing, and observes keys and the page's status.
const SCRIPT: &str = "\
    if (!window.stopwatch) { \
        const watch = window.stopwatch = {frames: [], laps: [], paints: true}; \
        performance.setResourceTimingBufferSize(1e5); \
        const raf = window.requestAnimationFrame.bind(window); \
        window.requestAnimationFrame = f => raf(t => { \
            const start = performance.now(); \
            try { f(t); } finally { watch.frames.push([start, performance.now() - start]); } }); \
        const canvas = document.getElementById('sightline'); let lap = null; \
        const gl = canvas.getContext('webgl2'); \
        for (const name of ['drawElements', 'clear']) { \
            const draw = gl[name].bind(gl); gl[name] = (...all) => { if (watch.paints) draw(...all); }; } \
        window.addEventListener('keydown', e => { if (e.key !== 'Shift') lap = {key: performance.now()}; }, true); \
        const busy = (key, now) => { \
            const frames = watch.frames.map(f => [f[0], f[0] + f[1]]); \
            const asked = performance.getEntriesByType('resource').map(e => [e.startTime, e.responseEnd]); \
            const spans = frames.concat(asked).filter(s => s[0] >= key).sort((a, b) => a[0] - b[0]); \
            let sum = 0, until = 0; \
            for (const [from, to] of spans) { \
                sum += Math.max(0, Math.min(to, now) - Math.max(from, until)); until = Math.max(until, to); } \
            return sum; }; \
        new MutationObserver(() => { \
            const s = JSON.parse(canvas.dataset.status), now = performance.now(); \
            if (lap === null || !s.shown) return; \
            const done = lap, key = lap.key; \
            if (done.shown === undefined) { \
                done.own = watch.frames.filter(f => f[0] >= key).reduce((sum, f) => sum + f[1], 0); \
                done.busy = busy(key, now); done.shown = now - key; \
                raf(() => raf(() => { done.painted = performance.now() - key; })); } \
            if (!s.complete) return; \
            done.complete = now - key; done.all = busy(key, now); lap = null; watch.laps.push(done); \
        }).observe(canvas, {attributes: true, attributeFilter: ['data-status']}); \
    } \
    window.stopwatch.frames = []; window.stopwatch.laps = []; performance.clearResourceTimings();";

/// Whether the page is painted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Painting {
    /// As for a user.
    On,
    /// The page computes every frame and omits its drawing.
    Off,
}

/// From a key to the step that it leads to, ms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lap {
    /// Computing time of the page.
    pub own_ms: f64,
    /// Computing time and waiting for responses, until record and left image are shown.
    pub busy_ms: f64,
    /// The same, until the step is complete.
    pub all_ms: f64,
    /// Until record and left image are shown, with all waiting.
    pub shown_ms: f64,
    /// Until the step is complete, with all waiting.
    pub complete_ms: f64,
    /// Until the step is painted.
    pub painted_ms: f64,
}

/// Median and 95th percentile; `None` without values.
pub fn spread(values: impl IntoIterator<Item = f64>) -> Option<(f64, f64)> {
    let mut values: Vec<f64> = values.into_iter().collect();
    values.sort_by(f64::total_cmp);
    let last = values.len().checked_sub(1)?;
    let at = |share: f64| values[(last as f64 * share).round() as usize];
    Some((at(0.5), at(0.95)))
}

/// Resets the stopwatch; the first call installs it in the page.
pub async fn begin(browser: &Browser, painting: Painting) {
    browser.evaluate(SCRIPT).await;
    browser.evaluate(&format!("window.stopwatch.paints = {}", painting == Painting::On)).await;
    // A frame that is already requested still calls the browser's own function.
    tokio::time::sleep(std::time::Duration::from_millis(300)).await;
}

/// The laps since [`begin`], one for each key that led to a step.
pub async fn laps(browser: &Browser) -> Vec<Lap> {
    let read = |lap: &Value| {
        let number = |name: &str| lap[name].as_f64().unwrap_or(f64::NAN);
        Lap {
            own_ms: number("own"),
            busy_ms: number("busy"),
            all_ms: number("all"),
            shown_ms: number("shown"),
            complete_ms: number("complete"),
            painted_ms: number("painted"),
        }
    };
    let laps = browser.evaluate("return window.stopwatch.laps").await;
    laps.as_array().map(|laps| laps.iter().map(read).collect()).unwrap_or_default()
}

/// Computing time of each animation frame in which the page was laid out, since [`begin`], ms; a frame without changes takes
/// a tenth of it.
pub async fn frames(browser: &Browser) -> Vec<f64> {
    const LEAST_MS: f64 = 2.0;
    let frames = browser.evaluate("return window.stopwatch.frames.map(f => f[1])").await;
    let all = frames.as_array().into_iter().flatten().filter_map(Value::as_f64);
    all.filter(|took| *took >= LEAST_MS).collect()
}
