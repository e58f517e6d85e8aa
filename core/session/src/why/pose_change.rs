//! The change of the estimated pose from one stop to the next, with its standard deviation, axis by axis.
//!
//! ```text
//! before_from_after = site_from_rover(before)⁻¹ · site_from_rover(after)
//! σ_t = √diag(R_d diag((f_along L)², (f_across L)², (f_across L)²) R_dᵀ)      σ_angle = σ_a    (as `predict`)
//! ```
//! If visual odometry corrected the pose, σ follows from its covariance. Frame: the rover at the previous stop, x ahead, y
//! to the right, z down.

use nalgebra::{Matrix3, Rotation3, Vector3};
use sightline_geometry::frames::Pose;
use sightline_geometry::odometry_error::OdometryError;
use sightline_rover::visual_odometry::MeasuredMotion;

/// The axes with their units, in the order of the components.
pub const AXES: [(&str, &str); 6] = [
    ("Δx ahead", "m"),
    ("Δy right", "m"),
    ("Δz down", "m"),
    ("Δroll", "deg"),
    ("Δpitch", "deg"),
    ("Δyaw", "deg"),
];

/// The change of a pose between two stops: translation in m, then roll, pitch and yaw in degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseChange {
    /// The change, m and deg.
    pub change: [f64; 6],
    /// 1σ of each component, m and deg.
    pub sigma: [f64; 6],
}

impl PoseChange {
    /// The change from the pose `before` to `after`; σ is from `measured` if that corrected the pose, else from `error`.
    pub fn between(
        before: &Pose,
        after: &Pose,
        error: &OdometryError,
        measured: Option<&MeasuredMotion>,
    ) -> Self {
        let before_from_after = before.inverse() * after;
        let measured = measured.filter(|measured| measured.corrects).and_then(|m| m.update.covariance);
        let sigma = match measured {
            Some(covariance) => {
                let turn = before_from_after.rotation.to_rotation_matrix();
                let block =
                    |at: usize| -> Matrix3<f64> { covariance.fixed_view::<3, 3>(at, at).into_owned() };
                let turned = |at: usize| turn.matrix() * block(at) * turn.matrix().transpose();
                joined(&roots(&turned(0)), &roots(&turned(3)).map(f64::to_degrees))
            }
            None => modelled(&before_from_after.translation.vector, error),
        };
        Self { change: components(&before_from_after), sigma }
    }
}

/// The components of a transform: translation in m, then roll, pitch and yaw in degrees.
pub fn components(before_from_after: &Pose) -> [f64; 6] {
    let (roll, pitch, yaw) = before_from_after.rotation.euler_angles();
    joined(&before_from_after.translation.vector, &Vector3::new(roll, pitch, yaw).map(f64::to_degrees))
}

fn modelled(way: &Vector3<f64>, error: &OdometryError) -> [f64; 6] {
    let [along, across] = [error.along_fraction, error.across_fraction].map(|f| (f * way.norm()).powi(2));
    let forward = way.try_normalize(1e-9).unwrap_or_else(Vector3::x);
    let turn = Rotation3::rotation_between(&Vector3::x(), &forward).unwrap_or_else(Rotation3::identity);
    let diagonal = Matrix3::from_diagonal(&Vector3::new(along, across, across));
    let covariance = turn.matrix() * diagonal * turn.matrix().transpose();
    joined(&roots(&covariance), &Vector3::repeat(error.attitude_deg))
}

fn roots(covariance: &Matrix3<f64>) -> Vector3<f64> {
    covariance.diagonal().map(|variance| variance.max(0.0).sqrt())
}

fn joined(translation: &Vector3<f64>, angles: &Vector3<f64>) -> [f64; 6] {
    [translation.x, translation.y, translation.z, angles.x, angles.y, angles.z]
}

#[cfg(test)]
mod tests {
    use super::*;
    use sightline_geometry::frames::attitude_from_roll_pitch_yaw;

    #[test]
    fn a_change_is_in_the_frame_of_the_stop_before_with_the_sigma_of_the_model() {
        let quarter = attitude_from_roll_pitch_yaw(0.0, 0.0, std::f64::consts::FRAC_PI_2);
        let before = Pose::translation(3.0, 1.0, 0.0) * quarter;
        let after = before * Pose::translation(2.0, 0.0, 0.0) * attitude_from_roll_pitch_yaw(0.0, 0.0, 0.1);
        let error = OdometryError { along_fraction: 0.05, across_fraction: 0.01, attitude_deg: 0.3 };
        let found = PoseChange::between(&before, &after, &error, None);
        let expected = [2.0, 0.0, 0.0, 0.0, 0.0, 0.1_f64.to_degrees()];
        assert!(found.change.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?}");
        let sigma = [0.1, 0.02, 0.02, 0.3, 0.3, 0.3];
        assert!(found.sigma.iter().zip(sigma).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?}");
    }
}
