//! Closed-loop drives: the rover goes to a target on its own estimates.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use sightline_geometry::camera::CameraName;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::Error;
use sightline_recordings::{DrivenTraverse, create_simulated};
use sightline_rover::driving::executive::{self, CycleInput};
use sightline_rover::driving::{
    ArcNavigator, ArrivalAction, Cycle, DriveCommand, GoalRule, OdometryPair, StopReason,
};
use sightline_rover::pipeline;
use sightline_session::replayed_drive::ReplayedDrive;
use sightline_session::targeted_drive::TargetedDrive;
use sightline_track::settings::Settings;
use sightline_track::target::Designation;
use sightline_track::trace::StepTrace;
use sightline_world::rover::driven::DrivenStop;
use sightline_world::scenario::{PlacedRock, RockShape};
use sightline_world::{Scenario, choose_targets, library};

fn scenario() -> Scenario {
    let mut scenario = Scenario { seed: 4402, ..library::scenario("approach-10").unwrap() };
    (scenario.camera.image_size, scenario.camera.samples_per_axis) = (512, 2);
    scenario.targets.window_px = 11;
    scenario.terrain.slope_deg = 3.0;
    (scenario.rover.slip_scale, scenario.rover.slip_spread) = (1.0, 0.2);
    scenario.drive.pointing_error_deg = 0.05;
    scenario
}

pub(crate) fn command() -> DriveCommand {
    DriveCommand { standoff_m: 2.0, tolerance_m: 0.01, ..DriveCommand::default() }
}

fn world(folder: &Path) -> (DrivenTraverse, Designation) {
    let scenario = scenario();
    let world = DrivenTraverse::begin(&scenario, folder, Cancel::default()).unwrap();
    let traverse = world.traverse();
    let pixel = choose_targets(traverse.world().unwrap(), &scenario, traverse.index())[0];
    (world, Designation::new(0, pixel))
}

pub(crate) fn begin(folder: &Path) -> TargetedDrive {
    let (world, designation) = world(folder);
    TargetedDrive::begin(world, designation, command(), &Settings::default(), Cancel::default()).unwrap()
}

fn drive(folder: &Path) -> TargetedDrive {
    let mut drive = begin(folder);
    while drive.advance(&Settings::default(), Cancel::default()).unwrap() {}
    drive
}

#[test]
fn a_drive_arrives_within_centimetres_of_the_true_target() {
    let folder = tempfile::tempdir().unwrap();
    let drive = drive(&folder.path().join("drive"));
    let summary = drive.summary();
    println!("{summary:?}");
    assert_eq!((summary.arrived, summary.reason), (true, Some(StopReason::Arrived)));
    assert_eq!((summary.tracked, summary.collisions), (Some(true), 0));
    assert!(summary.target_error_m.unwrap() < 0.02 && summary.goal_error_m.unwrap() < 0.05);
    // The mast follows the target: it appears near the image centre at every stop.
    for step in &drive.steps[1..] {
        let centre = step.point_mast.left.centre_pixel();
        let off_px = step.located().unwrap().left_pixel.unwrap().distance(centre);
        assert!(off_px < 60.0, "stop {}: {off_px} px", step.step);
        let metered_px = drive.world.state()[step.step].metered_px.unwrap();
        // The pointing is centred on the prediction by wheels, which vision then corrects by a few pixels.
        assert!(metered_px.distance(step.point_mast.predicted_left.unwrap()) < 8.0);
    }
    // The covariance of the estimate includes the known error of the mast.
    for step in &drive.steps {
        let error = step.point_mast.error_covariance_in_rover.unwrap();
        let sigma_m = error.symmetric_eigenvalues().max().sqrt();
        assert!((sigma_m / (0.05f64.to_radians() * step.range_m()) - 1.0).abs() < 0.15, "{sigma_m}");
        let located = step.located().unwrap().covariance_in_rover.unwrap();
        let added = step.update.target.covariance_in_rover - located;
        assert!((added - error).norm() < 0.1 * error.norm(), "stop {}", step.step);
    }
    // No step is longer than a tenth of the distance to the target, apart from the compensation of the previous step's slip.
    for (step, cycle) in drive.steps.iter().zip(&drive.cycles) {
        let distance_m = step.update.target.last_distance_m;
        assert!(cycle.report.is_none_or(|report| report.wheels_m < 0.115 * distance_m));
    }
}

#[test]
fn a_look_after_arrival_centres_the_target_at_one_more_stop() {
    let folder = tempfile::tempdir().unwrap();
    let (world, designation) = world(&folder.path().join("drive"));
    let command =
        DriveCommand { standoff_m: 7.0, on_arrival: vec![ArrivalAction::Look; 2], ..DriveCommand::default() };
    let settings = Settings::default();
    let mut drive = TargetedDrive::begin(world, designation, command, &settings, Cancel::default()).unwrap();
    while drive.advance(&settings, Cancel::default()).unwrap() {}
    assert_eq!(drive.summary().reason, Some(StopReason::Arrived));
    let count = drive.steps.len();
    let decided: Vec<u32> = drive.cycles.iter().map(|cycle| cycle.arrival_actions).collect();
    assert_eq!(decided[count - 4..], [0, 1, 2, 2]);
    let state = drive.world.state();
    for (k, arrived) in [(count - 2, &state[count - 3]), (count - 1, &state[count - 2])] {
        assert!(drive.cycles[k - 1].motion.is_none() && drive.cycles[k - 1].ending.is_none());
        assert_eq!(state[k].true_site_from_rover, arrived.true_site_from_rover);
        assert_eq!(state[k].site_from_rover, arrived.site_from_rover);
        // The mast points at the target as located at the previous stop.
        let step = &drive.steps[k];
        let predicted = step.point_mast.predicted_left.unwrap();
        assert!(predicted.distance(step.point_mast.left.centre_pixel()) < 1e-6, "{predicted:?}");
        assert_ne!(state[k].mast_angles, arrived.mast_angles);
    }
}

#[test]
fn threads_and_ground_truth_do_not_change_a_drive() {
    let folder = tempfile::tempdir().unwrap();
    let judged = drive(&folder.path().join("judged"));
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let (world, steps, cycles) = one_thread.install(|| drive_blind(&folder.path().join("blind")));
    assert!(steps.len() > 10);
    assert_eq!(cycles, judged.cycles);
    assert_eq!(world.state(), judged.world.state());
    assert_eq!(steps.len(), judged.steps.len());
    // Only the designation may have a warning that needs the truth.
    for (blind, judged) in steps.iter().zip(&judged.steps).skip(1) {
        assert_eq!(*blind, judged.trace);
    }
    let last = steps.len() - 1;
    let images = [&world, &judged.world].map(|world| world.traverse().capture(last).unwrap());
    assert_eq!(images[0], images[1]);
}

/// A complete drive without any comparison with the truth.
fn drive_blind(folder: &Path) -> (DrivenTraverse, Vec<StepTrace>, Vec<Cycle>) {
    let (mut world, designation) = world(folder);
    let settings = Settings::default();
    let mut steps = vec![pipeline::designate(world.traverse(), designation, &settings).unwrap()];
    let mut cycles = Vec::new();
    loop {
        let input = CycleInput {
            command: &command(),
            navigator: &ArcNavigator::default(),
            first: &steps[0],
            last: &steps[steps.len() - 1],
            before: cycles.last(),
            hazards: None,
        };
        let (cycle, step) = executive::advance(&mut world, &input, &settings, Cancel::default()).unwrap();
        cycles.push(cycle);
        match step {
            Some(step) => steps.push(step),
            None => return (world, steps, cycles),
        }
    }
}

#[test]
fn replay_compares_commands_with_the_recorded_motion() {
    let folder = tempfile::tempdir().unwrap();
    let planned = create_simulated(&scenario(), folder.path()).unwrap();
    let pixel = choose_targets(planned.world().unwrap(), &scenario(), planned.index())[0];
    let designation = Designation::new(0, pixel);
    let settings = Settings::default();
    let mut drive =
        ReplayedDrive::begin(&planned, designation, command(), &settings, Cancel::default()).unwrap();
    while drive.advance(&settings, Cancel::default()).unwrap() {}
    let summary = drive.summary();
    println!("{summary:?}");
    assert_eq!((drive.steps.len(), drive.cycles.len()), (summary.stops, summary.stops));
    // The planned approach has steps of a tenth of the distance straight ahead, like the command; the target is beside its
    // centre, so that the commanded path is curved.
    let [median_m, max_m] = summary.apart_m.unwrap();
    assert!(median_m < 0.05 && max_m < 0.3, "{summary:?}");
    assert!(summary.holds_target && summary.mast_apart_deg.unwrap() < 15.0, "{summary:?}");
    for cycle in &drive.cycles[..drive.cycles.len() - 1] {
        let answer = drive.answer_to(cycle).unwrap();
        let [then, now] = [cycle.step, cycle.step + 1].map(|step| planned.site_from_rover(step));
        let moved = then.inv_mul(&now).translation.vector;
        assert!((answer.recorded_m[0] - moved.x).hypot(answer.recorded_m[1] - moved.y) < 1e-12);
    }
}

#[test]
fn a_drive_branched_at_a_stop_leaves_the_trunk_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let mut trunk = begin(&folder.path().join("trunk"));
    let settings = Settings::default();
    for _ in 0..3 {
        assert!(trunk.advance(&settings, Cancel::default()).unwrap());
    }
    let at_stop_2 = trunk.world.state()[..3].to_vec();
    let kept = (trunk.world.state().to_vec(), trunk.steps.clone(), trunk.cycles.clone());
    let mut branch = begin(&folder.path().join("branch"));
    branch.world.restore(at_stop_2).unwrap();
    (branch.steps, branch.cycles) = (trunk.steps[..3].to_vec(), trunk.cycles[..2].to_vec());
    branch.command.step_fraction = 0.05;
    assert!(branch.advance(&settings, Cancel::default()).unwrap());
    assert_ne!(branch.world.state()[3], trunk.world.state()[3]);
    assert_eq!((trunk.world.state().to_vec(), trunk.steps.clone(), trunk.cycles.clone()), kept);
    // With the trunk's command the branch equals the trunk.
    branch.world.restore(trunk.world.state()[..3].to_vec()).unwrap();
    (branch.steps, branch.cycles) = (trunk.steps[..3].to_vec(), trunk.cycles[..2].to_vec());
    branch.command = command();
    assert!(branch.advance(&settings, Cancel::default()).unwrap());
    assert_eq!(branch.world.state(), trunk.world.state());
    assert_eq!(branch.steps[3], trunk.steps[3]);
}

#[test]
fn a_cancelled_cycle_leaves_the_drive_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let mut drive = begin(&folder.path().join("drive"));
    let flag = AtomicBool::new(true);
    let outcome = drive.advance(&Settings::default(), Cancel::from(&flag));
    assert!(matches!(outcome, Err(Error::Cancelled)));
    assert_eq!((drive.steps.len(), drive.cycles.len(), drive.world.state().len()), (1, 0, 1));
    assert!(drive.advance(&Settings::default(), Cancel::default()).unwrap());
}

#[test]
fn a_command_that_makes_no_sense_is_refused_in_one_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |name: &str, change: fn(&mut DriveCommand)| {
        let (world, designation) = world(&folder.path().join(name));
        let mut command = command();
        change(&mut command);
        let settings = Settings::default();
        let begun = TargetedDrive::begin(world, designation, command, &settings, Cancel::default());
        begun.err().unwrap().to_string()
    };
    assert!(refused("far", |c| c.standoff_m = 20.0).contains("standoff_m: 20 m is not less than"));
    let outside = refused("outside", |c| c.offset_m = [0.0, -15.0]);
    assert!(
        outside.contains("offset_m: the goal at x") && outside.contains("outside the ground"),
        "{outside}"
    );
    let tilted = refused("tilted", |c| c.tilt_max_deg = 1.0);
    assert!(tilted.contains("tilt_max_deg: 1° is less than the"), "{tilted}");
    assert!(refused("lax", |c| (c.standoff_m, c.tolerance_m) = (0.5, 0.6)).contains("tolerance_m"));
    assert!(
        refused("fixed", |c| (c.goal, c.step_fraction) = (GoalRule::Fixed, 2.0)).contains("step_fraction")
    );
}

/// Ground on which little but the rover's own tracks has texture, and a rock ahead.
fn smooth_ground(texture: f64) -> Scenario {
    let mut scenario = scenario();
    (scenario.terrain.slope_deg, scenario.terrain.rms_at_1m_m) = (0.0, 0.005);
    (scenario.rocks.area_fraction, scenario.rocks.cluster_count) = (0.0, 0);
    (scenario.texture.grain_cover, scenario.texture.drift_cover) = (0.0, 0.0);
    scenario.texture.albedo_std *= texture;
    scenario.texture.soil_slope_std *= texture;
    scenario.rover.tracks = true;
    let shape = RockShape::Block;
    let rock =
        |x_m: f64, y_m: f64| PlacedRock { x_m, y_m, diameter_m: 0.5, height_m: 0.3, yaw_deg: 30.0, shape };
    scenario.rocks.placed = vec![rock(0.0, 0.0), rock(0.6, 0.5)];
    scenario
}

/// The stops of a short drive on smooth ground.
fn on_smooth_ground(texture: f64, odometry_pair: OdometryPair) -> Vec<DrivenStop> {
    let folder = tempfile::tempdir().unwrap();
    let scenario = smooth_ground(texture);
    let world = DrivenTraverse::begin(&scenario, &folder.path().join("drive"), Cancel::default()).unwrap();
    let traverse = world.traverse();
    let pixel = choose_targets(traverse.world().unwrap(), &scenario, traverse.index())[0];
    let command = DriveCommand { stops_max: 5, odometry_pair, ..command() };
    let (designation, settings) = (Designation::new(0, pixel), Settings::default());
    let mut drive = TargetedDrive::begin(world, designation, command, &settings, Cancel::default()).unwrap();
    while drive.advance(&settings, Cancel::default()).unwrap() {}
    assert_eq!(drive.steps.len(), 5);
    // The state is complete: the drive continues from its folder.
    let resumed = DrivenTraverse::resume(&folder.path().join("drive")).unwrap();
    assert_eq!(resumed.state(), drive.world.state());
    drive.world.state().to_vec()
}

/// Distance of the estimated from the true position, m.
fn position_error_m(stop: &DrivenStop) -> f64 {
    let [estimated, truth] =
        [stop.site_from_rover, stop.true_site_from_rover].map(|pose| pose.to_pose().translation.vector);
    (estimated - truth).norm()
}

#[test]
fn the_rover_looks_back_where_the_ground_ahead_is_blank() {
    let stops = on_smooth_ground(0.4, OdometryPair::Shared);
    assert!(stops[0].odometry_look.is_none(), "the first motion is measured in the tracker's pairs");
    let first = stops[1].odometry.as_ref().unwrap();
    assert_eq!((first.camera, first.update.accepted, &first.refused_too), (None, false, &None));
    for (number, stop) in (2..).zip(&stops[2..]) {
        let measured = stop.odometry.as_ref().unwrap();
        let camera = (measured.camera, measured.update.accepted, measured.corrects);
        assert_eq!(camera, (Some(CameraName::ODOMETRY), true, true), "{number}: {measured:?}");
        let ahead = measured.refused_too.as_ref().unwrap();
        assert!(ahead.contains("odometry_inliers"), "{number}: {ahead}");
        assert!(position_error_m(stop) - position_error_m(&stops[number - 1]) < 0.005, "{number}");
    }
    for stop in &stops[1..] {
        assert!(stop.odometry_look.unwrap().azimuth_rad.cos() < -0.9, "{:?}", stop.odometry_look);
    }
}

#[test]
fn own_pairs_measure_the_motion_before_mast_pointing() {
    let stops = on_smooth_ground(0.5, OdometryPair::Own);
    for (number, stop) in stops.iter().enumerate() {
        let look = stop.odometry_look.unwrap();
        assert!(look.azimuth_rad.cos() > 0.9 && look.elevation_rad < -0.3, "{number}: {look:?}");
        if let Some(measured) = &stop.odometry {
            assert_eq!((measured.camera, measured.corrects), (Some(CameraName::ODOMETRY), true), "{number}");
            assert!(position_error_m(stop) < 0.005, "{number}: {} m", position_error_m(stop));
        } else {
            assert_eq!(number, 0);
        }
    }
}
