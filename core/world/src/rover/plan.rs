//! The plan of a drive, computed before its world exists.
//!
//! Rocks, ground and settings need the path of the drive before the world exists: [`planned`] drives the course over flat
//! ground without slip, with the targets' centre on the ground.
//!
//! Frames: site and rover, m. Source: domain.md 5.4.

use sightline_geometry::camera::Mast;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::Result;
use sightline_geometry::frames::Point3;

use crate::camera::rig::Rig;
use crate::ground::level::MEAN_GROUND_Z_M;
use crate::rover::approach::distances_m;
use crate::rover::course;
use crate::rover::scene::{Scene, TrueDrive};
use crate::rover::suspension::{Stand, WHEEL_RADIUS_M, WHEELS_M};
use crate::scenario::{Course, DriveSettings, RoverSettings};

/// Smallest extent of the ground behind the first stop and to either side, m.
const AROUND_START_M: [f64; 2] = [2.5, 7.0];
/// Extent of the ground behind the targets' centre, seen from any stop, m.
const BEHIND_GOAL_M: f64 = 9.0;
/// Extent of the ground around the rover at any stop, m.
const AROUND_ROVER_M: f64 = 2.0;

/// Horizontal position of the targets' centre, site frame, m: such that the first stop is near the origin.
pub(crate) fn goal_m(drive: &DriveSettings) -> [f64; 2] {
    let level_m = drive.start_distance_m + 0.3;
    let (sine, cosine) = (drive.heading_deg + drive.start_bearing_deg).to_radians().sin_cos();
    [level_m * cosine, level_m * sine]
}

/// The course on flat ground without slip; fails if it is impossible even there.
pub(crate) fn planned(drive: &DriveSettings) -> Result<TrueDrive> {
    let [x_m, y_m] = goal_m(drive);
    course::drive(&Scene {
        ground_z_m: &|_, _| MEAN_GROUND_Z_M,
        blocked_by_m: &|_, _| None,
        centre: Point3::new(x_m, y_m, MEAN_GROUND_Z_M),
        rig: &Rig::Mast(Mast::spirit()),
        drive,
        rover: &RoverSettings::default(),
        cancel: Cancel::default(),
    })
}

/// Largest x of the front wheels, with a margin, site frame, m.
pub(crate) fn wheels_reach_m(drive: &DriveSettings) -> f64 {
    let front_m = WHEELS_M[0][0] + WHEEL_RADIUS_M + 0.1;
    if drive.course == Course::Approach && drive.heading_deg == 0.0 {
        let distances = distances_m(drive.start_distance_m, drive.end_distance_m, drive.step_fraction);
        let last_m = distances.last().copied().unwrap_or(drive.start_distance_m);
        // The camera is at least 1.3 m above the targets' centre and 0.4 m ahead of the middle wheels.
        let level_m = (last_m * last_m - 1.3 * 1.3).max(0.0).sqrt();
        return goal_m(drive)[0] - level_m - 0.4 + front_m;
    }
    let stands = planned(drive).into_iter().flat_map(|planned| planned.legs).flat_map(|leg| leg.stands);
    let farthest =
        |stand: Stand| stand.contacts_in_site.iter().map(|point| point.x).fold(f64::NEG_INFINITY, f64::max);
    stands.map(farthest).fold(front_m, f64::max) + WHEEL_RADIUS_M + 0.1
}

/// The rectangle of ground that the drive needs, site frame, m: lower and upper limit along x, then along y.
///
/// It contains every stop of the plan and the ground that its cameras see behind the targets' centre; for a straight
/// approach along x it extends 2.5 m behind the first stop, 9 m behind the centre and 7 m to either side.
pub(crate) fn ground_extent_m(drive: &DriveSettings) -> [[f64; 2]; 2] {
    let goal = goal_m(drive);
    let [behind_m, aside_m] = AROUND_START_M;
    let mut extent_m = [[-behind_m, goal[0]], [-aside_m, aside_m]];
    let mut hold = |point: [f64; 2], margin_m: f64| {
        for (axis, [from_m, to_m]) in extent_m.iter_mut().enumerate() {
            *from_m = from_m.min(point[axis] - margin_m);
            *to_m = to_m.max(point[axis] + margin_m);
        }
    };
    for stop in planned(drive).into_iter().flat_map(|planned| planned.stops) {
        let stop = stop.site_from_rover.translation.vector;
        hold([stop.x, stop.y], AROUND_ROVER_M);
        let (dx, dy) = (goal[0] - stop.x, goal[1] - stop.y);
        let level_m = dx.hypot(dy);
        let (cosine, sine) = (dx / level_m, dy / level_m);
        for side_m in [-aside_m, aside_m] {
            let x_m = goal[0] + BEHIND_GOAL_M * cosine - side_m * sine;
            hold([x_m, goal[1] + BEHIND_GOAL_M * sine + side_m * cosine], 0.0);
        }
    }
    extent_m
}
