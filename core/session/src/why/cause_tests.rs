//! The cause of a loss, found without the truth, is the trouble of the world; a step without a trouble has no cause.

use nalgebra::UnitQuaternion;
use serde_json::{Value, json};

use super::*;
use crate::track;
use sightline_geometry::frames::Vector3;
use sightline_testing::{PlaneWorld, Trouble};
use sightline_track::settings::Changes;
use sightline_track::target::Designation;

/// The stop of the trouble.
const STEP: usize = 4;
/// Turn per step that moves the target to the edge of the right image at that stop, deg.
const TURN_DEG: f64 = 2.0;

fn poses() -> Vec<Pose> {
    (0..6).map(|stop| Pose::translation(0.4 * f64::from(stop), 0.0, 0.0)).collect()
}

fn turned(pose: &Pose, deg: f64) -> Pose {
    pose * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), deg.to_radians())
}

/// A drive whose estimated heading jumps.
fn with_heading_jump(deg: f64) -> PlaneWorld {
    let mut world = PlaneWorld::new(poses());
    for stop in STEP..6 {
        let since = Pose::translation(0.4 * (stop - STEP) as f64, 0.0, 0.0);
        world.estimates[stop] = turned(&poses()[STEP], deg) * since;
    }
    world
}

/// The summary of a step without the truth; `changes` apply from [`STEP`] on.
fn summary_at(world: &PlaneWorld, step: usize, changes: &[(&str, Value)]) -> sentence::Summary {
    let changes: Changes = changes.iter().map(|(key, value)| ((*key).to_owned(), value.clone())).collect();
    let settings = Settings::default().with(&changes).unwrap();
    let mut steps =
        track::run(world, Designation::new(0, Pixel::new(118.3, 131.6)), &Settings::default()).unwrap();
    steps.truncate(STEP);
    while steps.len() <= step {
        let next = track::advance(world, &steps[0], &steps[steps.len() - 1], &settings);
        steps.push(next);
    }
    steps.iter_mut().for_each(|step| step.truth = None);
    assert!(steps[1..STEP].iter().all(|step| step.verdict().unwrap().accepted));
    assert!(!steps[step].verdict().unwrap().accepted, "the step is rejected");
    let before = Some(&steps[step - 1]);
    Book { trace: &steps[step], before, settings: &settings, prediction_px: None, sources: world }.summary()
}

/// A search window that contains the target for usual errors, but not after a jump.
fn narrow() -> [(&'static str, Value); 1] {
    [("search_window_px", json!(81))]
}

#[test]
fn a_heading_jump_is_named_with_its_size_and_effect() {
    for (deg, side) in [(7.0, "right"), (-7.0, "left")] {
        let summary = summary_at(&with_heading_jump(deg), STEP, &narrow());
        let expected = format!(
            "The heading estimate jumped by 7.0° to the {side} while the rover drove straight; the prediction is "
        );
        assert!(summary.headline.starts_with(&expected), "{summary:?}");
        let off: f64 = summary.headline[expected.len()..].split(' ').next().unwrap().parse().unwrap();
        // 7° at a focal length of 600 px, and a little perspective.
        assert!((70.0..85.0).contains(&off), "{summary:?}");
        assert!(summary.headline.ends_with("px off and the target is outside the search window."));
    }
}

#[test]
fn a_heading_jump_stays_the_cause_at_the_steps_after_it() {
    let summary = summary_at(&with_heading_jump(7.0), STEP + 1, &narrow());
    assert!(
        summary.headline.starts_with("The heading estimate jumped by 7.0° to the right at step 4 while"),
        "{summary:?}"
    );
}

#[test]
fn a_jump_of_the_position_to_a_side_is_named() {
    let mut world = PlaneWorld::new(poses());
    for stop in STEP..6 {
        world.estimates[stop].translation.vector += Vector3::y() * 0.7;
    }
    let summary = summary_at(&world, STEP, &narrow());
    assert!(summary.headline.starts_with("The position estimate jumped by 0.7"), "{summary:?}");
}

#[test]
fn a_stuck_rover_is_named_as_slip() {
    let mut world = PlaneWorld::new(poses());
    for stop in STEP..6 {
        world.true_poses[stop] = world.true_poses[STEP - 1];
    }
    let summary = summary_at(&world, STEP, &[("tolerance_factor", json!(0.5))]);
    let expected = "farther than predicted (limit ";
    assert!(
        summary.headline.starts_with("The match is good, but 0.") && summary.headline.contains(expected),
        "{summary:?}"
    );
    assert!(summary.headline.contains("the rover moved less than the 0.400 m of its pose estimate (slip)"));
}

#[test]
fn a_covered_target_is_named_as_a_window_without_contrast() {
    let mut world = PlaneWorld::new(poses());
    world.troubles[STEP] = Trouble::Covered;
    let summary = summary_at(&world, STEP, &[]);
    assert!(
        summary.headline.starts_with("The search window has no contrast: 100 % of its positions are flat"),
        "{summary:?}"
    );
    // The next step is lost for the same reason, which is explained at the first one.
    world.troubles[STEP + 1] = Trouble::Covered;
    let summary = summary_at(&world, STEP + 1, &[]);
    assert!(summary.headline.starts_with("The target was lost at the update before"), "{summary:?}");
}

#[test]
fn a_target_that_leaves_an_image_is_named_with_the_edge() {
    // A steady turn to the right moves the target towards the left edge of both images.
    let turning = |deg: f64| {
        let mut world = PlaneWorld::new(poses());
        for stop in 0..6 {
            let turned = turned(&poses()[stop], deg * stop as f64);
            (world.true_poses[stop], world.estimates[stop]) = (turned, turned);
        }
        world
    };
    let left = summary_at(&turning(TURN_DEG), STEP, &[]);
    assert!(
        left.headline.starts_with("The target leaves the") && left.headline.contains("px from the left edge"),
        "{left:?}"
    );
    let gone = summary_at(&turning(TURN_DEG), STEP + 1, &[]);
    assert!(gone.headline.starts_with("The target was lost at the update before"), "{gone:?}");
}

#[test]
fn a_step_without_a_trouble_has_no_cause() {
    let strict = [("match_sigma_max_px", json!(0.001))];
    let summary = summary_at(&PlaneWorld::new(poses()), STEP, &strict);
    assert_eq!(summary.headline, "No single cause is visible.", "{summary:?}");
    assert!(summary.bullets[0].starts_with("Rejected: match σ "), "{summary:?}");
    // A true turn on an arc is not a jump, and a jump inside the search window is not a cause.
    let mut world = PlaneWorld::new(poses());
    for stop in STEP..6 {
        world.true_poses[stop] = turned(&(poses()[STEP - 1] * Pose::translation(0.4, 0.021, 0.0)), 6.0);
        world.estimates[stop] = world.true_poses[stop];
    }
    assert_eq!(summary_at(&world, STEP, &strict).headline, "No single cause is visible.");
    let summary = summary_at(&with_heading_jump(2.0), STEP, &strict);
    assert_eq!(summary.headline, "No single cause is visible.", "{summary:?}");
}
