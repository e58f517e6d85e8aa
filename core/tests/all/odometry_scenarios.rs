//! Drives in the library's scenarios for visual odometry: a ramp, own tracks, periodic tracks, and no texture.

use sightline_geometry::cancel::Cancel;
use sightline_geometry::frames::Pose;
use sightline_recordings::DrivenTraverse;
use sightline_rover::driving::DriveCommand;
use sightline_session::targeted_drive::TargetedDrive;
use sightline_track::settings::Settings;
use sightline_track::target::Designation;
use sightline_world::rover::driven::DrivenStop;
use sightline_world::{Scenario, choose_targets, library};

/// Number of motions.
const MOTIONS: usize = 5;

/// The stops of a drive of [`MOTIONS`] steps towards the first target.
fn driven(name: &str) -> Vec<DrivenStop> {
    let mut scenario = Scenario { seed: 5412, ..library::scenario(name).unwrap() };
    (scenario.camera.image_size, scenario.camera.samples_per_axis) = (512, 2);
    scenario.targets.window_px = 11;
    let folder = tempfile::tempdir().unwrap();
    let world = DrivenTraverse::begin(&scenario, &folder.path().join("drive"), Cancel::default()).unwrap();
    let traverse = world.traverse();
    let pixel = choose_targets(traverse.world().unwrap(), &scenario, traverse.index())[0];
    let (designation, settings) = (Designation::new(0, pixel), Settings::default());
    let command = DriveCommand { standoff_m: 2.0, ..DriveCommand::default() };
    let mut drive = TargetedDrive::begin(world, designation, command, &settings, Cancel::default()).unwrap();
    while drive.steps.len() <= MOTIONS && drive.advance(&settings, Cancel::default()).unwrap() {}
    drive.world.state().to_vec()
}

/// Length of a motion, and distance between the poses after it if both start at the same pose, m.
fn error_m(before: &DrivenStop, after: &DrivenStop, motion: &Pose) -> [f64; 2] {
    let [from, to] = [before, after].map(|stop| stop.true_site_from_rover.to_pose());
    let truth = from.inverse() * to;
    let length_m = truth.translation.vector.norm();
    [length_m, (truth.translation.vector - motion.translation.vector).norm()]
}

/// Number of accepted motions; asserts that all of them are correct within a centimetre or 4 % of the step.
fn accepted(stops: &[DrivenStop]) -> usize {
    let mut count = 0;
    for pair in stops.windows(2) {
        let measured = pair[1].odometry.as_ref().unwrap();
        let Some(motion) = measured.update.accepted_motion() else { continue };
        let [length_m, position_error_m] = error_m(&pair[0], &pair[1], &motion.inverse());
        assert!(
            position_error_m < (0.04 * length_m).max(0.01),
            "{position_error_m} m off after {length_m} m"
        );
        count += 1;
    }
    count
}

#[test]
fn visual_odometry_measures_the_slip_on_a_ramp() {
    let stops = driven("ramp-25");
    assert_eq!(accepted(&stops), MOTIONS);
    let last = &stops[MOTIONS];
    let estimated = last.site_from_rover.to_pose().translation.vector;
    let position_error_m = (last.true_site_from_rover.to_pose().translation.vector - estimated).norm();
    let slips: Vec<f64> =
        stops[1..].iter().map(|stop| stop.odometry.as_ref().unwrap().update.slip.unwrap().along).collect();
    assert!(slips.iter().all(|slip| *slip > 0.2), "{slips:?}");
    assert!(position_error_m < 0.01, "{position_error_m}");
}

#[test]
fn on_own_tracks_most_motions_are_measured_backwards() {
    let stops = driven("own-tracks");
    assert!(accepted(&stops) >= MOTIONS - 1);
    let back = stops.iter().filter(|stop| stop.odometry.as_ref().is_some_and(|m| m.camera.is_some()));
    assert!(back.count() >= 3);
}

#[test]
fn tracks_that_repeat_themselves_and_plain_ground_are_refused() {
    for (name, reason) in [("picket-fence", "odometry_ambiguity"), ("featureless", "only 0 of 0 matches")] {
        let stops = driven(name);
        assert_eq!(accepted(&stops), 0, "{name}");
        // The first motion has only images ahead: no earlier stop looked back.
        for stop in &stops[2..] {
            let refusal = stop.odometry.as_ref().unwrap().refusal().unwrap();
            assert!(refusal.contains("looking back") && refusal.contains(reason), "{name}: {refusal}");
        }
    }
}
