//! The weighted motion against Horn's, and its covariance against the scatter of its errors.

use super::*;
use crate::estimate::motion_scene::{Scene, drive, exact};

/// The error (τ, ω): the small motion from the estimate to the truth.
fn error(found: &UncertainMotion, truth: &Pose) -> Vector6<f64> {
    let rest = truth * found.after_from_before.inverse();
    let shift = rest * found.about - found.about;
    let turn = rest.rotation.scaled_axis();
    Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z)
}

/// Points 2 to 15 m away, in the field of view of a navcam.
fn near_and_far(scene: &mut Scene, count: usize) -> Vec<Point3> {
    let point = |_| {
        let (range, azimuth) = (scene.between(2.0, 15.0), scene.between(-0.4, 0.4));
        Point3::new(range * azimuth.cos(), range * azimuth.sin(), scene.between(-0.5, 0.5))
    };
    (0..count).map(point).collect()
}

#[test]
fn with_equal_round_covariances_it_is_horns_motion() {
    let mut scene = Scene::new(1);
    for _ in 0..50 {
        let pairs = scene.matches(40, &drive(), 0.02);
        let (before, after): (Vec<_>, Vec<_>) = pairs.iter().map(|pair| (pair.before, pair.after)).unzip();
        let expected = rigid_motion(&before, &after, None).unwrap();
        let found = rigid_motion_by_covariance(&pairs, Loss::Squares).unwrap().after_from_before;
        assert!((found.to_homogeneous() - expected.to_homogeneous()).norm() < 1e-10);
    }
}

#[test]
fn exact_data_give_the_exact_motion_whatever_the_loss() {
    let mut scene = Scene::new(2);
    for loss in [Loss::Squares, Loss::Huber, Loss::Cauchy] {
        let truth = scene.any_motion(1.0);
        let mut pairs = scene.stereo_matches(&near_and_far(&mut Scene::new(3), 30), &truth);
        pairs.iter_mut().for_each(|pair| pair.after = truth * pair.before);
        let found = rigid_motion_by_covariance(&pairs, loss).unwrap().after_from_before;
        assert!((found.to_homogeneous() - truth.to_homogeneous()).norm() < 1e-12, "{loss:?}");
    }
}

#[test]
fn where_noise_grows_with_range_it_beats_horn_and_its_covariance_is_calibrated() {
    let mut scene = Scene::new(4);
    let points = near_and_far(&mut scene, 80);
    let runs = 600;
    let (mut plain, mut weighted, mut nees) = (Vector6::zeros(), Vector6::zeros(), 0.0);
    for _ in 0..runs {
        let pairs = scene.stereo_matches(&points, &drive());
        let found = rigid_motion_by_covariance(&pairs, Loss::Squares).unwrap();
        let (before, after): (Vec<_>, Vec<_>) = pairs.iter().map(|pair| (pair.before, pair.after)).unzip();
        let horn =
            UncertainMotion { after_from_before: rigid_motion(&before, &after, None).unwrap(), ..found };
        let [by_weight, by_horn] = [&found, &horn].map(|motion| error(motion, &drive()));
        nees += by_weight.dot(&(found.covariance.cholesky().unwrap().solve(&by_weight))) / f64::from(runs);
        weighted += by_weight.component_mul(&by_weight);
        plain += by_horn.component_mul(&by_horn);
    }
    // The mean of 600 chi-squares of 6 degrees of freedom has a standard deviation of 0.14.
    println!("NEES {nees}, ratios {:?}", plain.component_div(&weighted).map(f64::sqrt).as_slice());
    assert!((nees - 6.0).abs() < 0.5, "mean NEES {nees}");
    let [shift, turn] =
        [0, 3].map(|from| (plain.fixed_rows::<3>(from).sum() / weighted.fixed_rows::<3>(from).sum()).sqrt());
    assert!(shift > 1.5 && turn > 1.5, "Horn's errors are {shift} and {turn} times as large");
}

#[test]
fn robust_losses_hold_back_a_match_that_is_wrong() {
    let mut scene = Scene::new(5);
    let points = near_and_far(&mut scene, 40);
    let mut pairs = scene.stereo_matches(&points, &drive());
    pairs[7].after += Vector3::new(0.0, 0.4, 0.0);
    pairs[21].after += Vector3::new(0.0, 0.3, 0.2);
    let off =
        |loss| error(&rigid_motion_by_covariance(&pairs, loss).unwrap(), &drive()).fixed_rows::<3>(0).norm();
    let [squares, huber, cauchy] = [Loss::Squares, Loss::Huber, Loss::Cauchy].map(off);
    assert!(huber < squares / 3.0 && cauchy < squares / 3.0, "{squares} {huber} {cauchy}");
}

#[test]
fn a_match_without_noise_cannot_be_weighted() {
    let mut pairs = Scene::new(6).matches(10, &drive(), 0.01);
    pairs[3] = exact(pairs[3].before, pairs[3].after, Matrix3::zeros());
    assert_eq!(rigid_motion_by_covariance(&pairs, Loss::Squares), Err(Degenerate::Covariance));
    assert_eq!(
        rigid_motion_by_covariance(&pairs[..2], Loss::Squares),
        Err(Degenerate::TooFew { matches: 2 })
    );
}
