//! Why the target of a drive was lost: the root cause of the first of the last consecutive rejected updates.

use std::sync::Arc;

use sightline_recordings::Traverse;
use sightline_track::settings::Settings;

use crate::step::RunStep;
use crate::why::Book;

/// The stop of that update with its root cause, and its evidence; `None` if the last update was good.
///
/// The comparison with the truth is not used.
pub(super) fn loss(
    traverse: &Traverse,
    steps: &[Arc<RunStep>],
    settings: &Settings,
) -> Option<(String, Vec<String>)> {
    let is_good = |step: &Arc<RunStep>| step.verdict().is_some_and(|verdict| verdict.good);
    let after = steps.iter().rposition(is_good).map_or(1, |last| last + 1);
    let first = (after..steps.len()).find(|&place| steps[place].verdict().is_some())?;
    let without_truth = |place: usize| RunStep { truth: None, ..steps[place].as_ref().clone() };
    let (step, before) = (without_truth(first), without_truth(first - 1));
    let book = Book { trace: &step, before: Some(&before), settings, prediction_px: None, sources: traverse };
    let summary = book.summary();
    Some((format!("The target was lost at stop {}: {}", step.step, summary.headline), summary.bullets))
}
