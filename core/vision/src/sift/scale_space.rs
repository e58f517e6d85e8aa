//! The Gaussians of one octave after the other, in a sliding window of rows.
//!
//! ```text
//! G_0 of the first octave: the (doubled) image with blur b, blurred by sqrt(σ₀² − b²)
//! G_l = G_(l−1) blurred by σ₀ k^(l−1) sqrt(k² − 1),    k = 2^(1/s),    l = 1 … s + 2
//! G_0 of the next octave: every second pixel of G_s, whose blur is 2σ₀
//! ```
//! | symbol | our name | unit |
//! |---|---|---|
//! | G_l | [`Octave::layers`] | fraction of full scale |
//! | s, σ₀ | `scales_per_octave`, `sigma` of the settings | –, px of the octave |
//! | b | `image_blur_px` of the settings, doubled in the doubled image | px |
//!
//! The doubled image has the image's pixels at even positions and the means of two or four of them between.
//!
//! Only the required rows of each layer are stored, so that all of them stay in the cache: row y is searched for extrema
//! once the rows up to y + [`ScaleSpace::reach`], which its descriptors need, are computed; rows above y − reach are
//! discarded. Only G_0 of the next octave is stored completely, a quarter of the image.

use std::ops::Range;

use rayon::prelude::*;

use super::blur::{Kernel, blur};
use super::plane::Plane;
use super::{SiftSettings, extent};
use crate::image::GrayImage;

/// Width of the border of an octave that is not searched for extrema, px.
pub(super) const BORDER: usize = 5;
/// Least blur applied to the first image, px.
const LEAST_BLUR_PX: f64 = 0.1;
/// Upper bounds of the number of scales and of σ₀.
const SCALES_MAX: u32 = 100;
const SIGMA_MAX: f64 = 100.0;
/// Rows by which the window advances.
const STEP: usize = 64;

/// The Gaussians of one octave.
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

    /// Columns and rows, px.
    pub(super) fn size(&self) -> [usize; 2] {
        [self.layers[0].width, self.layers[0].height]
    }

    /// Pixel pitch in pixels of the input image.
    pub(super) fn input_px(&self) -> f64 {
        2_f64.powi(self.exponent)
    }

    /// Blur at a layer, which may be fractional, px of this octave.
    pub(super) fn sigma_at(&self, layer: f64) -> f64 {
        self.sigma * (layer / self.scales() as f64).exp2()
    }
}

/// The octaves of an image; one is stored at a time.
pub(super) struct ScaleSpace<'a> {
    image: &'a GrayImage,
    /// The input of the first octave: the image or its double.
    source: Plane,
    first: Kernel,
    /// Kernels from G_(l−1) to G_l.
    steps: Vec<Kernel>,
    octave: Octave,
    /// G_0 of the next octave.
    next: Plane,
    /// Number of octaves begun.
    begun: usize,
    /// Rows up to which the layers are requested, and rows already searched for extrema.
    front: usize,
    searched: usize,
}

impl<'a> ScaleSpace<'a> {
    /// Prepares the first octave without computing it; `None` for invalid settings.
    pub(super) fn new(image: &'a GrayImage, settings: &SiftSettings) -> Option<Self> {
        let SiftSettings { double_image, scales_per_octave: s, sigma, image_blur_px, .. } = *settings;
        let is_blur = |blur: f64| blur > 0.0 && blur <= SIGMA_MAX;
        if !(1..=SCALES_MAX).contains(&s) || !is_blur(sigma) || !image_blur_px.is_finite() {
            return None;
        }
        let k = (1.0 / f64::from(s)).exp2();
        let step = |l: u32| Kernel::gaussian(sigma * k.powi(l as i32 - 1) * (k * k - 1.0).sqrt());
        let blur_px = if double_image { 2.0 * image_blur_px } else { image_blur_px };
        let missing = (sigma * sigma - blur_px * blur_px).max(LEAST_BLUR_PX * LEAST_BLUR_PX).sqrt();
        let layers = (0..s + 3).map(|_| Plane::default()).collect();
        Some(Self {
            image,
            source: Plane::default(),
            first: Kernel::gaussian(missing),
            steps: (1..s + 3).map(step).collect(),
            octave: Octave { exponent: if double_image { -1 } else { 0 }, layers, sigma },
            next: Plane::default(),
            begun: 0,
            front: 0,
            searched: 0,
        })
    }

    /// Begins the next octave; returns false after the last that is large enough for an extremum.
    pub(super) fn next_octave(&mut self) -> bool {
        let held = self.rows_held();
        let mut size = [self.next.width, self.next.height];
        if self.begun == 0 {
            let times = if self.octave.exponent < 0 { 2 } else { 1 };
            size = [self.image.width(), self.image.height()].map(|side| times * side as usize);
            self.source.begin(size, held);
            self.octave.layers[0].begin(size, held);
        } else {
            self.octave.exponent += 1;
            std::mem::swap(&mut self.octave.layers[0], &mut self.next);
        }
        self.octave.layers[1..].iter_mut().for_each(|layer| layer.begin(size, held));
        let half = size.map(|side| side / 2);
        self.next.begin(half, half[1]);
        (self.front, self.searched) = (0, BORDER);
        self.begun += 1;
        size[0].min(size[1]) > 2 * BORDER
    }

    /// Advances the window; returns the octave and the rows that can be searched, `None` at its end.
    pub(super) fn slide(&mut self) -> Option<(&Octave, Range<usize>)> {
        let [_, height] = self.octave.size();
        let (first, last) = (self.searched, height - BORDER);
        while self.searched == first && first < last {
            self.advance();
            let made = self.octave.layers[self.octave.scales() + 2].made;
            let end = if made == height { last } else { made.saturating_sub(self.reach()).min(last) };
            self.searched = end.max(first);
        }
        (first < last).then_some((&self.octave, first..self.searched))
    }

    /// The octave as far as it is computed.
    #[cfg(test)]
    pub(super) fn octave(&self) -> &Octave {
        &self.octave
    }

    /// Rows above and below an extremum's pixel on which its feature may depend.
    fn reach(&self) -> usize {
        let coarsest = self.octave.sigma_at(self.octave.scales() as f64 + 0.5);
        (f64::from(extent::REACH) * coarsest).ceil() as usize + extent::MOVE_MAX + 2
    }

    /// Rows stored per layer: the reach above and below an extremum, plus the lead of the first layer.
    fn rows_held(&self) -> usize {
        let ahead: usize = self.steps.iter().map(Kernel::radius).sum();
        2 * self.reach() + ahead + self.first.radius() + STEP
    }

    /// Computes the next rows of all layers.
    fn advance(&mut self) {
        let [_, height] = self.octave.size();
        self.front = (self.front + STEP).min(height);
        let layers = &mut self.octave.layers;
        if self.begun == 1 {
            if self.octave.exponent < 0 {
                double(self.image, &mut self.source, self.front);
            } else {
                copy(self.image, &mut self.source, self.front);
            }
            blur(&self.source, &self.first, &mut layers[0], self.front);
        }
        for (l, step) in self.steps.iter().enumerate() {
            let (before, after) = layers.split_at_mut(l + 1);
            blur(&before[l], step, &mut after[0], self.front);
        }
        let s = layers.len() - 3;
        halve(&layers[s], &mut self.next);
    }
}

/// Copies the image's rows up to `end`.
fn copy(image: &GrayImage, plane: &mut Plane, end: usize) {
    let (width, stride) = (plane.width, plane.stride);
    for (first, rows) in plane.make(end) {
        let pixels = image.as_raw()[first * width..].chunks_exact(width);
        for (row, pixels) in rows.chunks_exact_mut(stride).zip(pixels) {
            row[..width].copy_from_slice(pixels);
        }
    }
}

/// Doubles the image: every pixel, and the means half-way between; the last ones are repeated.
fn double(image: &GrayImage, plane: &mut Plane, end: usize) {
    let (width, height) = (image.width() as usize, image.height() as usize);
    let stride = plane.stride;
    let pixels = |y: usize| &image.as_raw()[y.min(height - 1) * width..][..width];
    for (first, rows) in plane.make(end) {
        rows.par_chunks_exact_mut(stride).enumerate().for_each(|(i, row)| {
            let y = first + i;
            double_row(pixels(y / 2), pixels(y.div_ceil(2)), row);
        });
    }
}

/// One row of the doubled image: means of two rows, and between neighbours their mean.
fn double_row(above: &[f32], below: &[f32], doubled: &mut [f32]) {
    let last = above.len() - 1;
    let pairs = above.windows(2).zip(below.windows(2));
    for (two, (above, below)) in doubled.chunks_exact_mut(2).zip(pairs) {
        two[0] = 0.5 * (above[0] + below[0]);
        two[1] = 0.25 * ((above[0] + below[0]) + (above[1] + below[1]));
    }
    let value = 0.5 * (above[last] + below[last]);
    doubled[2 * last..][..2].fill(value);
}

/// Takes every second pixel of every second available row.
fn halve(fine: &Plane, coarse: &mut Plane) {
    let (width, stride) = (coarse.width, coarse.stride);
    let end = fine.made.div_ceil(2).min(coarse.height);
    for (first, rows) in coarse.make(end) {
        for (i, row) in rows.chunks_exact_mut(stride).enumerate() {
            let pairs = fine.row(2 * (first + i)).chunks_exact(2);
            for (value, pair) in row[..width].iter_mut().zip(pairs) {
                *value = pair[0];
            }
        }
    }
}
