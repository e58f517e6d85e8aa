//! Directed drives: motions in their order, another command from their end, the hand-off on arrival.

use std::path::Path;

use sightline_geometry::cancel::Cancel;
use sightline_recordings::DrivenTraverse;
use sightline_rover::driving::{ArrivalAction, DriveCommand, Motion, NavigatorKind, StopReason};
use sightline_rover::visual_odometry::OdometryMode;
use sightline_session::stop_cause::StopCause;
use sightline_session::targeted_drive::TargetedDrive;
use sightline_track::presets::preset;
use sightline_track::settings::Settings;
use sightline_track::target::Designation;
use sightline_world::scenario::{CameraRig, FurtherRig};
use sightline_world::{Scenario, choose_targets, library};

fn scenario() -> Scenario {
    let mut scenario = library::scenario("k9-5").unwrap();
    (scenario.camera.image_size, scenario.camera.samples_per_axis) = (512, 2);
    scenario.camera.rig = CameraRig::MerNavcam;
    scenario.camera.hand_over = None;
    let name = "front_hazcam".parse().unwrap();
    scenario.camera.further.push(FurtherRig {
        name,
        rig: CameraRig::MerFrontHazcam,
        look_deg: None,
        image_size: 512,
    });
    scenario.drive.end_distance_m = 4.0;
    scenario
}

fn begin(folder: &Path, command: DriveCommand, settings: &Settings) -> TargetedDrive {
    begin_in(&scenario(), folder, command, settings)
}

fn begin_in(scenario: &Scenario, folder: &Path, command: DriveCommand, settings: &Settings) -> TargetedDrive {
    let world = DrivenTraverse::begin(scenario, folder, Cancel::default()).unwrap();
    let traverse = world.traverse();
    let pixel = choose_targets(traverse.world().unwrap(), scenario, traverse.index())[0];
    let designation = Designation::new(0, pixel);
    TargetedDrive::begin(world, designation, command, settings, Cancel::default()).unwrap()
}

fn to_end(drive: &mut TargetedDrive, settings: &Settings) {
    while drive.advance(settings, Cancel::default()).unwrap() {}
}

#[test]
fn directed_motions_run_in_order_and_can_be_continued() {
    let folder = tempfile::tempdir().unwrap();
    let settings = Settings::default();
    let motions: Vec<Motion> =
        ["-0.3", "turn 15", "0.4", "turn -15"].iter().map(|text| text.parse().unwrap()).collect();
    let blind = DriveCommand { odometry: OdometryMode::Off, ..DriveCommand::default() };
    let command = DriveCommand { motions: motions.clone(), ..blind.clone() };
    let mut drive = begin(&folder.path().join("drive"), command, &settings);
    to_end(&mut drive, &settings);
    assert_eq!(drive.summary().reason, Some(StopReason::Completed));
    assert_eq!((drive.why(), drive.steps.len()), (None, 5));
    let driven: Vec<Motion> = drive.cycles.iter().filter_map(|cycle| cycle.motion).collect();
    assert_eq!(driven, motions);
    // The true rover followed the motions, on level ground with little slip.
    let (mut place, mut heading) = ([0.0f64; 2], 0.0f64);
    for motion in &motions {
        let ([ahead, right], turn) = motion.after(1.0);
        place[0] += ahead * heading.cos() - right * heading.sin();
        place[1] += ahead * heading.sin() + right * heading.cos();
        heading += turn;
    }
    let [first, last] = [0, 4].map(|stop: usize| drive.world.state()[stop].true_site_from_rover.to_pose());
    let moved = first.inv_mul(&last);
    assert!((moved.translation.x - place[0]).hypot(moved.translation.y - place[1]) < 0.05, "{moved}");
    assert!((moved.rotation.euler_angles().2 - heading).abs().to_degrees() < 1.0);
    assert!(drive.steps.iter().all(|step| !step.update.state.is_lost()), "the target is tracked along");

    let minutes = drive.summary().flight_minutes;
    drive.go_on(DriveCommand { standoff_m: 3.5, ..blind }).unwrap();
    to_end(&mut drive, &settings);
    let summary = drive.summary();
    println!("{summary:?}");
    assert!(summary.arrived && summary.flight_minutes > minutes && summary.target_error_m.unwrap() < 0.02);
    assert_eq!(drive.command.since, Some(4));
    // A command whose value is out of range is refused.
    let refused =
        drive.go_on(DriveCommand { standoff_m: 30.0, tilt_max_deg: 90.0, ..DriveCommand::default() });
    assert!(refused.unwrap_err().to_string().contains("tilt_max_deg"));
}

#[test]
fn hand_off_registers_the_hazcams_to_the_first_view() {
    let folder = tempfile::tempdir().unwrap();
    let settings = preset("combined").unwrap().settings().unwrap();
    for (name, looks) in [("direct", 0), ("after-a-look", 1)] {
        let mut on_arrival = vec![ArrivalAction::Look; looks];
        on_arrival.push(ArrivalAction::HandOff);
        let command = DriveCommand { on_arrival, ..DriveCommand::default() };
        let mut drive = begin(&folder.path().join(name), command, &settings);
        to_end(&mut drive, &settings);
        let summary = drive.summary();
        let count = drive.steps.len();
        let [mast, handed] = [count - 2, count - 1].map(|stop| &drive.steps[stop]);
        let found = handed.shape().and_then(|shape| shape.registration.as_ref()).expect("it is registered");
        println!("{name}: {summary:?}, registered to stop {}, {:?}", found.to_step, found.reason);
        assert_eq!(summary.reason, Some(StopReason::Arrived));
        // Without a look the last surface is that of the designation.
        assert_eq!(found.to_step, if looks == 0 { 0 } else { mast.step });
        // The surface of the designation, from 5 m, is less accurate.
        assert!(found.failure.is_none() && summary.target_error_m.unwrap() < 0.02 / (1.0 + looks as f64));
        let placement = handed.shape().unwrap().placement.expect("the arm is told");
        // The standoff of 2 m exceeds the reach of the arm.
        assert!(!placement.is_reachable && placement.offset_m.is_some(), "{placement:?}");
        // The rover does not move, and the pair is that of the body.
        let state = drive.world.state();
        assert_eq!(state[count - 1].true_site_from_rover, state[count - 2].true_site_from_rover);
        assert_eq!(state[count - 1].mast_angles, state[count - 2].mast_angles);
        let index = drive.world.traverse().index();
        assert!(index.stops[count - 1].mast_angles.is_none() && index.stops[count - 2].mast_angles.is_some());
        // A reopened drive has the same images and steps.
        let path = drive.world.traverse().folder().to_owned();
        let again = DrivenTraverse::resume(&path).unwrap();
        assert_eq!(again.state(), drive.world.state());
        let trace = sightline_rover::pipeline::run_step(again.traverse(), &mast.update, &settings);
        assert_eq!(trace.update, handed.update);
    }
    let mut without = scenario();
    without.camera.further.clear();
    let world = DrivenTraverse::begin(&without, &folder.path().join("none"), Cancel::default()).unwrap();
    let command = DriveCommand { on_arrival: vec![ArrivalAction::HandOff], ..DriveCommand::default() };
    let designation = drive_target(&world, &without);
    let refused = TargetedDrive::begin(world, designation, command, &settings, Cancel::default());
    let told = refused.map(drop).unwrap_err().to_string();
    assert!(told.contains("on_arrival") && told.contains("hand_off"), "{told}");
}

fn drive_target(world: &DrivenTraverse, scenario: &Scenario) -> Designation {
    let traverse = world.traverse();
    Designation::new(0, choose_targets(traverse.world().unwrap(), scenario, traverse.index())[0])
}

#[test]
fn the_final_approach_brings_the_target_within_reach() {
    let folder = tempfile::tempdir().unwrap();
    let settings = preset("combined").unwrap().settings().unwrap();
    let on_arrival = vec![ArrivalAction::Approach, ArrivalAction::Look, ArrivalAction::HandOff];
    let command = DriveCommand { on_arrival, ..DriveCommand::default() };
    // The tracks of the wheels are free of rocks up to the end of the planned drive.
    let mut scenario = scenario();
    scenario.drive.end_distance_m = 1.8;
    let mut drive = begin_in(&scenario, &folder.path().join("clear"), command.clone(), &settings);
    to_end(&mut drive, &settings);
    let summary = drive.summary();
    println!("{summary:?}");
    assert_eq!((summary.reason, summary.collisions), (Some(StopReason::Arrived), 0));
    // The goal of the summary is that of the approach.
    assert!(summary.goal_error_m.unwrap() < 0.06 && summary.target_error_m.unwrap() < 0.02, "{summary:?}");
    let begun = drive.cycles.iter().position(|cycle| cycle.action == Some(ArrivalAction::Approach)).unwrap();
    let approach = &drive.cycles[begun];
    assert!(approach.motion.is_some() && approach.arrival_actions == 1, "it drives at once");
    assert!((0.6..0.8).contains(&approach.goal.distance_m), "{:?}", approach.goal);
    let actions: Vec<_> = drive.cycles[begun + 1..].iter().filter_map(|cycle| cycle.action).collect();
    assert_eq!(actions, [ArrivalAction::Look, ArrivalAction::HandOff], "in their order, after the approach");
    let looks = drive.cycles.iter().position(|cycle| cycle.action == Some(ArrivalAction::Look)).unwrap();
    assert!(drive.cycles[looks].goal.arrived);
    let handed = drive.steps.last().unwrap();
    let placement = handed.shape().unwrap().placement.expect("the arm is told");
    assert!(placement.is_reachable, "{placement:?}");

    // Among rocks, an approach without a map stalls at one; with a map it does not start.
    let to_rocks = |name: &str, navigator: NavigatorKind| {
        let command = DriveCommand { standoff_m: 2.6, navigator, ..command.clone() };
        let settings = Settings::default();
        let mut drive = begin(&folder.path().join(name), command, &settings);
        to_end(&mut drive, &settings);
        drive
    };
    assert_eq!(to_rocks("blind", NavigatorKind::Arcs).summary().reason, Some(StopReason::Stalled));
    let mut drive = to_rocks("map", NavigatorKind::Gestalt);
    let (summary, last) = (drive.summary(), drive.cycles.last().unwrap());
    println!("{summary:?}");
    assert_eq!((summary.reason, summary.collisions), (Some(StopReason::NoSafePath), 0));
    let detail = last.ending.as_ref().unwrap().detail.as_deref().unwrap();
    assert!(detail.starts_with("the way of the approach is not clear: at x "), "{detail}");
    let named = format!("No path is safe: {detail}.");
    let why = drive.why().unwrap();
    println!("{why:#?}");
    assert_eq!((why.cause, why.sentence), (Some(StopCause::NoSafePath), named));
    assert!(why.evidence[0].contains("2.60 m") && why.evidence[0].contains("1.30 m"), "{:?}", why.evidence);
}
