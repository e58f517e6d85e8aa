//! The mast: the poses of the head's cameras in the rover frame, and the angles that aim them at a point.
//!
//! Head attitude in the rover frame (x forward, y right, z down): `Rz(azimuth) Ry(elevation)`, no roll; azimuth to
//! the right, elevation up (domain.md 4.1). The head frame's origin is the intersection of the pan and tilt axes; the
//! cameras are 15 cm above it and 10 cm beside, so panning moves them.
//!
//! Pointing in closed form (domain.md 4.4), with C_h, u the ray of the left image's centre in the head
//! frame and d the point seen from the mast's origin, m:
//!
//! ```text
//! s = −C_h·u + sqrt((C_h·u)² − |C_h|² + |d|²)     distance along the ray, m
//! w = C_h + s u    ρ = sqrt(w_x² + w_z²)    φ = atan2(w_z, w_x)
//! el = φ − asin(d_z/ρ)    az = atan2(d_y, d_x) − atan2(w_y, ρ cos(φ − el))
//! ```
//!
//! Aiming the head's x axis at the point instead is wrong by 28 px at 8 m and more than 100 px near 2 m.
//!
//! An error of the angles rotates a located point about the axes through the origin o. With the pan axis z, the tilt
//! axis `y' = Rz(az) y` and the standard deviation σ of each angle, independent of the other, the covariance of a
//! point p is `σ² (a aᵀ + e eᵀ)`, `a = z × (p − o)`, `e = y' × (p − o)`, to first order.
//!
//! For CAHVORE, C_h is the entrance pupil of that ray. The mast's limits belong to the rover, not here.

use nalgebra::{Matrix3, Rotation3, Translation3};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::{Cahv, Cahvor, Camera, CameraModel};
use crate::frames::{Point3, Pose, Vector3, attitude_from_roll_pitch_yaw};

/// The pointing of the mast's head.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct MastAngles {
    /// Clockwise seen from above, zero along the rover's +x, rad.
    pub azimuth_rad: f64,
    /// Positive up, rad.
    pub elevation_rad: f64,
}

/// A pan and tilt mast with a stereo pair in its head.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Mast {
    /// Intersection of the pan and tilt axes, in the rover frame, m.
    #[schema(value_type = [f64; 3])]
    pub origin_in_rover: Point3,
    /// The left camera in the head frame.
    pub left_in_head: Camera,
    /// The right camera in the head frame.
    pub right_in_head: Camera,
}

impl Mast {
    /// Spirit's navcam pair, 1024 × 1024 (domain.md 4.3; labels of sols 767 and 1869), O made unit.
    pub fn spirit() -> Self {
        let left = Cahvor::normalised(
            Cahv::as_printed(
                Point3::new(0.005639432, -0.087625493, -0.154191937),
                Vector3::new(0.999761977, -0.021823919, 0.000864177),
                Vector3::new(495.747969785, 1177.706878329, 5.803285646),
                Vector3::new(515.650401747, -15.93401673, 1188.779044878),
            ),
            Vector3::new(0.988542432, -0.148334643, -0.027948366),
            [0.019876, -0.014281, 0.020876],
        );
        let right = Cahvor::normalised(
            Cahv::as_printed(
                Point3::new(0.004992998, 0.112718472, -0.154626655),
                Vector3::new(0.999849554, 0.016356223, 0.005864408),
                Vector3::new(499.288427796, 1217.467308686, 9.823775044),
                Vector3::new(517.730216717, 2.175475536, 1212.755674429),
            ),
            Vector3::new(0.999975429, 0.00661847, 0.002355312),
            [0.0003, -0.004874, 0.018766],
        );
        Self {
            origin_in_rover: Point3::new(0.45781, 0.02779, -1.09668),
            left_in_head: Camera::new(CameraModel::Cahvor(left), 1024, 1024),
            right_in_head: Camera::new(CameraModel::Cahvor(right), 1024, 1024),
        }
    }

    /// The pose of the head in the rover frame.
    pub fn rover_from_head(&self, angles: MastAngles) -> Pose {
        let attitude = attitude_from_roll_pitch_yaw(0.0, angles.elevation_rad, angles.azimuth_rad);
        Pose::from_parts(Translation3::from(self.origin_in_rover.coords), attitude)
    }

    /// The left and the right camera in the rover frame.
    pub fn cameras_in_rover(&self, angles: MastAngles) -> (Camera, Camera) {
        let rover_from_head = self.rover_from_head(angles);
        (self.left_in_head.moved(&rover_from_head), self.right_in_head.moved(&rover_from_head))
    }

    /// Covariance of a point located by the cameras, from the error of the angles alone, rover frame, m²; each angle
    /// has the standard deviation `sigma_rad`.
    pub fn pointing_covariance(
        &self,
        angles: MastAngles,
        point_in_rover: &Point3,
        sigma_rad: f64,
    ) -> Matrix3<f64> {
        let arm = point_in_rover - self.origin_in_rover;
        let pan_axis = Vector3::z_axis();
        let tilt_axis = Rotation3::from_axis_angle(&pan_axis, angles.azimuth_rad) * Vector3::y();
        let (by_azimuth, by_elevation) = (pan_axis.cross(&arm), tilt_axis.cross(&arm));
        let sum = by_azimuth * by_azimuth.transpose() + by_elevation * by_elevation.transpose();
        sum * (sigma_rad * sigma_rad)
    }

    /// The angles that bring a point (rover frame, m) to the centre of the left image.
    ///
    /// Azimuth is in (−π, π]. `None` if the point is nearer to the mast than the ray passes, or so steeply above or
    /// below that no tilt reaches it.
    pub fn point_left_centre_at(&self, point_in_rover: &Point3) -> Option<MastAngles> {
        let ray = self.left_in_head.ray(self.left_in_head.centre_pixel())?;
        let (c, u) = (ray.origin.coords, ray.direction);
        let d = point_in_rover - self.origin_in_rover;

        let root_of = c.dot(&u).powi(2) - c.norm_squared() + d.norm_squared();
        let s = -c.dot(&u) + root_of.sqrt();
        let w = c + u * s;
        let rho = w.x.hypot(w.z);
        if root_of.is_nan() || root_of < 0.0 || s <= 0.0 || d.z.abs() > rho {
            return None;
        }
        let tilt = (d.z / rho).asin();
        let elevation_rad = w.z.atan2(w.x) - tilt;
        let azimuth_rad = d.y.atan2(d.x) - w.y.atan2(rho * tilt.cos());
        Some(MastAngles { azimuth_rad: wrapped(azimuth_rad), elevation_rad: wrapped(elevation_rad) })
    }
}

/// Wraps an angle to (−π, π], rad.
fn wrapped(angle_rad: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    let turned = angle_rad.rem_euclid(TAU);
    if turned > PI { turned - TAU } else { turned }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::Pixel;

    #[test]
    fn the_aimed_camera_has_the_point_at_its_centre_all_around() {
        let mast = Mast::spirit();
        for azimuth_deg in (-180..180).step_by(15) {
            let azimuth = f64::from(azimuth_deg).to_radians();
            for (range, down) in [(0.8, 1.2), (2.0, 1.39), (8.0, 1.2), (40.0, -3.0)] {
                let offset = Vector3::new(range * azimuth.cos(), range * azimuth.sin(), down);
                let point = mast.origin_in_rover + offset;
                let angles = mast.point_left_centre_at(&point).unwrap();
                let (left, _) = mast.cameras_in_rover(angles);
                let pixel = left.project(&point).unwrap();
                assert!(pixel.distance(Pixel::new(511.5, 511.5)) < 1e-9, "{pixel:?} at {offset:?}");
                assert!(angles.azimuth_rad.abs() <= std::f64::consts::PI);
            }
        }
    }

    #[test]
    fn pointing_covariance_is_that_of_points_located_by_turned_cameras() {
        let mast = Mast::spirit();
        let point = Point3::new(1.9, 1.2, 0.1);
        let angles = mast.point_left_centre_at(&point).unwrap();
        // The position that the reported pose gives a point of the true head: reported · true⁻¹ · p, differentiated
        // by both angles.
        let located = |azimuth_rad: f64, elevation_rad: f64| {
            let turned = MastAngles {
                azimuth_rad: angles.azimuth_rad + azimuth_rad,
                elevation_rad: angles.elevation_rad + elevation_rad,
            };
            mast.rover_from_head(angles) * mast.rover_from_head(turned).inverse() * point
        };
        let step = 1e-6;
        let [a, e] =
            [[step, 0.0], [0.0, step]].map(|[da, de]| (located(da, de) - located(-da, -de)) / (2.0 * step));
        let expected = (a * a.transpose() + e * e.transpose()) * 0.01f64.powi(2);
        let covariance = mast.pointing_covariance(angles, &point, 0.01);
        assert!((covariance - expected).norm() < 1e-8 * expected.norm(), "{covariance} {expected}");
        // Across the line of sight it is about range times angle.
        let range_m = (point - mast.origin_in_rover).norm();
        let sigma_m = covariance.symmetric_eigenvalues().max().sqrt();
        assert!((sigma_m / (0.01 * range_m) - 1.0).abs() < 0.01, "{sigma_m} {range_m}");
    }

    #[test]
    fn a_point_inside_the_head_cannot_be_aimed_at() {
        let mast = Mast::spirit();
        assert_eq!(mast.point_left_centre_at(&(mast.origin_in_rover + Vector3::new(0.05, 0.0, 0.0))), None);
        assert_eq!(mast.point_left_centre_at(&Point3::new(f64::NAN, 0.0, 0.0)), None);
    }

    #[test]
    fn azimuth_turns_right_and_elevation_up() {
        let mast = Mast::spirit();
        let pose = mast.rover_from_head(MastAngles { azimuth_rad: 0.2, elevation_rad: 0.1 });
        let forward = pose * Vector3::x();
        assert!(forward.y > 0.19 && forward.z < -0.09, "{forward:?}");
    }

    #[test]
    fn the_baseline_is_twenty_centimetres() {
        let mast = Mast::spirit();
        let baseline = (mast.left_in_head.model.centre() - mast.right_in_head.model.centre()).norm();
        assert!((baseline - 0.20034548).abs() < 1e-6, "{baseline}");
    }
}
