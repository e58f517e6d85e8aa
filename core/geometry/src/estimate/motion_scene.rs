//! Matched points with a known motion, for the tests of its estimation.

use nalgebra::{Matrix3, Vector6};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use super::motion_parameters::MotionParameters;
use super::weighted_motion::Correspondence;
use crate::frames::{Point3, Pose, Vector3};

/// Focal length times baseline of a navcam, px m: the range error is R²/245 m per pixel of disparity.
const FOCAL_BASELINE_PX_M: f64 = 245.0;
/// Focal length, px.
const FOCAL_PX: f64 = 1223.0;
/// Pixel noise of each camera, 1σ, px.
const PIXEL_NOISE_PX: f64 = 0.25;

/// Points and noise drawn from one seed.
pub(super) struct Scene(Pcg64);

impl Scene {
    pub(super) fn new(seed: u64) -> Self {
        Self(Pcg64::seed_from_u64(seed))
    }

    /// A uniform random number between two others.
    pub(super) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.random::<f64>()
    }

    /// A point of the ground in front of the rover: 4 × 4 × 1 m, its middle 5 m ahead.
    pub(super) fn ground(&mut self) -> Point3 {
        Point3::new(self.between(3.0, 7.0), self.between(-2.0, 2.0), self.between(-0.5, 0.5))
    }

    /// Gaussian noise with this standard deviation on each axis.
    pub(super) fn noise(&mut self, sigma: f64) -> Vector3 {
        Vector3::from_fn(|_, _| {
            let deviate: f64 = StandardNormal.sample(&mut self.0);
            deviate
        }) * sigma
    }

    /// Any motion: up to `shift_m` on each axis, and any attitude.
    pub(super) fn any_motion(&mut self, shift_m: f64) -> Pose {
        let mut angle = || self.between(-3.1, 3.1);
        let (roll, pitch, yaw) = (angle(), angle() / 2.1, angle());
        let mut shift = || self.between(-shift_m, shift_m);
        MotionParameters::from_vector(&Vector6::new(shift(), shift(), shift(), roll, pitch, yaw)).to_pose()
    }

    /// Random points and their positions after a motion, with this noise on each coordinate of the latter.
    pub(super) fn moved(&mut self, count: usize, motion: &Pose, sigma_m: f64) -> (Vec<Point3>, Vec<Point3>) {
        let pair = |_| {
            let before = self.ground();
            (before, motion * before + self.noise(sigma_m))
        };
        (0..count).map(pair).unzip()
    }

    /// The same points as matches.
    pub(super) fn matches(&mut self, count: usize, motion: &Pose, sigma_m: f64) -> Vec<Correspondence> {
        let (before, after) = self.moved(count, motion, sigma_m);
        let covariance = Matrix3::identity() * (sigma_m * sigma_m);
        before.into_iter().zip(after).map(|(before, after)| exact(before, after, covariance)).collect()
    }

    /// The points as stereo measures them before and after a motion.
    pub(super) fn stereo_matches(&mut self, points: &[Point3], motion: &Pose) -> Vec<Correspondence> {
        let measured = |point: &Point3| {
            let (before, before_covariance) = self.measured(point);
            let (after, after_covariance) = self.measured(&(motion * point));
            Correspondence { before, after, before_covariance, after_covariance }
        };
        points.iter().map(measured).collect()
    }

    /// A point as stereo from the origin measures it, and the covariance, which grows with the range.
    fn measured(&mut self, point: &Point3) -> (Point3, Matrix3<f64>) {
        let range = point.coords.norm();
        let along = point.coords / range;
        let side_m = range / FOCAL_PX * PIXEL_NOISE_PX;
        let along_m = range * range / FOCAL_BASELINE_PX_M * PIXEL_NOISE_PX * std::f64::consts::SQRT_2;
        let line = along * along.transpose();
        let needle = line * along_m + (Matrix3::identity() - line) * side_m;
        (point + needle * self.noise(1.0), needle * needle)
    }
}

/// A match in which only the second point is uncertain.
pub(super) fn exact(before: Point3, after: Point3, after_covariance: Matrix3<f64>) -> Correspondence {
    Correspondence { before, after, before_covariance: Matrix3::zeros(), after_covariance }
}

/// A drive of half a metre with a rotation, as between two updates.
pub(super) fn drive() -> Pose {
    MotionParameters::from_vector(&Vector6::new(-0.48, 0.12, 0.03, 0.04, -0.03, 0.15)).to_pose()
}
