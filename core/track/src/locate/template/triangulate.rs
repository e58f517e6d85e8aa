//! Step `triangulate`: the position from both pixels, with its covariance (K§4.4, R77; domain.md 3.1, 13.4).
//!
//! The position is the midpoint of the two unrectified rays; the ray gap is reported. The covariance is propagated by
//! the unscented transform of (u_l, v_l, u_r, v_r). With D the covariance of the left position, M = ∂right/∂left on
//! the surface and S the covariance of the right position for a given left one, an error of the left position
//! displaces both pixels along the surface:
//! ```text
//! P = [ D     D Mᵀ        ]
//!     [ M D   M D Mᵀ + S  ]
//! ```
//! The preset `half_pixel` is the papers': independent half pixels in both cameras, `P = I/4` (R172).

use nalgebra::{Matrix2, Matrix3, Matrix3x2, Matrix4, Vector2, Vector4};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::failure::TemplateFailure;
use super::point_stereo::{PointStereo, StereoInput};
use super::settings::NoiseModel;
use sightline_geometry::estimate::triangulate::midpoint;
use sightline_geometry::estimate::unscented::{UnscentedParameters, unscented};
use sightline_geometry::frames::{Pixel, Point3};
use sightline_record::{Declaration, Record, Unit};

/// The papers' noise: half a pixel (1σ) in each coordinate of each camera (R172), px².
pub(super) const HALF_PIXEL_VARIANCE: f64 = 0.25;

/// The position from both pixels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Triangulation {
    /// Position in the rover frame, m.
    #[schema(value_type = [f64; 3])]
    pub position_in_rover: Point3,
    /// Its covariance, m².
    #[schema(value_type = Vec<f64>)]
    pub covariance_in_rover: Matrix3<f64>,
    /// Derivative of the surface point with respect to the left pixel, m per px: its two tangents, column by column.
    #[schema(value_type = Option<Vec<f64>>)]
    pub surface_by_pixel: Option<Matrix3x2<f64>>,
    /// Distance from the left camera, m.
    pub range_m: f64,
    /// Distance between the two rays, m.
    pub gap_m: f64,
    /// Distance between the two rays at the target's distance, px.
    pub gap_px: f64,
}

/// Triangulates and propagates the noise of both pixels.
///
/// # Errors
/// If the rays do not meet in front of the cameras.
pub fn triangulate(
    input: &StereoInput<'_>,
    stereo: &PointStereo,
    left_covariance_px2: Matrix2<f64>,
    noise: NoiseModel,
) -> Result<Triangulation, TemplateFailure> {
    let meet = |l: Pixel, r: Pixel| midpoint(&input.left.ray(l)?, &input.right.ray(r)?);
    let (left, right) = (input.left_pixel, stereo.right_pixel);
    let found = meet(left, right).ok_or(TemplateFailure::RaysDoNotMeet)?;
    let mean = Vector4::new(left.x, left.y, right.x, right.y);
    let covariance = match noise {
        NoiseModel::Measured => joint_covariance(left_covariance_px2, stereo),
        NoiseModel::HalfPixel => Matrix4::identity() * HALF_PIXEL_VARIANCE,
    };
    let (_, covariance_in_rover) = unscented(&mean, &covariance, UnscentedParameters::default(), |z| {
        meet(Pixel::new(z[0], z[1]), Pixel::new(z[2], z[3])).map(|t| t.point.coords)
    })
    .ok_or(TemplateFailure::TooUncertain)?;
    let tangent = |offset: Vector2<f64>| {
        let moved = stereo.right_from_left * offset;
        let at = |sign: f64| {
            let l = left.offset(sign * offset.x, sign * offset.y);
            meet(l, right.offset(sign * moved.x, sign * moved.y)).map(|t| t.point)
        };
        Some((at(1.0)? - at(-1.0)?) / 2.0)
    };
    let tangents = tangent(Vector2::x()).zip(tangent(Vector2::y()));
    let focal_px = input.left.model.focal_length_px(left).unwrap_or(0.0);
    Ok(Triangulation {
        position_in_rover: found.point,
        covariance_in_rover,
        surface_by_pixel: tangents.map(|(u, v)| Matrix3x2::from_columns(&[u, v])),
        range_m: found.range_left_m,
        gap_m: found.gap_m,
        gap_px: found.gap_m * focal_px / found.range_left_m,
    })
}

/// The joint covariance of both pixels, px².
fn joint_covariance(left: Matrix2<f64>, stereo: &PointStereo) -> Matrix4<f64> {
    let m = stereo.right_from_left;
    let mut joint = Matrix4::zeros();
    joint.fixed_view_mut::<2, 2>(0, 0).copy_from(&left);
    joint.fixed_view_mut::<2, 2>(0, 2).copy_from(&(left * m.transpose()));
    joint.fixed_view_mut::<2, 2>(2, 0).copy_from(&(m * left));
    joint.fixed_view_mut::<2, 2>(2, 2).copy_from(&(m * left * m.transpose() + stereo.covariance_px2));
    joint
}

impl Record for Triangulation {
    fn declare(r: &mut Declaration<Self>) {
        r.quantity("position_in_rover", Unit::Metre, |t| t.position_in_rover)
            .describe("Triangulated position in the rover frame.");
        r.quantity("covariance_in_rover", Unit::SquareMetre, |t| t.covariance_in_rover)
            .describe("Covariance of the triangulated position.");
        r.quantity("surface_by_pixel", Unit::MetrePerPixel, |t| t.surface_by_pixel)
            .describe("Derivative of the surface point by the left pixel.");
        r.quantity("range_m", Unit::Metre, |t| t.range_m).describe("Distance from the left camera.");
        r.quantity("gap_m", Unit::Metre, |t| t.gap_m).describe("Smallest distance between the two rays.");
        r.quantity("gap_px", Unit::Pixel, |t| t.gap_px)
            .describe("Smallest distance between the two rays, at the distance of the target.");
    }
}
