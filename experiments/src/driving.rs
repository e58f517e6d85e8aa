//! Closed-loop drives in many worlds: arrival, errors of target and goal, collisions.
//!
//! Each world has a slope of up to 5° in any direction, slip of firm soil with a spread of 20 %, and one target, the first that
//! the scenario's rule chooses. Drives without obstacles have no rock above 10 cm within 1.2 m of the straight line from the
//! first stop to the goal that follows from the true target (`rocks.clear_path`); all other rocks are those of the world
//! with obstacles, so that the target is the same.

use std::path::Path;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use rayon::prelude::*;
use serde::Serialize;

use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::Point3;
use sightline_recordings::DrivenTraverse;
use sightline_rover::driving::set_goal::goal_position_m;
use sightline_rover::driving::{DriveCommand, GoalRule};
use sightline_rover::hazards::HazardSettings;
use sightline_rover::navigation::NavigatorSettings;
use sightline_session::driving::DriveSummary;
use sightline_session::targeted_drive::TargetedDrive;
use sightline_study::true_ground::way_to_goal_m;
use sightline_track::settings::Settings;
use sightline_track::target::Designation;
use sightline_world::scenario::{ClearPath, OdometryModel};
use sightline_world::target_truth::{TargetTruth, TruthSource};
use sightline_world::{Scenario, World, choose_targets};

/// One drive.
#[derive(Clone, Debug, Serialize)]
pub struct Drive {
    /// The world's seed.
    pub seed: u64,
    /// The outcome; `None` where the world has no target or the drive could not be made.
    pub summary: Option<DriveSummary>,
    /// Why there is none.
    pub problem: Option<String>,
    /// Length of a way over the true ground to the goal that follows from the true target, m; null without one, and without
    /// obstacles.
    pub way_m: Option<f64>,
}

/// The drives of a study with one rule for the goal.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// Drives that began.
    pub drives: usize,
    /// Drives that arrived.
    pub arrived: usize,
    /// Drives for which a way over the true ground exists, and those of them that arrived; 0 without obstacles.
    pub with_way: [usize; 2],
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

/// What the drives of a study have in common.
#[derive(Clone, Copy)]
pub struct Drives<'a> {
    /// The scenario whose worlds they are in.
    pub from: &'a Scenario,
    /// The command.
    pub command: &'a DriveCommand,
    /// The configuration of the tracker.
    pub settings: &'a Settings,
    /// Whether the rocks on the rover's way remain.
    pub obstacles: bool,
    /// A folder for the drives.
    pub folder: &'a Path,
    /// Whether they are kept, each with its images, as sessions can open them.
    pub keeps: bool,
}

impl Drives<'_> {
    /// Drives in the worlds of these seeds, several at a time; `tell` is called after each.
    pub fn run(&self, seeds: &[u64], tell: &(dyn Fn() + Sync)) -> Vec<Drive> {
        let one = |&seed: &u64| {
            let word = if self.command.goal == GoalRule::Fixed { "fixed" } else { "follows" };
            let folder = self.folder.join(format!("{word}-{seed}"));
            let outcome = self.drive(&scenario_of(self.from, seed), &folder);
            if !self.keeps {
                // The images of a hundred drives would fill a disk.
                let _ = std::fs::remove_dir_all(&folder);
            }
            tell();
            match outcome {
                Ok((summary, way_m)) => Drive { seed, summary: Some(summary), problem: None, way_m },
                Err(error) => Drive { seed, summary: None, problem: Some(error.to_string()), way_m: None },
            }
        };
        seeds.par_iter().map(one).collect()
    }

    /// One drive to its end, and the length of a way to its goal.
    fn drive(&self, scenario: &Scenario, folder: &Path) -> Result<(DriveSummary, Option<f64>)> {
        let world = DrivenTraverse::begin(scenario, &folder.join("open"), Cancel::default())?;
        let traverse = world.traverse();
        let targets = traverse.world().map(|world| choose_targets(world, scenario, traverse.index()));
        let pixel = targets.and_then(|targets| targets.first().copied());
        let pixel = pixel.ok_or_else(|| Error::Target("the world has no target".to_owned()))?;
        let designation = Designation::new(0, pixel);
        let world = if self.obstacles {
            world
        } else {
            self.without_obstacles(&world, scenario, designation, folder)?
        };
        let way_m = self.obstacles.then(|| self.way_m(&world, designation)).flatten();
        let command = self.command.clone();
        let mut drive = TargetedDrive::begin(world, designation, command, self.settings, Cancel::default())?;
        while drive.advance(self.settings, Cancel::default())? {}
        Ok((drive.summary(), way_m))
    }

    /// Length of a way over the true ground to the goal, m.
    fn way_m(&self, begun: &DrivenTraverse, designation: Designation) -> Option<f64> {
        let settings = (&HazardSettings::default(), &NavigatorSettings::default());
        way_to_goal_m(begun, self.command, designation, settings)
    }

    /// The same world without high rocks on the way to the goal.
    ///
    /// # Errors
    /// A target that is hidden, or whose own rock reaches into the way.
    fn without_obstacles(
        &self,
        open: &DrivenTraverse,
        scenario: &Scenario,
        designation: Designation,
        folder: &Path,
    ) -> Result<DrivenTraverse> {
        let target = target_in_site(open, designation)?;
        let start = TruthSource::true_site_from_rover(open.traverse(), 0).unwrap_or_default();
        let start_m = [start.translation.x, start.translation.y];
        let goal_m = goal_position_m(self.command, 0, &target, start_m);
        let centre = open.traverse().world().map(World::targets_centre).unwrap_or_default();
        let mut cleared = scenario.clone();
        cleared.rocks.clear_path = Some(ClearPath {
            to_x_m: goal_m[0] - centre.x,
            to_y_m: goal_m[1] - centre.y,
            ..ClearPath::default()
        });
        let world = DrivenTraverse::begin(&cleared, &folder.join("cleared"), Cancel::default())?;
        if (target_in_site(&world, designation)? - target).norm() > 1e-3 {
            return Err(Error::Target("the target's own rock is in the way".to_owned()));
        }
        Ok(world)
    }
}

/// The surface point under the target's pixel, site frame.
pub(crate) fn target_in_site(world: &DrivenTraverse, designation: Designation) -> Result<Point3> {
    let truth = TargetTruth::new(world.traverse(), designation, None);
    truth.map(|truth| truth.position_in_site()).ok_or_else(|| Error::Target("it has no surface".to_owned()))
}

/// Sums up drives.
pub fn outcome(drives: &[Drive]) -> Outcome {
    let made: Vec<DriveSummary> = drives.iter().filter_map(|drive| drive.summary).collect();
    let with_way = || drives.iter().filter(|drive| drive.way_m.is_some()).filter_map(|drive| drive.summary);
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
        with_way: [with_way().count(), with_way().filter(|summary| summary.arrived).count()],
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
        Drive { seed: 1, summary: Some(summary), problem: None, way_m: Some(8.0).filter(|_| arrived) }
    }

    #[test]
    fn errors_are_those_of_the_drives_that_arrived() {
        let mut drives: Vec<Drive> = (1..=100).map(|k| made(true, 0.001 * f64::from(k))).collect();
        drives.push(made(false, 9.0));
        drives.push(Drive { seed: 2, summary: None, problem: Some("no target".to_owned()), way_m: None });
        let outcome = outcome(&drives);
        assert_eq!(
            (outcome.drives, outcome.arrived, outcome.tracked, outcome.collisions),
            (101, 100, 100, 1)
        );
        assert_eq!(outcome.with_way, [100, 100]);
        assert!((outcome.target_error_m[0] - 0.050).abs() < 1e-9);
        assert!((outcome.target_error_m[1] - 0.099).abs() < 1e-9);
        assert!((outcome.goal_error_m[1] - 0.190).abs() < 1e-9);
    }
}
