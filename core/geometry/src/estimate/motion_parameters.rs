//! A rigid motion as six numbers: the paper's θ, translation and Euler angles (D§2, R173–R175).
//!
//! The angles are those of `frames.rs`: yaw about z, then pitch about y, then roll about x. They are well defined as
//! long as the pitch is far from ±90°, as that of a rover is (R175). Differences of angles are wrapped (E30).
//!
//! | symbol | our name | unit, frame |
//! |---|---|---|
//! | θ | [`MotionParameters`]: x, y, z, roll, pitch, yaw | m, rad; `after_from_before` |

use std::f64::consts::{PI, TAU};

use nalgebra::{Translation3, Vector6};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::frames::{Pose, Vector3, attitude_from_roll_pitch_yaw};

/// A rigid motion as translation and angles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct MotionParameters {
    /// Translation of the origin, m.
    pub translation_m: [f64; 3],
    /// Roll about x, rad.
    pub roll_rad: f64,
    /// Pitch about y, rad.
    pub pitch_rad: f64,
    /// Yaw about z, rad.
    pub yaw_rad: f64,
}

impl MotionParameters {
    /// The motion.
    pub fn to_pose(self) -> Pose {
        let attitude = attitude_from_roll_pitch_yaw(self.roll_rad, self.pitch_rad, self.yaw_rad);
        Pose::from_parts(Translation3::from(Vector3::from(self.translation_m)), attitude)
    }

    /// The vector θ: x, y, z in m, then roll, pitch, yaw in rad.
    pub fn to_vector(self) -> Vector6<f64> {
        let [x, y, z] = self.translation_m;
        Vector6::new(x, y, z, self.roll_rad, self.pitch_rad, self.yaw_rad)
    }

    /// The motion of a vector θ.
    pub fn from_vector(theta: &Vector6<f64>) -> Self {
        Self {
            translation_m: [theta[0], theta[1], theta[2]],
            roll_rad: theta[3],
            pitch_rad: theta[4],
            yaw_rad: theta[5],
        }
    }

    /// θ − `other`, the angles wrapped to −π … π.
    pub fn minus(self, other: Self) -> Vector6<f64> {
        let mut difference = self.to_vector() - other.to_vector();
        difference.fixed_rows_mut::<3>(3).apply(|angle| *angle = wrapped(*angle));
        difference
    }
}

impl From<&Pose> for MotionParameters {
    fn from(pose: &Pose) -> Self {
        let (roll_rad, pitch_rad, yaw_rad) = pose.rotation.euler_angles();
        Self { translation_m: pose.translation.vector.into(), roll_rad, pitch_rad, yaw_rad }
    }
}

/// Wraps an angle to −π … π, rad.
fn wrapped(angle: f64) -> f64 {
    (angle + PI).rem_euclid(TAU) - PI
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motion_returns_from_its_parameters() {
        for (roll_rad, pitch_rad, yaw_rad) in [(0.0, 0.0, 0.0), (0.3, -0.4, 3.1), (-2.0, 1.4, -3.1)] {
            let parameters =
                MotionParameters { translation_m: [0.4, -1.0, 0.02], roll_rad, pitch_rad, yaw_rad };
            let again = MotionParameters::from(&parameters.to_pose());
            assert!(again.minus(parameters).norm() < 1e-13, "{again:?}");
            assert_eq!(MotionParameters::from_vector(&parameters.to_vector()), parameters);
        }
    }

    #[test]
    fn yaw_turns_x_towards_y_and_pitch_turns_x_up() {
        let of = |pitch_rad, yaw_rad| {
            MotionParameters { translation_m: [0.0; 3], roll_rad: 0.0, pitch_rad, yaw_rad }.to_pose()
                * Vector3::x()
        };
        assert!((of(0.0, 0.1) - Vector3::new(0.1_f64.cos(), 0.1_f64.sin(), 0.0)).norm() < 1e-15);
        assert!((of(0.1, 0.0) - Vector3::new(0.1_f64.cos(), 0.0, -0.1_f64.sin())).norm() < 1e-15);
    }

    #[test]
    fn differences_of_angles_cross_the_half_turn() {
        let yaw =
            |yaw_rad| MotionParameters { translation_m: [0.0; 3], roll_rad: 0.0, pitch_rad: 0.0, yaw_rad };
        assert!((yaw(3.1).minus(yaw(-3.1))[5] - (6.2 - TAU)).abs() < 1e-15);
        assert!((yaw(-3.1).minus(yaw(3.1))[5] - (TAU - 6.2)).abs() < 1e-15);
        assert!((yaw(0.3).minus(yaw(0.1))[5] - 0.2).abs() < 1e-15);
    }
}
