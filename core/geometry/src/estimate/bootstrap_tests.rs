//! The bootstrap's covariance against the scatter of repeated experiments.

use super::*;
use crate::estimate::horn::rigid_motion;
use crate::estimate::motion_scene::{Scene, drive};
use crate::estimate::weighted_motion::rigid_motion_by_covariance;

fn fitted(pairs: &[Correspondence], weighting: Weighting) -> Pose {
    let (before, after): (Vec<_>, Vec<_>) = pairs.iter().map(|pair| (pair.before, pair.after)).unzip();
    match weighting {
        Weighting::None => rigid_motion(&before, &after, None).unwrap(),
        Weighting::Range => rigid_motion_by_covariance(pairs, Loss::Squares).unwrap().after_from_before,
    }
}

/// Variances of the six parameters by the bootstrap over those of repeated experiments, each with points of its own.
fn ratios(weighting: Weighting, is_stereo: bool) -> [f64; 6] {
    let mut scene = Scene::new(1);
    let truth = MotionParameters::from(&drive());
    let (mut scatter, mut mean) = (Vector6::zeros(), Vector6::zeros());
    for seed in 0..600 {
        let pairs = if is_stereo {
            let points: Vec<_> = (0..150).map(|_| scene.ground()).collect();
            scene.stereo_matches(&points, &drive())
        } else {
            scene.matches(150, &drive(), 0.01)
        };
        let motion = fitted(&pairs, weighting);
        let error = MotionParameters::from(&motion).minus(truth);
        scatter += error.component_mul(&error) / 600.0;
        let settings = BootstrapSettings { sets: 50, weighting, seed, ..BootstrapSettings::default() };
        mean += bootstrap(&pairs, &motion, &settings).unwrap().covariance.diagonal() / 600.0;
    }
    mean.component_div(&scatter).into()
}

#[test]
fn its_variances_are_those_of_repeated_experiments() {
    // A variance over 600 experiments has a standard deviation of 6 %.
    for (weighting, is_stereo) in [(Weighting::None, false), (Weighting::Range, true)] {
        let ratios = ratios(weighting, is_stereo);
        println!("{weighting:?}: {ratios:.3?}");
        assert!(ratios.iter().all(|ratio| (0.82..1.22).contains(ratio)), "{weighting:?}: {ratios:?}");
    }
}

#[test]
fn of_stereo_points_without_weights_it_overstates_only_the_roll_about_the_line_of_sight() {
    let ratios = ratios(Weighting::None, true);
    println!("{ratios:.3?}");
    for (i, ratio) in ratios.iter().enumerate() {
        let most = if i == 3 { 1.9 } else { 1.22 };
        assert!((0.82..most).contains(ratio), "{i}: {ratios:?}");
    }
}

#[test]
fn the_weighted_samples_are_those_of_whole_refits() {
    let mut scene = Scene::new(2);
    let points: Vec<_> = (0..100).map(|_| scene.ground()).collect();
    let pairs = scene.stereo_matches(&points, &drive());
    let motion = fitted(&pairs, Weighting::Range);
    let settings =
        BootstrapSettings { sets: 30, weighting: Weighting::Range, ..BootstrapSettings::default() };
    let result = bootstrap(&pairs, &motion, &settings).unwrap();
    let mut random = Pcg64::seed_from_u64(0);
    let mut times = vec![0; pairs.len()];
    for sample in &result.samples {
        draw(&mut times, &mut random);
        let drawn: Vec<_> =
            pairs.iter().zip(&times).flat_map(|(pair, &times)| vec![*pair; times as usize]).collect();
        let whole = MotionParameters::from(&fitted(&drawn, Weighting::Range)).to_vector();
        let step = Vector6::from(*sample) - result.parameters.to_vector();
        assert!((Vector6::from(*sample) - whole).norm() < 0.01 * step.norm(), "{whole} {sample:?}");
    }
}

#[test]
fn the_covariance_is_the_mean_square_of_the_samples_about_the_motion() {
    let pairs = Scene::new(3).matches(60, &drive(), 0.01);
    let motion = fitted(&pairs, Weighting::None);
    let result = bootstrap(&pairs, &motion, &BootstrapSettings::default()).unwrap();
    assert_eq!(result.samples.len(), 200);
    let squares = result.samples.iter().map(|sample| Vector6::from(*sample) - result.parameters.to_vector());
    let expected = squares.map(|d| d * d.transpose()).sum::<Matrix6<f64>>() / 200.0;
    assert!((result.covariance - expected).norm() < 1e-12 * expected.norm());
    assert!((result.parameters.to_pose().to_homogeneous() - motion.to_homogeneous()).norm() < 1e-14);
}

#[test]
fn a_yaw_of_a_half_turn_does_not_blow_the_covariance_up() {
    let behind = MotionParameters { yaw_rad: std::f64::consts::PI, ..MotionParameters::from(&drive()) };
    let pairs = Scene::new(4).matches(60, &behind.to_pose(), 0.01);
    let motion = fitted(&pairs, Weighting::None);
    let result = bootstrap(&pairs, &motion, &BootstrapSettings::default()).unwrap();
    assert!(result.covariance[(5, 5)].sqrt() < 0.01, "{}", result.covariance);
    let yaws = result.samples.iter().map(|sample| (sample[5] - result.parameters.yaw_rad).abs());
    assert!(yaws.fold(0.0, f64::max) < 0.01);
}

#[test]
fn four_matches_are_enough_and_a_line_is_not() {
    let mut scene = Scene::new(5);
    let pairs = scene.matches(4, &drive(), 0.001);
    let motion = fitted(&pairs, Weighting::None);
    let usual = BootstrapSettings::default();
    let result = bootstrap(&pairs, &motion, &usual).unwrap();
    assert!(result.samples.iter().flatten().all(|value| value.is_finite()));
    let on_line: Vec<_> = (0..20).map(|i| Point3::new(4.0 + 0.1 * f64::from(i), 0.0, 0.0)).collect();
    let line = scene.stereo_matches(&on_line, &Pose::identity());
    assert!(bootstrap(&pairs[..2], &motion, &usual).is_none());
    let exact: Vec<_> =
        line.iter().zip(&on_line).map(|(p, &q)| Correspondence { before: q, after: q, ..*p }).collect();
    assert!(bootstrap(&exact, &Pose::identity(), &usual).is_none());
}

#[test]
fn the_same_seed_gives_the_same_bits() {
    let pairs = Scene::new(6).matches(60, &drive(), 0.01);
    let motion = fitted(&pairs, Weighting::None);
    let ask = |seed| bootstrap(&pairs, &motion, &BootstrapSettings { seed, ..BootstrapSettings::default() });
    assert_eq!(ask(1), ask(1));
    assert_ne!(ask(1).unwrap().samples, ask(2).unwrap().samples);
}
