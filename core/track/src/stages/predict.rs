//! Stage 1, `predict`: predicts the target at this stop by dead reckoning (K§4.1 step 1, R24).
//!
//! With the rover's estimated pose (R_i, t_i) mapping rover → site,
//! `p_rover,new = R_newᵀ (R_old p_rover,old + t_old − t_new)`, that is
//! `now_from_then = site_from_rover_nowⁱⁿᵛ · site_from_rover_then`.
//!
//! The covariance is rotated with the motion and grows by the error of the pose change: with a driven distance L,
//! `Σ_t = R_d diag((f_along L)², (f_across L)², (f_across L)²) R_dᵀ` along and across the driven direction, and an
//! attitude error of σ_a about each axis moves the target by `[p]×`: `Σ_a = σ_a² [p]× [p]×ᵀ`. The papers give no
//! covariance for the prediction; this is ours, with the error model of the traverse.
//!
//! If vision measured the motion with covariance Σ of (τ, ω), the target moves by `τ + ω × p`: `J Σ Jᵀ`, `J = [I, −[p]×]`.
//!
//! | symbol | name | unit, frame |
//! |---|---|---|
//! | p_rover,old | `target.position_in_rover` | m, rover frame of the last stop |
//! | p_rover,new | `position_in_rover` | m, rover frame of this stop |
//! | L | `step_length_m` | m |

use nalgebra::{Matrix3, Matrix3x6, Rotation3};

use crate::target::Target;
use sightline_geometry::camera::Camera;
use sightline_geometry::frames::{Pixel, Point3, Pose, Vector3};
use sightline_geometry::odometry_error::PoseChangeError;
use sightline_record::{Declaration, Record, Unit};

pub use super::prediction::Prediction;

/// Carries `target` from the last stop's estimated pose to this one's.
pub fn predict(
    target: &Target,
    site_from_rover_then: &Pose,
    site_from_rover_now: &Pose,
    error: &PoseChangeError,
) -> Prediction {
    let now_from_then = site_from_rover_now.inverse() * site_from_rover_then;
    let position_in_rover = now_from_then * target.position_in_rover;
    let rotation = now_from_then.rotation.to_rotation_matrix();
    let turned = rotation.matrix() * target.covariance_in_rover * rotation.matrix().transpose();
    // The translation, in the new rover frame.
    let way = now_from_then.translation.vector;
    let step_length_m = way.norm();
    Prediction {
        position_in_rover,
        position_in_site: site_from_rover_now * position_in_rover,
        covariance_in_rover: turned + motion_covariance(&position_in_rover, &way, error),
        step_length_m,
        travelled_since_update_m: target.travelled_since_update_m + step_length_m,
        travelled_m: target.travelled_m + step_length_m,
    }
}

/// `prediction` as displaced by a user: on the line of sight of `pixel`, at the same distance from the left camera's centre.
///
/// This choice keeps the scale by the ratio of distances (K-Eq 6) and every tolerance of `judge`, so that the
/// displacement is only across the line of sight. With the ray `o + t d`, the camera's centre C and the distance D,
/// `t = b + √(b² − |o − C|² + D²)`, `b = (C − o)·d`: rays of a CAHVORE camera do not start at C. The covariance is kept.
///
/// `None` if the pixel has no ray.
pub fn displaced(
    prediction: &Prediction,
    left: &Camera,
    pixel: Pixel,
    site_from_rover: &Pose,
) -> Option<Prediction> {
    let ray = left.ray(pixel)?;
    let centre = left.model.centre();
    let distance_m = (prediction.position_in_rover - centre).norm();
    let to_centre = centre - ray.origin;
    let along_m = to_centre.dot(&ray.direction);
    let root = along_m * along_m - to_centre.norm_squared() + distance_m * distance_m;
    let position_in_rover = ray.at(along_m + root.max(0.0).sqrt());
    Some(Prediction {
        position_in_rover,
        position_in_site: site_from_rover * position_in_rover,
        ..prediction.clone()
    })
}

/// The covariance that the error of one pose change adds to a point, m², rover frame.
fn motion_covariance(point: &Point3, way: &Vector3, error: &PoseChangeError) -> Matrix3<f64> {
    let cross = point.coords.cross_matrix();
    let odometry = match error {
        PoseChangeError::Modelled(odometry) => odometry,
        PoseChangeError::Measured(covariance) => {
            let mut moved = Matrix3x6::zeros();
            moved.fixed_view_mut::<3, 3>(0, 0).copy_from(&Matrix3::identity());
            moved.fixed_view_mut::<3, 3>(0, 3).copy_from(&-cross);
            return moved * **covariance * moved.transpose();
        }
    };
    let length_m = way.norm();
    let along = odometry.along_fraction * length_m;
    let across = odometry.across_fraction * length_m;
    let forward = way.try_normalize(1e-9).unwrap_or_else(Vector3::x);
    let rover_from_way =
        Rotation3::rotation_between(&Vector3::x(), &forward).unwrap_or_else(Rotation3::identity);
    let diagonal = Matrix3::from_diagonal(&Vector3::new(along * along, across * across, across * across));
    let translation = rover_from_way.matrix() * diagonal * rover_from_way.matrix().transpose();
    let attitude_rad = odometry.attitude_deg.to_radians();
    translation + cross * cross.transpose() * (attitude_rad * attitude_rad)
}

impl Record for Prediction {
    fn declare(r: &mut Declaration<Self>) {
        r.quantity("position_in_rover", Unit::Metre, |p| p.position_in_rover)
            .describe("Predicted position in the rover frame of this stop.")
            .formula("site_from_rover_now⁻¹ · site_from_rover_then · p", &[]);
        r.quantity("position_in_site", Unit::Metre, |p| p.position_in_site)
            .describe("Predicted position in the site frame.")
            .formula("site_from_rover · p", &["position_in_rover"]);
        r.quantity("covariance_in_rover", Unit::SquareMetre, |p| p.covariance_in_rover)
            .describe("Covariance of the prediction in the rover frame.")
            .formula("R Σ Rᵀ + Σ_t + Σ_a", &["step_length_m"]);
        r.quantity("step_length_m", Unit::Metre, |p| p.step_length_m)
            .describe("Estimated distance driven since the last stop.");
        r.quantity("travelled_since_update_m", Unit::Metre, |p| p.travelled_since_update_m)
            .describe("Estimated distance driven since the last accepted update.");
        r.quantity("travelled_m", Unit::Metre, |p| p.travelled_m)
            .describe("Estimated distance driven since the designation.");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sightline_geometry::camera::{Cahv, CameraModel};

    #[test]
    fn a_displaced_prediction_lies_under_its_pixel_as_far_away_as_before() {
        let linear = Cahv::as_printed(
            Point3::new(0.3, -0.1, -1.2),
            Vector3::x(),
            Vector3::new(127.5, 600.0, 0.0),
            Vector3::new(127.5, 0.0, 600.0),
        );
        let left = Camera::new(CameraModel::Cahv(linear), 256, 256);
        let position_in_rover = Point3::new(6.0, 0.4, -0.3);
        let site_from_rover = Pose::translation(3.0, -1.0, 0.2);
        let prediction = Prediction {
            position_in_rover,
            position_in_site: site_from_rover * position_in_rover,
            covariance_in_rover: Matrix3::identity() * 0.01,
            step_length_m: 1.0,
            travelled_since_update_m: 2.0,
            travelled_m: 3.0,
        };
        let pixel = Pixel::new(90.5, 201.25);
        let moved = displaced(&prediction, &left, pixel, &site_from_rover).unwrap();
        assert!(left.project(&moved.position_in_rover).unwrap().distance(pixel) < 1e-9);
        let distance_m = |p: &Point3| (p - left.model.centre()).norm();
        assert!((distance_m(&moved.position_in_rover) - distance_m(&position_in_rover)).abs() < 1e-12);
        assert!((moved.position_in_site - site_from_rover * moved.position_in_rover).norm() < 1e-12);
        assert_eq!(moved.covariance_in_rover, prediction.covariance_in_rover);
        assert_eq!(moved.travelled_since_update_m, prediction.travelled_since_update_m);
    }
}
