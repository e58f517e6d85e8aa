//! Slip and the pose estimate: slip acts only where it should, and sensors have their stated errors.

use super::courses::{close, moves, yaw_deg};
use crate::camera::rig::Rig;
use crate::rover::course;
use crate::rover::odometry::wheels_and_imu;
use crate::rover::plan::planned;
use crate::rover::scene::{Scene, TrueDrive};
use crate::scenario::{DriveSettings, ForcedSlip, Move, RoverSettings, Soil};
use sightline_geometry::camera::Mast;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::frames::Point3;
use sightline_geometry::odometry_error::OdometryError;

/// An odometry error model without errors.
const NO_ERROR: OdometryError =
    OdometryError { along_fraction: 0.0, across_fraction: 0.0, attitude_deg: 0.0 };

/// A drive over a plane z = a x + 0.294 towards a centre on it.
fn on_plane(
    drive: &DriveSettings,
    rover: &RoverSettings,
    a: f64,
) -> sightline_geometry::error::Result<TrueDrive> {
    let [x, y] = crate::rover::plan::goal_m(drive);
    course::drive(&Scene {
        ground_z_m: &|x, _| a * x + 0.294,
        blocked_by_m: &|_, _| None,
        centre: Point3::new(x, y, a * x + 0.294),
        rig: &Rig::Mast(Mast::spirit()),
        drive,
        rover,
        cancel: Cancel::default(),
    })
}

#[test]
fn blind_moves_fall_short_uphill_and_an_approach_turns_its_wheels_more() {
    // 15° uphill along x (z points down) in loose sand: slip ratio 45 %.
    let slope = -15f64.to_radians().tan();
    let sand = RoverSettings { soil: Soil::LooseSand, slip_scale: 1.0, ..RoverSettings::default() };
    let blind = moves(8.0, 0.0, 0.0, &[Move::Forward { distance_m: 1.0, stops: 1 }]);
    let drive = on_plane(&blind, &sand, slope).unwrap();
    let way =
        drive.stops[1].site_from_rover.translation.vector - drive.stops[0].site_from_rover.translation.vector;
    close(way.norm(), 0.55, 1e-6);
    close(drive.legs[0].driven_m, 1.0, 1e-9);
    let exact = DriveSettings { start_distance_m: 8.0, end_distance_m: 7.0, ..DriveSettings::default() };
    let drive = on_plane(&exact, &sand, slope).unwrap();
    let way =
        drive.stops[1].site_from_rover.translation.vector - drive.stops[0].site_from_rover.translation.vector;
    close(drive.legs[0].driven_m * 0.55, way.norm(), 1e-6);
    let firm = on_plane(&exact, &RoverSettings::default(), slope).unwrap();
    assert_eq!(firm.stops, drive.stops);
    // With too much slip the rover does not arrive.
    let steep = on_plane(&exact, &sand, -25f64.to_radians().tan());
    assert!(steep.expect_err("too steep").to_string().contains("rover.slip_scale"));
}

#[test]
fn with_all_slipping_the_estimate_advances_and_the_truth_does_not() {
    let stuck = RoverSettings { stuck_from_stop: 2, ..RoverSettings::default() };
    let settings = DriveSettings { end_distance_m: 7.0, ..DriveSettings::default() };
    let drive = on_plane(&settings, &stuck, 0.0).unwrap();
    let still = RoverSettings { gyro_walk_deg_per_root_hour: 0.0, gyro_bias_deg_per_hour: 0.0, ..stuck };
    let believed = wheels_and_imu(&drive, &NO_ERROR, &still, 1);
    let truth: Vec<f64> = drive.stops.iter().map(|stop| stop.site_from_rover.translation.x).collect();
    let seen: Vec<f64> = believed.iter().map(|pose| pose.translation.x).collect();
    close(seen[1], truth[1], 1e-9);
    assert_eq!((truth[2], truth[3], truth[4]), (truth[1], truth[1], truth[1]));
    // Commanded: 10 · 0.9 less 10 · 0.81, and so on.
    close(seen[2] - seen[1], 0.9, 1e-9);
    close(seen[3] - seen[2], 0.81, 1e-9);
    // With a slip ratio of one half, the next motion brings the rover to its planned place.
    let half =
        RoverSettings { forced_slip: vec![ForcedSlip { stop: 2, slip: 0.5 }], ..RoverSettings::default() };
    let half = on_plane(&settings, &half, 0.0).unwrap();
    let free = on_plane(&settings, &RoverSettings::default(), 0.0).unwrap();
    let x = |drive: &TrueDrive, stop: usize| drive.stops[stop].site_from_rover.translation.x;
    close(x(&half, 2) - x(&half, 1), 0.45, 1e-9);
    close(x(&half, 3), x(&free, 3), 1e-9);
}

#[test]
fn a_stuck_rover_makes_no_blind_move_either() {
    let stuck = RoverSettings {
        stuck_from_stop: 1,
        gyro_walk_deg_per_root_hour: 0.0,
        gyro_bias_deg_per_hour: 0.0,
        ..RoverSettings::default()
    };
    let list = [
        Move::Forward { distance_m: 0.6, stops: 1 },
        Move::Turn { angle_deg: 30.0, stops: 1 },
        Move::FaceTarget,
    ];
    let drive = on_plane(&moves(8.0, 20.0, 0.0, &list), &stuck, 0.0).unwrap();
    let believed = wheels_and_imu(&drive, &NO_ERROR, &stuck, 3);
    for (stop, advance_m) in [(1, 0.6), (2, 0.6), (3, 0.6)] {
        assert_eq!(drive.stops[stop], drive.stops[0]);
        close(believed[stop].translation.x - believed[0].translation.x, advance_m, 1e-9);
        // The gyro measures that the rover did not turn.
        close(yaw_deg(&believed[stop]), 0.0, 1e-9);
    }
    assert!(drive.legs.iter().all(|leg| leg.duration_s > 5.0));
}

#[test]
fn on_a_slope_the_estimate_runs_ahead_by_the_slip() {
    let sand = RoverSettings {
        soil: Soil::LooseSand,
        slip_scale: 1.0,
        gyro_walk_deg_per_root_hour: 0.0,
        gyro_bias_deg_per_hour: 0.0,
        ..RoverSettings::default()
    };
    let settings = DriveSettings { end_distance_m: 8.5, ..DriveSettings::default() };
    // Uphill 10° keeps 80 % of the wheels' advance; downhill 2 % − 18 %: 116 %.
    for (up_deg, kept) in [(10.0f64, 0.80), (-10.0, 1.16)] {
        let drive = on_plane(&settings, &sand, -up_deg.to_radians().tan()).unwrap();
        let believed = wheels_and_imu(&drive, &NO_ERROR, &sand, 1);
        let truth = drive.stops[2].site_from_rover.translation.vector
            - drive.stops[0].site_from_rover.translation.vector;
        let seen = believed[2].translation.vector - believed[0].translation.vector;
        close(truth.norm() / seen.norm(), kept, 1e-6);
        close(truth.normalize().dot(&seen.normalize()), 1.0, 1e-9);
    }
}

#[test]
fn without_noise_and_slip_wheels_and_imu_find_the_truth() {
    let list = [
        Move::Arc { radius_m: 3.0, angle_deg: 40.0, stops: 2 },
        Move::Crab { angle_deg: -20.0, stops: 2 },
        Move::Approach { to_distance_m: 4.0, step_fraction: 0.2 },
    ];
    let quiet = RoverSettings {
        gyro_walk_deg_per_root_hour: 0.0,
        gyro_bias_deg_per_hour: 0.0,
        ..RoverSettings::default()
    };
    let drive = planned(&moves(6.0, 10.0, 20.0, &list)).unwrap();
    for (stop, pose) in drive.stops.iter().zip(wheels_and_imu(&drive, &NO_ERROR, &quiet, 5)) {
        let off = stop.site_from_rover.inv_mul(&pose);
        assert!(off.translation.vector.norm() < 1e-9 && off.rotation.angle() < 1e-7, "{off}");
    }
}

#[test]
fn wheels_and_imu_have_the_errors_of_their_sensors() {
    let list = [Move::Forward { distance_m: 3.0, stops: 1 }];
    let drive = planned(&moves(8.0, 0.0, 0.0, &list)).unwrap();
    let error = OdometryError { along_fraction: 0.01, across_fraction: 0.005, attitude_deg: 0.1 };
    let rover = RoverSettings { gyro_bias_deg_per_hour: 0.0, ..RoverSettings::default() };
    let (mut along, mut across, mut yaw, mut pitch) = (0.0, 0.0, 0.0, 0.0);
    const SEEDS: u64 = 4000;
    for seed in 0..SEEDS {
        let off = drive.stops[1].site_from_rover.inv_mul(&wheels_and_imu(&drive, &error, &rover, seed)[1]);
        let (_, tilt, turn) = off.rotation.euler_angles();
        along += off.translation.x.powi(2);
        across += off.translation.z.powi(2);
        yaw += turn.to_degrees().powi(2);
        pitch += tilt.to_degrees().powi(2);
    }
    let rms = |sum: f64| (sum / SEEDS as f64).sqrt();
    // 4000 draws determine a standard deviation to 1.1 %; three times this is allowed.
    close(rms(along) / 0.03, 1.0, 0.034);
    close(rms(across) / 0.015, 1.0, 0.034);
    // 80 s of driving: 0.1°/√h · sqrt(80/3600).
    close(rms(yaw) / (0.1 * (80f64 / 3600.0).sqrt()), 1.0, 0.034);
    close(rms(pitch) / 0.1, 1.0, 0.034);
}

#[test]
fn the_gyros_bias_turns_the_yaw_for_as_long_as_the_rover_drives() {
    let list = [Move::Forward { distance_m: 1.5, stops: 1 }, Move::Forward { distance_m: -1.5, stops: 1 }];
    let drive = planned(&moves(8.0, 0.0, 0.0, &list)).unwrap();
    let rover = RoverSettings { gyro_walk_deg_per_root_hour: 0.0, ..RoverSettings::default() };
    let mut squares = 0.0;
    for seed in 0..4000 {
        let believed = wheels_and_imu(&drive, &NO_ERROR, &rover, seed);
        let yaws = [yaw_deg(&believed[1]), yaw_deg(&believed[2])];
        close(yaws[1], 2.0 * yaws[0], 1e-9);
        squares += yaws[1].powi(2);
    }
    close((squares / 4000.0).sqrt() / (80.0 / 3600.0), 1.0, 0.034);
}
