//! What the trackability map is worth: targets drawn where it says good, risky or bad, tracked and held against the truth.
//!
//! From each verdict of the first stop's map as many cells are drawn as asked for, by the seed alone. A target is followed to
//! its *end*: the last stop up to which, at every stop, its surface point is hidden by nothing and its window lies in both images
//! with as much again around it (what leaves a picture is no fault of the place). One that
//! is not seen for `STEPS_MIN` stops says little and is left out, before anything is tracked. It is *kept* when it is tracked
//! there (R116), *false* when the state says so and it is not.
//!
//! The truth is asked for the choice of what can be judged and for the judgement; the map never sees it. Beside this stands how
//! well *dark* meets true shadow.
//!
//! Units: shares from 0 to 1. Sources: papers.md R21, R116; docs/trackability.md.

use std::collections::BTreeMap;

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_pcg::Pcg64;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use sightline_geometry::camera::Camera;
use sightline_geometry::error::Result;
use sightline_geometry::frames::{Pixel, Point3};
use sightline_rover::trackability::map::Cell;
use sightline_rover::trackability::{Aspect, Ground, TrackabilityLimits, TrackabilityMap, Verdict};
use sightline_session::track::{self, Drive};
use sightline_track::settings::Settings;
use sightline_track::target::{Designation, TrackingState};

/// Stops after the first at which a target must be seen to say anything.
pub(crate) const STEPS_MIN: usize = 4;

/// What became of one target.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Where it was designated, px.
    pub pixel: Pixel,
    /// What the map said.
    pub verdict: Verdict,
    /// Why.
    pub reason: Option<Aspect>,
    /// What was measured of the reason.
    pub value: Option<f64>,
    /// The last stop at which it was seen.
    pub end: usize,
    /// Whether the designation was refused.
    pub is_refused: bool,
    /// Whether it was tracked at the end.
    pub is_kept: bool,
    /// Whether the state said so at the end although it was not.
    pub is_false: bool,
    /// Share of its window in true shadow.
    pub shadow: Option<f64>,
    /// All that was measured of it.
    pub measured: BTreeMap<Aspect, f64>,
}

/// Counts over the targets of one verdict or reason.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counts {
    /// Targets drawn.
    pub targets: usize,
    /// Designations that were refused.
    pub refused: usize,
    /// Tracked at the end.
    pub kept: usize,
    /// Said to be tracked there, and not.
    pub false_tracked: usize,
}

impl Counts {
    /// Share of the targets that were kept, 0 to 1.
    pub fn kept_share(&self) -> f64 {
        self.kept as f64 / self.targets.max(1) as f64
    }

    /// Adds a target.
    pub fn add(&mut self, outcome: &Outcome) {
        self.targets += 1;
        self.refused += usize::from(outcome.is_refused);
        self.kept += usize::from(outcome.is_kept);
        self.false_tracked += usize::from(outcome.is_false);
    }
}

/// Counts by verdict and by reason.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Table {
    /// Good, risky, bad.
    pub verdicts: [Counts; 3],
    /// The reasons of what is not good.
    pub reasons: BTreeMap<Aspect, Counts>,
}

impl Table {
    /// The counts over targets.
    pub fn of<'a>(outcomes: impl IntoIterator<Item = &'a Outcome>) -> Self {
        let mut table = Self::default();
        for outcome in outcomes {
            table.verdicts[outcome.verdict as usize].add(outcome);
            if let Some(reason) = outcome.reason {
                table.reasons.entry(reason).or_default().add(outcome);
            }
        }
        table
    }

    /// The counts of a verdict.
    pub fn verdict(&self, verdict: Verdict) -> Counts {
        self.verdicts[verdict as usize]
    }
}

/// What lies under the first image of a drive.
///
/// # Errors
/// As [`Ground::new`].
pub fn ground<D: Drive>(drive: &D, settings: &Settings) -> Result<Ground> {
    Ground::new(drive, 0, settings, &TrackabilityLimits::default())
}

/// Draws up to `count` targets of each verdict from a map and tracks them.
pub fn measure<D: Drive>(
    drive: &D,
    (ground, map): (&Ground, &TrackabilityMap),
    count: usize,
    seed: u64,
) -> Vec<Outcome> {
    let mut chosen: Vec<(Cell, usize)> = Vec::new();
    let margin_px = f64::from(ground.settings.template.template_size_px);
    for verdict in Verdict::ALL {
        let mut cells: Vec<Cell> = map.cells().filter(|cell| cell.verdict == verdict).collect();
        cells.shuffle(&mut Pcg64::seed_from_u64(seed ^ (verdict as u64 + 1)));
        let seen = cells.into_iter().filter_map(|cell| Some((cell, end_of(drive, cell.pixel, margin_px)?)));
        chosen.extend(seen.filter(|(_, end)| *end >= STEPS_MIN).take(count));
    }
    chosen.par_iter().map(|(cell, end)| follow(drive, ground, cell, *end)).collect()
}

/// The last stop up to which the surface point under a pixel of the first image is seen at every stop.
fn end_of<D: Drive>(drive: &D, pixel: Pixel, margin_px: f64) -> Option<usize> {
    let point = drive.surface_point_in_site(0, None, pixel)?;
    let is_seen = |step: usize| {
        let Some(site_from_rover) = drive.true_site_from_rover(step) else { return false };
        let in_rover: Point3 = site_from_rover.inverse() * point;
        let is_inside = |camera: &Camera| {
            let [right, bottom] = camera.size.map(|side| f64::from(side) - 1.0 - margin_px);
            camera.project(&in_rover).is_some_and(|pixel| {
                (margin_px..=right).contains(&pixel.x) && (margin_px..=bottom).contains(&pixel.y)
            })
        };
        drive.true_left_camera(step, None).is_some_and(is_inside)
            && is_inside(drive.cameras(step).1)
            && drive.is_visible(step, None, &point)
    };
    (1..drive.stop_count()).take_while(|step| is_seen(*step)).last()
}

fn follow<D: Drive>(drive: &D, ground: &Ground, cell: &Cell, end: usize) -> Outcome {
    let Cell { pixel, verdict, reason, value, .. } = *cell;
    let settings = &ground.settings;
    let seen = ground.assess(pixel, true);
    let numbers = seen.criteria.iter().filter_map(|one| Some((one.aspect, one.value?)));
    let mut outcome = Outcome {
        pixel,
        verdict,
        reason,
        value,
        end,
        is_refused: true,
        is_kept: false,
        is_false: false,
        shadow: drive.shadow_share(0, None, pixel, settings.template.template_size_px),
        measured: numbers.filter(|(_, value)| value.is_finite()).collect(),
    };
    let Ok(first) = track::designate(drive, Designation::new(0, pixel), settings) else {
        return outcome;
    };
    outcome.is_refused = false;
    let mut last = track::advance(drive, &first, &first, settings);
    while last.step < end {
        last = track::advance(drive, &first, &last, settings);
    }
    outcome.is_kept = last.truth.as_ref().and_then(|truth| truth.tracked) == Some(true);
    outcome.is_false = !outcome.is_kept && last.update.state == TrackingState::Tracking;
    outcome
}
