//! Metrics of a run: errors, fractions of steps within thresholds, survival, and the consistency of its covariances.
//!
//! Each metric contains its worst step, the number of steps used, and the reason if it has no value. The protocol is ours;
//! two of its metrics are from TAP-Vid (Doersch et al., *TAP-Vid: A Benchmark for Tracking Any Point in a Video*, NeurIPS
//! 2022 Datasets and Benchmarks, section 3): average Jaccard and occlusion accuracy, evaluated "query first", in pixels of
//! the original image instead of one reduced to 256 × 256.
//!
//! `docs/compare.md` defines the metrics; a test compares the page with [`NAMES`].

mod errors;
mod tap_vid;
#[cfg(test)]
mod tests;
pub mod uncertainty;

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use self::uncertainty::Uncertainty;
use crate::format;
use crate::step::RunStep;
use sightline_track::target::TrackingState;
use sightline_world::target_truth::{StepTruth, TruthKind};

/// The name of the protocol.
pub(crate) const PROTOCOL: &str =
    "sightline, steps after the pick; average Jaccard and occlusion accuracy as TAP-Vid 2022, query first";

/// The version of the protocol; it changes with the definition of a metric.
pub const VERSION: u32 = 1;

/// Thresholds for the fractions of steps within a distance in the image, px (as in TAP-Vid).
pub(crate) const THRESHOLDS_PX: [f64; 5] = [1.0, 2.0, 4.0, 8.0, 16.0];

/// Thresholds for the fractions of steps within a distance in space, cm.
pub(crate) const THRESHOLDS_CM: [f64; 4] = [1.0, 2.0, 5.0, 10.0];

/// The names of all metrics, in output order.
pub const NAMES: [&str; 24] = [
    "tracked_steps",
    "survival_steps",
    "false_lost",
    "false_tracking",
    "ade_px",
    "median_px",
    "max_px",
    "pck_1px",
    "pck_2px",
    "pck_4px",
    "pck_8px",
    "pck_16px",
    "ade_cm",
    "median_cm",
    "max_cm",
    "pck_1cm",
    "pck_2cm",
    "pck_5cm",
    "pck_10cm",
    "average_jaccard",
    "occlusion_accuracy",
    "mean_nees",
    "inside_3_sigma",
    "mean_nis",
];

/// The metrics of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RunMetrics {
    /// The name of the protocol.
    pub protocol: String,
    /// Its version.
    pub version: u32,
    /// The kind of truth; null without truth.
    pub truth: Option<TruthKind>,
    /// Number of steps of the run so far, the designation included.
    pub steps: usize,
    /// The excluded steps, and why.
    pub excluded: Vec<Excluded>,
    /// The metrics, in the order of their names.
    pub metrics: Vec<Metric>,
    /// The consistency of the covariances.
    pub uncertainty: Uncertainty,
}

/// A metric.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Metric {
    /// Its name.
    pub name: String,
    /// Its unit; empty for fractions, counts and squared Mahalanobis distances.
    pub unit: String,
    /// Its value; null if it is not available, with the reason in `note`.
    pub value: Option<f64>,
    /// Number of steps used.
    pub used: usize,
    /// The worst step by this metric; null if there is no bad step.
    pub worst_step: Option<usize>,
    /// Why it has no value, or a remark on it, as one sentence; null without either.
    pub note: Option<String>,
}

/// Steps that were excluded from metrics.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Excluded {
    /// The metrics from which they were excluded.
    pub of: String,
    /// The reason.
    pub why: String,
    /// The steps.
    pub steps: Vec<usize>,
}

/// A step that is evaluated.
struct Judged<'a> {
    trace: &'a RunStep,
    truth: Option<&'a StepTruth>,
    is_tracking: bool,
}

impl Judged<'_> {
    fn step(&self) -> usize {
        self.trace.step
    }

    /// The error in the image, px; `None` if the truth is not visible or the target was not located.
    fn err_px(&self) -> Option<f64> {
        self.truth?.err_px
    }

    /// Whether the true point is visible in the image.
    fn is_seen(&self) -> bool {
        self.truth.is_some_and(|truth| truth.left_pixel.is_some())
    }
}

/// The metrics of a run.
pub fn metrics(steps: &[Arc<RunStep>]) -> RunMetrics {
    let later = steps.iter().skip(1).map(AsRef::as_ref);
    let (faulty, good): (Vec<&RunStep>, Vec<&RunStep>) = later.partition(|trace| trace.fault().is_some());
    let (alone, good): (Vec<_>, Vec<_>) =
        good.into_iter().partition(|trace| trace.why_not_searched().is_some());
    let judged: Vec<Judged<'_>> = good
        .into_iter()
        .map(|trace| Judged {
            trace,
            truth: trace.truth.as_ref(),
            is_tracking: trace.update.state == TrackingState::Tracking,
        })
        .collect();
    let truth = steps.iter().find_map(|trace| trace.truth.as_ref()).map(|truth| truth.kind);
    let uncertainty = uncertainty::uncertainty(judged.iter().map(|step| step.trace));
    let mut found = Vec::with_capacity(NAMES.len());
    found.extend(errors::states(&judged));
    found.extend(errors::in_image(&judged));
    found.extend(errors::in_space(&judged));
    found.extend(tap_vid::metrics(&judged, truth));
    found.extend(uncertainty.metrics());
    RunMetrics {
        protocol: PROTOCOL.to_owned(),
        version: VERSION,
        truth,
        steps: steps.len(),
        excluded: excluded(steps.first().map(AsRef::as_ref), [&faulty, &alone], &judged),
        metrics: found,
        uncertainty,
    }
}

fn excluded(
    pick: Option<&RunStep>,
    [faulty, alone]: [&[&RunStep]; 2],
    judged: &[Judged<'_>],
) -> Vec<Excluded> {
    let of =
        |of: &str, why: &str, steps: Vec<usize>| Excluded { of: of.to_owned(), why: why.to_owned(), steps };
    let those =
        |which: fn(&Judged<'_>) -> bool| judged.iter().filter(|step| which(step)).map(Judged::step).collect();
    let mut found = vec![
        of(
            "all metrics",
            "the target was designated here",
            pick.map(|trace| trace.step).into_iter().collect(),
        ),
        of("all metrics", "the stop's files are damaged", faulty.iter().map(|trace| trace.step).collect()),
        of("all metrics", "visual odometry ran alone there", alone.iter().map(|trace| trace.step).collect()),
        of(
            "all metrics against the truth",
            "the truth is not known there",
            those(|step| step.truth.is_none()),
        ),
        of(
            "metrics in px",
            "the true point is not in the image",
            those(|step| step.truth.is_some() && !step.is_seen()),
        ),
        of(
            "mean, median and largest error",
            "the tracker reports the target as lost",
            those(|step| step.truth.is_some() && !step.is_tracking),
        ),
    ];
    found.retain(|excluded| !excluded.steps.is_empty());
    found
}

impl Metric {
    /// A value of this metric as text without its unit; fractions are in per cent.
    pub fn words(&self, value: f64) -> String {
        let is_share = self.name.starts_with("pck_")
            || matches!(self.name.as_str(), "average_jaccard" | "occlusion_accuracy" | "inside_3_sigma");
        if is_share { format!("{:.0} %", value * 100.0) } else { format::number(value) }
    }

    fn new(
        name: impl Into<String>,
        unit: &str,
        value: Option<f64>,
        used: usize,
        worst_step: Option<usize>,
    ) -> Self {
        Self { name: name.into(), unit: unit.to_owned(), value, used, worst_step, note: None }
    }

    fn with_note(self, note: Option<String>) -> Self {
        Self { note, ..self }
    }

    /// A metric without a value.
    fn missing(name: impl Into<String>, unit: &str, why: &str) -> Self {
        Self::new(name, unit, None, 0, None).with_note(Some(why.to_owned()))
    }
}
