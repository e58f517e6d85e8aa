//! Carries a target into the next frame by an uncertain motion (D§2, R168, R176, R177; D-Eq 3 and 6).
//!
//! ```text
//! x' = T(θ) x        inputs (x, P_xx) and (θ*, P_θθ), independent: an unscented transform of 9 dimensions
//! ```
//!
//! Tracking from stop to stop adds the motion's uncertainty each time, so the eigenvalues of P_xx do not shrink;
//! single axes may, since the frame rotates with the rover (E29).
//!
//! | symbol | our name | unit, frame |
//! |---|---|---|
//! | x, P_xx | `position`, `position_covariance` | m, m²; before |
//! | θ, P_θθ | `motion`, `motion_covariance` | m, rad; [`MotionParameters`], `after_from_before` |
//! | x', P_x'x' | the result | m, m²; after |

use nalgebra::{Matrix3, Matrix6, SMatrix, SVector};

use super::motion_parameters::MotionParameters;
use super::unscented::{UnscentedParameters, unscented};
use crate::frames::Point3;

/// Position and covariance after the motion; `None` if a covariance is not positive semidefinite.
pub fn carry(
    position: &Point3,
    position_covariance: &Matrix3<f64>,
    motion: MotionParameters,
    motion_covariance: &Matrix6<f64>,
) -> Option<(Point3, Matrix3<f64>)> {
    let mut mean = SVector::<f64, 9>::zeros();
    mean.fixed_rows_mut::<3>(0).copy_from(&position.coords);
    mean.fixed_rows_mut::<6>(3).copy_from(&motion.to_vector());
    let mut covariance = SMatrix::<f64, 9, 9>::zeros();
    covariance.fixed_view_mut::<3, 3>(0, 0).copy_from(position_covariance);
    covariance.fixed_view_mut::<6, 6>(3, 3).copy_from(motion_covariance);
    let (carried, carried_covariance) =
        unscented(&mean, &covariance, UnscentedParameters::default(), |input| {
            let point = Point3::from(input.fixed_rows::<3>(0).into_owned());
            let theta = input.fixed_rows::<6>(3).into_owned();
            Some((MotionParameters::from_vector(&theta).to_pose() * point).coords)
        })?;
    Some((Point3::from(carried), carried_covariance))
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector6;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;

    use super::*;
    use crate::frames::Vector3;

    fn needle() -> Matrix3<f64> {
        let along = Vector3::new(0.9, 0.3, 0.3).normalize();
        Matrix3::identity() * 4e-6 + along * along.transpose() * 9e-4
    }

    /// Millimetres and milliradians, as of one update (R178), with some correlation.
    fn motion_covariance() -> Matrix6<f64> {
        let sigma = Vector6::new(2e-3, 3e-3, 1e-3, 1e-3, 1.5e-3, 0.8e-3);
        Matrix6::from_fn(|i, j| sigma[i] * sigma[j] * if i == j { 1.0 } else { 0.2 })
    }

    fn sorted_eigenvalues(matrix: &Matrix3<f64>) -> [f64; 3] {
        let mut values: [f64; 3] = matrix.symmetric_eigenvalues().into();
        values.sort_by(f64::total_cmp);
        values
    }

    #[test]
    fn eigenvalues_do_not_shrink_over_a_run_while_single_axes_may() {
        let (mut position, mut covariance) = (Point3::new(9.0, 2.0, 0.5), needle());
        let mut has_axis_shrunk = false;
        for step in 0..30 {
            let theta = Vector6::new(-0.25, 0.02, 0.01, 0.02, -0.03, 0.2 * f64::from(step % 5 - 2));
            let motion = MotionParameters::from_vector(&theta);
            let (next, grown) = carry(&position, &covariance, motion, &motion_covariance()).unwrap();
            for (before, after) in sorted_eigenvalues(&covariance).iter().zip(sorted_eigenvalues(&grown)) {
                assert!(after >= before * 0.99, "step {step}: {before} to {after}");
            }
            assert!(grown.trace() > covariance.trace());
            has_axis_shrunk |= (0..3).any(|axis| grown[(axis, axis)] < covariance[(axis, axis)] * 0.9);
            (position, covariance) = (next, grown);
        }
        assert!(has_axis_shrunk);
    }

    #[test]
    fn the_covariance_is_that_of_many_drawn_motions() {
        let (position, covariance) = (Point3::new(6.0, -1.0, 0.3), needle());
        let motion = MotionParameters::from_vector(&Vector6::new(-0.5, 0.1, 0.0, 0.05, -0.02, 0.3));
        let (mean, predicted) = carry(&position, &covariance, motion, &motion_covariance()).unwrap();
        let position_factor = covariance.cholesky().unwrap().l();
        let motion_factor = motion_covariance().cholesky().unwrap().l();
        let mut random = Pcg64::seed_from_u64(5);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let draws = 40_000;
        let mut measured = Matrix3::zeros();
        for _ in 0..draws {
            let at = position + position_factor * Vector3::from_fn(|_, _| normal());
            let by = motion.to_vector() + motion_factor * Vector6::from_fn(|_, _| normal());
            let error = MotionParameters::from_vector(&by).to_pose() * at - mean;
            measured += error * error.transpose() / f64::from(draws);
        }
        // 1σ of a variance over 40 000 draws is 0.7 %.
        assert!((measured - predicted).norm() < 0.025 * predicted.norm(), "{measured} {predicted}");
    }

    #[test]
    fn a_motion_known_exactly_only_turns_the_covariance() {
        let motion = MotionParameters::from_vector(&Vector6::new(-0.5, 0.1, 0.0, 0.05, -0.02, 0.3));
        let position = Point3::new(6.0, -1.0, 0.3);
        let (mean, covariance) = carry(&position, &needle(), motion, &Matrix6::zeros()).unwrap();
        let rotation = motion.to_pose().rotation.to_rotation_matrix();
        assert!((mean - motion.to_pose() * position).norm() < 1e-14);
        assert!((covariance - rotation * needle() * rotation.transpose()).norm() < 1e-16);
    }
}
