//! Closed-loop drives on the hazard map: rocks on the path, missing range data, no safe path.

use std::path::Path;
use std::sync::Arc;

use sightline_geometry::camera::CameraName;
use sightline_geometry::cancel::Cancel;
use sightline_recordings::DrivenTraverse;
use sightline_rover::driving::executive::{self, CycleInput};
use sightline_rover::driving::set_goal::goal_position_m;
use sightline_rover::driving::{
    Cycle, DriveCommand, GoalRule, NavigatorKind, PathChoice, RangeData, StopHazards, StopReason,
};
use sightline_rover::hazards::CellBasis;
use sightline_session::targeted_drive::TargetedDrive;
use sightline_track::settings::Settings;
use sightline_track::target::Designation;
use sightline_world::{Scenario, choose_targets, library};

fn scenario() -> Scenario {
    let mut scenario = Scenario { seed: 3006, ..library::scenario("obstacles-10").unwrap() };
    (scenario.camera.image_size, scenario.camera.samples_per_axis) = (256, 2);
    scenario.targets.window_px = 9;
    (scenario.drive.start_distance_m, scenario.drive.end_distance_m) = (8.0, 2.0);
    // One rock on level ground blocks the path; no other does.
    (scenario.rocks.area_fraction, scenario.rocks.smallest_m) = (0.01, 0.1);
    scenario.terrain.slope_deg = 0.0;
    scenario
}

fn command(navigator: NavigatorKind) -> DriveCommand {
    // The small images are for the hazard map; tracking has no influence on the path.
    DriveCommand { navigator, goal: GoalRule::Fixed, stops_max: 60, ..DriveCommand::default() }
}

fn begin(scenario: &Scenario, command: DriveCommand, folder: &Path) -> Result<TargetedDrive, String> {
    let world = DrivenTraverse::begin(scenario, folder, Cancel::default()).unwrap();
    let traverse = world.traverse();
    let pixel = choose_targets(traverse.world().unwrap(), scenario, traverse.index())[0];
    let (designation, settings) = (Designation::new(0, pixel), Settings::default());
    TargetedDrive::begin(world, designation, command, &settings, Cancel::default())
        .map_err(|error| error.to_string())
}

fn to_end(drive: &mut TargetedDrive) {
    while drive.advance(&Settings::default(), Cancel::default()).unwrap() {}
}

#[test]
fn the_hazard_map_leads_round_a_rock_also_after_resuming() {
    let folder = tempfile::tempdir().unwrap();
    let in_folder =
        |name: &str, navigator| begin(&scenario(), command(navigator), &folder.path().join(name)).unwrap();
    let mut arcs = in_folder("arcs", NavigatorKind::Arcs);
    to_end(&mut arcs);
    let summary = arcs.summary();
    println!("{summary:?}");
    assert!(summary.collisions > 0 && summary.reason == Some(StopReason::Stalled), "{summary:?}");
    assert!(arcs.cycles.iter().all(|cycle| cycle.choice.is_none() && cycle.range_points.is_none()));

    let mut gestalt = in_folder("gestalt", NavigatorKind::Gestalt);
    to_end(&mut gestalt);
    let summary = gestalt.summary();
    println!("{summary:?}");
    assert_eq!((summary.reason, summary.collisions), (Some(StopReason::Arrived), 0));
    let vetoed = |cycle: &Cycle| cycle.choice.as_ref().map_or(0, PathChoice::vetoed_count);
    assert!(gestalt.cycles.iter().any(|cycle| vetoed(cycle) > 0));

    // The same up to the middle, then continued from the folder.
    let mut half = in_folder("half", NavigatorKind::Gestalt);
    let middle = gestalt.steps.len() / 2;
    for _ in 0..middle {
        assert!(half.advance(&Settings::default(), Cancel::default()).unwrap());
    }
    assert_eq!(half.cycles[..], gestalt.cycles[..middle]);
    let (steps, cycles) = (half.steps.clone(), half.cycles.clone());
    drop(half);
    let mut resumed = in_folder("unused", NavigatorKind::Gestalt);
    resumed.world = DrivenTraverse::resume(&folder.path().join("half")).unwrap();
    (resumed.steps, resumed.cycles) = (steps, cycles);
    to_end(&mut resumed);
    assert_eq!(resumed.world.state(), gestalt.world.state());
    assert_eq!((&resumed.cycles, &resumed.steps), (&gestalt.cycles, &gestalt.steps));
}

#[test]
fn a_drive_without_the_hazard_map_pair_is_rejected() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |name: &str, scenario: &Scenario, hazard_camera: Option<&str>| {
        let hazard_cameras = hazard_camera.map(|name| name.parse::<CameraName>().unwrap());
        let hazard_cameras = hazard_cameras.into_iter().collect();
        let command = DriveCommand { hazard_cameras, ..command(NavigatorKind::Morphin) };
        begin(scenario, command, &folder.path().join(name)).err().unwrap()
    };
    let mut without = scenario();
    without.camera.further.clear();
    let sentence = refused("none", &without, None);
    assert!(sentence.contains("navigator: `morphin` needs a pair of hazcams at every stop"), "{sentence}");
    assert!(sentence.contains("camera.further"), "{sentence}");
    let sentence = refused("other", &scenario(), Some("rear"));
    assert!(sentence.contains("hazard_cameras: stop 0 has no pair `rear`"), "{sentence}");
    assert!(sentence.contains("choose `front_hazcam`"), "{sentence}");
}

#[test]
fn the_rover_stays_without_range_data_or_a_safe_path() {
    let folder = tempfile::tempdir().unwrap();
    let mut drive =
        begin(&scenario(), command(NavigatorKind::Gestalt), &folder.path().join("drive")).unwrap();
    let first = Arc::clone(&drive.steps[0]);
    let command = drive.command.clone();
    let pair = [&first.trace, &first.trace];
    let mapped = drive.maps.at(drive.world.traverse(), &command, pair, Cancel::default()).unwrap().unwrap();
    let before = drive.world.state().to_vec();
    let mut ending = |change: &dyn Fn(&mut StopHazards)| {
        let mut hazards = (*mapped).clone();
        change(&mut hazards);
        let input = CycleInput {
            command: &command,
            navigator: &*command.navigator.navigator(),
            first: &first.trace,
            last: &first.trace,
            before: None,
            hazards: Some(&hazards),
        };
        let cycle = executive::drive(&mut drive.world, &input, Cancel::default()).unwrap();
        assert_eq!(cycle.motion, None);
        assert_eq!(drive.world.state(), before);
        cycle.ending.unwrap()
    };
    let missing = ending(&|hazards| hazards.range = RangeData::Missing("stop 0 has no pair".to_owned()));
    assert_eq!(missing.reason, StopReason::NoRangeData);
    assert_eq!(missing.detail.as_deref(), Some("stop 0 has no pair"));
    let few = ending(&|hazards| hazards.range = RangeData::Points(7));
    assert_eq!((few.reason, few.value, few.limit), (StopReason::NoRangeData, Some(7.0), Some(200.0)));
    let blocked = ending(&|hazards| {
        let grid = hazards.map.grid;
        for (index, cell) in hazards.map.cells.iter_mut().enumerate() {
            // The rover is at the centre of the window, on the only good ground.
            let [row, column] =
                [index / grid.side, index % grid.side].map(|n| n as f64 - 0.5 * grid.side as f64);
            let is_near = grid.cell_m * row.hypot(column) < 0.45;
            (cell.basis, cell.goodness) =
                if is_near { (CellBasis::Assumed, 1.0) } else { (CellBasis::Measured, 0.0) };
            (cell.step_m, cell.tilt_deg, cell.roughness_m) = (0.25, 0.0, 0.0);
        }
    });
    assert_eq!(blocked.reason, StopReason::NoSafePath);
    let sentence = blocked.detail.unwrap();
    assert!(sentence.contains("a step limit of 0.250 m instead of 0.165 m opens"), "{sentence}");
}

#[test]
fn mapping_beyond_the_time_budget_ends_the_drive() {
    let folder = tempfile::tempdir().unwrap();
    // The map of the first stop takes 5 minutes.
    let command = DriveCommand { flight_minutes_max: 2.0, ..command(NavigatorKind::Gestalt) };
    let mut drive = begin(&scenario(), command, &folder.path().join("drive")).unwrap();
    to_end(&mut drive);
    let ending = drive.ending().unwrap();
    assert_eq!((ending.reason, ending.limit), (StopReason::Time, Some(2.0)));
    assert!((5.0..7.0).contains(&ending.value.unwrap()), "{ending:?}");
    assert_eq!((drive.steps.len(), drive.summary().driven_m), (1, 0.0));
}

#[test]
fn a_drive_to_a_rock_ends_beside_it_with_a_reason() {
    let folder = tempfile::tempdir().unwrap();
    let mut drive =
        begin(&scenario(), command(NavigatorKind::Gestalt), &folder.path().join("drive")).unwrap();
    let traverse = drive.world.traverse();
    let mut rocks = traverse.world().unwrap().rocks().iter();
    let rock = rocks.find(|rock| rock.height_m > 0.35 && (1.0..4.0).contains(&rock.centre.x)).unwrap().centre;
    let target = traverse.site_from_rover(0) * drive.steps[0].trace.update.target.position_in_rover;
    let goal = goal_position_m(&drive.command, 0, &target, [0.0, 0.0]);
    drive.command.offset_m = [rock.x - goal[0], rock.y - goal[1]];
    to_end(&mut drive);
    let summary = drive.summary();
    assert_eq!((summary.reason, summary.collisions), (Some(StopReason::GoalBlocked), 0), "{summary:?}");
    let cycle = drive.cycles.last().unwrap();
    let ending = cycle.ending.as_ref().unwrap();
    let detail = ending.detail.as_deref().unwrap();
    assert!(detail.starts_with("the rover cannot stand at its goal, where the step is "), "{detail}");
    assert!(ending.value.unwrap() > ending.limit.unwrap());
    let blocked = cycle.choice.as_ref().unwrap().blocked_goal.unwrap();
    assert!((0.7..2.0).contains(&blocked.nearest_from_goal_m.unwrap()), "{blocked:?}");
    let nearest_m = blocked.nearest_from_goal_m.unwrap();
    assert!((cycle.goal.distance_m - nearest_m).abs() < 0.31, "{} {nearest_m}", cycle.goal.distance_m);
}
