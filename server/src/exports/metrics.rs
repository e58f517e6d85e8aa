//! How well a run went, in numbers, each with the step that is worst by it.
//!
//! Errors are taken over the steps after the designation that are in state `tracking` and whose truth is known; the others
//! are counted apart. `err_px` is the distance in the left image, `err_m` that in the present rover frame.

use sightline_session::step::{RunStep, StepRow};
use sightline_session::summary::summarise;

/// Errors in the image within which steps are counted, px.
const WITHIN_PX: [f64; 5] = [1.0, 2.0, 4.0, 8.0, 16.0];
/// Errors in space within which steps are counted, m.
const WITHIN_M: [f64; 4] = [0.01, 0.02, 0.05, 0.10];
/// How many steps are called the worst.
pub(crate) const WORST: usize = 5;

/// One number about a run.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Metric {
    /// What it is.
    pub name: String,
    /// Its value with its unit.
    pub value: String,
    /// The step that is worst by it.
    pub worst_step: Option<usize>,
}

/// The metrics of a run.
pub(crate) fn metrics(steps: &[std::sync::Arc<RunStep>]) -> Vec<Metric> {
    let rows: Vec<StepRow> = steps.iter().map(|trace| trace.row()).collect();
    let summary = summarise(steps.iter().map(AsRef::as_ref));
    let mut all = vec![
        of("steps, the designation included", summary.steps.to_string(), None),
        of("steps lost or failed", summary.steps_lost.to_string(), first(&rows, is_lost)),
    ];
    let Some(tracked) = summary.steps_tracked else {
        all.push(of("errors", "unknown: the traverse has no truth".to_owned(), None));
        all.extend(least(&rows, "least match score", |row| row.ncc));
        return all;
    };
    let share = |count: usize, of: usize| {
        format!("{count} of {of} ({:.0} %)", 100.0 * count as f64 / of.max(1) as f64)
    };
    all.push(of("steps tracked (state and error)", share(tracked, summary.steps), None));
    let untrue = |row: &StepRow| row.state == "tracking" && row.tracked == Some(false);
    let falsely = summary.false_tracked.unwrap_or(0);
    all.push(of("steps tracked falsely", falsely.to_string(), first(&rows, untrue)));
    all.push(of("steps lost falsely", summary.false_lost.unwrap_or(0).to_string(), None));
    let judged: Vec<&StepRow> = rows.iter().skip(1).filter(|row| row.state == "tracking").collect();
    type Error = fn(&StepRow) -> Option<f64>;
    let kinds: [(Error, &str, f64, &[f64]); 2] =
        [(|row| row.err_px, "px", 1.0, &WITHIN_PX), (|row| row.err_m, "cm", 100.0, &WITHIN_M)];
    for (error, unit, factor, within) in kinds {
        let mut known: Vec<(f64, usize)> =
            judged.iter().filter_map(|row| error(row).map(|value| (value, row.step))).collect();
        known.sort_by(|a, b| a.0.total_cmp(&b.0));
        let Some(&(greatest, worst)) = known.last() else { continue };
        let mean = known.iter().map(|(value, _)| value).sum::<f64>() / known.len() as f64;
        let quantile = |share: f64| known[((known.len() - 1) as f64 * share).round() as usize].0;
        let excluded = rows.len() - known.len();
        let words = |value: f64| format!("{:.2} {unit}", factor * value);
        all.push(of(
            &format!("error, mean over {} steps ({excluded} left out), {unit}", known.len()),
            words(mean),
            Some(worst),
        ));
        all.push(of(&format!("error, median, {unit}"), words(quantile(0.5)), Some(worst)));
        all.push(of(&format!("error, 95 %, {unit}"), words(quantile(0.95)), Some(worst)));
        all.push(of(&format!("error, greatest, {unit}"), words(greatest), Some(worst)));
        let counts: Vec<String> = within
            .iter()
            .map(|limit| {
                let count = known.iter().filter(|(value, _)| value <= limit).count();
                format!("≤ {}: {:.0} %", factor * limit, 100.0 * count as f64 / known.len() as f64)
            })
            .collect();
        all.push(of(&format!("share of steps within, {unit}"), counts.join(", "), Some(worst)));
    }
    all.extend(least(&rows, "least match score", |row| row.ncc));
    all
}

/// The worst steps of a run, by their place in it, the worst first: by the error in the image where the truth is known;
/// otherwise those that are lost, then those with the least score.
pub(crate) fn worst(steps: &[std::sync::Arc<RunStep>]) -> Vec<usize> {
    let mut places: Vec<(usize, f64)> = steps
        .iter()
        .enumerate()
        .skip(usize::from(steps.len() > 1))
        .map(|(place, trace)| (place, badness(&trace.row())))
        .collect();
    places.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    places.into_iter().take(WORST).map(|(place, _)| place).collect()
}

/// How bad a step is. Lost steps without a position come first; scores only tell steps apart that have no truth.
fn badness(row: &StepRow) -> f64 {
    let lost = if is_lost(row) { 1e6 } else { 0.0 };
    match row.err_px.or(row.err_m.map(|error| 100.0 * error)) {
        Some(error) => error,
        None => lost + 1.0 - row.ncc.or(row.confidence).unwrap_or(0.0),
    }
}

fn is_lost(row: &StepRow) -> bool {
    matches!(row.state.as_str(), "lost" | "failed")
}

fn of(name: &str, value: String, worst_step: Option<usize>) -> Metric {
    Metric { name: name.to_owned(), value, worst_step }
}

fn first(rows: &[StepRow], is_meant: impl Fn(&StepRow) -> bool) -> Option<usize> {
    rows.iter().find(|row| is_meant(row)).map(|row| row.step)
}

fn least(rows: &[StepRow], name: &str, get: fn(&StepRow) -> Option<f64>) -> Option<Metric> {
    let known = rows.iter().filter_map(|row| get(row).map(|value| (value, row.step)));
    let (value, step) = known.min_by(|a, b| a.0.total_cmp(&b.0))?;
    Some(of(name, format!("{value:.3}"), Some(step)))
}
