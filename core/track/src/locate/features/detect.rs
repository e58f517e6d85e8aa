//! Steps `detect`, `match_features` (left to right) and `triangulate`: the points of one stop (D§2, R157–R160).
//!
//! ```text
//! z_i = (l_iᵀ, r_iᵀ)ᵀ          x_i = f(z_i)                                                     D-Eq 1
//! P_i = (σ² + (σ_s s_i)²) J Jᵀ,  J = ∂f/∂z    by differences of one pixel
//! ```
//! f returns the midpoint of the two rays. The point has the descriptor of its left feature (R160).
//!
//! | symbol | name | unit, frame |
//! |---|---|---|
//! | l, r | keypoints of `left` and `right` | px |
//! | x | `Point::position_in_rover` | m, rover frame of the stop |
//! | σ, σ_s | `feature_sigma_px`, `feature_sigma_per_scale` | px, 1 |
//! | s | `Keypoint::sigma_px` of the left feature | px |

use nalgebra::{Matrix3, SMatrix};

use super::match_stereo::{StereoMatch, match_stereo, pixel_of};
use super::settings::FeatureSettings;
use crate::locate::store::HeapBytes;
use crate::stages::capture::StereoPair;
use sightline_geometry::camera::Camera;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::Result;
use sightline_geometry::estimate::triangulate::midpoint;
use sightline_geometry::frames::{Pixel, Point3, Vector3};
use sightline_vision::sift::{self, Features, Keypoint};

/// A feature that is matched in both images, as a point in space.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// Indices of the left and the right keypoint.
    pub stereo: StereoMatch,
    /// Position in the rover frame of the stop, m.
    pub position_in_rover: Point3,
    /// Its covariance, m².
    pub covariance_in_rover: Matrix3<f64>,
    /// Distance from the left camera, m.
    pub range_m: f64,
    /// Derivative of the position with respect to shifting both pixels right, both down, and the right one alone
    /// right, m per px.
    pub by_shift_m: [Vector3; 3],
}

/// The features of one stop: all of both images, and the triangulated points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StopFeatures {
    /// Features of the left image.
    pub left: Features,
    /// Features of the right image.
    pub right: Features,
    /// The points.
    pub points: Vec<Point>,
    /// Number of stereo matches whose range is outside the limits or that are not in front of the cameras.
    pub out_of_range: usize,
}

impl HeapBytes for StopFeatures {
    fn heap_bytes(&self) -> usize {
        let of_eye = |eye: &Features| size_of_val(&*eye.keypoints) + size_of_val(&*eye.descriptors);
        of_eye(&self.left) + of_eye(&self.right) + size_of_val(&*self.points)
    }
}

impl StopFeatures {
    /// Returns the position of a keypoint, px.
    pub fn pixel(keypoint: &Keypoint) -> Pixel {
        pixel_of(keypoint)
    }

    /// Returns the left keypoint of a point.
    pub fn left_of(&self, point: &Point) -> &Keypoint {
        &self.left.keypoints[point.stereo.left as usize]
    }
}

/// Finds the features of a stereo pair and their points in the rover frame.
///
/// # Errors
/// [`Error::Cancelled`](sightline_geometry::error::Error::Cancelled).
pub fn detect(
    pair: &StereoPair,
    cameras: [&Camera; 2],
    settings: &FeatureSettings,
    cancel: Cancel<'_>,
) -> Result<StopFeatures> {
    let sift = settings.sift();
    let left = sift::detect_until(&pair.left, &sift, cancel)?;
    let right = sift::detect_until(&pair.right, &sift, cancel)?;
    let matched = match_stereo(&left, &right, cameras, settings);
    let found = matched.len();
    let points: Vec<Point> = matched
        .into_iter()
        .filter_map(|stereo| {
            let l = StopFeatures::pixel(&left.keypoints[stereo.left as usize]);
            let r = StopFeatures::pixel(&right.keypoints[stereo.right as usize]);
            let scale_px = f64::from(left.keypoints[stereo.left as usize].sigma_px);
            triangulate(stereo, [l, r], scale_px, cameras, settings)
        })
        .collect();
    let out_of_range = found - points.len();
    Ok(StopFeatures { left, right, points, out_of_range })
}

/// Triangulates a match; `None` outside the range limits or behind a camera.
fn triangulate(
    stereo: StereoMatch,
    [l, r]: [Pixel; 2],
    scale_px: f64,
    [left, right]: [&Camera; 2],
    settings: &FeatureSettings,
) -> Option<Point> {
    let meet = |l: Pixel, r: Pixel| midpoint(&left.ray(l)?, &right.ray(r)?);
    let found = meet(l, r)?;
    let ranges = settings.feature_range_min_m..=settings.feature_range_max_m;
    if !ranges.contains(&found.range_left_m) {
        return None;
    }
    let along =
        |l: [Pixel; 2], r: [Pixel; 2]| Some((meet(l[1], r[1])?.point - meet(l[0], r[0])?.point) / 2.0);
    let to_both_sides = |p: Pixel, dx: f64, dy: f64| [p.offset(-dx, -dy), p.offset(dx, dy)];
    let jacobian = SMatrix::<f64, 3, 4>::from_columns(&[
        along(to_both_sides(l, 1.0, 0.0), [r, r])?,
        along(to_both_sides(l, 0.0, 1.0), [r, r])?,
        along([l, l], to_both_sides(r, 1.0, 0.0))?,
        along([l, l], to_both_sides(r, 0.0, 1.0))?,
    ]);
    let sigma_px = settings.feature_sigma_px.hypot(settings.feature_sigma_per_scale * scale_px);
    Some(Point {
        stereo,
        position_in_rover: found.point,
        covariance_in_rover: jacobian * jacobian.transpose() * (sigma_px * sigma_px),
        range_m: found.range_left_m,
        by_shift_m: [
            jacobian.column(0) + jacobian.column(2),
            jacobian.column(1) + jacobian.column(3),
            jacobian.column(2).into(),
        ],
    })
}
