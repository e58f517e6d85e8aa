//! RANSAC with many outliers, and its messages if there is no motion.

use super::*;
use crate::estimate::motion_scene::{Scene, drive, exact};
use crate::frames::Vector3;

/// The middle of the ground, where the target is.
const TARGET: Point3 = Point3::new(5.0, 0.0, 0.0);

/// `count` matches, of which the first `wrong` are matched with random points of the ground.
fn with_wrong(scene: &mut Scene, count: usize, wrong: usize, sigma_m: f64) -> Vec<Correspondence> {
    let mut pairs = scene.matches(count, &drive(), sigma_m);
    pairs[..wrong].iter_mut().for_each(|pair| pair.after = drive() * scene.ground());
    pairs
}

fn missing(pairs: &[Correspondence]) -> String {
    let fit = fit_motion(pairs, &RansacSettings::default());
    assert!(fit.after_from_before.is_none() && fit.inliers.is_empty() && fit.residuals_m.is_empty());
    fit.missing.unwrap()
}

#[test]
fn sixty_per_cent_of_wrong_matches_are_seen_through() {
    // 300 matches on 4 × 4 × 1 m, of which 120 are correct to 1 cm on each axis; at least one of a hundred samples of
    // three has no outlier with a probability of 99.87 %.
    let (mut good, mut worst_m, mut worst_rad) = (0, 0.0_f64, 0.0_f64);
    let mut scene = Scene::new(1);
    for seed in 0..1000 {
        let pairs = with_wrong(&mut scene, 300, 180, 0.01);
        let fit = fit_motion(&pairs, &RansacSettings { seed, ..RansacSettings::default() });
        let Some(motion) = fit.motion() else { continue };
        let off_m = (motion * TARGET - drive() * TARGET).norm();
        let off_rad = motion.rotation.angle_to(&drive().rotation);
        if off_m <= 0.005 && off_rad <= 0.005 {
            good += 1;
            (worst_m, worst_rad) = (worst_m.max(off_m), worst_rad.max(off_rad));
        }
    }
    println!("{good} of 1000; the worst of them {worst_m:.4} m and {worst_rad:.4} rad");
    assert!(good >= 990, "{good} of 1000");
}

#[test]
fn inliers_are_the_matches_inside_the_gate_and_the_numbers_are_theirs() {
    let pairs = with_wrong(&mut Scene::new(2), 200, 80, 0.005);
    let fit = fit_motion(&pairs, &RansacSettings::default());
    let motion = fit.motion().unwrap();
    let residuals: Vec<f64> = pairs.iter().map(|pair| pair.residual(&motion).norm()).collect();
    let inside: Vec<usize> = (0..200).filter(|&i| residuals[i] < 0.03).collect();
    assert_eq!(fit.inliers, inside);
    assert!(fit.inliers.iter().filter(|&&i| i >= 80).count() == 120 && fit.inliers.len() < 125);
    assert!(residuals.iter().zip(&fit.residuals_m).all(|(a, b)| (a - b).abs() < 1e-13));
    let mut sorted: Vec<f64> = inside.iter().map(|&i| residuals[i]).collect();
    sorted.sort_by(f64::total_cmp);
    let middle = (sorted[(sorted.len() - 1) / 2] + sorted[sorted.len() / 2]) / 2.0;
    assert!((fit.median_m.unwrap() - middle).abs() < 1e-13);
    let rms = (sorted.iter().map(|r| r * r).sum::<f64>() / sorted.len() as f64).sqrt();
    assert!((fit.rms_m.unwrap() - rms).abs() < 1e-13);

    assert_eq!(fit.consensus_by_draw.len(), 100);
    assert_eq!(fit.ending, Some(Ending::Settled));
    assert_eq!(fit.refits[0].inliers, *fit.consensus_by_draw.iter().max().unwrap());
    assert_eq!(fit.refits.last().unwrap().inliers as usize, fit.inliers.len());
}

#[test]
fn the_same_seed_gives_the_same_bits_and_another_seed_other_draws() {
    let pairs = with_wrong(&mut Scene::new(3), 150, 60, 0.01);
    for weighting in [Weighting::None, Weighting::Range] {
        let ask = |seed| fit_motion(&pairs, &RansacSettings { seed, weighting, ..RansacSettings::default() });
        let bits = |fit: &MotionFit| serde_json::to_string(fit).unwrap();
        assert_eq!(bits(&ask(5)), bits(&ask(5)));
        assert_ne!(ask(5).consensus_by_draw, ask(6).consensus_by_draw);
        let again: MotionFit = serde_json::from_str(&bits(&ask(5))).unwrap();
        assert_eq!(again, ask(5));
    }
}

#[test]
fn degenerate_sets_are_refused_by_name() {
    let exact = |before: Point3| exact(before, drive() * before, Matrix3::zeros());
    let line = |t: f64| Point3::new(4.0 + t, 1.0 - 0.5 * t, 0.2 * t);
    let two = [line(0.0), line(1.0)].map(exact);
    assert_eq!(missing(&two), "there are fewer than three matches (2)");
    assert_eq!(missing(&[]), "there are fewer than three matches (0)");
    assert_eq!(missing(&[exact(line(0.0)); 10]), "all matches are at the same point");
    let on_line: Vec<_> = (0..30).map(|i| exact(line(0.1 * f64::from(i)))).collect();
    assert!(missing(&on_line).starts_with("all matches are on a line"), "{}", missing(&on_line));
    let close: Vec<_> = (0..25)
        .map(|i| exact(TARGET + Vector3::new(0.003 * f64::from(i % 5), 0.003 * f64::from(i / 5), 0.0)))
        .collect();
    assert!(missing(&close).contains("too small for a rotation"), "{}", missing(&close));
}

#[test]
fn a_line_among_wrong_matches_is_not_taken_for_a_motion() {
    // The correct matches are within a centimetre of a line, so that some three span a triangle; the wrong ones are
    // matched farther and farther away.
    let mut scene = Scene::new(4);
    let mut pairs = with_wrong(&mut scene, 60, 20, 0.0);
    for (i, pair) in pairs.iter_mut().enumerate() {
        pair.after.z += 5.0 + 2.0 * i as f64;
        if i >= 20 {
            let before = Point3::new(3.0 + 0.05 * i as f64, 0.0, 0.0) + scene.noise(0.006);
            *pair = exact(before, drive() * before, Matrix3::zeros());
        }
    }
    let reason = missing(&pairs);
    assert!(reason.starts_with("refit to the inliers: all matches are on a line"), "{reason}");
}

#[test]
fn matches_that_all_lead_elsewhere_agree_on_nothing() {
    // Residuals of metres: not even the three sampled matches are within a millimetre of their motion.
    let pairs = with_wrong(&mut Scene::new(5), 40, 40, 0.0);
    let settings = RansacSettings { inlier_m: 0.001, ..RansacSettings::default() };
    let fit = fit_motion(&pairs, &settings);
    assert_eq!(fit.missing.unwrap(), "no draw found three matches that agree on a motion");
    assert_eq!(fit.consensus_by_draw.len(), 100);
}

#[test]
fn draws_go_on_until_success_is_probable() {
    let ask = |wrong: usize, adaptive: bool| {
        let pairs = with_wrong(&mut Scene::new(6), 200, wrong, 0.002);
        let settings = RansacSettings { draws: 10, adaptive, ..RansacSettings::default() };
        fit_motion(&pairs, &settings).consensus_by_draw.len()
    };
    assert_eq!(ask(150, false), 10);
    assert_eq!(ask(0, true), 10);
    // w is just above 0.25: ln 0.001 / ln(1 − w³) = 439 samples, a few less if wrong matches are inliers by chance.
    assert!((330..=450).contains(&ask(150, true)), "{}", ask(150, true));
    assert_eq!(ask(199, true), 2000);
}

#[test]
fn the_gate_by_covariance_admits_far_matches_that_three_centimetres_refuse() {
    let mut scene = Scene::new(7);
    let points: Vec<_> =
        (0..200).map(|_| scene.ground()).map(|p| Point3::new(3.0 * p.x - 6.0, p.y, p.z)).collect();
    let mut pairs = scene.stereo_matches(&points, &drive());
    pairs[..60].iter_mut().for_each(|pair| pair.after = drive() * scene.ground());
    let ask = |gate, weighting| {
        let fit = fit_motion(&pairs, &RansacSettings { gate, weighting, ..RansacSettings::default() });
        let motion = fit.motion().unwrap();
        (fit.inliers, (motion * TARGET - drive() * TARGET).norm())
    };
    let (by_distance, off_m) = ask(Gate::Distance, Weighting::None);
    let (by_covariance, weighted_off_m) = ask(Gate::Mahalanobis { limit: 3.37 }, Weighting::Range);
    let right = |inliers: &[usize]| inliers.iter().filter(|&&i| i >= 60).count();
    println!("{} {off_m:.4}, {} {weighted_off_m:.4}", right(&by_distance), right(&by_covariance));
    assert!(right(&by_covariance) >= 134 && right(&by_distance) < 100);
    assert!(by_covariance.len() - right(&by_covariance) < 10);
    assert!(weighted_off_m < 0.003 && off_m > 5.0 * weighted_off_m);
}

#[test]
fn altitudes_are_those_of_the_triangle() {
    let triangle = [[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, 4.0, 0.0]].map(Point3::from);
    assert!((altitude_m(&triangle) - 2.4).abs() < 1e-15);
    assert_eq!(altitude_m(&[TARGET; 3]), 0.0);
}

#[test]
fn refits_are_counted_and_end() {
    // A wide gate on noisy matches with wrong ones nearby: sets change for several fits.
    let mut scene = Scene::new(8);
    let mut pairs = scene.matches(200, &drive(), 0.02);
    pairs[..100].iter_mut().for_each(|pair| pair.after += Vector3::new(0.03, 0.02, 0.0));
    let one = fit_motion(&pairs, &RansacSettings { refits_max: 1, ..RansacSettings::default() });
    assert_eq!((one.refits.len(), one.ending), (1, Some(Ending::UsedUp)));
    let all = fit_motion(&pairs, &RansacSettings::default());
    assert!(all.refits.len() > 2 && all.refits.len() <= 20, "{:?}", all.refits);
    assert_ne!(all.ending, None);
}

#[test]
fn a_hundred_samples_succeed_as_often_as_r226_says() {
    let success = |share: f64| 1.0 - failure_probability(share, 100);
    assert!((success(0.5) - 0.999_998_4).abs() < 5e-8, "{}", success(0.5));
    // The smallest share of inliers for 99 % success, to the four digits that are given.
    assert!(success(0.355_65) < 0.99 && success(0.355_75) > 0.99);
}
