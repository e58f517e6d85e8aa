//! The input of point stereo and the points of its search, shared by the step and by its search.

use nalgebra::Matrix3x2;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use sightline_geometry::camera::Camera;
use sightline_geometry::frames::Pixel;
use sightline_geometry::stereo_geometry::StereoGeometry;
use sightline_vision::image::GrayImage;

/// The input of point stereo.
#[derive(Clone, Copy, Debug)]
pub struct StereoInput<'a> {
    /// The target in the left image, px.
    pub left_pixel: Pixel,
    /// The left image.
    pub left_image: &'a GrayImage,
    /// The right image.
    pub right_image: &'a GrayImage,
    /// The left camera, rover frame.
    pub left: &'a Camera,
    /// The right camera, rover frame.
    pub right: &'a Camera,
    /// The relation of the two views.
    pub geometry: StereoGeometry,
    /// Predicted distance from the left camera, m; `None` at the designation.
    pub predicted_range_m: Option<f64>,
    /// Derivative of the surface point with respect to the left pixel, measured at an earlier stop, rover frame, m
    /// per px; `None` without one.
    pub surface_by_pixel: Option<Matrix3x2<f64>>,
}

/// One candidate on the epipolar curve.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CurvePoint {
    /// Position in the right image, px.
    pub pixel: Pixel,
    /// Range along the left ray, m.
    pub range_m: f64,
    /// Best score within the tolerance across the curve; null if no window fits.
    pub score: Option<f32>,
}
