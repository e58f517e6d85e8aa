//! The straight approach: many targets in many worlds, judged at the last step (R108–R117).
//!
//! Each world is rendered once, with one pointing sequence, and all its targets are tracked in it, one run each.
//! A run counts as tracked when its last step is (R116). Runs without truth at the last step are left out of
//! the errors and counted apart. NEES is taken over the tracked runs, since no covariance is meant to
//! cover a false match.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::calibration::{Calibration, median};
use crate::frames::Pixel;
use crate::session::track::{self, Drive};
use crate::settings::Settings;
use crate::target::Designation;
use crate::trace::{StepTrace, Summary, summarise};

/// One target's run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ApproachRun {
    /// The world's seed.
    pub world: u64,
    /// The target's number in its world.
    pub target: usize,
    /// The designated pixel.
    pub pixel: Pixel,
    /// Why no run was possible: the sentence of the refusal.
    pub refused: Option<String>,
    /// Distance from the left camera at designation, m.
    pub distance_m: Option<f64>,
    /// Largest 1σ axis of the covariance at the last step, m.
    pub sigma_m: Option<f64>,
    /// Squared Mahalanobis distance of the error at the last step.
    pub nees: Option<f64>,
    /// Error at the last step along the line of sight, m; positive: estimated too far.
    pub err_range_m: Option<f64>,
    /// The verdict.
    pub summary: Summary,
}

/// All runs of a study, summed up.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ApproachSummary {
    /// How many worlds.
    pub worlds: usize,
    /// How many targets in all.
    pub targets: usize,
    /// How many designations were refused.
    pub refused: usize,
    /// Share of the targets whose last step was tracked.
    pub tracked_share: f64,
    /// Median error of the tracked runs at the last step, m.
    pub median_err_m: Option<f64>,
    /// Median error of all runs at the last step, m.
    pub median_err_of_all_m: Option<f64>,
    /// Median error of the tracked runs at the last step, px.
    pub median_err_px: Option<f64>,
    /// Median of the largest 1σ axis of the tracked runs, m.
    pub median_sigma_m: Option<f64>,
    /// Steps in state `tracking` that were not tracked, over all runs.
    pub false_tracked: usize,
    /// Steps lost or failed whose evidence was right, over all runs.
    pub false_lost: usize,
    /// The verdict on the covariances of the tracked runs.
    pub calibration: Option<Calibration>,
}

/// Tracks every pixel of `targets`, designated at the first stop, through one world.
pub fn track_world<D: Drive>(
    drive: &D,
    world: u64,
    targets: &[Pixel],
    settings: &Settings,
) -> Vec<ApproachRun> {
    let track =
        |(target, &pixel): (usize, &Pixel)| match track::run(drive, Designation { step: 0, pixel }, settings)
        {
            Ok(steps) => describe(world, target, pixel, &steps),
            Err(error) => ApproachRun { refused: Some(error.to_string()), ..empty(world, target, pixel) },
        };
    targets.par_iter().enumerate().map(track).collect()
}

/// Sums up the runs of one or more worlds.
pub fn summarise_runs(runs: &[ApproachRun]) -> ApproachSummary {
    let mut seeds: Vec<u64> = runs.iter().map(|run| run.world).collect();
    seeds.sort_unstable();
    seeds.dedup();
    let is_tracked = |run: &&ApproachRun| run.summary.run_tracked == Some(true);
    let tracked: Vec<&ApproachRun> = runs.iter().filter(is_tracked).collect();
    let of_tracked = |value: fn(&ApproachRun) -> Option<f64>| -> Vec<f64> {
        tracked.iter().filter_map(|run| value(run)).collect()
    };
    let all_errors: Vec<f64> = runs.iter().filter_map(|run| run.summary.final_err_m).collect();
    ApproachSummary {
        worlds: seeds.len(),
        targets: runs.len(),
        refused: runs.iter().filter(|run| run.refused.is_some()).count(),
        tracked_share: tracked.len() as f64 / runs.len().max(1) as f64,
        median_err_m: median(&of_tracked(|run| run.summary.final_err_m)),
        median_err_of_all_m: median(&all_errors),
        median_err_px: median(&of_tracked(|run| run.summary.final_err_px)),
        median_sigma_m: median(&of_tracked(|run| run.sigma_m)),
        false_tracked: runs.iter().filter_map(|run| run.summary.false_tracked).sum(),
        false_lost: runs.iter().filter_map(|run| run.summary.false_lost).sum(),
        calibration: Calibration::of(&of_tracked(|run| run.nees), seeds.len()),
    }
}

fn describe(world: u64, target: usize, pixel: Pixel, steps: &[StepTrace]) -> ApproachRun {
    let last = steps.last();
    let row = last.map(StepTrace::row);
    ApproachRun {
        distance_m: steps.first().map(|first| first.update.target.initial_distance_m),
        sigma_m: row.as_ref().and_then(|row| row.sigma_m),
        nees: row.as_ref().and_then(|row| row.nees),
        err_range_m: last.and_then(range_error_m),
        summary: summarise(steps),
        ..empty(world, target, pixel)
    }
}

/// The error along the line of sight from the left camera, m.
fn range_error_m(trace: &StepTrace) -> Option<f64> {
    let truth = trace.truth.as_ref()?.position_in_rover;
    let centre = trace.point_mast.as_ref()?.left.model.centre();
    Some((trace.update.target.position_in_rover - truth).dot(&(truth - centre).try_normalize(0.0)?))
}

fn empty(world: u64, target: usize, pixel: Pixel) -> ApproachRun {
    ApproachRun {
        world,
        target,
        pixel,
        refused: None,
        distance_m: None,
        sigma_m: None,
        nees: None,
        err_range_m: None,
        summary: Summary::default(),
    }
}
