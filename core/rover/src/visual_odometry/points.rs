//! Step `points`: corners of the left image with their positions by stereo.
//!
//! The window of the left image is searched along its epipolar line in the right one, resampled for a plane that is
//! parallel to the ground under the wheels. The search starts at half of the range of this ground. The right pixel gives
//! position and covariance,
//! ```text
//! σ_r = r² σ_s/(f b)        along the ray, from the stereo match
//! σ_⊥ = r σ_t/f             across it, from the match between the stops; 0 at the first stop, where the corner is the point
//! ```
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | r, f | range from the left camera, focal length there | m, px |
//! | b | baseline across the ray | m |
//! | σ_s, σ_t | errors of the two matches | px |
//!
//! Frame: rover, of the stop. Sources: domain.md 3.1, 9.2.

use nalgebra::{Matrix2, Matrix3};

use sightline_geometry::camera::Camera;
use sightline_geometry::estimate::triangulate::midpoint;
use sightline_geometry::frames::{Pixel, Point3, Pose, Vector3};
use sightline_vision::image::PixelRect;

use super::settings::OdometrySettings;
use super::windows::{self, Eye, Found};

/// Largest distance of a match from its epipolar line, px.
const BESIDE_MAX_PX: f64 = 1.6;
/// Largest distance from the line at which scores are computed, px: the peak's neighbours are two pixels farther.
const BESIDE_SCORES_PX: f64 = BESIDE_MAX_PX + 2.0;
/// Start of the search as a fraction of the ground's range.
const NEAREST_PART: f64 = 0.5;
/// Ranges of the two ends of an epipolar line's tangent, relative to a predicted range.
const NEAR_RANGE: [f64; 2] = [0.98, 1.02];

/// Both cameras of a stop with their images.
#[derive(Clone, Copy)]
pub(super) struct Eyes<'a> {
    pub(super) left: Eye<'a>,
    pub(super) right: Eye<'a>,
}

/// A point seen by both cameras.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    pub(super) left: Pixel,
    /// In the rover frame, m.
    pub(super) position: Point3,
    pub(super) covariance: Matrix3<f64>,
    /// Derivative of the position with respect to a common shift of the matches (left pixel along x and y, disparity), m
    /// per px.
    pub(super) by_shift: [Vector3; 3],
}

/// Why a corner has no point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NoPoint {
    /// Its window or its epipolar line is partly outside the images.
    Outside,
    /// No match is good enough.
    LowScore,
    /// Its range is beyond the limits.
    OutOfRange,
}

/// The normal of the ground under the wheels, rover frame.
pub(super) fn ground_normal() -> Vector3 {
    -Vector3::z()
}

/// The point of a pixel of the left image, searched over all ranges.
pub(super) fn point(eyes: &Eyes<'_>, left: Pixel, settings: &OdometrySettings) -> Result<Point, NoPoint> {
    let ray = eyes.left.camera.ray(left).ok_or(NoPoint::Outside)?;
    // z points down, and the ground is at z = 0.
    let ground_m = if ray.direction.z > 0.0 { -ray.origin.z / ray.direction.z } else { f64::INFINITY };
    let nearest_m = settings.range_min_m.max(NEAREST_PART * ground_m);
    if nearest_m >= settings.range_max_m {
        return Err(NoPoint::OutOfRange);
    }
    let line = Line::of(eyes, left, [nearest_m, settings.range_max_m]).ok_or(NoPoint::Outside)?;
    let assumed_m = ground_m.clamp(nearest_m, settings.range_max_m);
    let found = match_on_line(eyes, left, &ray.at(assumed_m), &line, 3.0, settings)?;
    of_match(eyes, left, &found, None, settings).ok_or(NoPoint::OutOfRange)
}

/// The point of a pixel of the left image with a predicted position; `reach_px` is the search distance of the right pixel
/// from the prediction, `left_px2` the covariance of the left pixel.
pub(super) fn point_near(
    eyes: &Eyes<'_>,
    (left, left_px2): (Pixel, Matrix2<f64>),
    predicted: &Point3,
    reach_px: f64,
    settings: &OdometrySettings,
) -> Result<Point, NoPoint> {
    let range_m = (predicted - eyes.left.camera.model.centre()).norm();
    let line = Line::of(eyes, left, NEAR_RANGE.map(|part| part * range_m)).ok_or(NoPoint::Outside)?;
    let line = line.middle(reach_px);
    let found = match_on_line(eyes, left, predicted, &line, reach_px, settings)?;
    of_match(eyes, left, &found, Some(left_px2), settings).ok_or(NoPoint::OutOfRange)
}

/// The epipolar line between two ranges, as a straight line.
struct Line {
    ends: [Pixel; 2],
}

impl Line {
    fn of(eyes: &Eyes<'_>, left: Pixel, ranges_m: [f64; 2]) -> Option<Self> {
        let ray = eyes.left.camera.ray(left)?;
        let [near, far] = ranges_m.map(|range_m| eyes.right.camera.project(&ray.at(range_m)));
        Some(Self { ends: [far?, near?] })
    }

    /// The part of the line within `reach_px` of its midpoint.
    fn middle(&self, reach_px: f64) -> Self {
        let [a, b] = self.ends;
        let middle = Pixel::new(0.5 * (a.x + b.x), 0.5 * (a.y + b.y));
        let length = a.distance(b).max(1e-9);
        let along = [(b.x - a.x) / length * reach_px, (b.y - a.y) / length * reach_px];
        Self { ends: [middle.offset(-along[0], -along[1]), middle.offset(along[0], along[1])] }
    }

    /// The pixels covered by the windows on the line, `margin_px` beyond its ends, and beside it up to the largest
    /// distance of a match.
    fn region(&self, half: u32, margin_px: f64) -> PixelRect {
        let beside_px = margin_px.min(BESIDE_SCORES_PX);
        let reach = f64::from(half) + beside_px;
        let [a, b] = self.ends;
        let length = a.distance(b).max(1e-9);
        let [dx, dy] = [b.x - a.x, b.y - a.y].map(|side| side / length * (margin_px - beside_px));
        let (a, b) = (a.offset(-dx, -dy), b.offset(dx, dy));
        let (x, y) = ((a.x.min(b.x) - reach).floor(), (a.y.min(b.y) - reach).floor());
        let span = |a: f64, b: f64| (a - b).abs() + 2.0 * reach + 2.0;
        PixelRect::new(x as i32, y as i32, span(a.x, b.x) as u32, span(a.y, b.y) as u32)
    }

    /// Distance of a pixel from the line, px.
    fn beside_px(&self, pixel: Pixel) -> f64 {
        let [a, b] = self.ends;
        let length = a.distance(b).max(1e-9);
        ((b.x - a.x) * (pixel.y - a.y) - (b.y - a.y) * (pixel.x - a.x)).abs() / length
    }
}

/// The best match on an epipolar line.
fn match_on_line(
    eyes: &Eyes<'_>,
    left: Pixel,
    assumed: &Point3,
    line: &Line,
    margin_px: f64,
    settings: &OdometrySettings,
) -> Result<Found, NoPoint> {
    let half = settings.window_px / 2;
    let (from, to) = (eyes.left.camera, eyes.right.camera);
    let map = windows::map_of_plane(from, to, &Pose::identity(), left, assumed, &ground_normal());
    let template = map.and_then(|map| windows::window(eyes.left.image, left, &map, half));
    let template = template.ok_or(NoPoint::Outside)?;
    let region = line.region(half, margin_px);
    let surface = windows::surface(&template, eyes.right.image, region, settings.score);
    let surface = surface.ok_or(NoPoint::Outside)?;
    let found = windows::best(&surface, |pixel| line.beside_px(pixel) <= BESIDE_MAX_PX);
    found.filter(|found| found.score >= settings.stereo_score_min).ok_or(NoPoint::LowScore)
}

/// The point of a stereo match; an error beyond the range limits.
fn of_match(
    eyes: &Eyes<'_>,
    left: Pixel,
    found: &Found,
    left_px2: Option<Matrix2<f64>>,
    settings: &OdometrySettings,
) -> Option<Point> {
    let camera: &Camera = eyes.left.camera;
    let ray = camera.ray(left)?;
    let met = midpoint(&ray, &eyes.right.camera.ray(found.pixel)?)?;
    let range_m = met.range_left_m;
    if !(settings.range_min_m..=settings.range_max_m).contains(&range_m) {
        return None;
    }
    let focal_px = camera.model.focal_length_px(left)?;
    let to_right = eyes.right.camera.model.centre() - camera.model.centre();
    let baseline_m = (to_right - ray.direction * to_right.dot(&ray.direction)).norm();
    let by_disparity = ray.direction * (range_m * range_m / (focal_px * baseline_m));
    // The axes of the pixels, across the ray.
    let across =
        |axis: Vector3| (axis - ray.direction * axis.dot(&ray.direction)).normalize() * (range_m / focal_px);
    let right = camera.model.horizontal_axis();
    let by_left = [across(right), across(camera.model.axis().cross(&right))];
    let stereo_px2 = found.covariance_px2.m11 + settings.stereo_sigma_px.powi(2);
    let mut covariance = by_disparity * by_disparity.transpose() * stereo_px2;
    if let Some(left_px2) = left_px2 {
        for (row, a) in by_left.iter().enumerate() {
            for (column, b) in by_left.iter().enumerate() {
                covariance += a * b.transpose() * left_px2[(row, column)];
            }
        }
    }
    let by_shift = [by_left[0], by_left[1], by_disparity];
    Some(Point { left, position: met.point, covariance, by_shift })
}
