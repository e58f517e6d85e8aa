//! A drive to several targets in turn: all are tracked, a lost one is dropped, and the drive continues.

use std::path::Path;

use sightline_geometry::cancel::Cancel;
use sightline_recordings::DrivenTraverse;
use sightline_rover::driving::{DriveCommand, StopReason};
use sightline_session::targeted_drive::TargetedDrive;
use sightline_track::settings::Settings;
use sightline_track::target::{Designation, TrackingState};
use sightline_world::scenario::Occluder;
use sightline_world::{Scenario, choose_targets, library};

fn scenario() -> Scenario {
    let mut scenario = library::scenario("five-targets").unwrap();
    (scenario.camera.image_size, scenario.camera.samples_per_axis) = (512, 1);
    scenario.targets.window_px = 9;
    scenario.drive.start_distance_m = 6.0;
    scenario
}

fn begin(scenario: &Scenario, (count, look_at_waiting): (usize, bool), folder: &Path) -> TargetedDrive {
    let world = DrivenTraverse::begin(scenario, folder, Cancel::default()).unwrap();
    let traverse = world.traverse();
    let pixels = choose_targets(traverse.world().unwrap(), scenario, traverse.index());
    let targets: Vec<Designation> = pixels[..count].iter().map(|pixel| Designation::new(0, *pixel)).collect();
    let command = DriveCommand { tolerance_m: 0.02, look_at_waiting, ..DriveCommand::default() };
    TargetedDrive::begin_to(world, &targets, command, &Settings::default(), Cancel::default()).unwrap()
}

/// Drives until no target is left to visit.
fn to_end(drive: &mut TargetedDrive) {
    loop {
        while drive.advance(&Settings::default(), Cancel::default()).unwrap() {}
        if !drive.visit_next() {
            return;
        }
    }
}

#[test]
fn targets_are_visited_in_turn_and_a_lost_one_is_dropped() {
    let folder = tempfile::tempdir().unwrap();
    let mut drive = begin(&scenario(), (2, true), &folder.path().join("two"));
    to_end(&mut drive);
    println!("{:#?}", drive.visits);
    let [first, second] = &drive.visits[..] else { panic!("two visits") };
    for visit in [first, second] {
        assert_eq!(visit.reason, StopReason::Arrived);
        assert!(visit.target_error_m.unwrap() < 0.03 && visit.goal_error_m.unwrap() < 0.05, "{visit:?}");
    }
    assert_eq!((second.since, second.until), (first.until, drive.steps.last().unwrap().step));
    // While the rover drove to the first target, the second left the view of the mast cameras; its position was propagated.
    let carried = drive.steps.iter().filter(|step| step.is_out_of_view()).count();
    assert!(carried > 0 && drive.steps[..first.until].iter().all(|step| !step.update.state.is_lost()));
    // The mast looked at it on the way, at extra stops.
    let looks: Vec<usize> = drive.cycles[..first.until]
        .iter()
        .filter(|cycle| cycle.looks_at.is_some())
        .map(|cycle| cycle.step)
        .collect();
    assert!(!looks.is_empty() && looks.len() < first.until / 3, "{looks:?}");
    for step in looks {
        assert_eq!(drive.cycles[step].motion, None);
        assert!(
            drive.steps[step + 1].why_not_searched().is_none()
                && drive.steps[step + 1].update.state == TrackingState::Tracking,
            "{step}"
        );
    }
    // The mast looks at it before the rover drives to it: two stops at the place of the first goal.
    let [here, looked] = [first.until, first.until + 1].map(|step| &drive.steps[step]);
    assert!(here.is_out_of_view() && looked.why_not_searched().is_none());
    assert_eq!(drive.cycles[first.until].motion, None);

    // Without looks on the way.
    let mut drive = begin(&scenario(), (2, false), &folder.path().join("without"));
    while drive.advance(&Settings::default(), Cancel::default()).unwrap() {}
    assert!(drive.cycles.iter().all(|cycle| cycle.looks_at.is_none()) && drive.steps.len() <= first.until);

    // From that stop on, a wall hides the second target until it is dropped.
    let mut hidden = scenario();
    let from_stop = u32::try_from(drive.steps.len()).unwrap();
    let wall =
        Occluder { from_stop, to_stop: from_stop + 2, at: 0.3, width_m: 10.0, height_m: 5.0, aside_m: 0.0 };
    hidden.events.occluders.push(wall);
    let mut drive = begin(&hidden, (3, false), &folder.path().join("three"));
    to_end(&mut drive);
    println!("{:#?}", drive.visits);
    let reasons: Vec<StopReason> = drive.visits.iter().map(|visit| visit.reason).collect();
    assert_eq!(reasons[..2], [StopReason::Arrived, StopReason::Lost]);
    let [first, second] = [0, 1].map(|visit: usize| drive.visits[visit].why.as_ref());
    assert_eq!(first, None, "it has arrived");
    let why = second.expect("the reason of a loss");
    let start = format!("The target was lost at stop {from_stop}: ");
    assert!(why.sentence.starts_with(&start) && !why.evidence.is_empty(), "{why:?}");
    assert!(!why.evidence.iter().any(|sentence| sentence.contains("truth")), "{why:?}");
    let third = &drive.visits[2];
    assert!(third.since == drive.visits[1].until && third.until > third.since, "it was driven to: {third:?}");
}
