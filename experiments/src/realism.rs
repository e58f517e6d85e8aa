//! How hard a simulated world is for the plainest tracker: correlation without scale and roll (R112).
//!
//! On the Mars Yard's straight approach plain correlation kept 80 % of its targets at steps of 5 % and 15 % at
//! steps of 23 % (R112–R114). A world in which it does much better is too easy: its texture, light, parallax or
//! noise must be mended, never the tracker. Beside that stands the mean score between successive stops by range,
//! over the matches of tracked steps: how fast surfaces change their look.
//!
//! Units: m, shares from 0 to 1. Sources: papers.md R111–R116.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use sightline_geometry::frames::Pixel;
use sightline_session::step::RunStep;
use sightline_session::summary::summarise;
use sightline_session::track::{self, Drive};
use sightline_study::point::Visit;
use sightline_study::staged::Staged;
use sightline_track::settings::Settings;
use sightline_track::target::Designation;

/// Far ends of the ranges in which scores are averaged, m; each reaches down to the next, the last to 0.
pub(crate) const RANGES_M: [f64; 5] = [12.0, 8.0, 6.0, 4.0, 3.0];

/// What plain correlation makes of a world at one step size.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Difficulty {
    /// Every how many stops are visited.
    pub stride: usize,
    /// How many targets.
    pub targets: usize,
    /// How many designations were refused.
    pub refused: usize,
    /// How many are tracked at the last visited stop.
    pub tracked: usize,
    /// For each range: how many matches of tracked steps, and the sum of their scores.
    pub scores: Vec<(usize, f64)>,
}

impl Difficulty {
    /// Share of the targets that are tracked at the last visited stop, 0 to 1.
    pub(crate) fn tracked_share(&self) -> f64 {
        self.tracked as f64 / self.targets.max(1) as f64
    }

    /// Mean score in each range; nothing where no match fell.
    pub(crate) fn mean_scores(&self) -> Vec<Option<f64>> {
        self.scores.iter().map(|&(count, sum)| (count > 0).then(|| sum / count as f64)).collect()
    }

    /// Adds the figures of another world at the same step size.
    pub(crate) fn add(&mut self, other: &Self) {
        self.targets += other.targets;
        self.refused += other.refused;
        self.tracked += other.tracked;
        for (sum, other) in self.scores.iter_mut().zip(&other.scores) {
            *sum = (sum.0 + other.0, sum.1 + other.1);
        }
    }
}

/// Tracks every target over every `stride`-th stop of a drive.
pub(crate) fn difficulty<D: Drive>(
    drive: &D,
    targets: &[Pixel],
    settings: &Settings,
    stride: usize,
) -> Difficulty {
    let drive = Staged::new(drive, Visit::Every(stride));
    let run = |&pixel: &Pixel| track::run(&drive, Designation::new(0, pixel), settings).ok();
    let runs: Vec<Option<Vec<RunStep>>> = targets.par_iter().map(run).collect();
    let mut found = Difficulty {
        stride,
        targets: targets.len(),
        refused: runs.iter().filter(|run| run.is_none()).count(),
        tracked: 0,
        scores: vec![(0, 0.0); RANGES_M.len()],
    };
    for steps in runs.iter().flatten() {
        found.tracked += usize::from(summarise(steps).run_tracked == Some(true));
        for step in &steps[1..] {
            let row = step.row();
            let range_m = step.update.target.last_distance_m;
            let bin = RANGES_M.iter().rposition(|far_m| range_m <= *far_m);
            if let (Some(true), Some(ncc), Some(bin)) = (row.tracked, row.ncc, bin) {
                found.scores[bin] = (found.scores[bin].0 + 1, found.scores[bin].1 + ncc);
            }
        }
    }
    found
}
