//! Stage 1, `predict`: where the target should be now, by dead reckoning (K§4.1 step 1, R24).
//!
//! With the rover's estimated pose (R_i, t_i) mapping rover → site,
//! `p_rover,new = R_newᵀ (R_old p_rover,old + t_old − t_new)`, that is
//! `now_from_then = site_from_rover_nowⁱⁿᵛ · site_from_rover_then`.
//!
//! The covariance turns with the motion and grows by the error of the pose change: with a driven distance L,
//! `Σ_t = R_d diag((f_along L)², (f_across L)², (f_across L)²) R_dᵀ` along and across the driven direction, and
//! an attitude error of σ_a about each axis moves the target by `[p]×`: `Σ_a = σ_a² [p]× [p]×ᵀ`.
//! The papers give no covariance for the prediction; this is ours, with the error model of the traverse.
//!
//! | symbol | name | unit, frame |
//! |---|---|---|
//! | p_rover,old | `target.position_in_rover` | m, rover frame of the last stop |
//! | p_rover,new | `position_in_rover` | m, rover frame of this stop |
//! | L | `step_length_m` | m |

use nalgebra::{Matrix3, Rotation3};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::frames::{Point3, Pose, Vector3};
use crate::target::Target;
use crate::traverse::OdometryError;

/// Where the target should be now.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Prediction {
    /// Position in the rover frame of this stop, m.
    #[schema(value_type = [f64; 3])]
    pub position_in_rover: Point3,
    /// Position in the site frame, m.
    #[schema(value_type = [f64; 3])]
    pub position_in_site: Point3,
    /// Covariance in the rover frame, m².
    #[schema(value_type = Vec<f64>)]
    pub covariance_in_rover: Matrix3<f64>,
    /// Estimated distance driven since the last stop, m.
    pub step_length_m: f64,
    /// Estimated distance driven since the last accepted update, m.
    pub travelled_since_update_m: f64,
    /// Estimated distance driven since the designation, m.
    pub travelled_m: f64,
}

/// Carries `target` from the last stop's estimated pose to this one's.
pub fn predict(
    target: &Target,
    site_from_rover_then: &Pose,
    site_from_rover_now: &Pose,
    odometry: &OdometryError,
) -> Prediction {
    let now_from_then = site_from_rover_now.inverse() * site_from_rover_then;
    let position_in_rover = now_from_then * target.position_in_rover;
    let rotation = now_from_then.rotation.to_rotation_matrix();
    let turned = rotation.matrix() * target.covariance_in_rover * rotation.matrix().transpose();
    // The way driven, seen from the new rover frame.
    let way = now_from_then.translation.vector;
    let step_length_m = way.norm();
    Prediction {
        position_in_rover,
        position_in_site: site_from_rover_now * position_in_rover,
        covariance_in_rover: turned + motion_covariance(&position_in_rover, &way, odometry),
        step_length_m,
        travelled_since_update_m: target.travelled_since_update_m + step_length_m,
        travelled_m: target.travelled_m + step_length_m,
    }
}

/// What the error of one pose change adds to the covariance of a point, m², rover frame.
fn motion_covariance(point: &Point3, way: &Vector3, odometry: &OdometryError) -> Matrix3<f64> {
    let length_m = way.norm();
    let along = odometry.along_fraction * length_m;
    let across = odometry.across_fraction * length_m;
    let forward = way.try_normalize(1e-9).unwrap_or_else(Vector3::x);
    let rover_from_way =
        Rotation3::rotation_between(&Vector3::x(), &forward).unwrap_or_else(Rotation3::identity);
    let diagonal = Matrix3::from_diagonal(&Vector3::new(along * along, across * across, across * across));
    let translation = rover_from_way.matrix() * diagonal * rover_from_way.matrix().transpose();
    let attitude_rad = odometry.attitude_deg.to_radians();
    let cross = point.coords.cross_matrix();
    translation + cross * cross.transpose() * (attitude_rad * attitude_rad)
}
