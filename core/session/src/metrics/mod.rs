//! What a run is worth, in numbers: errors, shares within thresholds, survival, and whether its covariances hold.
//!
//! Each metric knows the step at which the run does worst by it, how many steps it was made of, and, where it cannot be
//! given, why. The protocol is ours; two of its metrics are those of TAP-Vid (Doersch et al., *TAP-Vid: A Benchmark for
//! Tracking Any Point in a Video*, NeurIPS 2022 Datasets and Benchmarks, section 3): average Jaccard and occlusion
//! accuracy, evaluated "query first", in pixels of the image rather than of one reduced to 256 × 256.
//!
//! What the names mean is in `docs/compare.md`; a test compares the page with [`NAMES`].

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

/// What the protocol is called.
pub(crate) const PROTOCOL: &str =
    "sightline, steps after the pick; average Jaccard and occlusion accuracy as TAP-Vid 2022, query first";

/// The version of the protocol; another definition has another number.
pub const VERSION: u32 = 1;

/// Thresholds of the shares within a distance in the image, px (those of TAP-Vid).
pub(crate) const THRESHOLDS_PX: [f64; 5] = [1.0, 2.0, 4.0, 8.0, 16.0];

/// Thresholds of the shares within a distance in space, cm.
pub(crate) const THRESHOLDS_CM: [f64; 4] = [1.0, 2.0, 5.0, 10.0];

/// The names of all metrics, in their order.
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
    /// What the protocol is called.
    pub protocol: String,
    /// Its version.
    pub version: u32,
    /// What the truth is; null where there is none.
    pub truth: Option<TruthKind>,
    /// Steps of the run so far, the pick included.
    pub steps: usize,
    /// Which steps were left out, and why.
    pub excluded: Vec<Excluded>,
    /// The metrics, in the order of their names.
    pub metrics: Vec<Metric>,
    /// Whether the covariances hold.
    pub uncertainty: Uncertainty,
}

/// One number.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Metric {
    /// Its name.
    pub name: String,
    /// Its unit; empty for shares, counts and squared Mahalanobis distances.
    pub unit: String,
    /// Its value; null where it cannot be given.
    pub value: Option<f64>,
    /// How many steps it was made of.
    pub used: usize,
    /// The step at which the run does worst by it; null where no step does badly.
    pub worst_step: Option<usize>,
    /// Why it cannot be given, or what should be known of it, as one sentence.
    pub note: Option<String>,
}

/// Steps that were left out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Excluded {
    /// Of which metrics.
    pub of: String,
    /// Why.
    pub why: String,
    /// The steps.
    pub steps: Vec<usize>,
}

/// A step that counts.
struct Judged<'a> {
    trace: &'a RunStep,
    truth: Option<&'a StepTruth>,
    is_tracking: bool,
}

impl Judged<'_> {
    fn step(&self) -> usize {
        self.trace.step
    }

    /// The error in the image, where the truth is seen and something was located, px.
    fn err_px(&self) -> Option<f64> {
        self.truth?.err_px
    }

    /// Whether the truth is seen in the image.
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
    /// A value of this metric as text without its unit; shares are in per cent.
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

    /// A metric that cannot be given.
    fn missing(name: impl Into<String>, unit: &str, why: &str) -> Self {
        Self::new(name, unit, None, 0, None).with_note(Some(why.to_owned()))
    }
}
