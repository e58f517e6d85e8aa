//! Resampling of windows between two cameras that see the same ground, and the best match of one in a region of an image.
//!
//! A window is resampled from one image to the view of the other camera, with the affine map `∂from/∂to` of the plane
//! through the point:
//! ```text
//! X(u) = o + d (n·(P − o))/(n·d)          the ray (o, d) of pixel u meets the plane (P, n)
//! ∂to/∂from = ∂ project(to, X(u)) / ∂u    by differences of one pixel
//! ```
//! A plane seen at a grazing angle is tilted towards the camera until the cosine between its normal and the ray is 0.15.

use nalgebra::{Matrix2, Vector2};

use sightline_geometry::camera::Camera;
use sightline_geometry::frames::{Pixel, Point3, Pose, Ray, Vector3};
use sightline_vision::correlate::peak::peak_at;
use sightline_vision::correlate::pseudo::pseudo_surface;
use sightline_vision::correlate::{Surface, zncc};
use sightline_vision::image::sample::Kernel;
use sightline_vision::image::{GrayImage, Patch, PixelRect, resample};

use super::settings::OdometryScore;

/// Smallest cosine between a plane's normal and the ray to the camera.
const GRAZING: f64 = 0.15;

/// A camera with its image.
#[derive(Clone, Copy)]
pub(crate) struct Eye<'a> {
    /// Camera model in the rover frame of its stop.
    pub(crate) camera: &'a Camera,
    pub(crate) image: &'a GrayImage,
}

/// A match with subpixel position.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found {
    pub(super) pixel: Pixel,
    pub(super) score: f64,
    /// Covariance for noise that is independent from pixel to pixel, px².
    pub(super) covariance_px2: Matrix2<f64>,
}

/// `∂to/∂from` of the plane through `point` (frame of `from`), px per px.
pub(super) fn map_of_plane(
    from: &Camera,
    to: &Camera,
    to_from_from: &Pose,
    pixel: Pixel,
    point: &Point3,
    normal: &Vector3,
) -> Option<Matrix2<f64>> {
    let middle = from.ray(pixel)?.direction;
    let facing = middle.dot(normal);
    // The normal points to the camera's side.
    let normal = if facing > 0.0 { -normal } else { *normal };
    let facing = -facing.abs();
    let normal = if facing > -GRAZING { normal - middle * (facing + GRAZING) } else { normal };
    let seen = |ray: Ray| {
        let along = normal.dot(&(point - ray.origin)) / normal.dot(&ray.direction);
        to.project(&(to_from_from * ray.at(along)))
    };
    let at = |dx: f64, dy: f64| seen(from.ray(pixel.offset(dx, dy))?);
    let between = |a: Pixel, b: Pixel| Vector2::new(b.x - a.x, b.y - a.y) / 2.0;
    let columns = [between(at(-1.0, 0.0)?, at(1.0, 0.0)?), between(at(0.0, -1.0)?, at(0.0, 1.0)?)];
    let map = Matrix2::from_columns(&columns);
    map.iter().all(|value| value.is_finite()).then_some(map)
}

/// The window around a pixel of `image`, resampled for the map `map` = `∂to/∂from`; `None` if it is incomplete.
pub(super) fn window(image: &GrayImage, pixel: Pixel, map: &Matrix2<f64>, half: u32) -> Option<Patch> {
    let from_to = map.try_inverse()?;
    let patch = Patch::from(resample::window(image, pixel, &from_to, half, Kernel::Bicubic));
    patch.is_complete().then_some(patch)
}

/// The scores of a window at the positions of a region that contain it.
pub(super) fn surface(
    template: &Patch,
    image: &GrayImage,
    region: PixelRect,
    score: OdometryScore,
) -> Option<Surface> {
    match score {
        OdometryScore::Normalised => zncc::zncc_surface(template, image, region),
        OdometryScore::PseudoNormalised => pseudo_surface(template, image, region),
    }
}

/// The highest score at allowed whole pixels, refined to subpixel precision; `None` if it is at the border of the score
/// map.
pub(super) fn best(surface: &Surface, is_allowed: impl Fn(Pixel) -> bool) -> Option<Found> {
    let mut highest = (None, f32::NEG_INFINITY);
    for (iy, row) in (0..).zip(surface.scores.chunks_exact((surface.width as usize).max(1))) {
        for (ix, score) in (0..).zip(row) {
            // Excluded positions have the score NaN, which no comparison exceeds.
            if *score > highest.1 && is_allowed(surface.pixel_of(ix, iy)) {
                highest = (Some((ix, iy)), *score);
            }
        }
    }
    let (ix, iy) = highest.0?;
    let peak = peak_at(surface, ix, iy, true).filter(|peak| !peak.at_edge)?;
    Some(Found { pixel: peak.pixel, score: peak.score, covariance_px2: peak.covariance_px2 })
}

/// The square region around a pixel in which a window of side 2·half + 1 is searched up to `reach` px away.
pub(super) fn around(pixel: Pixel, half: u32, reach: u32) -> PixelRect {
    PixelRect::centred(pixel, 2 * (half + reach) + 1)
}
