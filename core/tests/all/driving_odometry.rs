//! Drives whose poses are corrected by visual odometry: on a slope with wheel slip, and with wheels that spin in place.

use std::path::Path;

use sightline_geometry::cancel::Cancel;
use sightline_geometry::frames::Pose;
use sightline_recordings::{DrivenTraverse, Traverse};
use sightline_rover::driving::{DriveCommand, Motion, OdometryPair, StopReason, TrackedStops};
use sightline_rover::visual_odometry::OdometryMode;
use sightline_session::metrics::metrics;
use sightline_session::step::RunStep;
use sightline_session::targeted_drive::TargetedDrive;
use sightline_track::settings::Settings;
use sightline_track::target::Designation;
use sightline_world::scenario::{ClearPath, ForcedSlip, OdometryModel};
use sightline_world::target_truth::TruthSource;
use sightline_world::{Scenario, choose_targets, library};

/// A slope on which the wheels lose a third of the distance and the rover slides sideways.
fn slope() -> Scenario {
    let mut scenario = Scenario { seed: 5301, ..library::scenario("approach-10").unwrap() };
    (scenario.camera.image_size, scenario.camera.samples_per_axis) = (512, 2);
    scenario.targets.window_px = 11;
    (scenario.terrain.slope_deg, scenario.terrain.slope_azimuth_deg) = (16.0, 60.0);
    (scenario.rover.slip_scale, scenario.rover.slip_spread) = (1.0, 0.2);
    scenario.rover.odometry = OdometryModel::WheelsAndImu;
    scenario.rocks.clear_path = Some(ClearPath::default());
    scenario
}

fn drive(scenario: &Scenario, command: DriveCommand, stops: usize, folder: &Path) -> TargetedDrive {
    let world = DrivenTraverse::begin(scenario, folder, Cancel::default()).unwrap();
    let traverse = world.traverse();
    let pixel = choose_targets(traverse.world().unwrap(), scenario, traverse.index())[0];
    let (settings, cancel) = (Settings::default(), Cancel::default());
    let mut drive =
        TargetedDrive::begin(world, Designation::new(0, pixel), command, &settings, cancel).unwrap();
    while drive.steps.len() < stops && drive.advance(&settings, cancel).unwrap() {}
    drive
}

fn with(odometry: OdometryMode) -> DriveCommand {
    DriveCommand { odometry, tilt_max_deg: 40.0, ..DriveCommand::default() }
}

/// Distance of the estimated pose from the true one at the last stop, m, and the angle between them, deg.
fn pose_error(traverse: &Traverse) -> (f64, f64) {
    let last = traverse.stop_count() - 1;
    let truth = TruthSource::true_site_from_rover(traverse, last).unwrap();
    let apart: Pose = truth.inverse() * traverse.site_from_rover(last);
    (apart.translation.vector.norm(), apart.rotation.angle().to_degrees())
}

#[test]
fn visual_odometry_keeps_the_pose_on_a_slope() {
    let folder = tempfile::tempdir().unwrap();
    let [full, check, none] = [OdometryMode::Full, OdometryMode::SlipCheck, OdometryMode::Off]
        .map(|mode| drive(&slope(), with(mode), 6, &folder.path().join(format!("{mode:?}"))));
    let [seen, checked, blind] = [&full, &check, &none].map(|drive| pose_error(drive.world.traverse()));
    println!("{seen:?} {checked:?} {blind:?}");
    assert!(seen.0 < 0.02 && seen.1 < 0.2, "{seen:?}");
    assert!(blind.0 > 0.2 && checked.0 > 0.2, "{blind:?} {checked:?}");
    for step in &full.steps[1..] {
        let measured = step.odometry.as_ref().unwrap();
        assert!(measured.corrects && measured.update.accepted, "{:?}", measured.update.refusal());
        // The covariance of the prediction is that of vision, an order of magnitude below that of the wheels.
        let sigma_m = step.prediction().unwrap().covariance_in_rover.symmetric_eigenvalues().max().sqrt();
        assert!(sigma_m < 0.1, "{sigma_m}");
    }
    for (step, blind) in check.steps[1..].iter().zip(&none.steps[1..]) {
        let measured = step.odometry.as_ref().unwrap();
        let slip = measured.update.slip.unwrap();
        assert!(!measured.corrects && slip.along.hypot(slip.aside) > 0.05, "{slip:?}");
        assert!(blind.odometry.is_none());
    }
    // No step is longer than visual odometry can follow, and the next step compensates its slip.
    let reports = full.cycles.iter().filter_map(|cycle| cycle.report);
    assert!(reports.clone().all(|report| report.wheels_m < 1.51));
}

#[test]
fn odometry_drives_resume_and_replay_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let whole = drive(&slope(), with(OdometryMode::Full), 4, &folder.path().join("whole"));
    let opened = Traverse::open(&folder.path().join("whole")).unwrap();
    for stop in 0..opened.stop_count() {
        assert_eq!(opened.site_from_rover(stop), whole.world.traverse().site_from_rover(stop));
        assert_eq!(opened.index().stops[stop].odometry, whole.world.state()[stop].odometry);
    }
    let resumed = DrivenTraverse::resume(&folder.path().join("whole")).unwrap();
    assert_eq!(resumed.state(), whole.world.state());
    let again = drive(&slope(), with(OdometryMode::Full), 4, &folder.path().join("again"));
    assert_eq!(again.world.state(), whole.world.state());
    // The corners are not stored; they are returned with the same update when it is computed again.
    let kept = opened.index().stops[2].odometry.as_ref().unwrap();
    let mut computed = kept.again(&opened, 2, Cancel::default()).unwrap();
    assert!(computed.table.len() > 50);
    computed.table.clear();
    assert_eq!(computed, kept.update);
}

#[test]
fn spinning_wheels_end_the_drive_with_a_reason() {
    let mut scenario = slope();
    (scenario.terrain.slope_deg, scenario.rover.slip_scale) = (2.0, 0.0);
    scenario.rover.forced_slip = vec![ForcedSlip { stop: 2, slip: 1.0 }, ForcedSlip { stop: 3, slip: 1.0 }];
    let folder = tempfile::tempdir().unwrap();
    let checked = drive(&scenario, with(OdometryMode::SlipCheck), 6, &folder.path().join("checked"));
    let ending = checked.ending().unwrap();
    assert_eq!((ending.reason, checked.steps.len()), (StopReason::Slip, 3));
    assert!((ending.value.unwrap() - 1.0).abs() < 0.03 && ending.limit == Some(0.9), "{ending:?}");
    let blind = drive(&scenario, with(OdometryMode::Off), 4, &folder.path().join("blind"));
    assert!(blind.ending().is_none());
}

#[test]
fn odometry_runs_alone_at_the_stops_between_two_steps() {
    let mut scenario = slope();
    (scenario.terrain.slope_deg, scenario.rover.slip_spread) = (4.0, 0.0);
    let folder = tempfile::tempdir().unwrap();
    let driven = |name: &str, command: DriveCommand| drive(&scenario, command, 8, &folder.path().join(name));
    let every = DriveCommand { standoff_m: 3.0, ..with(OdometryMode::Full) };
    let by_distance = DriveCommand { tracked_stops: TrackedStops::ByDistance, ..every.clone() };
    let own = DriveCommand { odometry_pair: OdometryPair::Own, ..by_distance.clone() };
    let [every, shared, own] = [("every", every), ("shared", by_distance), ("own", own)]
        .map(|(name, command)| driven(name, command));
    assert!(every.steps.iter().all(|step| !step.is_odometry_alone()));
    for drive in [&shared, &own] {
        let stops = drive.world.state();
        let mut left_m = 0.0;
        for (step, cycle) in drive.steps[1..].iter().zip(&drive.cycles) {
            let place = format!("stop {}", step.step);
            assert_eq!(step.is_odometry_alone(), cycle.odometry_alone, "{place}");
            assert_eq!(step.is_odometry_alone(), stops[step.step].odometry_alone, "{place}");
            assert!(step.odometry.as_ref().unwrap().update.accepted, "{place}");
            let Some(Motion::Arc { length_m, .. }) = cycle.motion else { panic!("{place} follows no arc") };
            // The two parts of a step have the same length, apart from the effect of slip.
            if step.is_odometry_alone() {
                left_m = length_m;
                assert!(length_m < 0.75 / 0.9 && step.verdict().is_none() && step.capture().is_none());
                assert!(cycle.flight.locate_s == 25.0 && step.row().reason.unwrap().contains("alone"));
            } else if left_m > 0.0 {
                assert!((length_m / left_m - 1.0).abs() < 0.2, "{place}: {length_m} m after {left_m} m");
                left_m = 0.0;
            }
            // The range alone has a 1σ of 5 cm at 8 m.
            assert!(step.truth.as_ref().unwrap().err_m < 0.1, "{place}");
        }
        let alone: Vec<usize> =
            drive.steps.iter().filter(|step| step.is_odometry_alone()).map(|step| step.step).collect();
        // Steps of 1.0, 0.9 and 0.8 m have two parts each.
        assert_eq!(alone, [1, 3, 5]);
        for cycle in drive.cycles.iter().filter(|cycle| alone.contains(&cycle.step)) {
            assert_eq!(cycle.flight.locate_s, 0.0);
        }
        assert_eq!(
            metrics(&drive.steps).excluded.iter().find(|one| one.why.contains("alone")).unwrap().steps,
            alone
        );
        // Serialisation preserves the kind of the step.
        let text = serde_json::to_string(drive.steps[1].as_ref()).unwrap();
        assert!(serde_json::from_str::<RunStep>(&text).unwrap().is_odometry_alone());
    }
    let sum = |drive: &TargetedDrive| drive.cycles.iter().map(|cycle| cycle.flight.locate_s).sum::<f64>();
    assert!(sum(&shared) < sum(&every));
    // The tracker's pair is not taken at stops at which odometry uses a pair of its own.
    let taken = |drive: &TargetedDrive, step: usize| {
        let traverse = drive.world.traverse();
        traverse.folder().join(&traverse.index().stops[step].left.image).exists()
    };
    assert!(taken(&shared, 1) && !taken(&own, 1) && taken(&own, 2));
}
