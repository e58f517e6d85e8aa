//! Patches: small square windows cut or resampled from an image (K§4.3.1, R51, R58, R59).
//!
//! Resampling by scale and roll (R58): the output at offset (u, v) from its centre samples the source at
//! ```text
//! centre + (1/s) [[cos ρ, sin ρ], [−sin ρ, cos ρ]] (u, v)ᵀ
//! ```
//! so content grows with s and rotates clockwise on screen with ρ. A warp takes any linear map F in place of s R(ρ),
//! with s = √|det F|: foreshortening differs little between consecutive stops. If s < 1 the source is smoothed first
//! (R58), otherwise detail finer than the new pixel grid would alias. The standard deviation of the Gaussian is
//! ```text
//! σ = 0.5 · sqrt(1/s² − 1)   source px
//! ```
//! which changes the blur of half a source pixel, assumed for any sampled image, to half a pixel of the *output* (Lowe
//! 2004, section 3.3). The Gaussian is normalised over the valid pixels inside the image, and an invalid pixel stays
//! invalid.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | s | `scale` | – |
//! | ρ | `roll_rad` | rad, clockwise on screen positive |
//! | u, v | offset from the patch's centre | px |

use std::ops::{Deref, DerefMut};

use image::Luma;
use nalgebra::{Matrix2, Rotation2, Vector2};

use super::sample::Kernel;
use super::{GrayImage, PixelRect, resample};
use sightline_geometry::frames::Pixel;

/// Assumed blur of a sampled image, px.
const NATURAL_BLUR_PX: f64 = 0.5;

/// Standard deviation below which a patch counts as flat, fractions of full scale.
///
/// Interpolating a constant has noise of 3e-8 in `f32`; one pixel of a 41 × 41 window that differs by one part in 65535
/// gives 3.7e-7.
pub const FLAT_STD: f64 = 1e-7;

/// Largest distance from a window at which its source is read, px: larger than any image, and small enough for `i32`.
const REACH_MAX_PX: f64 = 1e6;

/// A window of an image, or one resampled from it; NaN = invalid. It dereferences to its image.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Patch(GrayImage);

impl Patch {
    /// The pixels as an image.
    pub fn image(&self) -> &GrayImage {
        &self.0
    }

    /// Mean of the valid pixels, fraction of full scale; `None` without any.
    pub fn mean(&self) -> Option<f64> {
        moments(&self.0).map(|(mean, _)| mean)
    }

    /// Standard deviation of the valid pixels (divisor n), fraction of full scale; `None` without any.
    pub fn std(&self) -> Option<f64> {
        moments(&self.0).map(|(_, std)| std)
    }

    /// Fraction of the pixels that are valid, 0 to 1; 0 for an empty patch.
    pub fn valid_share(&self) -> f64 {
        let total = self.0.as_raw().len();
        if total == 0 { 0.0 } else { valid(&self.0).count() as f64 / total as f64 }
    }

    /// Returns whether every pixel is valid.
    pub fn is_complete(&self) -> bool {
        self.0.as_raw().iter().all(|v| v.is_finite())
    }

    /// Returns whether the patch has no texture: its standard deviation is below [`FLAT_STD`].
    pub fn is_flat(&self) -> bool {
        self.std().is_none_or(|std| std < FLAT_STD)
    }
}

impl From<GrayImage> for Patch {
    fn from(image: GrayImage) -> Self {
        Self(image)
    }
}

impl Deref for Patch {
    type Target = GrayImage;

    fn deref(&self) -> &GrayImage {
        &self.0
    }
}

impl DerefMut for Patch {
    fn deref_mut(&mut self) -> &mut GrayImage {
        &mut self.0
    }
}

/// The (2·half + 1)² window about the sub-pixel `centre`; NaN outside the image or touching an invalid pixel.
pub fn extract(image: &GrayImage, centre: Pixel, half: u32, kernel: Kernel) -> Patch {
    resample::window(image, centre, &Matrix2::identity(), half, kernel).into()
}

/// The window of `size` × `size` px about `centre`, with its content magnified by `scale` and rolled by `roll_rad`
/// (R58).
///
/// `size` must be odd. NaN outside the source or touching an invalid pixel, and everywhere unless `scale` is positive
/// and finite.
pub fn scale_roll(
    source: &GrayImage,
    centre: Pixel,
    scale: f64,
    roll_rad: f64,
    size: u32,
    kernel: Kernel,
) -> Patch {
    // Any other value makes the map singular, or a reflection.
    let map = Rotation2::new(roll_rad).into_inner() * if scale > 0.0 { scale } else { 0.0 };
    warp(source, centre, &map, size, kernel)
}

/// The window of `size` × `size` px about `centre`, with its content mapped by `map`, px per px.
///
/// If the map shrinks (determinant below 1), the source is smoothed first. `size` must be odd. NaN outside the source or
/// touching an invalid pixel, and everywhere if the map is singular.
pub fn warp(source: &GrayImage, centre: Pixel, map: &Matrix2<f64>, size: u32, kernel: Kernel) -> Patch {
    let scale = map.determinant().abs().sqrt();
    let Some(inverse) = map.try_inverse().filter(|_| scale.is_finite()) else {
        return invalid(size);
    };
    let read = |image: &GrayImage, centre: Pixel| -> Patch {
        resample::window(image, centre, &inverse, size / 2, kernel).into()
    };
    if !shrinks(scale) {
        return read(source, centre);
    }
    let half = (f64::from(size) - 1.0) / 2.0;
    let corners = [Vector2::new(half, half), Vector2::new(half, -half)];
    let farthest = corners.map(|corner| (inverse * corner).norm()).into_iter().fold(0.0, f64::max);
    match smoothed(source, centre, farthest, scale) {
        Some((smooth, corner)) => read(&smooth, centre.offset(-corner.x, -corner.y)),
        None => invalid(size),
    }
}

/// The window of `size` × `size` px whose pixel at offset o from its centre samples the source at `from(o)`, a map that
/// is nearly linear over the window and magnifies by `scale`.
///
/// If it shrinks, the source is smoothed first. NaN where `from` returns `None`, and as for [`warp`].
pub fn warp_by(
    source: &GrayImage,
    scale: f64,
    size: u32,
    kernel: Kernel,
    from: impl Fn(Vector2<f64>) -> Option<Pixel>,
) -> Patch {
    if !shrinks(scale) {
        return resample_through(source, size, kernel, from);
    }
    let half = (f64::from(size) - 1.0) / 2.0;
    let Some(centre) = from(Vector2::zeros()) else { return invalid(size) };
    let corners = [(half, half), (half, -half), (-half, half), (-half, -half)];
    let places = corners.iter().filter_map(|(u, v)| from(Vector2::new(*u, *v)));
    let farthest = places.map(|place| place.distance(centre)).fold(0.0, f64::max);
    match smoothed(source, centre, farthest, scale) {
        Some((smooth, corner)) => {
            resample_through(&smooth, size, kernel, |o| Some(from(o)?.offset(-corner.x, -corner.y)))
        }
        None => invalid(size),
    }
}

/// Returns whether content is shrunk; rounding may make the scale of a pure rotation slightly less than 1.
fn shrinks(scale: f64) -> bool {
    scale < 1.0 - 1e-12
}

/// The source up to `farthest` px from `centre`, smoothed for `scale` < 1, and the offset of its first pixel; `None`
/// outside the source.
fn smoothed(
    source: &GrayImage,
    centre: Pixel,
    farthest: f64,
    scale: f64,
) -> Option<(GrayImage, Vector2<f64>)> {
    let sigma_px = NATURAL_BLUR_PX * (1.0 / (scale * scale) - 1.0).sqrt();
    let reach = (farthest + 3.0 + (3.0 * sigma_px).ceil()).min(REACH_MAX_PX);
    let needed = PixelRect::centred(centre, 2 * reach.ceil() as u32 + 1);
    let part = needed.intersect(&PixelRect::whole(source.width(), source.height()))?;
    let corner = Vector2::new(f64::from(part.x), f64::from(part.y));
    Some((blurred(&crop(source, &part), sigma_px), corner))
}

/// The window of `size` × `size` px whose pixel at offset o from its centre samples the source at `from(o)`; NaN where
/// that is `None`, outside, or touches an invalid pixel.
pub fn resample_through(
    source: &GrayImage,
    size: u32,
    kernel: Kernel,
    from: impl Fn(Vector2<f64>) -> Option<Pixel>,
) -> Patch {
    let half = (f64::from(size) - 1.0) / 2.0;
    let read = |x: u32, y: u32| {
        let offset = Vector2::new(f64::from(x) - half, f64::from(y) - half);
        from(offset).and_then(|place| kernel.sample(source, place))
    };
    Patch(GrayImage::from_fn(size, size, |x, y| Luma([read(x, y).unwrap_or(f32::NAN)])))
}

/// The patch with zero mean and unit standard deviation (over its valid pixels); `None` if it is flat.
pub fn normalise(patch: &Patch) -> Option<Patch> {
    let (mean, std) = moments(patch).filter(|(_, std)| *std >= FLAT_STD)?;
    let scaled = patch.as_raw().iter().map(|v| ((f64::from(*v) - mean) / std) as f32).collect();
    GrayImage::from_raw(patch.width(), patch.height(), scaled).map(Patch)
}

/// `a − b`, each normalised first, in standard deviations; a flat patch is zero everywhere.
///
/// NaN where either is invalid or outside the smaller of the two.
pub fn normalised_difference(a: &Patch, b: &Patch) -> Patch {
    let level = |patch: &Patch| {
        normalise(patch).unwrap_or_else(|| {
            let mut zero = patch.clone();
            zero.iter_mut().filter(|v| v.is_finite()).for_each(|v| *v = 0.0);
            zero
        })
    };
    let (left, right) = (level(a), level(b));
    Patch(GrayImage::from_fn(a.width(), a.height(), |x, y| {
        let value = |patch: &Patch| patch.get_pixel_checked(x, y).map_or(f32::NAN, |p| p[0]);
        Luma([value(&left) - value(&right)])
    }))
}

/// The middle `size` × `size` px of a square patch; `None` if it is smaller, or if the centres would differ.
pub fn middle(patch: &Patch, size: u32) -> Option<Patch> {
    let inset = patch.width().checked_sub(size)?;
    let is_centred = patch.width() == patch.height() && inset.is_multiple_of(2);
    let part = PixelRect::new(inset as i32 / 2, inset as i32 / 2, size, size);
    is_centred.then(|| Patch(crop(patch, &part)))
}

/// The pixels of `part`, which must be inside the image.
pub fn crop(image: &GrayImage, part: &PixelRect) -> GrayImage {
    GrayImage::from_fn(part.width, part.height, |x, y| *image.get_pixel(x + part.x as u32, y + part.y as u32))
}

/// Gaussian smoothing, normalised over the valid pixels inside the image; invalid pixels stay invalid.
///
/// The kernel is truncated at 3σ, or at the image's longest side if that is shorter: taps beyond it read no pixel.
pub fn blurred(image: &GrayImage, sigma_px: f64) -> GrayImage {
    let (width, height) = (image.width() as usize, image.height() as usize);
    let radius = (3.0 * sigma_px).ceil().min(width.max(height) as f64) as usize;
    let weights: Vec<f64> =
        (0..=radius).map(|i| (-0.5 * (i as f64 / sigma_px.max(1e-9)).powi(2)).exp()).collect();
    // Weighted values and weights are summed separately, which keeps both passes separable.
    let mut values: Vec<f64> =
        image.as_raw().iter().map(|v| if v.is_finite() { f64::from(*v) } else { 0.0 }).collect();
    let mut sums: Vec<f64> = image.as_raw().iter().map(|v| f64::from(u8::from(v.is_finite()))).collect();
    for plane in [&mut values, &mut sums] {
        *plane = along_columns(&along_rows(plane, width, &weights), width, &weights);
    }
    let mut out = image.clone();
    let blurred = values.iter().zip(&sums).map(|(value, sum)| (value / sum) as f32);
    out.iter_mut().zip(blurred).filter(|(pixel, _)| pixel.is_finite()).for_each(|(pixel, v)| *pixel = v);
    out
}

/// Convolves each row with the symmetric kernel whose weights from its centre on are `weights`.
fn along_rows(plane: &[f64], width: usize, weights: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; plane.len()];
    for (to, from) in out.chunks_exact_mut(width.max(1)).zip(plane.chunks_exact(width.max(1))) {
        for (shift, weight) in taps(weights).filter(|(shift, _)| shift.unsigned_abs() < width) {
            let by = shift.unsigned_abs();
            if shift < 0 {
                add(&mut to[by..], weight, &from[..width - by]);
            } else {
                add(&mut to[..width - by], weight, &from[by..]);
            }
        }
    }
    out
}

/// Convolves each column with the symmetric kernel whose weights from its centre on are `weights`.
fn along_columns(plane: &[f64], width: usize, weights: &[f64]) -> Vec<f64> {
    let rows: Vec<&[f64]> = plane.chunks_exact(width.max(1)).collect();
    let mut out = vec![0.0; plane.len()];
    for (y, to) in out.chunks_exact_mut(width.max(1)).enumerate() {
        for (shift, weight) in taps(weights) {
            if let Some(from) = y.checked_add_signed(shift).and_then(|y| rows.get(y)) {
                add(to, weight, from);
            }
        }
    }
    out
}

/// Offset and weight of every tap, from the first to the last.
fn taps(weights: &[f64]) -> impl Iterator<Item = (isize, f64)> {
    let before = (1..weights.len()).rev().map(|i| (-(i as isize), weights[i]));
    before.chain(weights.iter().enumerate().map(|(i, weight)| (i as isize, *weight)))
}

fn add(to: &mut [f64], weight: f64, from: &[f64]) {
    for (sum, value) in to.iter_mut().zip(from) {
        *sum += weight * value;
    }
}

/// A patch without a valid pixel.
fn invalid(size: u32) -> Patch {
    Patch(GrayImage::from_pixel(size, size, Luma([f32::NAN])))
}

fn valid(image: &GrayImage) -> impl Iterator<Item = f64> {
    image.as_raw().iter().filter(|v| v.is_finite()).map(|v| f64::from(*v))
}

/// Mean and standard deviation of the valid pixels, in two passes to avoid cancellation with a large mean.
fn moments(image: &GrayImage) -> Option<(f64, f64)> {
    let (sum, count) = valid(image).fold((0.0, 0_u32), |(sum, count), v| (sum + v, count + 1));
    let count = (count > 0).then_some(f64::from(count))?;
    let mean = sum / count;
    let squares: f64 = valid(image).map(|v| (v - mean).powi(2)).sum();
    Some((mean, (squares / count).sqrt()))
}

#[cfg(test)]
#[path = "patch_tests.rs"]
mod tests;
