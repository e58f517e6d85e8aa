//! Drives that stop for one injected cause: the explanation names it, without scenario or truth, and its changes are
//! verified.

use std::path::Path;

use sightline_geometry::cancel::Cancel;
use sightline_recordings::DrivenTraverse;
use sightline_rover::driving::{DriveCommand, GoalRule, NavigatorKind, SlipCheck, StopReason};
use sightline_session::stop_cause::{StopCause, StopExplanation};
use sightline_session::targeted_drive::TargetedDrive;
use sightline_track::settings::Settings;
use sightline_track::target::Designation;
use sightline_world::{Scenario, choose_targets, library};

fn scenario(name: &str) -> Scenario {
    let mut scenario = Scenario { seed: 2, ..library::scenario(name).unwrap() };
    (scenario.camera.image_size, scenario.camera.samples_per_axis) = (256, 2);
    scenario.targets.window_px = 9;
    scenario
}

/// Hazard avoidance towards a fixed goal, on which tracking in images of this size has no influence.
fn avoiding() -> DriveCommand {
    DriveCommand {
        navigator: NavigatorKind::Gestalt,
        goal: GoalRule::Fixed,
        stops_max: 40,
        ..DriveCommand::default()
    }
}

fn drive(scenario: &Scenario, command: DriveCommand, folder: &Path) -> TargetedDrive {
    let world = DrivenTraverse::begin(scenario, folder, Cancel::default()).unwrap();
    let traverse = world.traverse();
    let pixel = choose_targets(traverse.world().unwrap(), scenario, traverse.index())[0];
    let (designation, settings) = (Designation::new(0, pixel), Settings::default());
    let mut drive = TargetedDrive::begin(world, designation, command, &settings, Cancel::default()).unwrap();
    while drive.advance(&settings, Cancel::default()).unwrap() {}
    drive
}

fn explained(scenario: &Scenario, command: DriveCommand) -> StopExplanation {
    let folder = tempfile::tempdir().unwrap();
    let why = drive(scenario, command, &folder.path().join("drive")).why().unwrap();
    println!("{why:#?}");
    why
}

#[test]
fn a_slope_beyond_the_limit_is_named() {
    let why = explained(&scenario("no-safe-path"), avoiding());
    assert_eq!((why.reason, why.cause), (StopReason::NoSafePath, Some(StopCause::NoSafePath)));
    assert!(why.sentence.starts_with("No path is safe: the tilt of the ground vetoes "), "{}", why.sentence);
    let blind = why.changes.iter().find(|change| change.text.starts_with("navigator arcs ")).unwrap();
    assert!(blind.decision.starts_with("the drive goes on: "), "{blind:?}");
}

#[test]
fn earlier_measurements_distinguish_reflection_from_rock() {
    let why = explained(&scenario("false-obstacle"), avoiding());
    assert_eq!(why.cause, Some(StopCause::FalseObstacle), "{}", why.sentence);
}

#[test]
fn ground_without_texture_is_named_where_odometry_refuses() {
    let command = || DriveCommand { refusals_max: Some(2), goal: GoalRule::Fixed, ..DriveCommand::default() };
    for name in ["featureless", "picket-fence"] {
        let mut scenario = scenario(name);
        // The imprints of the cleats are small.
        scenario.camera.image_size = 512;
        let why = explained(&scenario, command());
        let cause = Some(StopCause::FeaturelessGround);
        assert_eq!((why.reason, why.cause), (StopReason::OdometryRefused, cause), "{name}");
        let goes_on = why.changes.iter().find(|change| change.text == "refusals_max none instead of 2");
        assert!(goes_on.unwrap().decision.starts_with("the drive goes on: "), "{name}");
    }
}

#[test]
fn oscillation_at_the_goal_names_the_sufficient_tolerance() {
    let scenario = scenario("slope-oblique");
    let why =
        explained(&scenario, DriveCommand { tolerance_m: 0.001, stops_max: 60, ..DriveCommand::default() });
    assert_eq!((why.reason, why.cause), (StopReason::LimitCycle, Some(StopCause::LimitCycle)));
    assert!(why.sentence.starts_with("The drive repeats itself: stops "), "{}", why.sentence);
    let wider = why.changes.iter().find(|change| change.text.starts_with("tolerance_m ")).unwrap();
    assert_eq!(wider.decision, "arrived");
}

#[test]
fn a_slip_check_after_the_time_limit_is_an_order_of_events() {
    let folder = tempfile::tempdir().unwrap();
    let scenario = scenario("approach-10");
    let command = DriveCommand { goal: GoalRule::Fixed, stops_max: 5, ..DriveCommand::default() };
    let free = drive(&scenario, command.clone(), &folder.path().join("free"));
    let cycle = &free.cycles[2];
    // The time limit is reached with nine tenths of this motion left.
    let minutes = cycle.flight_minutes - 0.9 * cycle.report.unwrap().duration_s / 60.0;
    let limited = DriveCommand { flight_minutes_max: minutes, slip_max: 0.7, ..command };
    let of_command = DriveCommand { slip_check: SlipCheck::Command, ..limited.clone() };
    let mut ended = drive(&scenario, of_command, &folder.path().join("command"));
    assert!((ended.cycles[2].time_up_after.unwrap() - 0.1).abs() < 0.01);
    let why = ended.why().unwrap();
    println!("{why:#?}");
    assert_eq!((why.reason, why.cause), (StopReason::Slip, Some(StopCause::OrderOfEvents)));
    let of_wheels = why.changes.iter().find(|change| change.text == "slip_check wheels instead of command");
    assert_eq!(of_wheels.unwrap().decision, "time on Mars used up");
    // With that change the drive ends because of the time limit alone.
    let mut by_wheels = drive(&scenario, limited, &folder.path().join("wheels"));
    let why = by_wheels.why().unwrap();
    assert_eq!((why.reason, why.cause), (StopReason::Time, None));
}

#[test]
fn drives_without_an_injected_cause_have_none() {
    let folder = tempfile::tempdir().unwrap();
    let command = DriveCommand { stops_max: 4, ..avoiding() };
    let scenario = Scenario { seed: 4, ..scenario("obstacles-10") };
    let mut drive = drive(&scenario, command, &folder.path().join("drive"));
    let why = drive.why().unwrap();
    assert_eq!((why.reason, why.cause), (StopReason::StopLimit, None), "{}", why.sentence);
    let more = why.changes.iter().find(|change| change.text == "stops_max 54 instead of 4").unwrap();
    assert!(more.decision.starts_with("the drive goes on: "), "{more:?}");
}
