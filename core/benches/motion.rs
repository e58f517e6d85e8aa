//! Speed of the motion's fit and of its bootstrap; the goals are 2 ms and 5 ms on one thread.
//!
//! **The bound.** 1000 matches, of which 60 % are wrong, 100 draws and 200 bootstrap sets:
//!
//! | what | work | at what the processor can do |
//! |---|---|---|
//! | `fit_motion`, residuals | 100 × 1000 of 26 operations, two at a time and two a cycle | 0.2 ms |
//! | `fit_motion`, draws | 100 eigenvectors of a 4 × 4 matrix, 1 µs each | 0.1 ms |
//! | `fit_motion`, refits | about three of 400 matches, 0.01 ms each | 0.03 ms |
//! | `bootstrap`, draws | 200 × 400 random numbers, 2 ns each | 0.16 ms |
//! | `bootstrap`, sums | 200 × 400 of 34 operations (weighted: 84) | 0.3 ms (0.7 ms) |
//! | `bootstrap`, motions | 200 eigenvectors of a 4 × 4 matrix, 1 µs each | 0.2 ms |
//!
//! Run with `cargo bench -p sightline-core --profile dev --bench motion` (the profile `dev` is optimised); measured times:
//! `docs/benchmarks.md`.

use divan::Bencher;
use nalgebra::{Matrix3, Translation3, UnitQuaternion};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use sightline_geometry::estimate::bootstrap::{BootstrapSettings, bootstrap};
use sightline_geometry::estimate::ransac::{Gate, RansacSettings, Weighting, fit_motion};
use sightline_geometry::estimate::weighted_motion::Correspondence;
use sightline_geometry::frames::{Point3, Pose, Vector3};

fn main() {
    divan::main();
}

/// A drive of half a metre with a turn.
fn drive() -> Pose {
    let turn = UnitQuaternion::from_euler_angles(0.04, -0.03, 0.15);
    Pose::from_parts(Translation3::new(-0.48, 0.12, 0.03), turn)
}

/// 1000 matches on 4 × 4 × 1 m of ground, right to within a centimetre; the first 600 lead anywhere.
fn matches() -> Vec<Correspondence> {
    let mut random = Pcg64::seed_from_u64(1);
    let mut inside = |size: [f64; 3]| Vector3::from(size.map(|size| size * (random.random::<f64>() - 0.5)));
    let covariance = Matrix3::identity() * 3e-5;
    (0..1000)
        .map(|i| {
            let ground = [4.0, 4.0, 1.0];
            let before = Point3::new(5.0, 0.0, 0.0) + inside(ground);
            let wrong = drive() * (Point3::new(5.0, 0.0, 0.0) + inside(ground));
            let right = drive() * before + inside([0.02; 3]);
            let after = if i < 600 { wrong } else { right };
            Correspondence { before, after, before_covariance: covariance, after_covariance: covariance }
        })
        .collect()
}

fn fit(bencher: Bencher<'_, '_>, settings: RansacSettings) {
    let matches = matches();
    bencher.bench_local(|| fit_motion(&matches, &settings));
}

/// As in the paper.
#[divan::bench]
fn fit_plain(bencher: Bencher<'_, '_>) {
    fit(bencher, RansacSettings::default());
}

/// With gate and weights by covariance.
#[divan::bench]
fn fit_by_covariance(bencher: Bencher<'_, '_>) {
    let gate = Gate::Mahalanobis { limit: 3.37 };
    fit(bencher, RansacSettings { gate, weighting: Weighting::Range, ..RansacSettings::default() });
}

fn scatter(bencher: Bencher<'_, '_>, weighting: Weighting) {
    let right = &matches()[600..];
    let settings = BootstrapSettings { weighting, ..BootstrapSettings::default() };
    bencher.bench_local(|| bootstrap(right, &drive(), &settings));
}

/// Of 400 matches, by Horn's method.
#[divan::bench]
fn bootstrap_plain(bencher: Bencher<'_, '_>) {
    scatter(bencher, Weighting::None);
}

/// The same, weighted.
#[divan::bench]
fn bootstrap_by_covariance(bencher: Bencher<'_, '_>) {
    scatter(bencher, Weighting::Range);
}
