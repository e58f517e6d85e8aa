//! Zero-mean normalised cross-correlation (K-Eq 11, R62–R66), exhaustive over a region.
//!
//! ```text
//! ncc = Σ t j' / sqrt(Σ j'² − (Σ j')²/N)      t: template, zero mean and unit norm;  j': shifted window
//! ```
//! Because t has zero mean, the shift of the window is free, and it is chosen to keep digits:
//!
//! * Denominators come from integral images in `f64`, shifted by the mean of the region.
//! * Numerators come from `f32` sums over tiles of 64 × 24 positions, shifted by the mean of the tile. What the
//!   rounded template lacks of zero mean is put right afterwards.
//! * Where a window is so flat, or so far from its tile's mean, that these sums would lose digits, the position
//!   is computed again in `f64` in two passes. Every score is within 1e-5 of the definition in exact numbers.
//!
//! Windows without contrast score 0 and are counted; windows that touch an invalid pixel are excluded (R66).
//! Each score depends on the region and its own window only, so the number of threads changes nothing.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | t | `Template::values`, `Weights` | – |
//! | j' | window of the image, shifted | fraction of full scale |
//! | N | `count`: pixels of the template | – |

use pulp::Arch;
use rayon::prelude::*;

use super::dot::{TILE_COLUMNS, TILE_ROWS, Tile, Weights};
use super::exact::Template;
pub use super::surface::Surface;
use crate::image::integral::{self, Integral};
use crate::image::patch::{FLAT_STD, Patch};
use crate::image::{GrayImage, PixelRect};

/// A window's variance must exceed this share of the region's sum of squares: differences of the integral
/// image err by about 2e-15 of that sum, and a relative error of 1e-6 is allowed.
const VARIANCE_FLOOR: f64 = 2e-9;

/// A window's mean may differ from its tile's by this many of its standard deviations: the error of the `f32`
/// sums grows with the difference, and stays below 5e-6 for templates up to 41 × 41.
const MAX_OFFSET_STD: f64 = 8.0;

/// Multiply-adds from which a second thread pays for being woken.
const PARALLEL_WORK: usize = 2_000_000;

/// Scores of a square template with an odd side at every position whose whole window lies in `region` and in
/// the image.
///
/// `None` when the template is not square, has an even side or an invalid pixel, or when no position holds it.
pub fn zncc_surface(template: &Patch, image: &GrayImage, region: PixelRect) -> Option<Surface> {
    let size = template.width();
    if template.height() != size || size % 2 == 0 {
        return None;
    }
    let exact = Template::new(template)?;
    let region = region.intersect(&PixelRect::whole(image.width(), image.height()))?;
    let width = (region.width + 1).checked_sub(size).filter(|w| *w > 0)?;
    let height = (region.height + 1).checked_sub(size).filter(|h| *h > 0)?;
    let job = Job::new(exact, image, region, width as usize);
    let mut scores = vec![0.0; width as usize * height as usize];
    let band = TILE_ROWS * width as usize;
    let work = scores.len() * job.exact.values.len();
    let flat_positions = if work < PARALLEL_WORK {
        scores.chunks_mut(band).enumerate().map(|(i, scores)| job.band(i * TILE_ROWS, scores)).sum()
    } else {
        scores.par_chunks_mut(band).enumerate().map(|(i, scores)| job.band(i * TILE_ROWS, scores)).sum()
    };
    let half = (size / 2) as i32;
    let origin = [region.x + half, region.y + half];
    Some(Surface { origin, width, height, scores, flat_positions, template_size: size })
}

/// The score of two patches of the same size (any size, for windows at sub-pixel positions).
///
/// 0 when either has no contrast; `None` when the sizes differ, or either is empty or has an invalid pixel.
pub fn zncc(template: &Patch, window: &Patch) -> Option<f32> {
    if template.dimensions() != window.dimensions() || !window.is_complete() {
        return None;
    }
    let template = Template::new(template)?;
    Some(template.score(window.as_raw(), template.width, 0).unwrap_or(0.0) as f32)
}

/// What all positions share.
struct Job<'a> {
    exact: Template,
    weights: Weights,
    /// Sum and norm of the template as rounded to `f32`.
    weights_sum: f64,
    weights_norm: f64,
    image: &'a GrayImage,
    region: PixelRect,
    integral: Integral,
    /// Positions per row.
    width: usize,
    size: usize,
    count: f64,
    min_squares: f64,
}

/// Buffers of one band, used again for every tile.
struct Scratch {
    input: Vec<f32>,
    sums: Vec<f32>,
    doubtful: Vec<bool>,
}

impl<'a> Job<'a> {
    fn new(exact: Template, image: &'a GrayImage, region: PixelRect, width: usize) -> Self {
        let size = exact.width;
        let rounded: Vec<f32> = exact.values.iter().map(|t| *t as f32).collect();
        let count = rounded.len() as f64;
        let weights_sum: f64 = rounded.iter().map(|t| f64::from(*t)).sum();
        let squares: f64 = rounded.iter().map(|t| f64::from(*t).powi(2)).sum();
        let integral = Integral::new(image, &region);
        let floor = (VARIANCE_FLOOR * integral.total_squares()).max(count * FLAT_STD * FLAT_STD);
        Self {
            weights: Weights::new(&rounded, size),
            weights_sum,
            weights_norm: (squares - weights_sum * weights_sum / count).max(0.0).sqrt(),
            // Without contrast in the template every position takes the exact way, which counts it.
            min_squares: if exact.is_flat { f64::INFINITY } else { floor },
            exact,
            image,
            region,
            integral,
            width,
            size,
            count,
        }
    }

    /// Scores the rows of positions from `top`; gives the number of positions without contrast.
    fn band(&self, top: usize, scores: &mut [f32]) -> u32 {
        let mut scratch = Scratch {
            input: vec![0.0; self.weights.input_rows() * self.weights.input_columns()],
            sums: vec![0.0; TILE_ROWS * TILE_COLUMNS],
            doubtful: vec![false; TILE_COLUMNS],
        };
        let (arch, rows) = (Arch::new(), scores.len() / self.width);
        let mut flat = 0;
        for left in (0..self.width).step_by(TILE_COLUMNS) {
            let columns = TILE_COLUMNS.min(self.width - left);
            let shift = self.load_tile(left, top, columns, rows, &mut scratch.input);
            let (weights, input, output) = (&self.weights, &scratch.input, scratch.sums.as_mut_slice());
            arch.dispatch(Tile { weights, input, columns, rows, output });
            for y in 0..rows {
                let scores = &mut scores[y * self.width + left..][..columns];
                let sums = &scratch.sums[y * TILE_COLUMNS..][..columns];
                let doubtful = &mut scratch.doubtful[..columns];
                let any = arch.dispatch(|| self.score_row(left, top + y, shift, sums, scores, doubtful));
                if any || self.integral.has_invalid() {
                    flat += self.repair_row(left, top + y, scores, doubtful);
                }
            }
        }
        flat
    }

    /// Copies the pixels of a tile, less their mean, which is returned relative to the integral's shift.
    fn load_tile(&self, left: usize, top: usize, columns: usize, rows: usize, input: &mut [f32]) -> f64 {
        let (width, height) = (columns + self.size - 1, rows + self.size - 1);
        let mean = self.integral.sums(left, top, width, height)[0] / (width * height) as f64;
        let shift = (mean + self.integral.shift) as f32;
        for (y, out) in input.chunks_exact_mut(self.weights.input_columns()).enumerate() {
            let (inside, outside) = out.split_at_mut(width);
            outside.fill(0.0);
            if y >= height {
                inside.fill(0.0);
                continue;
            }
            let pixels = &integral::row(self.image, &self.region, (top + y) as u32)[left..left + width];
            for (out, v) in inside.iter_mut().zip(pixels) {
                *out = if v.is_finite() { v - shift } else { 0.0 };
            }
        }
        f64::from(shift) - self.integral.shift
    }

    /// Scores of one row of a tile from its numerators; says whether any of them is doubtful.
    #[inline(always)]
    fn score_row(
        &self,
        left: usize,
        y: usize,
        shift: f64,
        sums: &[f32],
        scores: &mut [f32],
        doubtful: &mut [bool],
    ) -> bool {
        let columns = scores.len();
        let (top, top2) = self.integral.corner_row(y);
        let (bottom, bottom2) = self.integral.corner_row(y + self.size);
        let (l, r) = (left..left + columns, left + self.size..left + self.size + columns);
        let (tl, tr, bl, br) = (&top[l.clone()], &top[r.clone()], &bottom[l.clone()], &bottom[r.clone()]);
        let (tl2, tr2, bl2, br2) = (&top2[l.clone()], &top2[r.clone()], &bottom2[l], &bottom2[r]);
        let (sums, doubtful) = (&sums[..columns], &mut doubtful[..columns]);
        let (per_count, offset_limit) = (1.0 / self.count, self.count / (MAX_OFFSET_STD * MAX_OFFSET_STD));
        let mut any = false;
        for x in 0..columns {
            let sum = br[x] - bl[x] - (tr[x] - tl[x]);
            let squares = br2[x] - bl2[x] - (tr2[x] - tl2[x]) - sum * sum * per_count;
            let offset = sum * per_count - shift;
            let numerator = f64::from(sums[x]) - self.weights_sum * offset;
            let norm = (squares as f32).sqrt() * self.weights_norm as f32;
            scores[x] = (numerator as f32 / norm).clamp(-1.0, 1.0);
            doubtful[x] = !(squares > self.min_squares) | (offset * offset * offset_limit > squares);
            any |= doubtful[x];
        }
        any
    }

    /// Excludes positions with invalid pixels and computes the doubtful ones exactly; counts those without contrast.
    fn repair_row(&self, left: usize, y: usize, scores: &mut [f32], doubtful: &[bool]) -> u32 {
        let stride = self.image.width() as usize;
        let start = (self.region.y as usize + y) * stride + self.region.x as usize + left;
        let mut flat = 0;
        for (x, (score, doubtful)) in scores.iter_mut().zip(doubtful).enumerate() {
            if !self.integral.all_valid(left + x, y, self.size, self.size) {
                *score = f32::NAN;
            } else if *doubtful {
                let exact = self.exact.score(self.image.as_raw(), stride, start + x);
                flat += u32::from(exact.is_none());
                *score = exact.unwrap_or(0.0) as f32;
            }
        }
        flat
    }
}

#[cfg(test)]
#[path = "zncc_tests.rs"]
mod tests;
