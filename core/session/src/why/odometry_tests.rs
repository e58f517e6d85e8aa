//! The part of visual odometry in a loss, found without the truth, and the explanations of its gates.

use nalgebra::{Matrix6, Vector6};
use serde_json::json;

use super::tests::{book, check, numbers, run};
use super::*;
use crate::track;
use sightline_geometry::frames::PoseRecord;
use sightline_rover::visual_odometry::{MeasuredMotion, OdometryPreset, OdometryUpdate, Slip};
use sightline_testing::PlaneWorld;
use sightline_track::settings::Changes;
use sightline_track::target::TrackingState;

/// A motion of 60 cm by wheels and 50 cm by vision, with this 1σ of the translation; the gate allows 1.5 cm.
fn measured(sigma_m: f64, corrects: bool) -> MeasuredMotion {
    let (limit, accepted) = (0.015, sigma_m <= 0.015);
    let gate = Gate {
        criterion: 43,
        name: "odometry_sigma_m".to_owned(),
        unit: "m".to_owned(),
        value: Some(sigma_m),
        limit,
        at_least: false,
        margin: Some(limit - sigma_m),
        passed: accepted,
        setting: Some("sigma_max_m".to_owned()),
    };
    let inliers = Gate {
        criterion: 40,
        name: "odometry_inliers".to_owned(),
        unit: String::new(),
        value: Some(40.0),
        limit: 25.0,
        at_least: true,
        margin: Some(15.0),
        passed: true,
        setting: Some("inliers_min".to_owned()),
    };
    let variances = Vector6::new(sigma_m, 0.001, 0.001, 0.001, 0.001, 0.001).map(|sigma| sigma * sigma);
    let update = OdometryUpdate {
        corners: 100,
        points: 90,
        matches: 60,
        consistent: 45,
        inliers: 40,
        coarse_search: None,
        after_from_before: Some(PoseRecord::from(&Pose::translation(-0.5, 0.0, 0.0))),
        wheels_m: [0.6, 0.0, 0.0],
        covariance: Some(Matrix6::from_diagonal(&variances)),
        chi2_per_dof: Some(1.0),
        change: Some(0.1),
        slip: Some(Slip { along: 1.0 / 6.0, aside: 0.0, along_sigma: 0.01 }),
        ambiguity: 0.0,
        repetition: 0.0,
        gates: vec![inliers, gate],
        missing: None,
        accepted,
        table: Vec::new(),
    };
    let wheels_site_from_rover = PoseRecord::from(&Pose::translation(1.2, 0.0, 0.0));
    MeasuredMotion {
        preset: OdometryPreset::Sightline,
        wheels_site_from_rover,
        corrects: corrects && accepted,
        camera: None,
        update,
        refused_too: None,
    }
}

/// A step at which the target is lost, with the previous step.
fn lost() -> (PlaneWorld, [RunStep; 2], Settings) {
    let (world, mut steps, _) = run(&[]);
    let changes = Changes::from([("search_window_px".to_owned(), json!(41))]);
    let settings = Settings::default().with(&changes).unwrap();
    let lost = track::advance(&world, &steps[0], &steps[1], &settings);
    assert_ne!(lost.update.state, TrackingState::Tracking);
    (world, [steps.swap_remove(1), lost], settings)
}

/// The sentence of a lost step with this odometry; the finding is the same without the truth.
fn told(odometry: Option<MeasuredMotion>, displaced_px: f64) -> String {
    let (world, [mut before, mut lost], settings) = lost();
    lost.odometry = odometry.map(Box::new);
    if let Some(predicted) = &mut before.trace.point_mast.predicted_left {
        predicted.x += displaced_px;
    }
    let blind = |mut step: RunStep| {
        step.truth = None;
        step
    };
    let finding = odometry::finding(&lost, Some(&before), &settings);
    assert_eq!(finding, odometry::finding(&blind(lost.clone()), Some(&blind(before.clone())), &settings));
    let book = Book {
        trace: &lost,
        before: Some(&before),
        settings: &settings,
        prediction_px: None,
        sources: &world,
    };
    book.summary().text()
}

#[test]
fn a_refused_update_is_named_with_gate_value_limit_and_margin() {
    let words = told(Some(measured(0.021, true)), 0.0);
    let expected = "Visual odometry refused its update: σ of the translation is 0.0210 m, limit 0.0150 m, margin -0.00600 m; \
                    the pose is that of wheels and gyro.";
    assert!(words.ends_with(expected), "{words}");
    let mut without = measured(0.021, true);
    without.update.gates.clear();
    without.update.missing = Some("only 3 points match".to_owned());
    assert!(told(Some(without), 0.0).contains("refused its update: only 3 points match;"));
}

#[test]
fn a_slip_check_says_that_the_pose_of_the_wheels_was_used() {
    let words = told(Some(measured(0.008, false)), 0.0);
    assert!(
        words.contains("it puts the rover 0.100 m (12.50 σ) from the pose of wheels and gyro"),
        "{words}"
    );
    // A motion that corrects the pose is not blamed for the loss.
    assert!(!told(Some(measured(0.01, true)), 0.0).contains("odometry"));
}

#[test]
fn without_odometry_what_the_matches_say_of_the_pose_is_told() {
    let words = told(None, 60.0);
    assert!(words.contains("The pose is without visual odometry, and "), "{words}");
    let of_before = words.contains("at step 1 the match was ");
    assert!(of_before || words.contains("at the rim of the search window: the rover may"), "{words}");
    let (_, [before, mut lost], settings) = lost();
    // A peak in the middle of a wide window is not evidence against the pose.
    let matched = lost.trace.located_mut().unwrap().evidence.template_mut().unwrap();
    let matched = matched.match_template.as_mut().unwrap();
    let [x, y] = matched.peak.integer;
    (matched.search_window.x, matched.search_window.y) = (x - 200, y - 200);
    (matched.search_window.width, matched.search_window.height) = (401, 401);
    assert_eq!(odometry::finding(&lost, Some(&before), &settings), None);
    let mut before = before;
    if let Some(predicted) = &mut before.trace.point_mast.predicted_left {
        predicted.x += 60.0;
    }
    let words = odometry::finding(&lost, Some(&before), &settings).unwrap().sentence;
    assert!(words.contains("at step 1 the match was ") && words.contains("σ from its prediction"), "{words}");
}

#[test]
fn a_tracked_step_says_nothing_of_odometry() {
    let (_, mut steps, settings) = run(&[]);
    steps[1].odometry = Some(Box::new(measured(0.021, true)));
    assert_eq!(steps[1].update.state, TrackingState::Tracking);
    assert_eq!(odometry::finding(&steps[1], Some(&steps[0]), &settings), None);
}

#[test]
fn the_gates_of_odometry_can_be_asked_for() {
    let (world, mut steps, settings) = run(&[]);
    steps[1].odometry = Some(Box::new(measured(0.021, true)));
    let book = book(&world, &steps, &settings, 1);
    let asked = |name: &str| book.ask(name).unwrap();
    assert_eq!(numbers(&asked("value.odometry_sigma_m")), [0.021]);
    assert_eq!(numbers(&asked("limit.odometry_sigma_m")), [0.015]);
    let gate = asked("gate.odometry_sigma_m");
    assert_eq!((gate.stage.as_str(), gate.text.as_deref()), ("visual_odometry", Some("FAIL")));
    let mut count = 0;
    for name in book.names() {
        check(&book.ask(&name).unwrap(), &mut count);
    }
    assert!(book.names().contains(&"gate.odometry_inliers".to_owned()) && count >= 15, "{count}");
}
