//! Errors against the truth, fractions of steps within thresholds, and the correctness of the tracking states.
//!
//! Mean, median and largest error are over the steps in state `tracking`, at which the tracker reports a position. So that
//! a tracker does not gain by giving up early, the fractions within a threshold (PCK) are over all steps with a known truth
//! (for px: inside the image), and a lost step counts as outside.

use super::{Judged, Metric, THRESHOLDS_CM, THRESHOLDS_PX};
use sightline_geometry::estimate::quantile::median;

const NO_TRUTH: &str = "It needs the truth, which this traverse does not have.";
const NOT_TRACKED: &str = "No step after the designation is tracked and has a known truth.";

/// Steps tracked, survival, false losses and false tracking.
pub(super) fn states(judged: &[Judged<'_>]) -> Vec<Metric> {
    let with_truth: Vec<&Judged<'_>> = judged.iter().filter(|step| step.truth.is_some()).collect();
    let lost = judged.iter().position(|step| step.trace.update.state.is_lost());
    let survived = lost.unwrap_or(judged.len());
    let survival = Metric::new(
        "survival_steps",
        "",
        Some(survived as f64),
        judged.len(),
        lost.map(|at| judged[at].step()),
    )
    .with_note(lost.is_none().then(|| "Never lost so far.".to_owned()));
    let verdict = |step: &Judged<'_>| step.truth.and_then(|truth| truth.tracked);
    let names = ["tracked_steps", "false_lost", "false_tracking"];
    let [tracked, false_lost, false_tracking] = if with_truth.is_empty() {
        names.map(|name| Metric::missing(name, "", NO_TRUTH))
    } else {
        let counts: [fn(&Judged<'_>) -> bool; 3] = [
            |step| step.truth.and_then(|truth| truth.tracked) == Some(true),
            |step| step.trace.is_false_loss(),
            |step| step.is_tracking && step.truth.and_then(|truth| truth.tracked) == Some(false),
        ];
        let count = |is: fn(&Judged<'_>) -> bool| with_truth.iter().filter(|step| is(step)).count() as f64;
        let untracked = with_truth.iter().find(|step| verdict(step) == Some(false)).map(|step| step.step());
        let first_lost = with_truth.iter().find(|step| counts[1](step)).map(|step| step.step());
        let wrong = with_truth.iter().filter(|step| counts[2](step));
        let wrong =
            wrong.max_by(|a, b| order(a.err_px()).total_cmp(&order(b.err_px()))).map(|step| step.step());
        let worst = [untracked, first_lost, wrong];
        [0, 1, 2].map(|i| Metric::new(names[i], "", Some(count(counts[i])), with_truth.len(), worst[i]))
    };
    vec![tracked, survival, false_lost, false_tracking]
}

/// A missing position sorts as infinitely far.
fn order(error: Option<f64>) -> f64 {
    error.unwrap_or(f64::INFINITY)
}

/// Errors in the left image, px.
pub(super) fn in_image(judged: &[Judged<'_>]) -> Vec<Metric> {
    let seen: Vec<Sample> =
        judged.iter().filter(|step| step.is_seen()).map(|step| Sample::new(step, step.err_px())).collect();
    let is_known = judged.iter().any(|step| step.truth.is_some());
    let why =
        if is_known { "The true point is outside every image after the designation." } else { NO_TRUTH };
    of_samples(&seen, "px", &THRESHOLDS_PX, why)
}

/// Errors in space, cm.
pub(super) fn in_space(judged: &[Judged<'_>]) -> Vec<Metric> {
    let known = judged.iter().filter_map(|step| Some((step, step.truth?)));
    let samples: Vec<Sample> =
        known.map(|(step, truth)| Sample::new(step, Some(truth.err_m * 100.0))).collect();
    of_samples(&samples, "cm", &THRESHOLDS_CM, NO_TRUTH)
}

/// The error of a step; `None` unless the state is `tracking`.
struct Sample {
    step: usize,
    error: Option<f64>,
}

impl Sample {
    fn new(step: &Judged<'_>, error: Option<f64>) -> Self {
        Self { step: step.step(), error: error.filter(|_| step.is_tracking) }
    }
}

fn of_samples(samples: &[Sample], unit: &str, thresholds: &[f64], why: &str) -> Vec<Metric> {
    let errors: Vec<f64> = samples.iter().filter_map(|sample| sample.error).collect();
    let reported = samples.iter().filter(|sample| sample.error.is_some());
    let worst = reported.max_by(|a, b| order(a.error).total_cmp(&order(b.error))).map(|sample| sample.step);
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    let largest = errors.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let mut metrics: Vec<Metric> = [("ade", Some(mean)), ("median", median(&errors)), ("max", Some(largest))]
        .into_iter()
        .map(|(name, value)| {
            let name = format!("{name}_{unit}");
            match errors.is_empty() {
                true => Metric::missing(name, unit, if samples.is_empty() { why } else { NOT_TRACKED }),
                false => Metric::new(name, unit, value, errors.len(), worst),
            }
        })
        .collect();
    metrics.extend(thresholds.iter().map(|threshold| {
        let name = format!("pck_{threshold}{unit}");
        if samples.is_empty() {
            return Metric::missing(name, "", why);
        }
        let is_within = |sample: &&Sample| sample.error.is_some_and(|error| error < *threshold);
        let share = samples.iter().filter(is_within).count() as f64 / samples.len() as f64;
        // Of equally bad steps (without a position) the first one counts.
        let outside = samples.iter().filter(|sample| !is_within(sample)).rev();
        let worst = outside.max_by(|a, b| order(a.error).total_cmp(&order(b.error)));
        Metric::new(name, "", Some(share), samples.len(), worst.map(|sample| sample.step))
    }));
    metrics
}
