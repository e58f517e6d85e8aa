//! Closed-loop drives in many worlds: arrival, errors of target and goal, collisions.
//!
//! Each world has a slope of up to 5° in any direction, slip of firm soil with a spread of 20 %, and one target, the first that
//! the scenario's rule chooses. Each drive is made twice: with a goal that follows the target and with a fixed one.

use std::path::Path;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use rayon::prelude::*;
use serde::Serialize;

use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::{Error, Result};
use sightline_recordings::DrivenTraverse;
use sightline_rover::driving::{DriveCommand, GoalRule};
use sightline_session::driving::{DriveSummary, TargetedDrive};
use sightline_track::settings::Settings;
use sightline_track::target::Designation;
use sightline_world::scenario::OdometryModel;
use sightline_world::{Scenario, choose_targets};

/// One drive.
#[derive(Clone, Debug, Serialize)]
pub struct Drive {
    /// The world's seed.
    pub seed: u64,
    /// The outcome; `None` where the world has no target or the drive could not be made.
    pub summary: Option<DriveSummary>,
    /// Why there is none.
    pub problem: Option<String>,
}

/// The drives of a study with one rule for the goal.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// Drives that began.
    pub drives: usize,
    /// Drives that arrived.
    pub arrived: usize,
    /// Drives whose target was tracked at the last stop.
    pub tracked: usize,
    /// Collisions in all drives.
    pub collisions: u32,
    /// Median and 99th percentile of the target's error over the drives that arrived, m.
    pub target_error_m: [f64; 2],
    /// Median and 95th percentile of the goal's error over the drives that arrived, m.
    pub goal_error_m: [f64; 2],
}

/// The scenario of one world: `from` on a slope with slip.
pub fn scenario_of(from: &Scenario, seed: u64) -> Scenario {
    let mut random = Pcg64::seed_from_u64(seed ^ 0x5109e);
    let mut scenario = Scenario { seed, ..from.clone() };
    scenario.terrain.slope_deg = random.random_range(0.0..5.0);
    scenario.terrain.slope_azimuth_deg = random.random_range(-180.0..180.0);
    (scenario.rover.slip_scale, scenario.rover.slip_spread) = (1.0, 0.2);
    scenario.rover.odometry = OdometryModel::WheelsAndImu;
    scenario
}

/// Drives in the worlds of these seeds, several at a time; `tell` is called after each.
pub fn drives(
    from: &Scenario,
    seeds: &[u64],
    command: &DriveCommand,
    settings: &Settings,
    folder: &Path,
    tell: &(dyn Fn() + Sync),
) -> Vec<Drive> {
    let one = |&seed: &u64| {
        let word = if command.goal == GoalRule::Fixed { "fixed" } else { "follows" };
        let folder = folder.join(format!("{word}-{seed}"));
        let outcome = drive(&scenario_of(from, seed), command, settings, &folder);
        // The images of a hundred drives would fill a disk.
        let _ = std::fs::remove_dir_all(&folder);
        tell();
        match outcome {
            Ok(summary) => Drive { seed, summary: Some(summary), problem: None },
            Err(error) => Drive { seed, summary: None, problem: Some(error.to_string()) },
        }
    };
    seeds.par_iter().map(one).collect()
}

/// One drive to its end.
fn drive(
    scenario: &Scenario,
    command: &DriveCommand,
    settings: &Settings,
    folder: &Path,
) -> Result<DriveSummary> {
    let world = DrivenTraverse::begin(scenario, folder, Cancel::default())?;
    let traverse = world.traverse();
    let targets = traverse.world().map(|world| choose_targets(world, scenario, traverse.index()));
    let pixel = targets.and_then(|targets| targets.first().copied());
    let pixel = pixel.ok_or_else(|| Error::Target("the world has no target".to_owned()))?;
    let designation = Designation { step: 0, pixel };
    let mut drive = TargetedDrive::begin(world, designation, *command, settings, Cancel::default())?;
    while drive.advance(settings, Cancel::default())? {}
    Ok(drive.summary())
}

/// Sums up drives.
pub fn outcome(drives: &[Drive]) -> Outcome {
    let made: Vec<DriveSummary> = drives.iter().filter_map(|drive| drive.summary).collect();
    let arrived = || made.iter().filter(|summary| summary.arrived);
    let quantiles = |of: fn(&DriveSummary) -> Option<f64>, high: f64| {
        let mut values: Vec<f64> = arrived().filter_map(of).collect();
        values.sort_by(f64::total_cmp);
        [0.5, high].map(|part| {
            let at = (part * values.len() as f64).ceil() as usize;
            values.get(at.saturating_sub(1)).copied().unwrap_or(f64::NAN)
        })
    };
    Outcome {
        drives: made.len(),
        arrived: arrived().count(),
        tracked: made.iter().filter(|summary| summary.tracked == Some(true)).count(),
        collisions: made.iter().map(|summary| summary.collisions).sum(),
        target_error_m: quantiles(|summary| summary.target_error_m, 0.99),
        goal_error_m: quantiles(|summary| summary.goal_error_m, 0.95),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn made(arrived: bool, error_m: f64) -> Drive {
        let summary = DriveSummary {
            stops: 18,
            arrived,
            reason: None,
            target_error_m: Some(error_m),
            goal_error_m: Some(2.0 * error_m),
            driven_m: 8.0,
            collisions: u32::from(!arrived),
            tracked: Some(arrived),
            flight_minutes: 20.0,
        };
        Drive { seed: 1, summary: Some(summary), problem: None }
    }

    #[test]
    fn errors_are_those_of_the_drives_that_arrived() {
        let mut drives: Vec<Drive> = (1..=100).map(|k| made(true, 0.001 * f64::from(k))).collect();
        drives.push(made(false, 9.0));
        drives.push(Drive { seed: 2, summary: None, problem: Some("no target".to_owned()) });
        let outcome = outcome(&drives);
        assert_eq!(
            (outcome.drives, outcome.arrived, outcome.tracked, outcome.collisions),
            (101, 100, 100, 1)
        );
        assert!((outcome.target_error_m[0] - 0.050).abs() < 1e-9);
        assert!((outcome.target_error_m[1] - 0.099).abs() < 1e-9);
        assert!((outcome.goal_error_m[1] - 0.190).abs() < 1e-9);
    }
}
