//! The rover's pose estimates.
//!
//! **Stated.** The first estimate is true. Each step's motion `t, R` (rover frame of the previous stop) is measured as
//! `t + a e_a + b e_b + c e_c` and `R · δR`: e_a along the motion, e_b and e_c across it, with a ~ N(0, (along · |t|)²),
//! b, c ~ N(0, (across · |t|)²), and δR of roll, pitch and yaw ~ N(0, attitude²) each. Errors accumulate from step to
//! step, as the tracker's prediction assumes (domain.md 5.5).
//!
//! **Wheels and IMU.** The first estimate is true. The motion of a leg is the wheels' advance integrated along the
//! estimated attitude Â: `ŵ = Σ_k Â_k w_k`. Slip is not detected, so it is an error of this estimate and in no covariance.
//! The position grows by `ŵ + a e_a + b e_b + c e_c` with a ~ N(0, (along · L)²), b, c ~ N(0, (across · L)²). Attitude:
//! roll and pitch are the true ones plus N(0, attitude²), redrawn by the accelerometers at each stop and constant until
//! the next; yaw is the true one plus the gyro's error, which grows over a leg of duration T by
//! `bias · T + walk · sqrt(T) · N(0, 1)`, linearly within it. The gyro is integrated while the rover drives (domain.md
//! 5.4), not at stops.
//!
//! **Heading jumps** (`rover.heading_jumps`) rotate the estimate about the rover's own vertical from their stop on; the
//! following motion is integrated along the rotated heading.
//!
//! | symbol | name | unit, frame |
//! |---|---|---|
//! | t, R | translation and rotation between two stops | m, rover frame of the first |
//! | w, Â | `wheels_m`, estimated attitude | m, rover frame; site from rover |
//! | L, T | `driven_m`, `duration_s` of a leg | m, s |
//!
//! Frames: site and rover. Sources: domain.md 5.5 (noise, gyro); papers.md R10, R126.

use nalgebra::{Translation3, UnitQuaternion};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use sightline_geometry::frames::{Pose, Vector3, attitude_from_roll_pitch_yaw};
use sightline_geometry::odometry_error::OdometryError;

use crate::ground::texture::mix;
use crate::rover::scene::{Leg, TrueDrive};
use crate::scenario::{FaultKind, HeadingJump, OdometryModel, RoverSettings, Scenario};

/// Seconds per hour.
const HOUR_S: f64 = 3600.0;

/// Jump of the estimated heading by an injected fault, clockwise from above, deg.
const FAULT_JUMP_DEG: f64 = 7.0;

/// The jumps of the estimated heading: those of the scenario, and those of injected faults.
fn heading_jumps(scenario: &Scenario) -> Vec<HeadingJump> {
    let injected = scenario.events.faults.iter().filter(|fault| fault.kind == FaultKind::PoseJump);
    let injected = injected.map(|fault| HeadingJump { stop: fault.from_stop, yaw_deg: FAULT_JUMP_DEG });
    scenario.rover.heading_jumps.iter().copied().chain(injected).collect()
}

/// The pose estimates of a scenario's drive, one for each stop.
pub fn believed(drive: &TrueDrive, scenario: &Scenario) -> Vec<Pose> {
    let believed = match scenario.rover.odometry {
        OdometryModel::Stated => {
            let true_poses: Vec<Pose> = drive.stops.iter().map(|stop| stop.site_from_rover).collect();
            estimates(&true_poses, &scenario.odometry_error, scenario.seed)
        }
        OdometryModel::WheelsAndImu => {
            wheels_and_imu(drive, &scenario.odometry_error, &scenario.rover, scenario.seed)
        }
    };
    let jumps = heading_jumps(scenario);
    if jumps.is_empty() {
        return believed;
    }
    with_heading_jumps(&believed, &jumps)
}

/// The estimates with their headings rotated from the given stops on.
pub(crate) fn with_heading_jumps(estimates: &[Pose], jumps: &[HeadingJump]) -> Vec<Pose> {
    let mut turned: Vec<Pose> = estimates.first().copied().into_iter().collect();
    for (number, pair) in estimates.windows(2).enumerate() {
        let yaw_deg: f64 =
            jumps.iter().filter(|jump| jump.stop as usize == number + 1).map(|jump| jump.yaw_deg).sum();
        let step = pair[0].inv_mul(&pair[1]) * attitude_from_roll_pitch_yaw(0.0, 0.0, yaw_deg.to_radians());
        turned.push(turned[turned.len() - 1] * step);
    }
    turned
}

/// The pose estimates of a drive through `true_poses`; the first is true.
pub fn estimates(true_poses: &[Pose], error: &OdometryError, seed: u64) -> Vec<Pose> {
    let mut random = Pcg64::new(u128::from(mix(seed ^ 0x0d0_3e72)), 0x0d03_e72b_b3c0_a700);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let mut estimates: Vec<Pose> = true_poses.first().copied().into_iter().collect();
    for pair in true_poses.windows(2) {
        let last = estimates[estimates.len() - 1];
        estimates.push(last * stated_step(&pair[0].inv_mul(&pair[1]), error, &mut normal));
    }
    estimates
}

/// One step's motion with the stated errors added.
fn stated_step(before_from_after: &Pose, error: &OdometryError, mut normal: impl FnMut() -> f64) -> Pose {
    let motion = before_from_after.translation.vector;
    let length_m = motion.norm();
    let [along, across, upright] = axes_of(&motion);
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
    Pose::from_parts(Translation3::from(seen), before_from_after.rotation * tilt)
}

/// The estimate at one stop of a drive whose legs are added one by one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Belief {
    /// The estimated pose.
    pub(crate) pose: Pose,
    /// Error of the attitude: roll, pitch, yaw, rad; used by `wheels_and_imu` only.
    pub(crate) attitude_error_rad: [f64; 3],
}

impl Belief {
    /// The estimate after a leg that ends at stop `number`; `poses` are the true ones at its ends.
    pub(crate) fn after(&self, leg: &Leg, poses: [&Pose; 2], number: usize, scenario: &Scenario) -> Self {
        let stop_seed = mix(scenario.seed ^ mix(number as u64 ^ 0xac71_0d03));
        let mut random = Pcg64::new(u128::from(stop_seed), 0xac71_0d03_0d03_72ad);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let error = &scenario.odometry_error;
        let mut after = match scenario.rover.odometry {
            OdometryModel::Stated => {
                let step = stated_step(&poses[0].inv_mul(poses[1]), error, &mut normal);
                Self { pose: self.pose * step, attitude_error_rad: [0.0; 3] }
            }
            OdometryModel::WheelsAndImu => {
                let mut of_drive =
                    Pcg64::new(u128::from(mix(scenario.seed ^ 0x13a0_0d03)), 0x13a0_0d03_5ee1_0e55);
                let sensors = Sensors::new(&scenario.rover, error, StandardNormal.sample(&mut of_drive));
                let [roll, pitch, yaw] = self.attitude_error_rad;
                let mut believed = AttitudeError { roll, pitch, yaw };
                let mut position = self.pose.translation.vector;
                let attitude = &poses[1].rotation;
                let pose = sensors.leg(leg, attitude, &mut believed, &mut position, &mut normal);
                Self { pose, attitude_error_rad: [believed.roll, believed.pitch, believed.yaw] }
            }
        };
        for jump in heading_jumps(scenario).iter().filter(|jump| jump.stop as usize == number) {
            after.pose *= attitude_from_roll_pitch_yaw(0.0, 0.0, jump.yaw_deg.to_radians());
        }
        after
    }
}

/// The unit vectors along a motion, horizontally across it, and across both; for no motion, along x.
fn axes_of(motion: &Vector3) -> [Vector3; 3] {
    let length_m = motion.norm();
    let along = if length_m > 0.0 { motion / length_m } else { Vector3::x() };
    let across = Vector3::z().cross(&along).normalize();
    [along, across, along.cross(&across)]
}

/// Error of the estimated attitude, rad.
#[derive(Clone, Copy, Default)]
struct AttitudeError {
    roll: f64,
    pitch: f64,
    yaw: f64,
}

impl AttitudeError {
    fn seen(self, attitude: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
        let (roll, pitch, yaw) = attitude.euler_angles();
        attitude_from_roll_pitch_yaw(roll + self.roll, pitch + self.pitch, yaw + self.yaw)
    }
}

/// The pose estimates from wheels, gyro and accelerometers.
pub(crate) fn wheels_and_imu(
    drive: &TrueDrive,
    error: &OdometryError,
    rover: &RoverSettings,
    seed: u64,
) -> Vec<Pose> {
    let mut random = Pcg64::new(u128::from(mix(seed ^ 0x13a0_0d03)), 0x13a0_0d03_5ee1_0e55);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let sensors = Sensors::new(rover, error, normal());
    let Some(first) = drive.stops.first() else { return Vec::new() };
    let mut believed = AttitudeError::default();
    let mut position = first.site_from_rover.translation.vector;
    let mut estimates = vec![first.site_from_rover];
    for (leg, stop) in drive.legs.iter().zip(drive.stops.iter().skip(1)) {
        let attitude = &stop.site_from_rover.rotation;
        estimates.push(sensors.leg(leg, attitude, &mut believed, &mut position, &mut normal));
    }
    estimates
}

/// The errors of wheels, gyro and accelerometers.
struct Sensors<'a> {
    error: &'a OdometryError,
    bias_rad_per_s: f64,
    /// Angle random walk of the gyro, rad/√s.
    walk_rad: f64,
    tilt_rad: f64,
}

impl<'a> Sensors<'a> {
    /// `bias` is the draw for the drive, in standard deviations.
    fn new(rover: &RoverSettings, error: &'a OdometryError, bias: f64) -> Self {
        Self {
            error,
            bias_rad_per_s: rover.gyro_bias_deg_per_hour.to_radians() / HOUR_S * bias,
            walk_rad: rover.gyro_walk_deg_per_root_hour.to_radians() / HOUR_S.sqrt(),
            tilt_rad: error.attitude_deg.to_radians(),
        }
    }

    /// The estimate after a leg that ends with a true attitude; attitude error and position are those before the leg.
    fn leg(
        &self,
        leg: &Leg,
        attitude: &UnitQuaternion<f64>,
        believed: &mut AttitudeError,
        position: &mut Vector3,
        mut normal: impl FnMut() -> f64,
    ) -> Pose {
        let error = self.error;
        let drift_rad =
            self.bias_rad_per_s * leg.duration_s + self.walk_rad * leg.duration_s.sqrt() * normal();
        let way = believed_way(leg, *believed, drift_rad);
        let [along, across, upright] = axes_of(&way);
        *position += way
            + along * (normal() * error.along_fraction * leg.driven_m)
            + across * (normal() * error.across_fraction * leg.driven_m)
            + upright * (normal() * error.across_fraction * leg.driven_m);
        *believed = AttitudeError {
            roll: self.tilt_rad * normal(),
            pitch: self.tilt_rad * normal(),
            yaw: believed.yaw + drift_rad,
        };
        Pose::from_parts(Translation3::from(*position), believed.seen(attitude))
    }
}

/// The wheels' path of a leg along the estimated attitude, site frame, m.
fn believed_way(leg: &Leg, at_start: AttitudeError, drift_rad: f64) -> Vector3 {
    let pieces = leg.wheels_m.len() as f64;
    let ways = leg.stands.windows(2).zip(&leg.wheels_m).enumerate().map(|(k, (ends, [x, y]))| {
        let [before, after] = [&ends[0], &ends[1]].map(|stand| stand.site_from_rover.rotation);
        let halfway =
            before * UnitQuaternion::from_scaled_axis(0.5 * (before.inverse() * after).scaled_axis());
        let yaw = at_start.yaw + drift_rad * (k as f64 + 0.5) / pieces;
        AttitudeError { yaw, ..at_start }.seen(&halfway) * Vector3::new(*x, *y, 0.0)
    });
    ways.sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_heading_jump_turns_the_way_that_follows_and_leaves_the_steps_lengths() {
        let drive: Vec<Pose> = (0..5).map(|stop| Pose::translation(f64::from(stop), 0.0, 0.0)).collect();
        let jumps = [HeadingJump { stop: 2, yaw_deg: 30.0 }];
        let turned = with_heading_jumps(&drive, &jumps);
        // The jump is at the stop: the path to it is unchanged, the next metre leads 30° to the right.
        for stop in 0..2 {
            assert!((turned[stop].translation.vector - drive[stop].translation.vector).norm() < 1e-12);
        }
        assert!((turned[2].translation.vector - drive[2].translation.vector).norm() < 1e-12);
        let way = turned[3].translation.vector - turned[2].translation.vector;
        let (sine, cosine) = 30.0_f64.to_radians().sin_cos();
        assert!((way - Vector3::new(cosine, sine, 0.0)).norm() < 1e-12, "{way}");
        assert!((turned[4].rotation.angle() - 30.0_f64.to_radians()).abs() < 1e-12);
    }
}
