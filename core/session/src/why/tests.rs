//! Every value of a tree equals that of the record, and every closed form reproduces it from the inputs in the tree.

use nalgebra::{Matrix2, Matrix3, Quaternion, Translation3, UnitQuaternion, Vector2};
use serde_json::json;

use super::*;
use crate::track::{self, NextStep};
use sightline_geometry::cancel::Cancel;
use sightline_geometry::frames::{Point3, Vector3};
use sightline_geometry::odometry_error::OdometryError;
use sightline_testing::{PlaneWorld, Trouble};
use sightline_track::settings::Changes;
use sightline_track::target::{Designation, TrackingState};

impl Sources for PlaneWorld {
    fn site_from_rover(&self, step: usize) -> Pose {
        self.estimates[step]
    }

    fn pose_error(&self) -> OdometryError {
        OdometryError::default()
    }

    fn image_file(&self, step: usize, eye: usize) -> Option<String> {
        Some(format!("images/{}_{step:04}.png", ["left", "right"][eye]))
    }
}

fn world() -> PlaneWorld {
    let mut world =
        PlaneWorld::new([0.0, 0.6, 1.2, 1.8, 2.4].map(|x| Pose::translation(x, 0.0, 0.0)).to_vec());
    // The estimate jumps once, and the cameras are covered at one stop.
    world.estimates[2].translation.vector += Vector3::new(0.01, 0.3, 0.0);
    world.troubles[3] = Trouble::Covered;
    world
}

pub(super) fn run(changes: &[(&str, serde_json::Value)]) -> (PlaneWorld, Vec<RunStep>, Settings) {
    let changes: Changes = changes.iter().map(|(k, v)| ((*k).to_owned(), v.clone())).collect();
    let (world, settings) = (world(), Settings::default().with(&changes).unwrap());
    let designation = Designation::new(0, Pixel::new(118.3, 131.6));
    let steps = track::run(&world, designation, &settings).unwrap();
    (world, steps, settings)
}

pub(super) fn book<'a>(
    world: &'a PlaneWorld,
    steps: &'a [RunStep],
    settings: &'a Settings,
    step: usize,
) -> Book<'a> {
    let before = step.checked_sub(1).map(|before| &steps[before]);
    Book { trace: &steps[step], before, settings, prediction_px: None, sources: world }
}

pub(super) fn numbers(node: &Node) -> Vec<f64> {
    node.numbers.iter().map(|number| number.unwrap_or(f64::NAN)).collect()
}

/// Access to the inputs of a node by name.
struct Inputs<'a>(&'a Node);

impl Inputs<'_> {
    fn all(&self, name: &str) -> Vec<f64> {
        let found = self.0.inputs.iter().find(|input| input.value == name);
        numbers(found.unwrap_or_else(|| panic!("{} has no input {name}", self.0.value)))
    }

    fn one(&self, name: &str) -> f64 {
        self.all(name)[0]
    }

    fn point(&self, name: &str) -> Point3 {
        Point3::from_slice(&self.all(name))
    }

    fn pose(&self, name: &str) -> Pose {
        let v = self.all(name);
        let rotation = UnitQuaternion::from_quaternion(Quaternion::new(v[3], v[4], v[5], v[6]));
        Pose::from_parts(Translation3::new(v[0], v[1], v[2]), rotation)
    }

    fn pixel_distance(&self, a: &str, b: &str) -> f64 {
        let (a, b) = (self.all(a), self.all(b));
        (a[0] - b[0]).hypot(a[1] - b[1])
    }
}

fn largest_sigma(covariance: &[f64]) -> f64 {
    match covariance.len() {
        4 => Matrix2::from_row_slice(covariance).symmetric_eigenvalues().max().sqrt(),
        _ => Matrix3::from_row_slice(covariance).symmetric_eigenvalues().max().sqrt(),
    }
}

/// The value of a closed form, recomputed from the inputs alone; `None` for a name without a recomputation.
fn recomputed(node: &Node) -> Option<Vec<f64>> {
    // The value of a gate is also available under its own name.
    let name = node.value.strip_prefix("value.").unwrap_or(&node.value);
    let name = recorded::own_words(name).unwrap_or(name);
    limits(node, name).or_else(|| places(node, name)).or_else(|| errors(node, name)).or_else(|| {
        let same = ["ncc", "far_ncc", "position", "position_covariance_m2", "template_size_px"];
        (name.starts_with("limit.") || same.contains(&name)).then(|| numbers(&node.inputs[0]))
    })
}

fn limits(node: &Node, name: &str) -> Option<Vec<f64>> {
    let i = Inputs(node);
    let root = |names: &[&str]| names.iter().map(|name| i.one(name).powi(2)).sum::<f64>().sqrt();
    let stereo = |of: &str| {
        i.one(of).powi(2) * i.one("setting.disparity_error_px") / (i.one("focal_px") * i.one("baseline_m"))
    };
    let fraction = || i.one("setting.navigation_error_fraction");
    let factor = || i.one("setting.tolerance_factor");
    let both = ["stereo_error_old_m", "stereo_error_new_m", "navigation_step_m"];
    let four = ["stereo_error_first_m", "stereo_error_new_m", "navigation_total_m", "designation_error_m"];
    Some(vec![match name {
        name if name.starts_with("gate.") => {
            let sign = if node.formula.as_deref() == Some("value − limit") { 1.0 } else { -1.0 };
            let name = name.trim_start_matches("gate.");
            sign * (i.one(&format!("value.{name}")) - i.one(&format!("limit.{name}")))
        }
        "limit.distance_correction_m" => factor() * root(&both),
        "limit.position_correction_m" => factor() * root(&four),
        "stereo_error_old_m" => stereo("last_distance_m"),
        "stereo_error_first_m" => stereo("initial_distance_m"),
        "stereo_error_new_m" => stereo(&node.inputs[0].value),
        "navigation_step_m" => fraction() * i.one("travelled_since_update_m"),
        "navigation_total_m" => fraction() * i.one("travelled_m"),
        "designation_error_m" => 0.5 * i.one("initial_distance_m") / i.one("focal_px"),
        _ => return None,
    }])
}

fn places(node: &Node, name: &str) -> Option<Vec<f64>> {
    let i = Inputs(node);
    let apart = |a: &str, b: &str| vec![(i.point(a) - i.point(b)).norm()];
    Some(match name {
        "scale" => vec![i.one("old_distance_m") / i.one("new_distance_m")],
        "search_window_px" => {
            let growth = i.one("setting.lost_search_growth").powf(i.one("lost_count"));
            vec![f64::from((i.one("setting.search_window_px") * growth).round() as u32 | 1)]
        }
        "edge_distance_px" => {
            let (peak, window) = (i.all("peak"), i.all("search_window"));
            let half = (i.one("template_size_px") / 2.0).floor();
            let along = |k: usize| {
                let (first, last) = (window[k] + half, window[k] + window[k + 2] - 1.0 - half);
                (peak[k] - first).min(last - peak[k])
            };
            vec![along(0).min(along(1))]
        }
        "predicted_position" => {
            let now_from_before = i.pose("pose").inverse() * i.pose("pose_before");
            (now_from_before * i.point("last_position")).coords.iter().copied().collect()
        }
        "position_in_site" => (i.pose("pose") * i.point("located_position")).coords.iter().copied().collect(),
        "pose_change" => {
            pose_change::components(&(i.pose("pose_before").inverse() * i.pose("pose"))).to_vec()
        }
        "predicted_range_m" => apart("predicted_position", "camera_centre"),
        "range_located_m" => apart("located_position", "camera_centre"),
        "range_m" => apart("position", "camera_centre"),
        "distance_correction_m" => vec![(i.one("range_located_m") - i.one("predicted_range_m")).abs()],
        "position_correction_m" => apart("position_in_site", "initial_position_in_site"),
        "correction_m" => apart("located_position", "predicted_position"),
        "correction_px" => vec![i.pixel_distance("left_px", "predicted_left")],
        _ => return None,
    })
}

fn errors(node: &Node, name: &str) -> Option<Vec<f64>> {
    let i = Inputs(node);
    let error = || i.point("position") - i.point("true_position");
    Some(vec![match name {
        "err_px" => i.pixel_distance("left_px", "true_px"),
        "err_m" => error().norm(),
        "nees" => {
            let covariance = Matrix3::from_row_slice(&i.all("position_covariance_m2"));
            error().dot(&(covariance.try_inverse().unwrap() * error()))
        }
        "tolerance_px" => (0.5 * i.one("magnification")).max(5.0),
        "innovation_sigma" => {
            let (to, from) = (i.all("match_px"), i.all("predicted_left"));
            let away = Vector2::new(to[0] - from[0], to[1] - from[1]);
            let sum = Matrix2::from_row_slice(&i.all("predicted_covariance_px2"))
                + Matrix2::from_row_slice(&i.all("match_covariance_px2"));
            away.dot(&(sum.try_inverse().unwrap() * away)).sqrt()
        }
        "match_sigma_px" => largest_sigma(&i.all("match_covariance_px2")),
        "predicted_sigma_px" => largest_sigma(&i.all("predicted_covariance_px2")),
        "sigma_m" => largest_sigma(&i.all("position_covariance_m2")),
        "feature_sigma_m" => {
            let covariance = i.all("feature_covariance");
            (0..3).map(|k| covariance[7 * k].sqrt()).fold(0.0, f64::max)
        }
        "confidence" if node.inputs.is_empty() => 1.0,
        "confidence" if node.inputs[0].value == "ncc" => i.one("ncc").clamp(0.0, 1.0),
        "confidence" => {
            let below = i.one("setting.confidence_matches") - i.one("inliers");
            1.0 / (1.0 + (i.one("setting.confidence_slope") * below).exp())
        }
        _ => return None,
    }])
}

/// Checks a tree, and counts the recomputed closed forms.
pub(super) fn check(node: &Node, count: &mut usize) {
    node.inputs.iter().for_each(|input| check(input, count));
    if !node.is_closed_form || node.has_more {
        return;
    }
    let expected = recomputed(node).unwrap_or_else(|| panic!("no recomputation of {}", node.value));
    let shown = numbers(node);
    assert_eq!(expected.len(), shown.len(), "{node:#?}");
    for (a, b) in expected.iter().zip(&shown) {
        assert!((a - b).abs() <= 1e-9 * b.abs().max(1.0), "{}: {a} against {b}", node.value);
    }
    *count += 1;
}

#[test]
fn every_closed_form_gives_the_recorded_value_from_the_inputs_that_are_shown() {
    for changes in [
        vec![
            ("match_sigma_max_px", json!(5.0)),
            ("edge_distance_min_px", json!(1.0)),
            ("left_right_max_px", json!(9.0)),
        ],
        vec![("lost_search_growth", json!(1.3)), ("second_peak_ratio_max", json!(0.9))],
        vec![("tracker", json!("features"))],
    ] {
        let (world, steps, settings) = run(&changes);
        for step in 0..steps.len() {
            let book = book(&world, &steps, &settings, step);
            let mut count = 0;
            for name in book.names() {
                check(&book.ask(&name).unwrap(), &mut count);
            }
            assert!(count >= if step == 0 { 4 } else { 15 }, "step {step}: {count}");
        }
    }
}

#[test]
fn the_values_are_those_of_the_record() {
    let (world, steps, settings) = run(&[]);
    let value = |step: usize, name: &str| {
        book(&world, &steps, &settings, step)
            .ask(name)
            .ok()
            .and_then(|node| node.numbers.first().copied().flatten())
    };
    for (step, trace) in steps.iter().enumerate() {
        let row = trace.row();
        for (name, expected) in [
            ("ncc", row.ncc),
            ("stereo_score", row.stereo_score),
            ("scale", row.scale),
            ("roll_deg", row.roll_deg),
            ("err_px", row.err_px),
            ("err_m", row.err_m),
            ("nees", row.nees),
            ("sigma_m", row.sigma_m),
            ("range_m", row.range_m),
            ("budget_with_m", row.budget_with_m),
            ("value.distance_correction_m", row.distance_correction_m),
            ("limit.distance_correction_m", row.distance_tolerance_m),
            ("value.position_correction_m", row.position_correction_m),
            ("limit.position_correction_m", row.position_tolerance_m),
        ] {
            assert_eq!(value(step, name), expected, "{name} of step {step}");
        }
        for gate in trace.verdict().into_iter().flat_map(|verdict| &verdict.gates) {
            assert_eq!(value(step, &format!("gate.{}", gate.name)), gate.margin, "{}", gate.name);
        }
    }
}

#[test]
fn a_quantity_in_words_of_its_own_has_the_recorded_value() {
    let mut compared = std::collections::BTreeSet::new();
    for changes in [vec![], vec![("tracker", json!("features"))]] {
        let (world, steps, settings) = run(&changes);
        for step in 0..steps.len() {
            let book = book(&world, &steps, &settings, step);
            for quantity in StageQuantity::all() {
                let (stage, declared) = (&quantity.stage().schema().stage, quantity.declared());
                let Some(recorded) = book.of_record(stage, &declared.name) else { continue };
                let shown = book.ask(&quantity.name()).unwrap();
                let is_plain = !recorded.numbers.is_empty() && recorded.numbers.len() <= 3;
                if is_plain {
                    assert_eq!(numbers(&shown), recorded.numbers, "{quantity:?} of step {step}");
                    assert_eq!(shown.unit, recorded.unit, "{quantity:?}");
                    compared.extend(recorded::own_words(&quantity.name()));
                }
            }
        }
    }
    assert!(compared.len() > 25, "{compared:?}");
}

#[test]
fn every_value_of_a_step_leads_to_a_file_a_pose_a_setting_or_a_click() {
    let (world, steps, settings) = run(&[]);
    fn origins(node: &Node, found: &mut Vec<OriginKind>) {
        found.extend(node.origin.as_ref().map(|origin| origin.kind));
        node.inputs.iter().for_each(|input| origins(input, found));
    }
    let book = book(&world, &steps, &settings, 2);
    for name in book.names() {
        let node = book.ask(&name).unwrap();
        let mut found = Vec::new();
        origins(&node, &mut found);
        assert!(!found.is_empty(), "{node:#?}");
        assert!(node.formula.is_some() || node.origin.is_some(), "{name} says nothing");
    }
    let ncc = book.ask("ncc").unwrap();
    let mut files = Vec::new();
    fn names(node: &Node, files: &mut Vec<String>) {
        files.extend(node.origin.as_ref().map(|origin| origin.name.clone()));
        node.inputs.iter().for_each(|input| names(input, files));
    }
    names(&ncc, &mut files);
    assert!(files.contains(&"images/left_0002.png".to_owned()), "{files:?}");
    assert!(files.iter().any(|name| name == "pose estimate of stop 2"), "{files:?}");
    assert!(book.ask("nonsense").unwrap_err().to_string().starts_with("value: step 2 has no value"));
}

#[test]
fn the_sentence_of_a_lost_step_names_value_limit_rim_and_how_far_the_prediction_was_off() {
    let (world, mut steps, _) = run(&[]);
    let changes = Changes::from([("search_window_px".to_owned(), json!(41))]);
    let settings = Settings::default().with(&changes).unwrap();
    steps.truncate(2);
    let lost = track::advance(&world, &steps[0], &steps[1], &settings);
    let row = lost.row();
    assert_ne!(lost.update.state, TrackingState::Tracking);
    let before = Some(&steps[1]);
    let summary =
        Book { trace: &lost, before, settings: &settings, prediction_px: None, sources: &world }.summary();
    let words = summary.text();
    let truth = lost.truth.as_ref().unwrap().left_pixel.unwrap();
    let off = lost.point_mast.predicted_left.unwrap().distance(truth);
    assert!(summary.bullets[0].starts_with("Rejected: ") && summary.bullets.len() <= 3, "{words}");
    let failed = format!("match score {} is below 0.700 by ", words::number(row.ncc.unwrap()));
    assert!(words.contains(&failed), "{words}");
    assert!(words.contains(&format!(
        "prediction is {} px from the truth, which is outside the search window",
        words::number(off)
    )));
    assert!(words.contains("Correct rejection: the match is "), "{words}");
    let rim = template::edge_distance_px(
        lost.template().unwrap().match_template.as_ref().unwrap(),
        settings.template.template_size_px,
    );
    let matched = lost.template().unwrap().match_template.as_ref().unwrap();
    assert_eq!(Some(rim), matched.edge_distance_px);
    assert_eq!(words.contains("rim of the search window"), rim <= 3.0, "{rim}: {words}");
}

#[test]
fn a_displaced_prediction_is_told_as_what_a_person_did() {
    let (world, steps, settings) = run(&[]);
    let pixel = Pixel::new(110.0, 140.0);
    let (first, last) = (&steps[0], &steps[1]);
    let prediction_px = Some(pixel);
    let next = NextStep {
        first,
        last,
        settings: &settings,
        prediction_px,
        before: None,
        ended: None,
        cancel: Cancel::default(),
    };
    let tried = next.compute(&world).unwrap();
    let book = Book { trace: &tried, prediction_px: Some(pixel), ..book(&world, &steps, &settings, 2) };
    let node = book.ask("predicted_position").unwrap();
    assert!(!node.is_closed_form);
    assert_eq!(numbers(&node.inputs[0]), [110.0, 140.0]);
    assert_eq!(node.inputs[0].origin.as_ref().unwrap().kind, OriginKind::Person);
}
