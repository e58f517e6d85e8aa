//! The feature locator in a world with an analytic ground truth.

use nalgebra::UnitQuaternion;
use serde_json::{Value, json};

use sightline_geometry::cancel::Cancel;
use sightline_geometry::frames::{Pixel, Pose, Vector3};
use sightline_rover::pipeline::Stops;
use sightline_session::step::RunStep;
use sightline_session::track;
use sightline_testing::{PlaneWorld, Trouble};
use sightline_track::locate::store::SharedStore;
use sightline_track::presets::preset;
use sightline_track::settings::{Changes, Settings};
use sightline_track::target::{Designation, TrackingState};
use sightline_track::trace::ArrayName;

/// The recommended configuration with changes.
fn settings(changes: &[(&str, Value)]) -> Settings {
    let changes: Changes = changes.iter().map(|(key, value)| ((*key).to_owned(), value.clone())).collect();
    preset("features").unwrap().settings().unwrap().with(&changes).unwrap()
}

/// A drive of six stops towards the plane, each a fifteenth closer, with a small turn.
fn drive() -> PlaneWorld {
    let stop = |i: i32| {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.01 * f64::from(i));
        Pose::from_parts(Vector3::new(0.4 * f64::from(i), 0.02 * f64::from(i), 0.0).into(), turn)
    };
    PlaneWorld {
        normal: Vector3::new(0.9, 0.3, 0.3).normalize(),
        ..PlaneWorld::new((0..6).map(stop).collect())
    }
}

fn run(world: &PlaneWorld, settings: &Settings) -> Vec<RunStep> {
    let designation = Designation::new(0, Pixel::new(140.3, 120.6));
    track::run(world, designation, settings).unwrap()
}

/// The error that tracking adds to that of the designation, m.
fn position_error_m(world: &PlaneWorld, steps: &[RunStep]) -> f64 {
    let last = steps.last().unwrap();
    let now_from_first = world.true_poses[last.step].inverse() * world.true_poses[0];
    (last.update.target.position_in_rover - now_from_first * steps[0].update.target.position_in_rover).norm()
}

fn states(steps: &[RunStep]) -> Vec<&'static str> {
    steps.iter().map(|step| step.update.state.word()).collect()
}

#[test]
fn the_target_follows_the_scene_within_millimetres() {
    let world = drive();
    for (name, most_m) in [("features", 0.002), ("features-paper", 0.03)] {
        let steps = run(&world, &preset(name).unwrap().settings().unwrap());
        assert!(position_error_m(&world, &steps) < most_m, "{name}: {} m", position_error_m(&world, &steps));
        for step in &steps[1..] {
            let located = step.located().unwrap();
            assert_eq!(step.update.state, TrackingState::Tracking);
            assert!(located.confidence > 0.9, "{name}: {}", located.confidence);
        }
    }
}

#[test]
fn the_covariance_never_shrinks_and_covers_the_drift() {
    let world = drive();
    let steps = run(&world, &settings(&[("feature_memory", json!(1))]));
    let sizes: Vec<Vector3> = steps
        .iter()
        .map(|step| {
            let mut values = step.update.target.covariance_in_rover.symmetric_eigenvalues();
            values.as_mut_slice().sort_by(f64::total_cmp);
            values
        })
        .collect();
    for pair in sizes.windows(2) {
        for axis in 0..3 {
            assert!(pair[1][axis] > 0.99 * pair[0][axis], "{pair:?}");
        }
    }
    let grown = (sizes[5] - sizes[0]).map(|v| v.max(0.0)).sum().sqrt();
    assert!(
        position_error_m(&world, &steps) < 4.0 * grown + 1e-4,
        "{} m, {grown} m",
        position_error_m(&world, &steps)
    );
}

#[test]
fn a_covered_stop_is_dead_reckoned_and_the_target_reacquired() {
    let mut world = drive();
    world.troubles[2] = Trouble::Covered;
    world.troubles[3] = Trouble::Covered;
    let steps = run(&world, &settings(&[]));
    assert_eq!(states(&steps), ["tracking", "tracking", "lost", "lost", "tracking", "tracking"]);
    let located = steps[2].located().unwrap();
    assert!(located.missing.as_ref().unwrap().contains("since step 1"), "{:?}", located.missing);
    let sigma = |step: &RunStep| step.row().sigma_m.unwrap();
    assert!(sigma(&steps[3]) > sigma(&steps[2]) && sigma(&steps[2]) > sigma(&steps[1]));
    // The uncertainty that dead reckoning added while the stops were covered is removed again.
    assert!(sigma(&steps[4]) < sigma(&steps[2]) && position_error_m(&world, &steps) < 0.002);
    let evidence = steps[4].features().unwrap();
    assert!(evidence.match_features.unwrap().from_step <= 1);
}

#[test]
fn reacquisition_requires_a_higher_confidence() {
    let world = drive();
    let count = run(&world, &settings(&[]))[1].row().inliers.unwrap();
    // A confidence of 0.6 at every step: enough to remain tracked, too little to be found again.
    let middle = count as f64 - (0.6_f64 / 0.4).ln() / 0.1;
    let at = |middle: f64| settings(&[("confidence_matches", json!(middle)), ("feature_memory", json!(1))]);
    let gate = |steps: &[RunStep], step: usize| steps[step].verdict().unwrap().gates[0].limit;
    let steps = run(&world, &at(middle));
    assert_eq!((steps[1].update.state, gate(&steps, 1)), (TrackingState::Tracking, 0.5));
    let lost = run(&world, &at(1000.0));
    assert_eq!((lost[1].update.state, gate(&lost, 2)), (TrackingState::Lost { count: 1 }, 0.7));
    assert!(lost[1].verdict().unwrap().reason.as_ref().unwrap().contains("confidence"));
}

#[test]
fn a_wrong_pose_estimate_is_discarded_as_a_prior() {
    let mut world = drive();
    for pose in &mut world.estimates[2..] {
        *pose *= UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.2);
    }
    let free = run(&world, &settings(&[]));
    assert!(position_error_m(&world, &free) < 0.002, "{} m", position_error_m(&world, &free));
    let given_up = |steps: &[RunStep], step: usize| {
        steps[step].features().unwrap().match_features.unwrap().prior_given_up
    };
    let bound = run(&world, &settings(&[("prior_radius_px", json!(20.0)), ("feature_memory", json!(1))]));
    assert!(states(&bound).iter().all(|state| *state == "tracking"), "{:?}", states(&bound));
    assert!(position_error_m(&world, &bound) < 0.002, "{} m", position_error_m(&world, &bound));
    assert!(!given_up(&bound, 1) && given_up(&bound, 2));
    let right = run(&drive(), &settings(&[("prior_radius_px", json!(20.0))]));
    assert!(position_error_m(&drive(), &right) < 0.002 && !given_up(&right, 2));
}

#[test]
fn two_identical_pairs_are_no_motion() {
    let world = PlaneWorld::new(vec![Pose::identity(); 2]);
    let steps = run(&world, &settings(&[]));
    let motion = steps[1].features().unwrap().fit_motion.as_ref().unwrap();
    assert!(motion.translation_m.iter().all(|metres| metres.abs() < 1e-9), "{motion:?}");
    assert!(motion.roll_pitch_yaw_deg.iter().all(|degrees| degrees.abs() < 1e-9));
}

/// The drive with one camera covered from the second stop on.
struct OneEyed(PlaneWorld);

impl OneEyed {
    fn located(&self) -> String {
        let settings = settings(&[]);
        let designation = Designation::new(0, Pixel::new(140.3, 120.6));
        let first = track::designate(&self.0, designation, &settings).unwrap();
        let mut pair = self.0.capture(1, Cancel::default()).unwrap();
        std::sync::Arc::make_mut(&mut pair.right).pixels_mut().for_each(|pixel| pixel[0] = 0.4);
        let (left, right) = self.0.cameras(1);
        let seen = sightline_track::locate::features::detect::detect(
            &pair,
            [left, right],
            &settings.features,
            Cancel::default(),
        )
        .unwrap();
        assert!(seen.left.keypoints.len() > 50 && seen.points.is_empty());
        let anchor = first.update.target.memory.features().unwrap().newest().next().unwrap();
        let input = sightline_track::locate::features::motion::MotionInput {
            then: &anchor.features,
            now: &seen,
            expected_now_from_then: &Pose::identity(),
            left,
            settings: &settings.features,
        };
        sightline_track::locate::features::motion::motion(&input).fit.missing.unwrap()
    }
}

#[test]
fn a_covered_eye_leaves_too_few_matches() {
    let why = OneEyed(drive()).located();
    assert!(why.contains("three") || why.contains("few"), "{why}");
}

#[test]
fn ranges_that_exclude_each_other_are_refused_with_their_names() {
    let settings = settings(&[("feature_range_min_m", json!(50.0)), ("feature_range_max_m", json!(5.0))]);
    let designation = Designation::new(0, Pixel::new(140.3, 120.6));
    let refused = track::designate(&drive(), designation, &settings).unwrap_err().to_string();
    assert!(refused.contains("feature_range_min_m") && refused.contains("feature_range_max_m"), "{refused}");
}

#[test]
fn the_tables_list_every_feature_and_mark_the_inliers() {
    let steps = run(&drive(), &settings(&[]));
    let evidence = steps[1].features().unwrap();
    let columns = sightline_track::locate::features::evidence::FeatureColumn::COUNT;
    let values = steps[1].array(ArrayName::FEATURES).unwrap().values();
    assert_eq!(values.len(), evidence.detect.unwrap().left * columns);
    let inlier = sightline_track::locate::features::evidence::FeatureColumn::Inlier as usize;
    let agreeing = values.chunks_exact(columns).filter(|row| row[inlier] == 1.0).count();
    assert_eq!(Some(agreeing), steps[1].row().inliers);
    assert_eq!(steps[1].array(ArrayName::CLOUD).unwrap().size(), [5, 200]);
    assert!(steps[0].array(ArrayName::CLOUD).is_none() && steps[0].array(ArrayName::RIGHT_WINDOW).is_some());
}

#[test]
fn features_of_one_target_are_reused_for_the_next() {
    let store = SharedStore::default();
    let settings = settings(&[]).features;
    let empty = sightline_track::locate::features::detect::StopFeatures::default;
    let first = store.get(3, &settings, 64, empty);
    let again = store.get(3, &settings, 64, || unreachable!("it is kept"));
    assert!(std::sync::Arc::ptr_eq(&first, &again));
    let other = sightline_track::locate::features::FeatureSettings { sift_sigma: 1.7, ..settings };
    assert!(!std::sync::Arc::ptr_eq(&first, &store.get(3, &other, 64, empty)));
}
