//! The drive: where the rover truly stands at each stop, and where it believes to stand.
//!
//! **Stops.** Distances follow `D_i = D_0 (1 − step)^i`, i = 0 … n with n = ceil(ln(D_0/D_n)/ln(1/(1 − step)))
//! (R104, R106): 10 m to 2 m in steps of 10 % is 16 steps, 17 stops, the last at 1.853 m. D is measured from
//! the **centre of the left camera**, with the mast pointed, to the **targets' centre**.
//!
//! **True poses.** The rover keeps yaw 0 on the line y = goal's y. At each place a plane is fitted to the
//! ground under the six wheels (least squares); it gives height, roll and pitch, as a rocker-bogie averages
//! its wheels. The place along the line is found by bisection until the distance is exact.
//!
//! **Estimated poses.** The first is true. Each step's motion `t, R` (rover frame of the stop before) is
//! seen as `t + a e_a + b e_b + c e_c` and `R · δR`: e_a along the motion, e_b and e_c across it, with
//! a ~ N(0, (along · |t|)²), b, c ~ N(0, (across · |t|)²), and δR of roll, pitch and yaw ~ N(0, attitude²)
//! each. Errors add up from step to step, as the tracker's prediction assumes (domain.md 5.5).
//!
//! | symbol | name | unit, frame |
//! |---|---|---|
//! | D | `distance_m` | m |
//! | a, b in z = a x + b y + c | slopes of the fitted plane | m/m, site |
//!
//! Frames: site and rover. Sources: domain.md 5.4 (wheels), 5.5 (odometry), 4.5 (pointing error).

use nalgebra::{Matrix3, Rotation3, Translation3, UnitQuaternion};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use crate::camera::{Mast, MastAngles};
use crate::error::{Error, Result};
use crate::frames::{Pose, Vector3, attitude_from_roll_pitch_yaw};
use crate::traverse::OdometryError;

use crate::sim::ground::terrain::MEAN_GROUND_Z_M;
use crate::sim::ground::texture::mix;
use crate::sim::scenario::{DriveSettings, Scenario};
use crate::sim::world::World;

/// Where the wheels stand in the rover frame, m (domain.md 5.4).
const WHEELS_M: [[f64; 2]; 6] =
    [[0.70, -0.53], [0.70, 0.53], [0.0, -0.60], [0.0, 0.60], [-0.70, -0.53], [-0.70, 0.53]];

/// Where the rover truly stands and where its mast truly looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrueStop {
    /// The rover in the site frame.
    pub site_from_rover: Pose,
    /// The angles that put the targets' centre on the centre of the left image.
    pub angles: MastAngles,
}

/// The distances of the stops from the targets' centre, m.
pub fn distances_m(drive: &DriveSettings) -> Vec<f64> {
    let keep = 1.0 - drive.step_fraction;
    let ratio = (drive.start_distance_m / drive.end_distance_m).ln() / (1.0 / keep).ln();
    // A ratio that is whole but for rounding must not add a step.
    let steps = (ratio - 1e-9).ceil().max(0.0) as i32;
    (0..=steps).map(|step| drive.start_distance_m * keep.powi(step)).collect()
}

/// Where the targets' centre lies in the plane, site frame, m: such that the first stop is near the origin.
pub fn goal_m(drive: &DriveSettings) -> [f64; 2] {
    [drive.start_distance_m + 0.3, 0.0]
}

/// How far along x the front wheels get, with a margin, site frame, m.
pub fn wheels_reach_m(drive: &DriveSettings) -> f64 {
    let last_m = distances_m(drive).last().copied().unwrap_or(drive.start_distance_m);
    // The camera is at least 1.3 m above the targets' centre and 0.4 m ahead of the middle wheels.
    let level_m = (last_m * last_m - 1.3 * 1.3).max(0.0).sqrt();
    goal_m(drive)[0] - level_m - 0.4 + 0.70 + 0.13 + 0.1
}

/// The mast of the scenario: Spirit's navcams, reduced to the scenario's image size by block averages.
pub fn mast(scenario: &Scenario) -> Mast {
    let mut mast = Mast::spirit();
    let factor = (mast.left_in_head.width() / scenario.camera.image_size.max(1)).max(1);
    if factor > 1 {
        mast.left_in_head = mast.left_in_head.downsampled(factor);
        mast.right_in_head = mast.right_in_head.downsampled(factor);
    }
    mast
}

/// The rover on the ground at x, y of the site frame (m), yaw 0.
fn rover_on_ground(world: &World, x_m: f64, y_m: f64) -> Pose {
    let (mut normal_matrix, mut right_side) = (Matrix3::zeros(), Vector3::zeros());
    for [wheel_x, wheel_y] in WHEELS_M {
        let row = Vector3::new(wheel_x, wheel_y, 1.0);
        normal_matrix += row * row.transpose();
        right_side += row * world.ground_z_at(x_m + wheel_x, y_m + wheel_y);
    }
    // The wheels are not on one line, so the matrix can be inverted.
    let plane = normal_matrix.try_inverse().unwrap_or_else(Matrix3::identity) * right_side;
    let down = Vector3::new(-plane.x, -plane.y, 1.0).normalize();
    let forward = Vector3::new(1.0, 0.0, plane.x).normalize();
    let right = down.cross(&forward);
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[forward, right, down]));
    let position = Vector3::new(x_m, y_m, plane.z) - down * MEAN_GROUND_Z_M;
    Pose::from_parts(Translation3::from(position), UnitQuaternion::from_rotation_matrix(&rotation))
}

/// The stop at a place along the line of the drive; fails where the mast cannot look at the centre.
fn stop_at(world: &World, mast: &Mast, x_m: f64) -> Result<TrueStop> {
    let centre = world.targets_centre();
    let site_from_rover = rover_on_ground(world, x_m, centre.y);
    let centre_in_rover = site_from_rover.inverse_transform_point(&centre);
    let angles = mast
        .point_left_centre_at(&centre_in_rover)
        .ok_or_else(|| Error::setting("drive", "the mast cannot look at the targets' centre from a stop"))?;
    Ok(TrueStop { site_from_rover, angles })
}

/// Distance from the centre of the left camera to the targets' centre, m.
pub fn distance_m(world: &World, mast: &Mast, stop: &TrueStop) -> f64 {
    let (left, _) = mast.cameras_in_rover(stop.angles);
    (stop.site_from_rover * left.model.centre() - world.targets_centre()).norm()
}

/// The stop at exactly `wanted_m` from the targets' centre.
fn stop_at_distance(world: &World, mast: &Mast, wanted_m: f64) -> Result<TrueStop> {
    let goal_x_m = world.targets_centre().x;
    let (mut far_x_m, mut near_x_m) = (goal_x_m - wanted_m - 2.0, goal_x_m - 0.8);
    for _ in 0..60 {
        let middle_m = 0.5 * (far_x_m + near_x_m);
        let stop = stop_at(world, mast, middle_m)?;
        if distance_m(world, mast, &stop) > wanted_m { far_x_m = middle_m } else { near_x_m = middle_m }
    }
    let stop = stop_at(world, mast, far_x_m)?;
    if (distance_m(world, mast, &stop) - wanted_m).abs() > 1e-9 {
        let problem =
            format!("no place on the line of the drive is {wanted_m:.3} m from the targets' centre");
        return Err(Error::setting("drive.end_distance_m", problem));
    }
    Ok(stop)
}

/// The true stops of the scenario, from the farthest to the nearest.
pub fn true_stops(world: &World, scenario: &Scenario) -> Result<Vec<TrueStop>> {
    let mast = mast(scenario);
    distances_m(&scenario.drive).into_iter().map(|d| stop_at_distance(world, &mast, d)).collect()
}

/// The pose estimates of a drive through `true_poses`; the first is true.
pub fn estimates(true_poses: &[Pose], error: &OdometryError, seed: u64) -> Vec<Pose> {
    let mut random = Pcg64::new(u128::from(mix(seed ^ 0x0d0_3e72)), 0x0d03_e72b_b3c0_a700);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let mut estimates: Vec<Pose> = true_poses.first().copied().into_iter().collect();
    for pair in true_poses.windows(2) {
        let before_from_after = pair[0].inv_mul(&pair[1]);
        let motion = before_from_after.translation.vector;
        let length_m = motion.norm();
        let along = if length_m > 0.0 { motion / length_m } else { Vector3::x() };
        let across = Vector3::z().cross(&along).normalize();
        let upright = along.cross(&across);
        let seen = motion
            + along * (normal() * error.along_fraction * length_m)
            + across * (normal() * error.across_fraction * length_m)
            + upright * (normal() * error.across_fraction * length_m);
        let attitude_rad = error.attitude_deg.to_radians();
        let tilt = attitude_from_roll_pitch_yaw(
            normal() * attitude_rad,
            normal() * attitude_rad,
            normal() * attitude_rad,
        );
        let step = Pose::from_parts(Translation3::from(seen), before_from_after.rotation * tilt);
        let last = estimates[estimates.len() - 1];
        estimates.push(last * step);
    }
    estimates
}

/// The angles that the mast truly takes when asked for `angles`, with the scenario's pointing error.
pub fn angles_with_error(angles: MastAngles, scenario: &Scenario, stop: usize) -> MastAngles {
    let sigma_rad = scenario.drive.pointing_error_deg.to_radians();
    let mut random = Pcg64::new(u128::from(mix(scenario.seed ^ mix(stop as u64 ^ 0x9a57))), 0x9a57_9a57);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    MastAngles {
        azimuth_rad: angles.azimuth_rad + sigma_rad * normal(),
        elevation_rad: angles.elevation_rad + sigma_rad * normal(),
    }
}
