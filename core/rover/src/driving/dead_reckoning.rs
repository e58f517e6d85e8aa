//! Horizontal dead reckoning with covariance: by the pose estimates, and by the wheels alone.
//!
//! The covariance of x, y and heading grows from step to step by the error model of the odometry:
//!
//! ```text
//! P' = F P Fᵀ + G diag((along L)², (across L)², attitude²) Gᵀ
//! F  = [1 0 −Δy; 0 1 Δx; 0 0 1]      G = the axes along and across the step, and the heading
//! ```
//!
//! A step measured by visual odometry adds `M Σ Mᵀ` instead, where M maps its error (τ, ω) from the rover frame to x, y
//! and heading.
//!
//! | symbol | name | unit, frame |
//! |---|---|---|
//! | Δx, Δy, L | the step and its length | m, site |
//! | P | `covariance` of x, y, heading | m², m rad, rad², site |
//!
//! Slip is in neither covariance. Frame: site, horizontal. Sources: domain.md 5.5; papers.md R10.

use nalgebra::{Matrix3, Matrix3x6, Vector2};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use sightline_geometry::frames::Pose;
use sightline_geometry::odometry_error::{OdometryError, PoseChangeError};

use super::motion::Motion;

/// Horizontal pose of the rover with its covariance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Reckoned {
    /// x and y of the rover's origin, site frame, m.
    pub position_m: [f64; 2],
    /// Heading, rad, positive to the right of the site's +x.
    pub heading_rad: f64,
    /// Covariance of x, y (m) and heading (rad).
    pub covariance: [[f64; 3]; 3],
}

impl Reckoned {
    /// A pose without uncertainty: that of the first stop.
    pub(super) fn exactly(pose: &Pose) -> Self {
        let origin = pose.translation.vector;
        let heading_rad = pose.rotation.euler_angles().2;
        Self { position_m: [origin.x, origin.y], heading_rad, covariance: [[0.0; 3]; 3] }
    }

    /// The pose at the next stop, from the pose estimated there.
    pub(super) fn at(&self, pose: &Pose, error: &PoseChangeError) -> Self {
        let there = Self::exactly(pose);
        let covariance = match error {
            PoseChangeError::Modelled(error) => self.grown(there.position_m, error),
            PoseChangeError::Measured(covariance) => {
                let axes = pose.rotation.to_rotation_matrix();
                let mut level = Matrix3x6::zeros();
                level.fixed_view_mut::<2, 3>(0, 0).copy_from(&axes.matrix().fixed_rows::<2>(0));
                level.fixed_view_mut::<1, 3>(2, 3).copy_from(&axes.matrix().fixed_rows::<1>(2));
                self.grown_by(there.position_m, level * **covariance * level.transpose())
            }
        };
        Self { covariance, ..there }
    }

    /// The pose after a fraction of a motion of the wheels, as on level ground without slip.
    pub(super) fn rolled(&self, motion: &Motion, part: f64, error: &OdometryError) -> Self {
        let ([ahead_m, right_m], turned_rad) = motion.after(part);
        let (sine, cosine) = self.heading_rad.sin_cos();
        let position_m = [
            self.position_m[0] + cosine * ahead_m - sine * right_m,
            self.position_m[1] + sine * ahead_m + cosine * right_m,
        ];
        let heading_rad = self.heading_rad + turned_rad;
        Self { position_m, heading_rad, covariance: self.grown(position_m, error) }
    }

    /// The covariance after a step, by the odometry's error model.
    fn grown(&self, to_m: [f64; 2], error: &OdometryError) -> [[f64; 3]; 3] {
        let step = Vector2::from(to_m) - Vector2::from(self.position_m);
        let length_m = step.norm();
        let along = step.try_normalize(0.0).unwrap_or_else(Vector2::x);
        let axes = Matrix3::new(along.x, -along.y, 0.0, along.y, along.x, 0.0, 0.0, 0.0, 1.0);
        let sigmas = [
            error.along_fraction * length_m,
            error.across_fraction * length_m,
            error.attitude_deg.to_radians(),
        ];
        let added = Matrix3::from_diagonal(&sigmas.map(|sigma| sigma * sigma).into());
        self.grown_by(to_m, axes * added * axes.transpose())
    }

    /// The covariance after a step that adds the covariance `added`.
    fn grown_by(&self, to_m: [f64; 2], added: Matrix3<f64>) -> [[f64; 3]; 3] {
        let step = Vector2::from(to_m) - Vector2::from(self.position_m);
        let carried = Matrix3::new(1.0, 0.0, -step.y, 0.0, 1.0, step.x, 0.0, 0.0, 1.0);
        let before = Matrix3::from(self.covariance).transpose();
        let after = carried * before * carried.transpose() + added;
        std::array::from_fn(|row| std::array::from_fn(|column| after[(row, column)]))
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    const ERROR: OdometryError =
        OdometryError { along_fraction: 0.03, across_fraction: 0.02, attitude_deg: 0.5 };
    const MOTIONS: [Motion; 4] = [
        Motion::Arc { length_m: 1.0, curvature_per_m: 0.2 },
        Motion::Arc { length_m: 0.8, curvature_per_m: 0.0 },
        Motion::Turn { angle_rad: 0.7 },
        Motion::Arc { length_m: -0.6, curvature_per_m: -0.3 },
    ];

    fn start() -> Reckoned {
        Reckoned { position_m: [-3.0, 1.0], heading_rad: 0.4, covariance: [[0.0; 3]; 3] }
    }

    #[test]
    fn the_covariance_is_that_of_many_noisy_drives() {
        let mean = MOTIONS.iter().fold(start(), |place, motion| place.rolled(motion, 1.0, &ERROR));
        let mut random = rand_pcg::Pcg64::seed_from_u64(7);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let count = 40_000;
        let mut sum = [[0.0; 3]; 3];
        for _ in 0..count {
            let mut place = start();
            for motion in &MOTIONS {
                let there = place.rolled(motion, 1.0, &ERROR);
                let way = Vector2::from(there.position_m) - Vector2::from(place.position_m);
                let along = way.try_normalize(0.0).unwrap_or_else(Vector2::x);
                let [a, b] = [
                    normal() * ERROR.along_fraction * way.norm(),
                    normal() * ERROR.across_fraction * way.norm(),
                ];
                place = Reckoned {
                    position_m: [
                        there.position_m[0] + a * along.x - b * along.y,
                        there.position_m[1] + a * along.y + b * along.x,
                    ],
                    heading_rad: there.heading_rad + normal() * ERROR.attitude_deg.to_radians(),
                    ..there
                };
            }
            let off = [
                place.position_m[0] - mean.position_m[0],
                place.position_m[1] - mean.position_m[1],
                place.heading_rad - mean.heading_rad,
            ];
            for (row, sums) in sum.iter_mut().enumerate() {
                for (column, value) in sums.iter_mut().enumerate() {
                    *value += off[row] * off[column] / f64::from(count);
                }
            }
        }
        for (row, sums) in sum.iter().enumerate() {
            for (column, value) in sums.iter().enumerate() {
                let scale = (mean.covariance[row][row] * mean.covariance[column][column]).sqrt();
                let off = (value - mean.covariance[row][column]).abs() / scale;
                assert!(off < 0.03, "{row} {column}: {value} {}", mean.covariance[row][column]);
            }
        }
    }

    #[test]
    fn wheels_and_estimates_agree_where_the_estimates_are_what_the_wheels_did() {
        let wheels = start().rolled(&MOTIONS[0], 0.5, &ERROR);
        let [x, y] = wheels.position_m;
        let turn = nalgebra::UnitQuaternion::from_euler_angles(0.0, 0.0, wheels.heading_rad);
        let pose = Pose::from_parts(nalgebra::Translation3::new(x, y, 0.3), turn);
        let estimated = start().at(&pose, &PoseChangeError::Modelled(ERROR));
        assert!((estimated.heading_rad - wheels.heading_rad).abs() < 1e-12);
        assert_eq!((estimated.position_m, estimated.covariance), (wheels.position_m, wheels.covariance));
    }
}
