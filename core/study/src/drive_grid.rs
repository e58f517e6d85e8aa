//! Commanded drives over a grid of slope, rock coverage, use of visual odometry and navigator.
//!
//! Each drive starts 10 m from the first target chosen by the scenario's rule, among the rocks of `obstacles-10` without
//! the placed one, with the slip of firm soil; the seed also draws the direction of the slope. The columns are those of
//! the summary of `sightline drive`.
//!
//! Reachability of the goal is determined on the true ground with the limits of the navigator; `arcs` uses those of
//! `gestalt` (`true_ground.rs`).
//!
//! The interval of the fraction of arrived drives is that of Clopper and Pearson, 95 %. Source: driving.md §2, R98.

use std::collections::BTreeMap;
use std::path::Path;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use statrs::distribution::{Beta, ContinuousCDF};

use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::{Error, Result};
use sightline_recordings::DrivenTraverse;
use sightline_rover::driving::{DriveCommand, NavigatorKind};
use sightline_rover::hazards::HazardSettings;
use sightline_rover::navigation::NavigatorPreset;
use sightline_rover::visual_odometry::OdometryMode;
use sightline_session::driving::DriveSummary;
use sightline_session::targeted_drive::TargetedDrive;
use sightline_track::settings::Settings;
use sightline_track::target::Designation;
use sightline_world::{Scenario, choose_targets, library};

use super::plan::code_key;
use super::true_ground::way_to_goal_m;

/// A cell of the grid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cell {
    /// Mean slope of the ground, deg.
    pub slope_deg: f64,
    /// Fraction of the ground covered by rocks.
    pub coverage: f64,
    /// Use of visual odometry.
    pub odometry: OdometryMode,
    /// The navigator.
    pub navigator: NavigatorKind,
}

/// Row of one drive.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DriveRow {
    /// Key of the code that ran it.
    pub code: String,
    /// Its cell of the grid.
    #[serde(flatten)]
    pub cell: Cell,
    /// Seed of the world.
    pub seed: u64,
    /// Side of the images, px.
    pub size: u32,
    /// Samples along each side of a pixel.
    pub samples_per_axis: u32,
    /// Reason why it could not start; null if it did.
    pub problem: Option<String>,
    /// Length of a path over the true ground to the goal, m; null without one.
    pub way_m: Option<f64>,
    /// Outcome; absent if it could not start.
    #[serde(flatten)]
    pub summary: Option<DriveSummary>,
}

/// Summary of a cell's drives.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CellSummary {
    /// The cell.
    #[serde(flatten)]
    pub cell: Cell,
    /// Number of drives that started.
    pub drives: usize,
    /// Number of arrived drives.
    pub arrived: usize,
    /// 95 % interval of the fraction of arrived drives.
    pub arrived_interval: [f64; 2],
    /// Number of drives with a path to the goal, and number of these drives that arrived.
    pub with_way: [usize; 2],
    /// Collisions in all drives.
    pub collisions: u32,
    /// Number of drives that did not arrive, by reason.
    pub reasons: BTreeMap<String, usize>,
    /// Median and largest error of the target over the arrived drives, m; null without one.
    pub target_error_m: Option<[f64; 2]>,
    /// Median and largest error of the goal over the arrived drives, m; null without one.
    pub goal_error_m: Option<[f64; 2]>,
}

/// Grid of a study.
#[derive(Clone, Debug)]
pub struct DriveGrid {
    /// The cells.
    pub cells: Vec<Cell>,
    /// Seeds of the worlds, used in every cell.
    pub seeds: Vec<u64>,
    /// Side of the images, px.
    pub size: u32,
    /// Samples along each side of a pixel.
    pub samples_per_axis: u32,
}

impl DriveGrid {
    /// The scenario of a drive.
    ///
    /// # Errors
    /// A cell for which no world can be generated.
    pub fn scenario(&self, cell: &Cell, seed: u64) -> Result<Scenario> {
        let mut random = Pcg64::seed_from_u64(seed ^ 0x9a1d_d21e);
        let mut scenario = Scenario { seed, ..library::scenario("obstacles-10")? };
        scenario.terrain.slope_deg = cell.slope_deg;
        scenario.terrain.slope_azimuth_deg = random.random_range(-180.0..180.0);
        scenario.rocks.area_fraction = cell.coverage;
        scenario.rocks.placed.clear();
        scenario.camera.image_size = self.size;
        scenario.camera.samples_per_axis = self.samples_per_axis;
        // The rule's window of 21 px is for images of 1024 px.
        scenario.targets.window_px = (scenario.targets.window_px * self.size / 1024).max(9) | 1;
        scenario.validate()?;
        Ok(scenario)
    }

    /// Runs all drives that are not among the `known` rows; `tell` is called with each new row.
    ///
    /// # Errors
    /// [`Error::Cancelled`], a cell for which no world can be generated, or an error of `tell`.
    pub fn run(
        &self,
        known: &[DriveRow],
        folder: &Path,
        cancel: Cancel<'_>,
        tell: &(dyn Fn(&DriveRow) -> Result<()> + Sync),
    ) -> Result<Vec<DriveRow>> {
        let code = code_key();
        let all = self.seeds.iter().flat_map(|seed| self.cells.iter().map(move |cell| (*cell, *seed)));
        let all: Vec<(Cell, u64)> = all.collect();
        let one = |(cell, seed): &(Cell, u64)| {
            let empty = DriveRow {
                code: code.clone(),
                cell: *cell,
                seed: *seed,
                size: self.size,
                samples_per_axis: self.samples_per_axis,
                problem: None,
                way_m: None,
                summary: None,
            };
            if let Some(found) = known.iter().find(|row| row.is_of(&empty)) {
                return Ok(found.clone());
            }
            let place = folder.join(format!("{:?}-{:?}-{seed}", cell.odometry, cell.navigator));
            let place = place.join(format!("{}-{}", cell.slope_deg, cell.coverage));
            let driven = self.drive(cell, *seed, &place, cancel);
            // Images are removed: those of a hundred drives would fill the disk.
            let _ = std::fs::remove_dir_all(&place);
            let row = match driven {
                Ok((way_m, summary)) => DriveRow { way_m, summary: Some(summary), ..empty },
                Err(Error::Cancelled) => return Err(Error::Cancelled),
                Err(error) => DriveRow { problem: Some(error.to_string()), ..empty },
            };
            tell(&row)?;
            Ok(row)
        };
        all.par_iter().map(one).collect()
    }

    /// Length of a path over the true ground, and outcome.
    fn drive(
        &self,
        cell: &Cell,
        seed: u64,
        folder: &Path,
        cancel: Cancel<'_>,
    ) -> Result<(Option<f64>, DriveSummary)> {
        let scenario = self.scenario(cell, seed)?;
        let world = DrivenTraverse::begin(&scenario, folder, cancel)?;
        let traverse = world.traverse();
        let targets = traverse.world().map(|world| choose_targets(world, &scenario, traverse.index()));
        let pixel = targets.and_then(|targets| targets.first().copied());
        let pixel = pixel.ok_or_else(|| Error::Target("the world offers no target".to_owned()))?;
        let command =
            DriveCommand { navigator: cell.navigator, odometry: cell.odometry, ..DriveCommand::default() };
        let (designation, settings) = (Designation::new(0, pixel), Settings::default());
        let limits = match cell.navigator {
            NavigatorKind::Morphin => NavigatorPreset::Morphin.settings(),
            NavigatorKind::Gestalt | NavigatorKind::Arcs => NavigatorPreset::Gestalt.settings(),
        };
        let way_m = way_to_goal_m(&world, &command, designation, (&HazardSettings::default(), &limits));
        let mut drive = TargetedDrive::begin(world, designation, command, &settings, cancel)?;
        while drive.advance(&settings, cancel)? {}
        Ok((way_m, drive.summary()))
    }

    /// Summaries of all cells.
    pub fn summaries(&self, rows: &[DriveRow]) -> Vec<CellSummary> {
        let of_cell = |cell: &Cell| {
            let own = |row: &&DriveRow| row.cell == *cell;
            let made: Vec<(bool, DriveSummary)> =
                rows.iter().filter(own).filter_map(|row| Some((row.way_m.is_some(), row.summary?))).collect();
            summary(*cell, &made)
        };
        self.cells.iter().map(of_cell).collect()
    }
}

impl DriveRow {
    /// Returns whether both rows are of the same drive.
    fn is_of(&self, other: &Self) -> bool {
        let key = |row: &Self| (row.code.clone(), row.cell, row.seed, row.size, row.samples_per_axis);
        key(self) == key(other)
    }
}

/// Summary of a cell; the flag of each drive is whether it had a path.
fn summary(cell: Cell, drives: &[(bool, DriveSummary)]) -> CellSummary {
    let made: Vec<DriveSummary> = drives.iter().map(|(_, summary)| *summary).collect();
    let with_way = || drives.iter().filter(|(has_way, _)| *has_way);
    let arrived = || made.iter().filter(|summary| summary.arrived);
    let mut reasons = BTreeMap::new();
    for reason in made.iter().filter(|summary| !summary.arrived).filter_map(|summary| summary.reason) {
        *reasons.entry(reason.word().to_owned()).or_insert(0) += 1;
    }
    let errors = |of: fn(&DriveSummary) -> Option<f64>| {
        let mut values: Vec<f64> = arrived().filter_map(of).collect();
        values.sort_by(f64::total_cmp);
        Some([*values.get(values.len().saturating_sub(1) / 2)?, *values.last()?])
    };
    CellSummary {
        cell,
        drives: made.len(),
        arrived: arrived().count(),
        arrived_interval: interval(arrived().count(), made.len()),
        with_way: [with_way().count(), with_way().filter(|(_, summary)| summary.arrived).count()],
        collisions: made.iter().map(|summary| summary.collisions).sum(),
        reasons,
        target_error_m: errors(|summary| summary.target_error_m),
        goal_error_m: errors(|summary| summary.goal_error_m),
    }
}

/// 95 % interval of a fraction, by Clopper and Pearson.
fn interval(count: usize, of: usize) -> [f64; 2] {
    let (k, n) = (count as f64, of as f64);
    let quantile =
        |a: f64, b: f64, part: f64| Beta::new(a, b).map_or(f64::NAN, |beta| beta.inverse_cdf(part));
    let low = if count == 0 { 0.0 } else { quantile(k, n - k + 1.0, 0.025) };
    let high = if count == of { 1.0 } else { quantile(k + 1.0, n - k, 0.975) };
    [low, high]
}

#[cfg(test)]
mod tests {
    use super::*;
    use sightline_rover::driving::StopReason;

    fn cell() -> Cell {
        Cell {
            slope_deg: 5.0,
            coverage: 0.05,
            odometry: OdometryMode::Full,
            navigator: NavigatorKind::Gestalt,
        }
    }

    fn made(reason: StopReason, error_m: f64) -> DriveSummary {
        DriveSummary {
            stops: 20,
            arrived: reason == StopReason::Arrived,
            reason: Some(reason),
            target_error_m: Some(error_m),
            goal_error_m: Some(2.0 * error_m),
            driven_m: 8.0,
            collisions: u32::from(reason == StopReason::Stalled),
            tracked: Some(true),
            flight_minutes: 40.0,
        }
    }

    #[test]
    fn the_interval_is_that_of_clopper_and_pearson() {
        // R: binom.test(7, 8)$conf.int, binom.test(0, 8), binom.test(8, 8).
        for ((count, of), expected) in
            [((7, 8), [0.4734903, 0.9968403]), ((0, 8), [0.0, 0.3694166]), ((8, 8), [0.6305834, 1.0])]
        {
            let found = interval(count, of);
            for (value, wanted) in found.into_iter().zip(expected) {
                assert!((value - wanted).abs() < 1e-6, "{count} of {of}: {found:?}");
            }
        }
    }

    #[test]
    fn a_cell_sums_up_its_drives_alone_and_says_how_the_others_ended() {
        let grid = DriveGrid { cells: vec![cell()], seeds: vec![1], size: 256, samples_per_axis: 1 };
        let row = |cell: Cell, summary: Option<DriveSummary>| DriveRow {
            code: "c".to_owned(),
            cell,
            seed: 1,
            size: 256,
            samples_per_axis: 1,
            problem: None,
            way_m: summary.map(|_| 8.1),
            summary,
        };
        let mut rows: Vec<DriveRow> =
            (1..=3).map(|k| row(cell(), Some(made(StopReason::Arrived, 0.001 * f64::from(k))))).collect();
        rows.push(row(cell(), Some(made(StopReason::Stalled, 9.0))));
        rows.push(row(cell(), None));
        rows.push(row(Cell { slope_deg: 10.0, ..cell() }, Some(made(StopReason::Lost, 9.0))));
        let [found] = &grid.summaries(&rows)[..] else { panic!("one cell") };
        assert_eq!((found.drives, found.arrived, found.collisions), (4, 3, 1));
        assert_eq!(found.with_way, [4, 3]);
        assert_eq!(found.target_error_m, Some([0.002, 0.003]));
        assert_eq!(found.reasons, BTreeMap::from([(StopReason::Stalled.word().to_owned(), 1)]));
        // A row survives serialisation, with and without an outcome.
        for row in &rows {
            let text = serde_json::to_string(row).unwrap();
            assert_eq!(serde_json::from_str::<DriveRow>(&text).unwrap(), *row, "{text}");
        }
    }

    #[test]
    fn known_drives_of_the_same_code_are_not_driven_again() {
        let grid = DriveGrid { cells: vec![cell()], seeds: vec![5], size: 256, samples_per_axis: 1 };
        let known = DriveRow {
            code: code_key(),
            cell: cell(),
            seed: 5,
            size: 256,
            samples_per_axis: 1,
            problem: None,
            way_m: Some(8.1),
            summary: Some(made(StopReason::Arrived, 0.001)),
        };
        let folder = std::env::temp_dir();
        let flag = std::sync::atomic::AtomicBool::new(true);
        let run = |known: &[DriveRow]| grid.run(known, &folder, Cancel::from(&flag), &|_| Ok(()));
        assert_eq!(run(std::slice::from_ref(&known)).unwrap(), std::slice::from_ref(&known));
        let other = DriveRow { code: "other".to_owned(), ..known };
        assert!(matches!(run(&[other]), Err(Error::Cancelled)), "another code is driven anew");
    }
}
