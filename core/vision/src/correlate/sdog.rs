//! Sign of the difference of Gaussians: the tracker of Marsokhod (R219).
//!
//! ```text
//! b(x) = [ (G(σ₁) * I − G(σ₂) * I)(x) ≥ 0 ],   σ₂ = k σ₁         one bit per pixel
//! score = 2 · (fraction of pixels whose bits agree) − 1          −1 to 1
//! ```
//! The bits are the sign of a band-pass: they are invariant to gain and bias, and encode where the image is brighter or
//! darker than its surroundings. Rows of bits are packed into words of 64, so that a row of the template is compared by
//! one exclusive or and one population count.
//!
//! The template's bits need its surroundings up to 3σ₂ beyond its border; if the given patch is smaller, the Gaussians
//! are normalised over the available pixels, as at the border of an image. A window that touches an invalid pixel is
//! excluded (R66).
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | σ₁ | `sigma_px` | px |
//! | k | `ratio` | – |

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::grid::Grid;
use super::surface::Surface;
use crate::image::patch::{self, Patch};
use crate::image::{GrayImage, PixelRect};
use sightline_geometry::cancel::Cancel;

/// The two Gaussians.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sdog {
    /// Standard deviation of the narrower, px.
    pub sigma_px: f64,
    /// Ratio of the wider standard deviation to the narrower.
    pub ratio: f64,
}

impl Sdog {
    /// Reach of the wider Gaussian (3σ₂), px.
    pub fn margin_px(&self) -> u32 {
        (3.0 * self.sigma_px * self.ratio.max(1.0)).ceil() as u32
    }

    /// Scores at every position of `region` that contains the template: the middle `size` × `size` px of `wide`.
    ///
    /// `None` as for [`super::zncc_surface`].
    pub(super) fn surface(
        &self,
        wide: &Patch,
        size: u32,
        image: &GrayImage,
        region: PixelRect,
        cancel: Cancel<'_>,
    ) -> Option<Surface> {
        let grid = Grid::new((size, size), image, region)?;
        let inset = wide.width().checked_sub(size)? / 2;
        let all = PixelRect::new(inset as i32, inset as i32, size, size);
        let template = Bits::of(&self.band(wide, &all)?);
        if !template.is_complete() {
            return None;
        }
        let searched = Bits::of(&self.band(image, &grid.region)?);
        let is_complete = searched.is_complete();
        let count = f64::from(size).powi(2);
        let mut scores = vec![0.0; grid.len()];
        scores.par_chunks_mut(grid.width as usize).enumerate().for_each(|(iy, out)| {
            if cancel.is_requested() {
                return;
            }
            for (ix, out) in out.iter_mut().enumerate() {
                let is_valid = is_complete || searched.is_valid(ix, iy, size as usize);
                let agreement = f64::from(template.agreement(&searched, ix, iy)) / count;
                *out = if is_valid { (2.0 * agreement - 1.0) as f32 } else { f32::NAN };
            }
        });
        Some(grid.surface(scores, 0))
    }

    /// The difference of Gaussians over `part`; uses the image's pixels around it.
    fn band(&self, image: &GrayImage, part: &PixelRect) -> Option<GrayImage> {
        let margin = self.margin_px() as i32;
        let wide = PixelRect::new(
            part.x - margin,
            part.y - margin,
            part.width + 2 * margin as u32,
            part.height + 2 * margin as u32,
        )
        .intersect(&PixelRect::whole(image.width(), image.height()))?;
        let around = patch::crop(image, &wide);
        let narrow = patch::blurred(&around, self.sigma_px);
        let broad = patch::blurred(&around, self.sigma_px * self.ratio);
        let mut band = narrow;
        band.iter_mut().zip(broad.iter()).for_each(|(a, b)| *a -= b);
        let inside = PixelRect::new(part.x - wide.x, part.y - wide.y, part.width, part.height);
        Some(patch::crop(&band, &inside))
    }
}

/// Signs and validity of an image's pixels, row by row in words of 64.
struct Bits {
    width: usize,
    height: usize,
    /// Words per row: one more than the pixels need, so that a read may extend past the last.
    words: usize,
    signs: Vec<u64>,
    valid: Vec<u64>,
}

impl Bits {
    fn of(band: &GrayImage) -> Self {
        let (width, height) = (band.width() as usize, band.height() as usize);
        let words = width.div_ceil(64) + 1;
        let mut bits =
            Self { width, height, words, signs: vec![0; words * height], valid: vec![0; words * height] };
        for (x, y, value) in band.enumerate_pixels() {
            let (word, bit) = (y as usize * words + x as usize / 64, 1_u64 << (x % 64));
            if value[0] >= 0.0 {
                bits.signs[word] |= bit;
            }
            if value[0].is_finite() {
                bits.valid[word] |= bit;
            }
        }
        bits
    }

    /// Reads `length` bits (at most 64) of a row from column `x`.
    fn read(&self, plane: &[u64], x: usize, y: usize, length: usize) -> u64 {
        let (word, shift) = (y * self.words + x / 64, x % 64);
        let low = plane[word] >> shift;
        let high = if shift == 0 { 0 } else { plane[word + 1] << (64 - shift) };
        (low | high) & (u64::MAX >> (64 - length))
    }

    /// Splits a row of `width` into pieces of at most 64 columns: start and length.
    fn pieces(width: usize) -> impl Iterator<Item = (usize, usize)> {
        (0..width).step_by(64).map(move |start| (start, (width - start).min(64)))
    }

    fn is_complete(&self) -> bool {
        let valid: u32 = self.valid.iter().map(|word| word.count_ones()).sum();
        valid as usize == self.width * self.height
    }

    /// Returns whether all pixels of the window of `size` × `size` px at (x, y) are valid.
    fn is_valid(&self, x: usize, y: usize, size: usize) -> bool {
        (0..size).all(|row| {
            Self::pieces(size).all(|(start, length)| {
                self.read(&self.valid, x + start, y + row, length).count_ones() as usize == length
            })
        })
    }

    /// Number of this template's bits that agree with the window at (x, y) of `image`.
    fn agreement(&self, image: &Self, x: usize, y: usize) -> u32 {
        let mut differing = 0;
        for row in 0..self.height {
            for (start, length) in Self::pieces(self.width) {
                let here = self.read(&self.signs, start, row, length);
                let there = image.read(&image.signs, x + start, y + row, length);
                differing += (here ^ there).count_ones();
            }
        }
        (self.width * self.height) as u32 - differing
    }
}
