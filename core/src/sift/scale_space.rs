//! The Gaussians of one octave after the other.
//!
//! ```text
//! G_0 of the first octave: the (doubled) image, blurred by sqrt(σ₀² − b²) from the blur b that it has
//! G_l = G_(l−1) blurred by σ₀ k^(l−1) sqrt(k² − 1),    k = 2^(1/s),    l = 1 … s + 2
//! G_0 of the next octave: every second pixel of G_s, whose blur is 2σ₀
//! ```
//! | symbol | our name | unit |
//! |---|---|---|
//! | G_l | [`Octave::layers`] | fraction of full scale |
//! | s, σ₀ | `scales_per_octave`, `sigma` of the settings | –, px of the octave |
//! | b | `image_blur_px` of the settings, twice as much in the doubled image | px |
//!
//! The doubled image has the image's pixels at its even places and means of two or four of them between.

use super::SiftSettings;
use super::blur::{Kernel, blur};
use super::plane::Plane;
use crate::image::GrayImage;

/// Pixels along the edge of an octave in which no extremum is looked for.
pub(super) const BORDER: usize = 5;
/// Least blur by which the first image is made smooth, px.
const LEAST_BLUR_PX: f64 = 0.1;
/// More than this many scales are no scale space.
const SCALES_MAX: u32 = 100;

/// One octave.
pub(super) struct Octave {
    /// −1 for the doubled image, 0 for the input image's size, 1 for half of it …
    pub(super) exponent: i32,
    /// G_0 … G_(s+2).
    pub(super) layers: Vec<Plane>,
    sigma: f64,
}

impl Octave {
    /// s.
    pub(super) fn scales(&self) -> usize {
        self.layers.len() - 3
    }

    /// Pixels of the input image from one pixel to the next.
    pub(super) fn input_px(&self) -> f64 {
        2_f64.powi(self.exponent)
    }

    /// The blur of layer `layer`, which may be a fraction, px of this octave.
    pub(super) fn sigma_at(&self, layer: f64) -> f64 {
        self.sigma * (layer / self.scales() as f64).exp2()
    }

    /// Whether it can hold an extremum.
    fn is_large_enough(&self) -> bool {
        self.layers[0].width.min(self.layers[0].height) > 2 * BORDER
    }
}

/// The octaves of an image; one is held at a time.
pub(super) struct ScaleSpace {
    octave: Octave,
    /// From G_(l−1) to G_l.
    steps: Vec<Kernel>,
    is_first: bool,
}

impl ScaleSpace {
    /// Makes G_0 of the first octave; `None` for settings that describe no scale space.
    pub(super) fn new(image: &GrayImage, settings: &SiftSettings) -> Option<Self> {
        let SiftSettings { double_image, scales_per_octave: s, sigma, image_blur_px, .. } = *settings;
        if !(1..=SCALES_MAX).contains(&s) || !(sigma > 0.0 && sigma.is_finite() && image_blur_px.is_finite())
        {
            return None;
        }
        let k = (1.0 / f64::from(s)).exp2();
        let step = |l: u32| Kernel::gaussian(sigma * k.powi(l as i32 - 1) * (k * k - 1.0).sqrt());
        let mut layers: Vec<Plane> = (0..s + 3).map(|_| Plane::default()).collect();
        let (base, next) = layers.split_at_mut(1);
        let (exponent, blur_px) = if double_image { (-1, 2.0 * image_blur_px) } else { (0, image_blur_px) };
        if double_image {
            double(image, &mut next[0])
        } else {
            copy(image, &mut next[0])
        }
        let missing = (sigma * sigma - blur_px * blur_px).max(LEAST_BLUR_PX * LEAST_BLUR_PX).sqrt();
        blur(&next[0], &Kernel::gaussian(missing), &mut base[0]);
        let octave = Octave { exponent, layers, sigma };
        Some(Self { octave, steps: (1..s + 3).map(step).collect(), is_first: true })
    }

    /// Makes the next octave; `None` after the last that is large enough for an extremum.
    pub(super) fn next_octave(&mut self) -> Option<&Octave> {
        let s = self.octave.scales();
        if !self.is_first {
            let (base, finer) = self.octave.layers.split_at_mut(1);
            halve(&finer[s - 1], &mut base[0]);
            self.octave.exponent += 1;
        }
        self.is_first = false;
        if !self.octave.is_large_enough() {
            return None;
        }
        for (l, step) in self.steps.iter().enumerate() {
            let (before, after) = self.octave.layers.split_at_mut(l + 1);
            blur(&before[l], step, &mut after[0]);
        }
        Some(&self.octave)
    }
}

fn copy(image: &GrayImage, plane: &mut Plane) {
    let width = image.width() as usize;
    plane.resize(width, image.height() as usize);
    let stride = plane.stride;
    for (row, pixels) in plane.rows_mut().chunks_exact_mut(stride).zip(image.as_raw().chunks_exact(width)) {
        row[..width].copy_from_slice(pixels);
    }
}

/// Every pixel, and the means half-way between; the last ones are repeated.
fn double(image: &GrayImage, plane: &mut Plane) {
    let (width, height) = (image.width() as usize, image.height() as usize);
    plane.resize(2 * width, 2 * height);
    let stride = plane.stride;
    let pixels = image.as_raw();
    for (y, rows) in plane.rows_mut().chunks_exact_mut(2 * stride).enumerate() {
        let (even, odd) = rows.split_at_mut(stride);
        let this = &pixels[y * width..][..width];
        let below = &pixels[(y + 1).min(height - 1) * width..][..width];
        for x in 0..width {
            let right = (x + 1).min(width - 1);
            even[2 * x] = this[x];
            even[2 * x + 1] = 0.5 * (this[x] + this[right]);
            odd[2 * x] = 0.5 * (this[x] + below[x]);
            odd[2 * x + 1] = 0.25 * (this[x] + this[right] + below[x] + below[right]);
        }
    }
}

/// Every second pixel of every second row.
fn halve(fine: &Plane, coarse: &mut Plane) {
    let (width, height) = (fine.width / 2, fine.height / 2);
    coarse.resize(width, height);
    let stride = coarse.stride;
    for (y, row) in coarse.rows_mut().chunks_exact_mut(stride).enumerate() {
        for (value, pair) in row[..width].iter_mut().zip(fine.from_row(2 * y).chunks_exact(2)) {
            *value = pair[0];
        }
    }
}
