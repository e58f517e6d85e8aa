//! SIFT: keypoints that are repeatable between views, with their descriptors (R157–R162, E26).
//!
//! Lowe, *Distinctive Image Features from Scale-Invariant Keypoints*, IJCV 2004; the constants as in domain.md 12.1.
//!
//! ```text
//! G(σ)     the image blurred to σ                                     octaves of s + 3 images, k = 2^(1/s)
//! D_l    = G(k^(l+1) σ₀) − G(k^l σ₀)                                  difference of Gaussians, l = 0 … s + 1
//! x̂      = −H⁻¹ ∇D        D(x̂) = D + ½ ∇Dᵀ x̂                          an extremum of either sign, sub-pixel
//! σ(x̂)   = σ₀ · 2^((l + x̂_scale)/s) · 2^octave
//! ```
//! | symbol | our name | unit |
//! |---|---|---|
//! | s | [`SiftSettings::scales_per_octave`] | – |
//! | σ₀ | [`SiftSettings::sigma`] | px of the octave |
//! | x̂ | [`Keypoint::x`], [`Keypoint::y`], [`Keypoint::sigma_px`] | px of the input image |
//! | D(x̂) | [`Keypoint::contrast`] | fraction of full scale |
//! | l | [`Keypoint::layer`], the nearest to x̂ | – |
//!
//! | file | contents |
//! |---|---|
//! | `scale_space` | the Gaussians of one octave after the other |
//! | `blur` | the separable Gaussian filter |
//! | `plane` | an image with rows aligned to cache lines |
//! | `validity` | rejection of features near invalid pixels |
//! | `scan` | pixels greater or less than all 26 neighbours |
//! | `extrema` | their sub-pixel positions; low contrast and edges rejected |
//! | `gradient` | magnitude and direction of the gradient, many pixels at once |
//! | `orientation` | the dominant gradient directions around a keypoint |
//! | `descriptor` | the 4 × 4 histograms of gradients around a keypoint |
//! | `matching` | nearest descriptors |
//! | `products` | all nearest neighbours by a product of matrices |
//! | `lanes` | slices of `f32` as the processor's vectors |
//!
//! Pixel (x, y) of octave o is centred on pixel (2^o x, 2^o y) of the input image, without a half-pixel shift: the
//! doubled image of octave −1 is sampled *at* the pixels and half-way between them. (OpenCV's default is shifted by a
//! quarter pixel, its `enable_precise_upscale` is not.)
//!
//! Each pixel and keypoint is computed independently, in an order that does not depend on the number of threads: the
//! same image gives the same bits.

mod lanes;
mod plane;
mod blur;
mod extent;
mod scale_space;
mod validity;
mod scan;
mod extrema;
mod gradient;
mod orientation;
mod descriptor;
mod products;
pub mod matching;

use std::collections::BTreeSet;

use rayon::prelude::*;

use crate::image::GrayImage;
use extrema::Extremum;
use scale_space::{Octave, ScaleSpace};
use scan::Candidate;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::Result;
use validity::Validity;

pub use descriptor::Descriptor;
pub use matching::{Match, MatchSettings, Neighbours, matches, matches_where, nearest, nearest_where};

/// The parameters of [`detect`]; the defaults are Lowe's.
#[derive(Clone, Debug, PartialEq)]
pub struct SiftSettings {
    /// Whether the first octave is the image at twice its size; about four times as many features.
    pub double_image: bool,
    /// s: number of scales per octave at which extrema are searched for.
    pub scales_per_octave: u32,
    /// σ₀: blur of the first image of each octave, px of that octave.
    pub sigma: f64,
    /// Assumed blur of the input image, px.
    pub image_blur_px: f64,
    /// Least |D(x̂)|, for intensities from 0 to 1.
    pub contrast_min: f64,
    /// Largest ratio of the principal curvatures of D; above it the extremum is on an edge.
    pub edge_ratio_max: f64,
    /// Fraction of the highest peak of the direction histogram above which another peak gives an additional feature.
    pub orientation_peak: f64,
    /// Largest number of features, the strongest by |D(x̂)|; 0: no limit.
    pub features_max: u32,
}

impl Default for SiftSettings {
    fn default() -> Self {
        Self {
            double_image: true,
            scales_per_octave: 3,
            sigma: 1.6,
            image_blur_px: 0.5,
            contrast_min: 0.03,
            edge_ratio_max: 10.0,
            orientation_peak: 0.8,
            features_max: 0,
        }
    }
}

/// A position in the image with a scale and a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Keypoint {
    /// Column, px of the input image; 0 is the centre of the first pixel.
    pub x: f32,
    /// Row, px of the input image.
    pub y: f32,
    /// Scale, px of the input image: the blur at which the difference of Gaussians is extremal.
    pub sigma_px: f32,
    /// Direction of the gradients, from −π to π: 0 along +x, positive towards +y (down).
    pub orientation_rad: f32,
    /// D(x̂), fraction of full scale: positive for dark blobs on a bright background.
    pub contrast: f32,
    /// −1 is the doubled image, 0 the size of the input image.
    pub octave: i8,
    /// The scale within the octave, from 1 to s.
    pub layer: u8,
}

/// Keypoints and their descriptors, in the same order: octave, layer, row, column, direction.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Features {
    /// Positions, scales and directions.
    pub keypoints: Vec<Keypoint>,
    /// Descriptors of the keypoints.
    pub descriptors: Vec<Descriptor>,
}

/// Detects the features of an image.
///
/// Values are fractions of full scale. No feature depends on an invalid pixel (NaN): those whose descriptor would are
/// rejected. Images that are flat or too small for a single octave have no features, and invalid settings (a σ or a
/// number of scales that is not positive) give none.
pub fn detect(image: &GrayImage, settings: &SiftSettings) -> Features {
    // The default token is never cancelled.
    detect_until(image, settings, Cancel::default()).unwrap_or_default()
}

/// As [`detect`], but ends within some rows of an octave once `cancel` is requested.
///
/// # Errors
/// [`Error::Cancelled`](sightline_geometry::error::Error::Cancelled).
pub fn detect_until(image: &GrayImage, settings: &SiftSettings, cancel: Cancel<'_>) -> Result<Features> {
    let Some(validity) = Validity::of(image) else { return Ok(Features::default()) };
    let mended = validity.mended(image);
    let Some(mut space) = ScaleSpace::new(&mended, settings) else { return Ok(Features::default()) };
    let mut strongest = Strongest::new(settings.features_max);
    while space.next_octave() {
        let mut seen = BTreeSet::new();
        while let Some((octave, rows)) = space.slide() {
            cancel.check()?;
            let mut extrema = extrema::find(octave, rows, settings);
            extrema.retain(|extremum| seen.insert(extremum.pixel) && strongest.may_keep(extremum.contrast));
            let orient_one = |extremum: &Extremum| orient(octave, extremum, settings);
            let mut found: Vec<(Place, Keypoint)> = extrema.par_iter().flat_map_iter(orient_one).collect();
            found.retain(|(_, keypoint)| validity.allows(keypoint));
            let described = descriptor::describe(octave, &found);
            strongest.add(found.into_iter().zip(described));
        }
    }
    Ok(strongest.features())
}

/// Sort key of a feature: octave, layer, row and column.
type Place = (i32, Candidate);

/// The keypoints of an extremum: one for each direction.
fn orient(octave: &Octave, extremum: &Extremum, settings: &SiftSettings) -> Vec<(Place, Keypoint)> {
    let scale = octave.input_px();
    let sigma_in_octave = octave.sigma_at(extremum.layer_exact());
    let [x, y] = extremum.place();
    let layer = &octave.layers[extremum.pixel.layer];
    let directions =
        orientation::directions(layer, [x, y], sigma_in_octave as f32, settings.orientation_peak as f32);
    let keypoint = |orientation_rad| Keypoint {
        x: (x * scale) as f32,
        y: (y * scale) as f32,
        sigma_px: (sigma_in_octave * scale) as f32,
        orientation_rad,
        contrast: extremum.contrast as f32,
        octave: octave.exponent as i8,
        layer: extremum.pixel.layer as u8,
    };
    let place = (octave.exponent, extremum.pixel);
    directions.into_iter().map(|direction| (place, keypoint(direction))).collect()
}

/// The features found so far, or the strongest of them.
struct Strongest {
    /// Largest number of features; 0: no limit.
    count: usize,
    /// Contrast that a further feature must exceed once that number is reached.
    floor: f32,
    features: Vec<((Place, Keypoint), Descriptor)>,
}

impl Strongest {
    fn new(count: u32) -> Self {
        Self { count: count as usize, floor: -1.0, features: Vec::new() }
    }

    /// Returns whether a feature of this contrast may be kept; later features may still displace it.
    fn may_keep(&self, contrast: f64) -> bool {
        contrast.abs() as f32 > self.floor
    }

    /// Adds features; of equally strong ones the earlier stay.
    fn add(&mut self, features: impl Iterator<Item = ((Place, Keypoint), Descriptor)>) {
        self.features.extend(features);
        if self.count > 0 && self.features.len() > self.count {
            let strength = |feature: &((Place, Keypoint), Descriptor)| feature.0.1.contrast.abs();
            self.features.sort_by(|a, b| strength(b).total_cmp(&strength(a)));
            self.features.truncate(self.count);
            self.floor = self.features.last().map_or(-1.0, strength);
        }
    }

    /// Returns the kept features, in order.
    fn features(mut self) -> Features {
        self.features.sort_by_key(|((place, _), _)| *place);
        let (keypoints, descriptors) =
            self.features.into_iter().map(|((_, keypoint), descriptor)| (keypoint, descriptor)).unzip();
        Features { keypoints, descriptors }
    }
}

#[cfg(test)]
mod tests;
#[cfg(test)]
mod recorded_tests;
#[cfg(test)]
mod parts_tests;
