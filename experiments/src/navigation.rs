//! Drives among rocks without images: the navigator on exact range data and exact poses, beside a planner that knows the ground.
//!
//! The rover rolls, slips and stalls as in a drive on commands (`DrivenStop::next`). At each stop the rays of its hazcams give the
//! points that they see of the true surface. So a drive tells what the navigator does, apart from tracking, stereo and odometry.

use std::path::Path;

use rayon::prelude::*;
use serde::Serialize;

use sightline_geometry::camera::Camera;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::{Pixel, Point3, Pose, Ray};
use sightline_recordings::DrivenTraverse;
use sightline_rover::driving::set_goal::goal_position_m;
use sightline_rover::driving::{DriveCommand, Motion, Navigator, PathInput};
use sightline_rover::hazards::{HazardSettings, MapRules, Scan, assess, map_hazards};
use sightline_rover::navigation::{HazardNavigator, NavigatorSettings};
use sightline_study::true_ground::true_way_m;
use sightline_track::target::Designation;
use sightline_world::rover::driven::DrivenStop;
use sightline_world::{Scenario, World, choose_targets};

use crate::driving::{scenario_of, target_in_site};

/// Rays of a hazcam: every so many pixels along rows and columns.
const RAY_STEP_PX: u32 = 2;
/// Longest motion and largest turn, m and rad: those that odometry follows.
const STEP_MAX_M: f64 = 0.75;
const TURN_MAX_RAD: f64 = 18.0 * std::f64::consts::PI / 180.0;
/// Most stops of a drive.
const STOPS_MAX: usize = 100;

/// One drive, and whether there was a way.
#[derive(Clone, Debug, Default, Serialize)]
pub(crate) struct Drive {
    /// The world's seed.
    pub(crate) seed: u64,
    /// Why there is none.
    pub(crate) problem: Option<String>,
    /// Length of a way over the true ground, m; null without one.
    pub(crate) way_m: Option<f64>,
    /// Whether the rover came within the tolerance of the goal.
    pub(crate) arrived: bool,
    /// How it ended: `arrived`, `no_safe_path`, `stalled`, `touched` or `stop_limit`.
    pub(crate) end: &'static str,
    /// Stops, the first one included.
    pub(crate) stops: usize,
    /// Length of its path, m.
    pub(crate) driven_m: f64,
    /// Distance from the goal at the end, m.
    pub(crate) left_m: f64,
}

/// What the drives have in common.
#[derive(Clone, Copy)]
pub(crate) struct Drives<'a> {
    /// The scenario whose worlds they are in.
    pub(crate) from: &'a Scenario,
    /// The command.
    pub(crate) command: &'a DriveCommand,
    /// Settings of the map.
    pub(crate) hazards: &'a HazardSettings,
    /// Settings of the navigator.
    pub(crate) navigator: &'a NavigatorSettings,
    /// A folder for the states of the worlds, which are removed again.
    pub(crate) folder: &'a Path,
}

/// A drive under way.
struct Rover<'a> {
    of: &'a Drives<'a>,
    world: &'a World,
    scenario: &'a Scenario,
    hazcam: Camera,
    goal_m: [f64; 2],
}

impl Drives<'_> {
    /// Drives in the worlds of these seeds, several at a time; `tell` is called after each.
    pub(crate) fn run(&self, seeds: &[u64], tell: &(dyn Fn() + Sync)) -> Vec<Drive> {
        let one = |&seed: &u64| {
            let folder = self.folder.join(seed.to_string());
            let outcome = self.drive(&scenario_of(self.from, seed), &folder);
            let _ = std::fs::remove_dir_all(&folder);
            tell();
            match outcome {
                Ok(drive) => Drive { seed, ..drive },
                Err(error) => Drive { seed, problem: Some(error.to_string()), ..Drive::default() },
            }
        };
        seeds.par_iter().map(one).collect()
    }

    fn drive(&self, scenario: &Scenario, folder: &Path) -> Result<Drive> {
        let begun = DrivenTraverse::begin(scenario, folder, Cancel::default())?;
        let traverse = begun.traverse();
        let missing = |what: &str| Error::Target(format!("the world has no {what}"));
        let world = traverse.world().ok_or_else(|| missing("simulation"))?;
        let targets = choose_targets(world, scenario, traverse.index());
        let pixel = targets.first().copied().ok_or_else(|| missing("target"))?;
        let target = target_in_site(&begun, Designation::new(0, pixel))?;
        let mut cameras = traverse.further_cameras(0);
        let hazcam = cameras.find(|camera| camera.mast_angles.is_none() && camera.right.is_some());
        let hazcam = hazcam.ok_or_else(|| missing("hazcams"))?.left.clone();
        let first = begun.state().first().cloned().ok_or_else(|| missing("stop"))?;
        let start = first.true_site_from_rover.to_pose();
        let goal_m = goal_position_m(self.command, 0, &target, [start.translation.x, start.translation.y]);
        let way_m = true_way_m(world, &start, goal_m, (self.hazards, self.navigator));
        let rover = Rover { of: self, world, scenario, hazcam, goal_m };
        let driven = rover.drive(first)?;
        Ok(Drive { way_m, ..driven })
    }
}

impl Rover<'_> {
    fn drive(&self, first: DrivenStop) -> Result<Drive> {
        let settings = self.of.hazards;
        let navigator = HazardNavigator { settings: self.of.navigator.clone() };
        let (mut stop, mut map, mut before) = (first, None, None);
        let start = stop.true_site_from_rover.to_pose().translation.vector;
        let mut drive = Drive::default();
        loop {
            drive.stops += 1;
            let pose = stop.true_site_from_rover.to_pose();
            let goal = pose.inverse_transform_point(&Point3::new(
                self.goal_m[0],
                self.goal_m[1],
                pose.translation.z,
            ));
            drive.left_m = goal.x.hypot(goal.y);
            if let Some(end) = self.end(&drive, &stop) {
                return Ok(Drive { end, arrived: end == "arrived", ..drive });
            }
            let points = self.seen(&pose);
            let scan = Scan {
                points_in_rover: &points,
                site_from_rover: &pose,
                driven_m: drive.driven_m,
                noise: None,
            };
            let next = map_hazards(map.as_ref(), &scan, settings);
            let rules =
                MapRules::at([pose.translation.x, pose.translation.y], [start.x, start.y], None, settings);
            let goodness = assess(&next, &rules, settings);
            map = Some(next);
            let input = PathInput {
                goal_m: [goal.x, goal.y],
                step_m: self.of.command.step_fraction * (drive.left_m + self.of.command.standoff_m),
                before,
                map: Some(&goodness),
                site_from_rover: &pose,
            };
            let choice = navigator.select_path(&input);
            let Some(motion) = choice.motion() else {
                let end = if choice.stays_for().is_some() { "goal_blocked" } else { "no_safe_path" };
                return Ok(Drive { end, ..drive });
            };
            let (motion_m, turn_rad) = followed(&motion);
            before = Some(match motion {
                Motion::Turn { .. } => Motion::Turn { angle_rad: turn_rad },
                Motion::Arc { curvature_per_m, .. } => Motion::Arc { length_m: motion_m, curvature_per_m },
            });
            stop =
                stop.next(self.world, self.scenario, drive.stops, [motion_m, turn_rad], Cancel::default())?;
            drive.driven_m += motion_m.abs() * stop.completed;
        }
    }

    fn end(&self, drive: &Drive, stop: &DrivenStop) -> Option<&'static str> {
        if stop.touched_rocks > 0 {
            return Some("touched");
        }
        if stop.completed < 1.0 {
            return Some("stalled");
        }
        if drive.left_m <= self.of.command.tolerance_m {
            return Some("arrived");
        }
        (drive.stops >= STOPS_MAX).then_some("stop_limit")
    }

    /// The points that the left hazcam sees at a pose, rover frame, m.
    fn seen(&self, pose: &Pose) -> Vec<Point3> {
        let settings = self.of.hazards;
        let [width, height] = self.hazcam.size;
        let pixels = (0..height).step_by(RAY_STEP_PX as usize).flat_map(|row| {
            (0..width)
                .step_by(RAY_STEP_PX as usize)
                .map(move |column| Pixel::new(f64::from(column), f64::from(row)))
        });
        pixels
            .filter_map(|pixel| {
                let ray = self.hazcam.ray(pixel)?;
                let in_site = Ray { origin: pose * ray.origin, direction: pose * ray.direction };
                let hit = self.world.cast(&in_site)?;
                let is_near = (settings.range_min_m..=settings.range_max_m).contains(&hit.distance_m);
                let point = pose.inverse_transform_point(&hit.point);
                let is_own =
                    point.x.abs() < settings.own_half_length_m && point.y.abs() < settings.own_half_width_m;
                (is_near && !is_own).then_some(point)
            })
            .collect()
    }
}

/// Length and turn of a motion, cut to what odometry follows, m and rad.
fn followed(motion: &Motion) -> (f64, f64) {
    match *motion {
        Motion::Turn { angle_rad } => (0.0, angle_rad.clamp(-TURN_MAX_RAD, TURN_MAX_RAD)),
        Motion::Arc { length_m, curvature_per_m } => {
            let max_m = STEP_MAX_M.min(TURN_MAX_RAD / curvature_per_m.abs());
            let length_m = length_m.clamp(-max_m, max_m);
            (length_m, length_m * curvature_per_m)
        }
    }
}
