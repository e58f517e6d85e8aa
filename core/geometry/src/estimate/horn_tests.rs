//! Horn's motion against exact data, the decomposition by singular values and printed numbers.

use nalgebra::Matrix3;

use super::*;
use crate::estimate::motion_scene::{Scene, drive};

/// Largest distance between moved points and their matches, m.
fn worst_m(motion: &Pose, before: &[Point3], after: &[Point3]) -> f64 {
    before.iter().zip(after).map(|(p, q)| (motion * p - q).norm()).fold(0.0, f64::max)
}

/// The rotation by the singular values of the sums of products (Kabsch; Umeyama), domain.md 13.1.
fn rotation_by_singular_values(before: &[Point3], after: &[Point3]) -> Matrix3<f64> {
    let mean = |points: &[Point3]| points.iter().map(|p| p.coords).sum::<Vector3>() / points.len() as f64;
    let (from, to) = (mean(before), mean(after));
    let products = before.iter().zip(after).map(|(p, q)| (p.coords - from) * (q.coords - to).transpose());
    let svd = products.sum::<Matrix3<f64>>().svd(true, true);
    let (u, v) = (svd.u.unwrap(), svd.v_t.unwrap().transpose());
    v * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, (v * u.transpose()).determinant().signum()))
        * u.transpose()
}

#[test]
fn exact_data_gives_the_motion_to_a_millionth_of_a_micrometre() {
    let mut scene = Scene::new(1);
    for count in [3, 4, 10, 300] {
        for _ in 0..200 {
            let truth = scene.any_motion(2.0);
            let (before, after) = scene.moved(count, &truth, 0.0);
            let Ok(motion) = rigid_motion(&before, &after, None) else {
                assert_eq!(count, 3, "only three points may lie on a line by chance");
                continue;
            };
            assert!(worst_m(&motion, &before, &after) < 1e-12, "{count} points");
            assert!(motion.rotation.angle_to(&truth.rotation) < 1e-12 || count == 3, "{count} points");
            assert!((motion.rotation.quaternion().norm() - 1.0).abs() < 1e-15);
        }
    }
}

#[test]
fn a_kilometre_off_the_points_still_meet_within_the_digits_of_their_coordinates() {
    // A coordinate of 1000 m is rounded by up to 6e-14 m, a rotated one by several times that.
    let mut scene = Scene::new(2);
    for _ in 0..200 {
        let truth = scene.any_motion(1000.0);
        let (before, _) = scene.moved(50, &truth, 0.0);
        let far: Vec<_> = before.iter().map(|p| p + Vector3::new(1000.0, -1000.0, 1000.0)).collect();
        let after: Vec<_> = far.iter().map(|p| truth * p).collect();
        let motion = rigid_motion(&far, &after, None).unwrap();
        assert!(worst_m(&motion, &far, &after) < 2e-12);
        assert!(motion.rotation.angle_to(&truth.rotation) < 1e-12);
    }
}

#[test]
fn noisy_data_give_the_same_rotation_as_singular_values() {
    let mut scene = Scene::new(3);
    for sigma_m in [0.001, 0.05, 0.5] {
        for _ in 0..200 {
            let truth = scene.any_motion(2.0);
            let (before, after) = scene.moved(40, &truth, sigma_m);
            let motion = rigid_motion(&before, &after, None).unwrap();
            let expected = rotation_by_singular_values(&before, &after);
            assert!((motion.rotation.to_rotation_matrix().matrix() - expected).norm() < 1e-12);
        }
    }
}

#[test]
fn five_noisy_points_agree_with_the_reference() {
    // domain.md 15, TV9.
    let before = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 2.0, 3.0]]
        .map(Point3::from);
    let after = [
        [0.51, -0.27, 2.005],
        [1.37091147, 0.12310547, 1.7164388],
        [0.1964388, 0.69056967, 2.21621093],
        [0.88310547, -0.3621224, 2.92556967],
        [1.84810547, 1.6528776, 4.93556967],
    ]
    .map(Point3::from);
    let motion = rigid_motion(&before, &after, None).unwrap();
    let q = motion.rotation.quaternion();
    let found = [q.w, q.i, q.j, q.k].map(|value| value * q.w.signum());
    for (value, expected) in found.iter().zip([0.965266, 0.08542492, 0.17190393, 0.17723759]) {
        assert!((value - expected).abs() < 1e-8, "{q}");
    }
    let expected = Vector3::new(0.50844174, -0.25209038, 2.00383850);
    assert!((motion.translation.vector - expected).amax() < 1e-8, "{motion}");
    let squares: f64 = before.iter().zip(&after).map(|(p, q)| (motion * p - q).norm_squared()).sum();
    assert!(((squares / 5.0).sqrt() - 0.0178339915).abs() < 5e-9);
    assert!(
        (motion.rotation.to_rotation_matrix().matrix() - rotation_by_singular_values(&before, &after)).norm()
            < 1e-14
    );

    let mut sums = Sums::default();
    before.iter().zip(&after).for_each(|(p, q)| sums.add(1.0, &p.coords, &q.coords));
    let expected = [-9.52145026, -9.18252937, 7.49511337, 11.20886627];
    for (value, expected) in sums.fit().eigenvalues.iter().zip(expected) {
        assert!((value - expected).abs() < 5e-8, "{value}");
    }
}

#[test]
fn weights_count_like_repeated_points() {
    let mut scene = Scene::new(4);
    let (before, after) = scene.moved(6, &drive(), 0.05);
    let weights = [1.0, 2.0, 0.0, 3.0, 1.0, 1.0];
    let repeated = |points: &[Point3]| -> Vec<Point3> {
        points.iter().zip(weights).flat_map(|(p, w)| std::iter::repeat_n(*p, w as usize)).collect()
    };
    let weighted = rigid_motion(&before, &after, Some(&weights)).unwrap();
    let expected = rigid_motion(&repeated(&before), &repeated(&after), None).unwrap();
    assert!((weighted.to_homogeneous() - expected.to_homogeneous()).norm() < 1e-13);
}

#[test]
fn mirrored_and_flat_noisy_data_never_give_a_reflection() {
    let mut scene = Scene::new(5);
    let mut answers = 0;
    for case in 0..600 {
        let (mut before, mut after) = scene.moved(12, &drive(), 0.1);
        if case % 2 == 0 {
            after.iter_mut().for_each(|q| q.x = -q.x);
        } else {
            before.iter_mut().for_each(|p| p.z = 0.0);
            after = before.iter().map(|p| drive() * p + scene.noise(0.3)).collect();
        }
        let Ok(motion) = rigid_motion(&before, &after, None) else { continue };
        answers += 1;
        let rotation = motion.rotation.to_rotation_matrix();
        assert!((rotation.matrix().determinant() - 1.0).abs() < 1e-14);
        assert!((rotation.matrix() - rotation_by_singular_values(&before, &after)).norm() < 1e-9);
    }
    assert!(answers > 500, "{answers}");
}

#[test]
fn degenerate_sets_are_called_by_their_name() {
    let mut scene = Scene::new(6);
    let mut ask = |before: &[Point3]| {
        let after: Vec<_> = before.iter().map(|p| drive() * p + scene.noise(1e-3)).collect();
        rigid_motion(before, &after, None).unwrap_err()
    };
    let on_line = |t: f64| Point3::new(4.0 + t, 1.0 - 0.5 * t, 0.2 * t);
    assert_eq!(ask(&[on_line(0.0), on_line(1.0)]), Degenerate::TooFew { matches: 2 });
    assert_eq!(ask(&[on_line(0.3); 8]), Degenerate::Identical);
    let line: Vec<_> = (0..20).map(|i| on_line(0.1 * f64::from(i))).collect();
    assert!(matches!(ask(&line), Degenerate::OnALine { across_m } if across_m < 1e-6));
    let close: Vec<_> =
        (0..9).map(|i| Point3::new(4.0 + 0.003 * f64::from(i % 3), 0.003 * f64::from(i / 3), 0.0)).collect();
    assert!(matches!(ask(&close), Degenerate::Close { along_m } if along_m < 0.005));
    assert!(ask(&close).to_string().contains("0.0024 m"), "{}", ask(&close));
    assert_eq!(ask(&[on_line(0.0), on_line(f64::NAN), on_line(1.0)]), Degenerate::NotANumber);

    // No rotation maps a regular tetrahedron to its mirror image better than several others.
    let broad = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]].map(Point3::from);
    let mirrored = broad.map(|p| Point3::new(-p.x, -p.y, -p.z));
    assert_eq!(rigid_motion(&broad, &mirrored, None), Err(Degenerate::Unlike));
    assert_eq!(rigid_motion(&broad, &mirrored[1..], None), Err(Degenerate::Unpaired { before: 4, after: 3 }));
    assert_eq!(rigid_motion(&broad, &broad, Some(&[1.0])), Err(Degenerate::Unpaired { before: 4, after: 1 }));
    assert_eq!(rigid_motion(&broad, &broad, Some(&[0.0; 4])), Err(Degenerate::NotANumber));
}

#[test]
fn three_points_spread_as_their_altitude_says() {
    // Altitude 2 cm over the middle of a side of 1 m: 0.94 cm rms across; the criterion of domain.md 13.1.
    let triangle = |altitude: f64| [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, altitude, 0.0]].map(Point3::from);
    let mut sums = Sums::default();
    triangle(0.02).iter().for_each(|p| sums.add(1.0, &p.coords, &p.coords));
    let fitted = sums.fit();
    assert!((fitted.across_m - 0.02 * 2.0_f64.sqrt() / 3.0).abs() < 1e-12, "{fitted:?}");
    let [thin, broad] = [0.018, 0.024].map(triangle);
    assert!(matches!(rigid_motion(&thin, &thin, None), Err(Degenerate::OnALine { .. })));
    let unmoved = rigid_motion(&broad, &broad, None).unwrap();
    assert!(unmoved.translation.vector.norm() < 1e-12 && unmoved.rotation.angle() < 1e-9, "{unmoved:?}");
}
