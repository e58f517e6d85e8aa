//! The engine on an analytic world: a tracker that works, one that is made to fail, and faults.

use super::*;
use crate::point::Visit;
use sightline_geometry::error::Error;
use sightline_geometry::frames::Pose;
use sightline_testing::{PlaneWorld, Trouble};
use sightline_track::settings::Changes;

/// Seven stops of 0.3 m towards the plane.
fn drive() -> PlaneWorld {
    PlaneWorld::new((0..7).map(|stop| Pose::translation(0.3 * f64::from(stop), 0.0, 0.0)).collect())
}

fn chosen() -> Vec<Chosen> {
    [(110.0, 120.0), (130.0, 128.0), (140.0, 135.0)]
        .map(|(x, y)| Chosen { pixel: Pixel::new(x, y), group: "all".to_owned(), fault_step: None })
        .to_vec()
}

fn settings(changes: &[(&str, serde_json::Value)]) -> Settings {
    let changes: Changes = changes.iter().map(|(key, value)| ((*key).to_owned(), value.clone())).collect();
    Settings::default().with(&changes).unwrap()
}

fn track(drive: &PlaneWorld, point: &Point, chosen: &[Chosen], settings: &Settings) -> Vec<Run> {
    let watch = Watch { cancel: &AtomicBool::new(false), tell: &|| () };
    measure(drive, point, chosen, settings, false, &watch).unwrap()
}

fn plain() -> Point {
    Point::plain("plane", "n_skip", 0)
}

#[test]
fn targets_on_a_plane_are_tracked_and_their_drift_is_what_is_left_of_the_error() {
    let runs = track(&drive(), &plain(), &chosen(), &settings(&[]));
    for run in &runs {
        assert_eq!((run.end, run.summary.run_tracked), (Some(Fate::Tracked), Some(true)), "{run:?}");
        assert_eq!((run.summary.steps, run.summary.steps_tracked), (7, Some(7)));
        let [first_m, last_m] = run.distance_m.unwrap();
        assert!((first_m - last_m - 1.8).abs() < 0.1, "{first_m} {last_m}");
        assert!(run.drift_m.unwrap() < 0.1 && run.summary.final_err_m.unwrap() < 0.1, "{run:?}");
    }
}

#[test]
fn a_tracker_whose_every_match_is_refused_loses_all_targets_although_its_evidence_is_right() {
    // No match has a standard deviation of a thousandth of a pixel.
    let refusing = settings(&[("match_sigma_max_px", 0.001.into())]);
    let runs = track(&drive(), &plain(), &chosen(), &refusing);
    for run in &runs {
        assert_eq!((run.end, run.state.as_deref()), (Some(Fate::Lost), Some("failed")));
        assert_eq!((run.summary.run_tracked, run.end_is_false_loss), (Some(false), true), "{run:?}");
    }
}

#[test]
fn a_tracker_that_believes_the_wrong_place_is_false_and_not_lost() {
    // The estimated heading jumps by 4°; the search window is too small to contain the truth, and all gates are
    // disabled.
    let mut point = plain();
    point.fault = Some(Fault::HeadingJump { step: 3, yaw_deg: 4.0 });
    let mut chosen = chosen();
    chosen.iter_mut().for_each(|target| target.fault_step = Some(3));
    let blind = settings(&[
        ("ncc_min", (-1.0).into()),
        ("stereo_ncc_min", (-1.0).into()),
        ("tolerance_factor", 100.0.into()),
        ("search_window_px", 31.into()),
    ]);
    let runs = track(&drive(), &point, &chosen, &blind);
    assert!(runs.iter().any(|run| run.at_fault == Some(Fate::False)), "{runs:?}");
    assert!(runs.iter().all(|run| run.at_fault != Some(Fate::Tracked)), "{runs:?}");
    assert!(runs.iter().any(|run| run.false_after_fault >= 1));
}

#[test]
fn a_covered_camera_is_a_loss_at_its_step_and_the_target_comes_back() {
    let mut drive = drive();
    drive.troubles[3] = Trouble::Covered;
    let mut chosen = chosen();
    chosen.iter_mut().for_each(|target| target.fault_step = Some(3));
    for run in track(&drive, &plain(), &chosen, &settings(&[])) {
        assert_eq!((run.at_fault, run.end), (Some(Fate::Lost), Some(Fate::Tracked)), "{run:?}");
        assert_eq!(run.false_after_fault, 0);
    }
}

#[test]
fn a_pixel_without_texture_in_reach_is_refused_and_said() {
    let outside = [Chosen { pixel: Pixel::new(900.0, 10.0), group: "all".to_owned(), fault_step: None }];
    let runs = track(&drive(), &plain(), &outside, &settings(&[]));
    assert!(runs[0].refused.as_ref().is_some_and(|why| why.contains("900")), "{runs:?}");
}

#[test]
fn larger_steps_visit_fewer_stops() {
    let point = Point { visit: Visit::Every(3), ..plain() };
    assert_eq!(track(&drive(), &point, &chosen(), &settings(&[]))[0].summary.steps, 3);
}

#[test]
fn a_cancelled_study_ends_without_a_result() {
    let watch = Watch { cancel: &AtomicBool::new(true), tell: &|| () };
    let ended = measure(&drive(), &plain(), &chosen(), &settings(&[]), false, &watch);
    assert!(matches!(ended, Err(Error::Cancelled)));
}

#[test]
fn the_steps_of_a_straight_drive_are_those_of_its_geometry() {
    let watch = Watch { cancel: &AtomicBool::new(false), tell: &|| () };
    let runs = measure(&drive(), &plain(), &chosen(), &settings(&[]), true, &watch).unwrap();
    let steps = &runs[1].steps;
    assert_eq!((steps.len(), steps[0].magnification, steps[1].position), (7, None, 2));
    for pair in steps.windows(2) {
        let expected = pair[0].distance_m.unwrap() / pair[1].distance_m.unwrap();
        let (seen, truth) = (pair[1].magnification.unwrap(), pair[1].magnification_true.unwrap());
        assert!((truth - expected).abs() < 1e-9 && (seen / truth - 1.0).abs() < 0.01, "{seen} {truth}");
        assert!(
            pair[1].roll_true_deg.unwrap().abs() < 0.5
                && pair[1].azimuth_change_true_deg.unwrap().abs() < 0.5
        );
    }
}
