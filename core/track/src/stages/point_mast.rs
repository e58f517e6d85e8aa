//! Stage 2, `point_mast`: the azimuth and elevation that centre the prediction (K§4.1 step 2, R25), and the
//! camera models at the pointing in use.
//!
//! A recorded or rendered traverse is replayed: its pointing stays as it was taken, so that the target appears
//! off the centre. What is wanted is computed all the same (closed form, domain.md 4.4) and shown beside what
//! was used. With perfect pose and pointing the target would appear exactly at the image centre (R32).
//!
//! The gate ellipse is the prediction's covariance seen in the left image: `J Σ Jᵀ` with J = ∂pixel/∂point.

use nalgebra::{Matrix2, Matrix3};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use sightline_geometry::camera::{Camera, Mast, MastAngles};
use sightline_geometry::frames::{Pixel, Point3};
use sightline_record::{Declaration, Record, Unit};

/// Pointing and camera models of this stop.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Pointing {
    /// The angles that would centre the prediction in the left image; null without a mast or out of reach.
    pub wanted: Option<MastAngles>,
    /// The angles at which the pair was taken; null without a mast.
    pub used: Option<MastAngles>,
    /// The left camera in the rover frame, at the pointing used.
    pub left: Camera,
    /// The right camera in the rover frame, at the pointing used.
    pub right: Camera,
    /// The prediction in the left image, px; null when it is behind the camera.
    pub predicted_left: Option<Pixel>,
    /// The prediction in the right image, px.
    pub predicted_right: Option<Pixel>,
    /// Covariance of the prediction in the left image, px²: the gate.
    #[schema(value_type = Option<Vec<f64>>)]
    pub predicted_covariance_px2: Option<Matrix2<f64>>,
}

/// The cameras of a stop as they were used.
#[derive(Clone, Copy, Debug)]
pub struct UsedPointing<'a> {
    /// The mast, where it is known.
    pub mast: Option<&'a Mast>,
    /// The angles at which the pair was taken.
    pub angles: Option<MastAngles>,
    /// The left camera in the rover frame.
    pub left: &'a Camera,
    /// The right camera in the rover frame.
    pub right: &'a Camera,
}

/// Computes the wanted pointing and projects the prediction through the cameras in use.
pub fn point_mast(
    position_in_rover: &Point3,
    covariance_in_rover: &Matrix3<f64>,
    used: UsedPointing<'_>,
) -> Pointing {
    let projected = used.left.model.project_with_jacobian(position_in_rover);
    Pointing {
        wanted: used.mast.and_then(|mast| mast.point_left_centre_at(position_in_rover)),
        used: used.angles,
        left: used.left.clone(),
        right: used.right.clone(),
        predicted_left: projected.map(|(pixel, _)| pixel),
        predicted_right: used.right.project(position_in_rover),
        predicted_covariance_px2: projected.map(|(_, j)| j * covariance_in_rover * j.transpose()),
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
        r.quantity("predicted_left", Unit::Pixel, |p| p.predicted_left)
            .describe("The prediction in the left image; missing behind the camera.");
        r.quantity("predicted_right", Unit::Pixel, |p| p.predicted_right)
            .describe("The prediction in the right image; missing behind the camera.");
        r.quantity("predicted_covariance_px2", Unit::SquarePixel, |p| p.predicted_covariance_px2)
            .describe("Covariance of the prediction in the left image.")
            .formula("J Σ Jᵀ", &["predict.covariance_in_rover"]);
    }
}
