//! Stage 2, `point_mast`: the azimuth and elevation that centre the prediction (K§4.1 step 2, R25), and the
//! camera models at the pointing in use.
//!
//! A recorded or rendered traverse is replayed: its pointing is fixed, so that the target appears off the centre. The
//! wanted pointing is computed all the same (closed form, domain.md 4.4) and shown beside the used one. With perfect
//! pose and pointing the target would appear exactly at the image centre (R32).
//!
//! The error of the mast angles rotates the cameras: a point that is located through them has the covariance Σ_m in
//! the rover frame (`Mast::pointing_covariance`), and a prediction is displaced in the image accordingly. The gate
//! ellipse is the sum projected into the left image: `J (Σ + Σ_m) Jᵀ` with J = ∂pixel/∂point.

use nalgebra::{Matrix2, Matrix3};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use sightline_geometry::camera::{Camera, Mast, MastAngles};
use sightline_geometry::frames::{Pixel, Point3};
use sightline_record::{Declaration, Record, Unit};

/// Pointing and camera models of this stop.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Pointing {
    /// The mast angles that would centre the prediction in the left image of the main pair; null for a pair without a
    /// mast, or if out of reach.
    pub wanted: Option<MastAngles>,
    /// The angles at which the pair was taken; null without a mast.
    pub used: Option<MastAngles>,
    /// The left camera of the target's pair in the rover frame, at the pointing used; of the main pair if the stop
    /// lacks that pair.
    pub left: Camera,
    /// The right camera of the same pair in the rover frame, at the pointing used.
    pub right: Camera,
    /// Covariance Σ_m of a point located at the prediction, due to the error of the mast angles, rover frame, m²;
    /// null without a known error.
    #[serde(default)]
    #[schema(value_type = Option<Vec<f64>>)]
    pub error_covariance_in_rover: Option<Matrix3<f64>>,
    /// The prediction in the left image, px; null if it is behind the camera.
    pub predicted_left: Option<Pixel>,
    /// The prediction in the right image, px.
    pub predicted_right: Option<Pixel>,
    /// Covariance of the prediction in the left image, px²: the gate ellipse.
    #[schema(value_type = Option<Vec<f64>>)]
    pub predicted_covariance_px2: Option<Matrix2<f64>>,
}

/// The cameras of a stop at the pointing used.
#[derive(Clone, Copy, Debug)]
pub struct UsedPointing<'a> {
    /// The mast; `None` if unknown.
    pub mast: Option<&'a Mast>,
    /// The angles at which the pair was taken.
    pub angles: Option<MastAngles>,
    /// Standard deviation of each of these angles, rad; 0 if unknown.
    pub error_rad: f64,
    /// The left camera in the rover frame.
    pub left: &'a Camera,
    /// The right camera in the rover frame.
    pub right: &'a Camera,
}

impl UsedPointing<'_> {
    /// Covariance of a point located by the cameras, from the error of the mast angles alone, rover frame, m²; `None`
    /// without a known error or a known mast.
    pub fn error_covariance(&self, point_in_rover: &Point3) -> Option<Matrix3<f64>> {
        let (mast, angles) = self.mast.zip(self.angles).filter(|_| self.error_rad > 0.0)?;
        Some(mast.pointing_covariance(angles, point_in_rover, self.error_rad))
    }
}

/// Computes the wanted pointing and projects the prediction through the cameras in use.
pub fn point_mast(
    position_in_rover: &Point3,
    covariance_in_rover: &Matrix3<f64>,
    used: UsedPointing<'_>,
) -> Pointing {
    let projected = used.left.model.project_with_jacobian(position_in_rover);
    let error_covariance_in_rover = used.error_covariance(position_in_rover);
    let seen = error_covariance_in_rover.map_or(*covariance_in_rover, |error| covariance_in_rover + error);
    Pointing {
        wanted: used.mast.and_then(|mast| mast.point_left_centre_at(position_in_rover)),
        used: used.angles,
        left: used.left.clone(),
        right: used.right.clone(),
        error_covariance_in_rover,
        predicted_left: projected.map(|(pixel, _)| pixel),
        predicted_right: used.right.project(position_in_rover),
        predicted_covariance_px2: projected.map(|(_, j)| j * seen * j.transpose()),
    }
}

/// The pointing at a stop that lacks the target's pair, with the cameras of its main pair: the target is predicted in
/// neither image, and the mast is not pointed at it.
pub fn without_pair(left: &Camera, right: &Camera) -> Pointing {
    Pointing {
        wanted: None,
        used: None,
        left: left.clone(),
        right: right.clone(),
        error_covariance_in_rover: None,
        predicted_left: None,
        predicted_right: None,
        predicted_covariance_px2: None,
    }
}

/// Declares the units of a camera model's vectors at a path of the evidence.
pub(crate) fn declare_camera<E: 'static>(r: &mut Declaration<E>, path: &str) {
    for (vector, unit) in [
        ("C", Unit::Metre),
        ("E", Unit::Metre),
        ("H", Unit::Pixel),
        ("V", Unit::Pixel),
        ("size", Unit::Pixel),
    ] {
        r.field(format!("{path}.{vector}"), unit);
    }
}

impl Record for Pointing {
    fn declare(r: &mut Declaration<Self>) {
        declare_camera(r, "left");
        declare_camera(r, "right");
        r.quantity("wanted.azimuth_rad", Unit::Radian, |p| p.wanted.map(|angles| angles.azimuth_rad))
            .describe("Azimuth that would centre the prediction; missing without a mast or out of reach.");
        r.quantity("wanted.elevation_rad", Unit::Radian, |p| p.wanted.map(|angles| angles.elevation_rad))
            .describe("Elevation that would centre the prediction; missing without a mast or out of reach.");
        r.quantity("used.azimuth_rad", Unit::Radian, |p| p.used.map(|angles| angles.azimuth_rad))
            .describe("Azimuth at which the pair was taken; missing without a mast.");
        r.quantity("used.elevation_rad", Unit::Radian, |p| p.used.map(|angles| angles.elevation_rad))
            .describe("Elevation at which the pair was taken; missing without a mast.");
        r.quantity("error_covariance_in_rover", Unit::SquareMetre, |p| p.error_covariance_in_rover)
            .describe("Covariance of a point at the prediction from the error of the mast angles alone; missing without a known error.")
            .formula("σ² (a aᵀ + e eᵀ), a = z × (p − o), e = y' × (p − o)", &["predict.position_in_rover"]);
        r.quantity("predicted_left", Unit::Pixel, |p| p.predicted_left)
            .describe("The prediction in the left image; missing behind the camera.");
        r.quantity("predicted_right", Unit::Pixel, |p| p.predicted_right)
            .describe("The prediction in the right image; missing behind the camera.");
        r.quantity("predicted_covariance_px2", Unit::SquarePixel, |p| p.predicted_covariance_px2)
            .describe("Covariance of the prediction in the left image.")
            .formula("J (Σ + Σ_m) Jᵀ", &["predict.covariance_in_rover", "error_covariance_in_rover"]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pointing_error_moves_the_prediction_by_focal_length_times_angle_at_any_range() {
        let mast = Mast::spirit();
        let error_rad = 0.05_f64.to_radians();
        for range_m in [2.0, 10.0] {
            let point = Point3::new(range_m, 0.3 * range_m, 0.2);
            let angles = mast.point_left_centre_at(&point).unwrap();
            let (left, right) = mast.cameras_in_rover(angles);
            let with_error = |error_rad: f64| {
                let used = UsedPointing {
                    mast: Some(&mast),
                    angles: Some(angles),
                    error_rad,
                    left: &left,
                    right: &right,
                };
                point_mast(&point, &(Matrix3::identity() * 1e-6), used)
            };
            let (exact, pointed) = (with_error(0.0), with_error(error_rad));
            assert_eq!(exact.error_covariance_in_rover, None);
            let [before, after] = [&exact, &pointed].map(|p| p.predicted_covariance_px2.unwrap());
            let focal_px = left.model.focal_length_px(left.centre_pixel()).unwrap();
            let added = (after - before).symmetric_eigenvalues();
            // The azimuth rotates the line of sight by less if it looks down.
            let expected = [focal_px * error_rad * angles.elevation_rad.cos(), focal_px * error_rad];
            for (variance_px2, expected_px) in [added.min(), added.max()].into_iter().zip(expected) {
                // The cameras are 15 cm beside the axes, which shortens or lengthens the arm at 2 m.
                let ratio = variance_px2.sqrt() / expected_px;
                assert!((ratio - 1.0).abs() < 0.2 / range_m, "{range_m} m: {ratio}");
            }
        }
    }
}
