//! The worst steps of a run: those that a report shows with pictures.

use std::sync::Arc;

use sightline_session::step::{RunStep, StepRow};

/// How many steps are called the worst.
const WORST: usize = 5;

/// The worst steps of a run, by their place in it, the worst first: by the error in the image where the truth is known;
/// otherwise those that are lost, then those with the least score.
pub(super) fn worst(steps: &[Arc<RunStep>]) -> Vec<usize> {
    let mut places: Vec<(usize, f64)> = steps
        .iter()
        .enumerate()
        .skip(usize::from(steps.len() > 1))
        .map(|(place, trace)| (place, badness(&trace.row())))
        .collect();
    places.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    places.into_iter().take(WORST).map(|(place, _)| place).collect()
}

/// The badness of a step. Lost steps without a position are worst; scores order the steps without truth.
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
