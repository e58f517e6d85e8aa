//! Steps of an analytic world that are lost for a known reason: the counterfactual must find it.

use std::sync::OnceLock;
use std::sync::atomic::AtomicBool;

use serde_json::{Value, json};

use super::*;
use crate::track;
use crate::what_if::try_step;
use sightline_geometry::camera::{Camera, CameraName, Mast, MastAngles};
use sightline_geometry::cancel::Cancel;
use sightline_geometry::frames::{Point3, Pose, Vector3};
use sightline_geometry::odometry_error::OdometryError;
use sightline_geometry::stereo_geometry::StereoGeometry;
use sightline_rover::pipeline::Stops;
use sightline_rover::visual_odometry::{MeasuredMotion, OdometryMode, OdometryPreset};
use sightline_testing::{PlaneWorld, Trouble};
use sightline_track::settings::Settings;
use sightline_track::stages::capture::StereoPair;
use sightline_track::target::Designation;
use sightline_track::trace::StepKind;
use sightline_world::target_truth::TruthSource;

/// The step that is lost.
const STEP: usize = 2;

fn settings(changes: &[(&str, Value)]) -> Settings {
    let changes = changes.iter().map(|(key, value)| ((*key).to_owned(), value.clone()));
    Settings::default().with(&changes.collect()).unwrap()
}

/// An approach whose estimated pose jumps sideways at [`STEP`].
fn world(jump_m: f64) -> PlaneWorld {
    let mut world = PlaneWorld::new([0.0, 0.6, 1.2].map(|x| Pose::translation(x, 0.0, 0.0)).to_vec());
    world.estimates[STEP].translation.vector += Vector3::y() * jump_m;
    world
}

/// The world with a cache of its images, because a search uses the same two pairs repeatedly.
struct Rendered {
    world: PlaneWorld,
    pairs: Vec<OnceLock<StereoPair>>,
}

impl Rendered {
    fn new(world: PlaneWorld) -> Self {
        let pairs = world.true_poses.iter().map(|_| OnceLock::new()).collect();
        Self { world, pairs }
    }
}

impl Stops for Rendered {
    fn stop_count(&self) -> usize {
        self.world.stop_count()
    }
    fn time_s(&self, step: usize) -> f64 {
        self.world.time_s(step)
    }
    fn site_from_rover(&self, step: usize) -> Pose {
        self.world.estimates[step]
    }
    fn cameras(&self, step: usize) -> (&Camera, &Camera) {
        self.world.cameras(step)
    }
    fn mast(&self) -> Option<&Mast> {
        None
    }
    fn mast_angles(&self, _step: usize) -> Option<MastAngles> {
        None
    }
    fn odometry_error(&self) -> OdometryError {
        self.world.odometry_error()
    }
    fn pointing_error_deg(&self) -> f64 {
        self.world.pointing_error_deg()
    }
    fn stereo(&self) -> StereoGeometry {
        self.world.stereo()
    }
    fn capture(&self, step: usize, _: Cancel<'_>) -> Result<StereoPair> {
        if self.world.troubles[step] == Trouble::Missing {
            return self.world.capture(step, Cancel::default());
        }
        Ok(self.pairs[step].get_or_init(|| self.world.capture(step, Cancel::default()).unwrap()).clone())
    }
}

impl TruthSource for Rendered {
    fn true_site_from_rover(&self, step: usize) -> Option<Pose> {
        self.world.true_site_from_rover(step)
    }
    fn true_left_camera(&self, step: usize, camera: Option<CameraName>) -> Option<&Camera> {
        self.world.true_left_camera(step, camera)
    }
    fn surface_point_in_site(&self, step: usize, camera: Option<CameraName>, pixel: Pixel) -> Option<Point3> {
        self.world.surface_point_in_site(step, camera, pixel)
    }
    fn is_visible(&self, step: usize, camera: Option<CameraName>, point_in_site: &Point3) -> bool {
        self.world.is_visible(step, camera, point_in_site)
    }
}

/// A run of which only the last step has the settings under test.
struct Staged {
    world: Rendered,
    steps: Vec<RunStep>,
    settings: Settings,
}

impl Staged {
    fn new(world: PlaneWorld, changes: &[(&str, Value)]) -> Self {
        let world = Rendered::new(world);
        let designation = Designation::new(0, Pixel::new(118.3, 131.6));
        let mut steps = track::run(&world, designation, &Settings::default()).unwrap();
        steps.truncate(STEP);
        let settings = settings(changes);
        steps.push(track::advance(&world, &steps[0], &steps[STEP - 1], &settings));
        Self { world, steps, settings }
    }

    fn base(&self) -> Base<'_> {
        Base {
            first: &self.steps[0],
            last: Some(&self.steps[STEP - 1]),
            recorded: &self.steps[STEP],
            settings: &self.settings,
            prediction_px: None,
        }
    }

    fn answer(&self) -> Answer {
        look(&self.world, self.base(), &AtomicBool::new(false), &mut |_| {}).unwrap()
    }

    fn with(&self, key: &str, value: Value) -> RunStep {
        let what_if = WhatIf { settings: Changes::from([(key.to_owned(), value)]), ..WhatIf::default() };
        try_step(&self.world, self.base(), &what_if, Cancel::default()).unwrap()
    }
}

fn of<'a>(answer: &'a Answer, setting: &str) -> &'a Finding {
    let is_it = |finding: &&Finding| finding.changes.len() == 1 && finding.changes[0].setting == setting;
    let found = answer.findings.iter().find(is_it);
    found.unwrap_or_else(|| panic!("nothing was found for {setting}: {answer:#?}"))
}

#[test]
fn a_window_too_small_for_a_displaced_prediction_is_answered_by_the_least_window_that_holds_the_match() {
    // 40 cm sideways at 6.8 m are 35 px; a window of 61 px searches 20 px to each side.
    let staged = Staged::new(world(0.4), &[("search_window_px", json!(61))]);
    assert!(!is_accepted(&staged.steps[STEP]));
    let answer = staged.answer();
    let finding = of(&answer, "search_window_px");
    let least = (63..=143)
        .step_by(2)
        .find(|&side| {
            let tried = staged.with("search_window_px", json!(side));
            tried.truth.as_ref().unwrap().tracked == Some(true)
        })
        .unwrap();
    assert_eq!(finding.changes[0].to, json!(least));
    assert_eq!(finding.outcome, Outcome::Right);
    assert!(finding.row.err_px.unwrap() < 2.0 && finding.margin_after.unwrap() > 0.0, "{finding:?}");
    assert!(finding.runs <= 26, "{}", finding.runs);
    assert!((finding.relative - f64::from(least - 61) / 61.0).abs() < 1e-12);
    assert!(finding.sentence.starts_with(&format!("search window 61 → {least} px: accepted, correct")));
    let margin = finding.with_margin.as_ref().unwrap();
    let wide = staged.with("search_window_px", margin.to.clone());
    let wide_px = wide.template().unwrap().match_template.as_ref().unwrap().edge_distance_px.unwrap();
    assert_eq!(wide.truth.as_ref().unwrap().tracked, Some(true));
    assert!(wide_px >= 10.0, "the peak is half a template from the rim: {wide_px} px at {margin:?}");
    // The verified row equals that of the recomputed step.
    let again = try_step(&staged.world, staged.base(), &finding.what_if(), Cancel::default()).unwrap();
    assert_eq!(again.row(), finding.row);
}

#[test]
fn the_prediction_need_only_move_until_the_match_is_in_the_window() {
    let staged = Staged::new(world(0.4), &[("search_window_px", json!(61))]);
    let answer = staged.answer();
    let finding = answer.findings.iter().find(|finding| finding.moved.is_some()).unwrap();
    let moved = finding.moved.as_ref().unwrap();
    let truth = staged.steps[STEP].truth.as_ref().unwrap().left_pixel.unwrap();
    assert!(moved.from.distance(moved.to) < moved.from.distance(truth));
    // The search window extends 20 px from the displaced prediction; a match within the tolerance of R116 counts as right.
    let tolerance_px = staged.steps[STEP].truth.as_ref().unwrap().tolerance_px;
    let left_px = (truth.x - moved.to.x).abs().max((truth.y - moved.to.y).abs());
    assert!((19.0..20.5 + tolerance_px).contains(&left_px), "{left_px} px are left, {tolerance_px} allowed");
    assert_eq!(finding.outcome, Outcome::Right);
    let again = try_step(&staged.world, staged.base(), &finding.what_if(), Cancel::default()).unwrap();
    assert_eq!(again.row(), finding.row);
    let nearer = Pixel::new(
        moved.from.x + (moved.to.x - moved.from.x) * 0.8,
        moved.from.y + (moved.to.y - moved.from.y) * 0.8,
    );
    let short = WhatIf { prediction_px: Some(nearer), ..WhatIf::default() };
    assert!(!is_accepted(&try_step(&staged.world, staged.base(), &short, Cancel::default()).unwrap()));
}

#[test]
fn a_slip_that_odometry_would_have_seen_is_answered_by_the_place_where_it_puts_the_prediction() {
    let staged = Staged::new(world(0.4), &[("search_window_px", json!(61))]);
    let by_vision = |staged: &Staged| {
        let answer = staged.answer();
        let is_it = |finding: &&Finding| {
            finding.moved.as_ref().is_some_and(|moved| moved.because.contains("visual odometry"))
        };
        (answer.findings.iter().find(is_it).cloned(), answer)
    };
    let (finding, _) = by_vision(&staged);
    let finding = finding.unwrap();
    let truth = staged.steps[STEP].truth.as_ref().unwrap().left_pixel.unwrap();
    let moved = finding.moved.as_ref().unwrap();
    assert!(moved.from.distance(truth) > 30.0 && moved.to.distance(truth) < 1.5, "{moved:?} {truth:?}");
    assert_eq!(finding.outcome, Outcome::Right);
    assert!(finding.sentence.contains("which is off in this drive"), "{}", finding.sentence);
    // A refused motion is reported with its gate; for a corrected pose this candidate does not apply.
    let mut refused = staged;
    let how = (OdometryMode::Full, OdometryPreset::Sightline);
    let mut measured = MeasuredMotion::measure(&refused.world, STEP, None, how, Cancel::default()).unwrap();
    let gate = measured.update.gates.iter_mut().find(|gate| gate.name == "odometry_sigma_m").unwrap();
    (gate.limit, gate.passed, gate.margin) = (1e-6, false, gate.value.map(|value| 1e-6 - value));
    (measured.update.accepted, measured.corrects) = (false, false);
    refused.steps[STEP].odometry = Some(Box::new(measured.clone()));
    let (named, _) = by_vision(&refused);
    assert!(named.unwrap().sentence.contains("σ of the translation is "), "the gate is named");
    (measured.update.accepted, measured.corrects) = (true, true);
    refused.steps[STEP].odometry = Some(Box::new(measured));
    let (none, answer) = by_vision(&refused);
    assert!(none.is_none() && !answer.without.contains(&"visual odometry".to_owned()));
}

#[test]
fn a_limit_too_strict_is_answered_by_the_value_that_failed_rounded_to_the_loose_side() {
    let staged = Staged::new(world(0.0), &[("ncc_min", json!(0.9999))]);
    let ncc = staged.steps[STEP].row().ncc.unwrap();
    assert!(ncc < 0.9999 && !is_accepted(&staged.steps[STEP]));
    let finding_of = staged.answer();
    let finding = of(&finding_of, "ncc_min");
    let to = finding.changes[0].to.as_f64().unwrap();
    assert!(to <= ncc && ncc - to <= 0.1 * (0.9999 - ncc), "{to} for {ncc}");
    assert_eq!((finding.outcome, finding.runs), (Outcome::Right, 2));
    assert!((finding.margin_after.unwrap() - (ncc - to)).abs() < 1e-12);
    // It is the smallest of all right changes.
    assert_eq!(finding_of.findings[0], *finding);
}

#[test]
fn a_tolerance_too_strict_is_answered_by_its_factor() {
    let staged = Staged::new(world(0.4), &[("tolerance_factor", json!(0.3))]);
    let gate = staged.steps[STEP].verdict().unwrap().gates[3].clone();
    assert!(gate.name == "position_correction_m" && !gate.passed, "{gate:?}");
    let answer = staged.answer();
    let to = of(&answer, "tolerance_factor").changes[0].to.as_f64().unwrap();
    let exact = 0.3 * gate.value.unwrap() / gate.limit;
    assert!(to >= exact && to - exact <= 0.1 * (exact - 0.3), "{to} for {exact}");
    // A term of the tolerance has the same effect, but must be searched for.
    let fraction = of(&answer, "disparity_error_px").changes[0].to.as_f64().unwrap();
    assert!(is_accepted(&staged.with("disparity_error_px", json!(fraction))));
    assert!(!is_accepted(&staged.with("disparity_error_px", json!(1.0 + 0.8 * (fraction - 1.0)))));
}

#[test]
fn two_limits_too_strict_are_answered_together_and_neither_alone() {
    let staged = Staged::new(world(0.4), &[("ncc_min", json!(0.9999)), ("tolerance_factor", json!(0.3))]);
    let failed = staged.steps[STEP].verdict().unwrap().gates.iter().filter(|g| !g.passed).count();
    assert_eq!(failed, 2);
    let answer = staged.answer();
    let both = answer.findings.iter().find(|finding| finding.changes.len() == 2).unwrap();
    assert_eq!(both.outcome, Outcome::Right);
    assert!(answer.without.contains(&"ncc_min".to_owned()), "{:?}", answer.without);
    assert!(answer.without.contains(&"tolerance_factor".to_owned()));
}

#[test]
fn an_acceptance_that_is_false_tracking_is_said_plainly_and_comes_last() {
    let staged = Staged::new(
        world(0.4),
        &[
            ("search_window_px", json!(61)),
            ("ncc_min", json!(0.95)),
            ("stereo_ncc_min", json!(-1.0)),
            ("far_ncc_min", json!(-1.0)),
        ],
    );
    let answer = staged.answer();
    let finding = of(&answer, "ncc_min");
    assert_eq!(finding.outcome, Outcome::False);
    assert!(finding.sentence.contains("FALSE"), "{}", finding.sentence);
    let outcomes: Vec<Outcome> = answer.findings.iter().map(|finding| finding.outcome).collect();
    assert!(outcomes.is_sorted(), "{outcomes:?}");
    assert_eq!((outcomes[0], *outcomes.last().unwrap()), (Outcome::Right, Outcome::False));
    for alike in answer.findings.chunk_by(|a, b| a.outcome == b.outcome) {
        assert!(alike.is_sorted_by(|a, b| a.relative <= b.relative));
    }
}

#[test]
fn false_tracking_is_turned_into_a_loss_by_a_stricter_limit_and_into_the_truth_by_a_wider_search() {
    let loose = [
        ("search_window_px", json!(61)),
        ("ncc_min", json!(-1.0)),
        ("stereo_ncc_min", json!(-1.0)),
        ("far_ncc_min", json!(-1.0)),
        ("tolerance_factor", json!(100.0)),
    ];
    let staged = Staged::new(world(0.4), &loose);
    assert!(is_accepted(&staged.steps[STEP]));
    let answer = staged.answer();
    assert_eq!(answer.goal, Goal::NotFalse);
    assert_eq!(of(&answer, "search_window_px").outcome, Outcome::Right);
    let stricter = of(&answer, "ncc_min");
    assert_eq!(stricter.outcome, Outcome::Rejected);
    let ncc = staged.steps[STEP].row().ncc.unwrap();
    let to = stricter.changes[0].to.as_f64().unwrap();
    assert!(to > ncc && to < ncc + 0.13 * (1.0 + ncc), "{to} for {ncc}");
    assert!(answer.findings.iter().all(|finding| finding.outcome != Outcome::False));
}

#[test]
fn partial_findings_come_as_they_are_found_and_the_same_question_has_the_same_answer() {
    let staged = Staged::new(world(0.0), &[("ncc_min", json!(0.9999))]);
    let mut heard: Vec<(usize, usize)> = Vec::new();
    let mut on = |answer: &Answer| heard.push((answer.k, answer.findings.len()));
    let answer = look(&staged.world, staged.base(), &AtomicBool::new(false), &mut on).unwrap();
    assert!(heard.is_sorted() && heard.iter().any(|(k, findings)| *k < answer.n && *findings > 0));
    assert_eq!((answer.k, answer.findings.len() + answer.without.len()), (answer.n, answer.n));
    assert_eq!(staged.answer(), answer);
}

#[test]
fn a_cancelled_question_ends_before_its_next_trial() {
    let staged = Staged::new(world(0.0), &[("ncc_min", json!(0.9999))]);
    let cancel = AtomicBool::new(false);
    let mut last = None;
    let mut on = |answer: &Answer| {
        cancel.store(answer.k >= 2, std::sync::atomic::Ordering::Relaxed);
        last = Some(answer.clone());
    };
    let ended = look(&staged.world, staged.base(), &cancel, &mut on);
    assert!(matches!(ended, Err(Error::Cancelled)));
    assert_eq!(last.unwrap().k, 2);
}

#[test]
fn where_there_is_nothing_to_save_the_question_is_refused_with_the_reason() {
    let staged = Staged::new(world(0.0), &[]);
    let refuse = |base: &Base<'_>| goal(base).unwrap_err().to_string();
    assert!(refuse(&staged.base()).contains("was accepted"));
    let designation = Base { last: None, recorded: &staged.steps[0], ..staged.base() };
    assert!(refuse(&designation).contains("designated at step 0"));
    let mut covered = world(0.0);
    covered.troubles[STEP] = Trouble::Missing;
    assert!(refuse(&Staged::new(covered, &[]).base()).contains("files of step 2"));
    let mut failed = staged.steps[STEP].clone();
    let StepKind::Tracked { judge, .. } = &mut failed.kind else { panic!("the step was judged") };
    judge.state_before = TrackingState::Failed;
    assert!(refuse(&Base { recorded: &failed, ..staged.base() }).contains("had failed before step 2"));
}
