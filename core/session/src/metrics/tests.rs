//! Metrics of runs with prescribed errors.

use super::*;
use crate::track;
use sightline_geometry::frames::{Pixel, Point3, Pose};
use sightline_testing::{PlaneWorld, Trouble};
use sightline_track::settings::Settings;
use sightline_track::target::Designation;

/// A prescribed step after the designation: state, error in px (`None`: the truth is hidden) and m, and NEES.
#[derive(Clone, Copy)]
struct Said {
    state: TrackingState,
    err_px: Option<f64>,
    err_m: f64,
    nees: f64,
}

const LOST: TrackingState = TrackingState::Lost { count: 1 };

fn said(state: TrackingState, err_px: Option<f64>, err_m: f64) -> Said {
    Said { state, err_px, err_m, nees: 3.0 }
}

/// A tracked run over the plane, with its states and truths replaced.
fn run(later: &[Said]) -> Vec<Arc<RunStep>> {
    let world = PlaneWorld::new(vec![Pose::identity(), Pose::translation(0.3, 0.0, 0.0)]);
    let designation = Designation::new(0, Pixel::new(128.0, 120.0));
    let [first, second] = track::run(&world, designation, &Settings::default()).unwrap().try_into().unwrap();
    let later = later.iter().enumerate().map(|(i, said)| {
        let mut trace = second.clone();
        (trace.step, trace.update.state) = (i + 1, said.state);
        let left_pixel = said.err_px.map(|_| Pixel::new(100.0, 100.0));
        let tracked = left_pixel
            .map(|_| said.state == TrackingState::Tracking && said.err_px.is_some_and(|error| error <= 5.0));
        trace.truth = Some(StepTruth {
            kind: TruthKind::Surface,
            position_in_rover: Point3::origin(),
            left_pixel,
            err_m: said.err_m,
            err_px: said.err_px,
            nees: Some(said.nees),
            magnification: 1.0,
            tolerance_px: 5.0,
            tracked,
        });
        trace
    });
    std::iter::once(first).chain(later).map(Arc::new).collect()
}

fn metric(found: &RunMetrics, name: &str) -> Metric {
    found.metrics.iter().find(|metric| metric.name == name).unwrap_or_else(|| panic!("no {name}")).clone()
}

fn value(found: &RunMetrics, name: &str) -> f64 {
    metric(found, name).value.unwrap_or_else(|| panic!("{name}: {:?}", metric(found, name)))
}

/// Tracked with 0.5 and 3 px, tracked while hidden, falsely lost (1.5 px), falsely tracked (20 px).
fn five() -> RunMetrics {
    use TrackingState::Tracking;
    metrics(&run(&[
        said(Tracking, Some(0.5), 0.005),
        said(Tracking, Some(3.0), 0.03),
        said(Tracking, None, 0.04),
        said(LOST, Some(1.5), 0.015),
        said(Tracking, Some(20.0), 0.30),
    ]))
}

#[test]
fn the_metrics_are_those_of_their_names_in_that_order() {
    let names: Vec<String> = five().metrics.into_iter().map(|metric| metric.name).collect();
    assert_eq!(names, NAMES);
}

#[test]
fn mean_median_and_largest_error_are_over_the_steps_that_claim_to_track() {
    let found = five();
    assert!((value(&found, "ade_px") - 23.5 / 3.0).abs() < 1e-12);
    assert_eq!((value(&found, "median_px"), value(&found, "max_px")), (3.0, 20.0));
    assert_eq!((metric(&found, "max_px").worst_step, metric(&found, "ade_px").used), (Some(5), 3));
    assert!((value(&found, "ade_cm") - (0.5 + 3.0 + 4.0 + 30.0) / 4.0).abs() < 1e-9);
    assert_eq!(metric(&found, "max_cm").worst_step, Some(5));
}

#[test]
fn a_lost_step_counts_as_outside_every_threshold() {
    let found = five();
    let shares = ["pck_1px", "pck_2px", "pck_4px", "pck_8px", "pck_16px"].map(|name| value(&found, name));
    assert_eq!(shares, [0.25, 0.25, 0.5, 0.5, 0.5], "four steps with the truth in the image");
    assert_eq!(metric(&found, "pck_4px").worst_step, Some(4), "nothing reported is worse than 20 px");
    let shares = ["pck_1cm", "pck_2cm", "pck_5cm", "pck_10cm"].map(|name| value(&found, name));
    assert_eq!(shares, [0.2, 0.2, 0.6, 0.6], "five steps with the truth known");
}

#[test]
fn survival_false_losses_and_false_tracking_have_the_words_of_the_house() {
    let found = five();
    for (name, count, worst) in [
        ("survival_steps", 3.0, Some(4)),
        ("false_lost", 1.0, Some(4)),
        ("false_tracking", 1.0, Some(5)),
        ("tracked_steps", 2.0, Some(4)),
    ] {
        assert_eq!((value(&found, name), metric(&found, name).worst_step), (count, worst), "{name}");
    }
    let calm = metrics(&run(&[said(TrackingState::Tracking, Some(0.1), 0.001); 4]));
    let survival = metric(&calm, "survival_steps");
    assert_eq!((survival.value, survival.worst_step), (Some(4.0), None));
    assert_eq!(survival.note.as_deref(), Some("Never lost so far."));
    assert_eq!(metric(&calm, "pck_1px").worst_step, None, "no step does badly");
}

#[test]
fn average_jaccard_and_occlusion_accuracy_are_those_of_tap_vid() {
    let found = five();
    // δ 1 and 2: TP 1, FP 3 (3 px, hidden, 20 px), FN 3 (3 px, lost, 20 px). δ 4, 8 and 16: TP 2, FP 2, FN 2.
    let expected = (2.0 * (1.0 / 7.0) + 3.0 * (2.0 / 6.0)) / 5.0;
    assert!((value(&found, "average_jaccard") - expected).abs() < 1e-12);
    assert!((value(&found, "occlusion_accuracy") - 3.0 / 5.0).abs() < 1e-12);
    assert_eq!(metric(&found, "occlusion_accuracy").worst_step, Some(3));
}

#[test]
fn excluded_steps_are_listed_with_the_reason() {
    let found = five();
    let steps = |why: &str| {
        let found = found.excluded.iter().find(|excluded| excluded.why.contains(why));
        found.unwrap_or_else(|| panic!("{why}")).steps.clone()
    };
    assert_eq!(steps("designated here"), [0]);
    assert_eq!(steps("not in the image"), [3]);
    assert_eq!(steps("reports the target as lost"), [4]);
    let mut world =
        PlaneWorld::new((0..3).map(|i| Pose::translation(0.3 * f64::from(i), 0.0, 0.0)).collect());
    world.troubles[1] = Trouble::Missing;
    let designation = Designation::new(0, Pixel::new(128.0, 120.0));
    let steps = track::run(&world, designation, &Settings::default()).unwrap();
    let found = metrics(&steps.into_iter().map(Arc::new).collect::<Vec<_>>());
    assert!(found.excluded.iter().any(|excluded| excluded.why.contains("damaged") && excluded.steps == [1]));
    assert_eq!(metric(&found, "ade_px").used, 1);
}

#[test]
fn without_truth_each_metric_says_what_it_needs_and_nis_is_there_all_the_same() {
    let mut steps = run(&[said(TrackingState::Tracking, Some(0.1), 0.001); 3]);
    for step in &mut steps {
        Arc::make_mut(step).truth = None;
    }
    let found = metrics(&steps);
    assert_eq!(found.truth, None);
    for metric in &found.metrics {
        let needs_truth = !matches!(metric.name.as_str(), "survival_steps" | "mean_nis");
        assert_eq!(metric.value.is_none(), needs_truth, "{}", metric.name);
        assert!(!needs_truth || metric.note.as_ref().unwrap().contains("truth"), "{metric:?}");
    }
}

#[test]
fn a_carried_truth_tells_drift_and_nothing_of_occlusion() {
    let mut steps = run(&[said(TrackingState::Tracking, Some(0.1), 0.001); 3]);
    for step in &mut steps {
        if let Some(truth) = &mut Arc::make_mut(step).truth {
            truth.kind = TruthKind::Carried;
        }
    }
    let found = metrics(&steps);
    assert!(metric(&found, "ade_px").value.is_some());
    assert!(metric(&found, "average_jaccard").note.unwrap().contains("does not apply"));
}

#[test]
fn the_verdict_names_mean_band_and_number_of_steps() {
    // χ² with 90 degrees of freedom: 65.647 and 118.136 (any table of quantiles).
    let [low, high] = uncertainty::band(3.0, 30).unwrap();
    assert!((low - 65.647 / 30.0).abs() < 1e-4 && (high - 118.136 / 30.0).abs() < 1e-4, "{low} {high}");
    let with = |nees: f64| {
        let step = Said { nees, ..said(TrackingState::Tracking, Some(0.1), 0.001) };
        metrics(&run(&[step; 30])).uncertainty
    };
    assert_eq!(
        with(4.1).sentence,
        "covariance probably too small: mean NEES 4.1, band 2.2 to 3.9 for 30 steps"
    );
    for (nees, verdict) in
        [(12.0, " too small:"), (3.0, "about right"), (1.0, "probably too large"), (0.1, " too large:")]
    {
        let found = with(nees);
        assert!(found.sentence.contains(verdict), "{}", found.sentence);
        let inside = found.coverage.iter().find(|coverage| coverage.sigmas == 2.0).unwrap();
        assert_eq!(inside.share, f64::from(nees <= 4.0));
        // χ² with 3 degrees of freedom below 4: 73.85 %.
        assert!((inside.expected - 0.7385).abs() < 1e-4);
    }
}

#[test]
fn nis_is_the_squared_distance_in_sigmas_between_match_and_prediction() {
    let steps = run(&[said(TrackingState::Tracking, Some(0.1), 0.001)]);
    let mut trace = steps[1].as_ref().clone();
    let evidence = trace.located_mut().and_then(|located| located.evidence.template_mut()).unwrap();
    let matched = evidence.match_template.as_mut().unwrap();
    (matched.pixel, matched.covariance_px2) = (Pixel::new(103.0, 104.0), nalgebra::Matrix2::identity() * 9.0);
    let pointing = &mut trace.point_mast;
    pointing.predicted_left = Some(Pixel::new(100.0, 100.0));
    pointing.predicted_covariance_px2 = Some(nalgebra::Matrix2::identity() * 16.0);
    assert!((uncertainty::nis(&trace).unwrap() - 1.0).abs() < 1e-12);
    trace.update.state = LOST;
    assert_eq!(uncertainty::nis(&trace), None, "only accepted updates count");
}
