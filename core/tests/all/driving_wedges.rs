//! A drive on a hazard map from the mast's navcams: two wedges show the way around a rock (R101, R102).

use std::path::Path;

use sightline_geometry::camera::CameraName;
use sightline_geometry::cancel::Cancel;
use sightline_recordings::DrivenTraverse;
use sightline_rover::driving::{DriveCommand, GoalRule, NavigatorKind, StopReason};
use sightline_rover::hazards::CellBasis;
use sightline_rover::pipeline::Stops;
use sightline_session::targeted_drive::TargetedDrive;
use sightline_track::settings::Settings;
use sightline_track::target::Designation;
use sightline_world::{Scenario, choose_targets, library};

fn scenario() -> Scenario {
    let mut scenario = Scenario { seed: 3012, ..library::scenario("navcam-wedges").unwrap() };
    (scenario.camera.image_size, scenario.camera.samples_per_axis) = (256, 2);
    scenario.targets.window_px = 9;
    (scenario.drive.start_distance_m, scenario.drive.end_distance_m) = (8.0, 2.0);
    // The mast has a pointing error.
    scenario.drive.pointing_error_deg = 0.05;
    // One rock on level ground blocks the path; no other does.
    (scenario.rocks.area_fraction, scenario.rocks.smallest_m) = (0.01, 0.1);
    scenario.terrain.slope_deg = 0.0;
    scenario
}

fn name(text: &str) -> CameraName {
    text.parse().unwrap()
}

/// The drive of a scenario on the map of these pairs, to its first target.
fn begin(scenario: &Scenario, hazard_cameras: Vec<CameraName>, folder: &Path) -> TargetedDrive {
    let world = DrivenTraverse::begin(scenario, folder, Cancel::default()).unwrap();
    let traverse = world.traverse();
    let pixel = choose_targets(traverse.world().unwrap(), scenario, traverse.index())[0];
    // The small images are for the hazard map; tracking has no influence on the path.
    let command = DriveCommand {
        navigator: NavigatorKind::Gestalt,
        goal: GoalRule::Fixed,
        stops_max: 60,
        hazard_cameras,
        ..DriveCommand::default()
    };
    let (designation, settings) = (Designation::new(0, pixel), Settings::default());
    TargetedDrive::begin(world, designation, command, &settings, Cancel::default()).unwrap()
}

#[test]
fn two_wedges_of_the_navcams_lead_round_a_rock() {
    let folder = tempfile::tempdir().unwrap();
    let mut drive = begin(&scenario(), ["left_wedge", "right_wedge"].map(name).to_vec(), folder.path());
    while drive.advance(&Settings::default(), Cancel::default()).unwrap() {}
    let summary = drive.summary();
    println!("{summary:?}");
    assert_eq!((summary.reason, summary.collisions), (Some(StopReason::Arrived), 0));
    assert!(drive.cycles.iter().any(|cycle| cycle.choice.as_ref().is_some_and(|c| c.vetoed_count() > 0)));

    // Both pairs look in the direction of the scenario, also with the pointing error.
    let traverse = drive.world.traverse();
    let stop = &traverse.index().stops[3];
    for (camera, azimuth_deg) in stop.cameras.iter().zip([-20.0, 20.0_f64]) {
        let told = camera.mast_angles.unwrap();
        assert!((told.azimuth_rad.to_degrees() - azimuth_deg).abs() < 1e-9, "{told:?}");
        assert!((told.elevation_rad.to_degrees() + 25.0).abs() < 1e-9, "{told:?}");
        let axis = traverse.further_pair(3, camera.name).unwrap().left.model.axis();
        assert!((axis.y.atan2(axis.x).to_degrees() - azimuth_deg).abs() < 3.0, "{axis}");
        let truth = camera.true_left_camera.as_ref().unwrap().model.axis();
        let off_deg = axis.angle(&truth).to_degrees();
        assert!(off_deg > 0.0 && off_deg < 0.3, "{off_deg}");
    }
}

#[test]
fn two_wedges_cover_both_sides_but_not_below_the_rover() {
    let folder = tempfile::tempdir().unwrap();
    let sides = |word: &str, hazard_cameras: Vec<CameraName>| {
        let mut drive = begin(&scenario(), hazard_cameras, &folder.path().join(word));
        let (command, pair) = (drive.command.clone(), [&drive.steps[0].trace, &drive.steps[0].trace]);
        let mapped = drive.maps.at(drive.world.traverse(), &command, pair, Cancel::default()).unwrap();
        let hazards = mapped.expect("the first stop has a map");
        let map = &hazards.map;
        let measured = |right_m: f64| {
            let ahead_m = (10..40).map(|k| 0.1 * f64::from(k));
            let is_known = |x_m: &f64| {
                map.cell_at([*x_m, right_m * x_m]).is_some_and(|cell| cell.basis == CellBasis::Measured)
            };
            ahead_m.filter(is_known).count()
        };
        let below = map.cell_at([0.0, 0.0]).unwrap().basis;
        (measured(-0.6), measured(0.6), below)
    };
    let both = sides("both", ["left_wedge", "right_wedge"].map(name).to_vec());
    let one = sides("one", vec![name("left_wedge")]);
    println!("{both:?} {one:?}");
    assert!(both.0 > 10 && both.1 > 10, "{both:?}");
    assert!(one.0 > 10 && one.1 == 0, "{one:?}");
    assert_eq!(both.2, CellBasis::Assumed);
}
