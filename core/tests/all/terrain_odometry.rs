//! Planned drives whose poses are corrected by vision: on a steep slope, and with wheels that spin in place.

use std::path::Path;

use sightline_geometry::cancel::Cancel;
use sightline_geometry::frames::Pose;
use sightline_recordings::{Traverse, create_simulated};
use sightline_rover::pipeline::Stops;
use sightline_rover::visual_odometry::{OdometryMode, OdometryPreset};
use sightline_world::scenario::Move;
use sightline_world::{Scenario, library};

/// A planned drive of the library, with small images.
fn planned(name: &str, change: impl FnOnce(&mut Scenario), folder: &Path) -> Traverse {
    let mut scenario = Scenario { seed: 5311, ..library::scenario(name).unwrap() };
    (scenario.camera.image_size, scenario.camera.samples_per_axis) = (512, 2);
    change(&mut scenario);
    create_simulated(&scenario, folder).unwrap()
}

fn with(planned: &Traverse, mode: OdometryMode) -> Traverse {
    planned.with_odometry(mode, OdometryPreset::Sightline, Cancel::default()).unwrap()
}

/// Distance of the estimated position from the true one at the last stop, m.
fn position_error_m(drive: &Traverse) -> f64 {
    let last = drive.stop_count() - 1;
    let apart: Pose = drive.true_site_from_rover(last).unwrap().inverse() * drive.site_from_rover(last);
    apart.translation.vector.norm()
}

#[test]
fn odometry_alone_keeps_a_steep_drive_near_the_truth() {
    let folder = tempfile::tempdir().unwrap();
    let shorten = |scenario: &mut Scenario| scenario.drive.end_distance_m = 6.6;
    let planned = planned("slope-steep", shorten, folder.path());
    let index = std::fs::read(folder.path().join("traverse.toml")).unwrap();
    let [off, full] = [OdometryMode::Off, OdometryMode::Full].map(|mode| with(&planned, mode));
    println!(
        "{} m off, {} m full, {} stops",
        position_error_m(&off),
        position_error_m(&full),
        full.stop_count()
    );
    assert!(position_error_m(&off) > 0.2 && position_error_m(&full) < 0.03);
    assert_eq!(off.index(), planned.index());
    for stop in 1..full.stop_count() {
        let measured = full.measured_motion(stop).unwrap();
        assert_eq!(measured.corrects, measured.update.accepted);
        // A record normalises its quaternion again, so the last bits may differ.
        let after = measured.pose_after(&full.site_from_rover(stop - 1));
        let apart: Pose = full.site_from_rover(stop).inverse() * after;
        assert!(apart.rotation.angle() < 1e-12 && apart.translation.vector.norm() < 1e-12);
    }
    // The folder is unchanged.
    assert_eq!(std::fs::read(folder.path().join("traverse.toml")).unwrap(), index);
}

#[test]
fn the_slip_check_ends_a_planned_drive_of_a_stuck_rover() {
    let folder = tempfile::tempdir().unwrap();
    let shorten = |scenario: &mut Scenario| {
        scenario.drive.moves = vec![Move::Forward { distance_m: 2.8, stops: 7 }];
    };
    let planned = planned("stuck", shorten, folder.path());
    let checked = with(&planned, OdometryMode::SlipCheck);
    assert_eq!((planned.stop_count(), checked.stop_count()), (8, 6));
    let slip = checked.measured_motion(5).unwrap().update.slip.unwrap().along;
    assert!((slip - 1.0).abs() < 0.05, "{slip}");
    // The poses remain those of the wheels; full odometry continues, and detects that the rover did not move.
    assert!((0..6).all(|stop| checked.site_from_rover(stop) == planned.site_from_rover(stop)));
    let full = with(&planned, OdometryMode::Full);
    assert!(
        full.stop_count() == 8 && position_error_m(&full) < 0.05 && position_error_m(&planned) > 0.4,
        "{}",
        position_error_m(&full)
    );
}
