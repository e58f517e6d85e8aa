//! Zero-mean normalised cross-correlation (K-Eq 11, R62–R66), exhaustive over a region.
//!
//! ```text
//! ncc = Σ t j' / sqrt(Σ j'² − (Σ j')²/N)      t: template, zero mean and unit norm;  j': shifted window
//! ```
//! Because t has zero mean, the shift of the window is free, and it is chosen to keep digits:
//!
//! * Denominators come from a rolling integral image in `f64`, shifted by the mean of the region.
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

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::dot::{TILE_COLUMNS, TILE_ROWS, Tile, Weights};
use super::exact::Template;
pub use super::surface::Surface;
use crate::image::integral::{self, RollingIntegral};
use crate::image::patch::{FLAT_STD, Patch};
use crate::image::{GrayImage, PixelRect};

/// A window's sum of squares must exceed this share of its strip's: differences of the running totals err by
/// about 2e-15 of the strip, and a relative error of 1e-6 is allowed.
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
    if template.height() != size || size.is_multiple_of(2) {
        return None;
    }
    let exact = Template::new(template)?;
    let region = region.intersect(&PixelRect::whole(image.width(), image.height()))?;
    let width = (region.width + 1).checked_sub(size).filter(|w| *w > 0)?;
    let height = (region.height + 1).checked_sub(size).filter(|h| *h > 0)?;
    let job = Job::new(exact, image, region, width as usize);
    let mut scores = vec![0.0; width as usize * height as usize];
    let (band, work) = (TILE_ROWS * width as usize, scores.len() * job.exact.values.len());
    let flat_positions = if work < PARALLEL_WORK {
        let mut scratch = job.scratch();
        scores.chunks_mut(band).enumerate().map(|(i, band)| job.band(&mut scratch, i * TILE_ROWS, band)).sum()
    } else {
        let bands = scores.par_chunks_mut(band).enumerate();
        bands.map_init(|| job.scratch(), |scratch, (i, band)| job.band(scratch, i * TILE_ROWS, band)).sum()
    };
    let half = (size / 2) as i32;
    let origin = [region.x + half, region.y + half];
    Some(Surface { origin, width, height, scores, flat_positions, template_size: size })
}

/// The score of two patches of the same size (any size, for windows at sub-pixel positions).
///
/// 0 when either has no contrast; `None` when the sizes differ, or either is empty or has an invalid pixel.
pub fn zncc(template: &Patch, window: &Patch) -> Option<f32> {
    Reference::new(template)?.score(window)
}

/// A patch prepared for many single scores in double precision.
pub struct Reference(Template);

impl Reference {
    /// `None` when the patch is empty or has an invalid pixel.
    pub fn new(patch: &Patch) -> Option<Self> {
        Template::new(patch).map(Self)
    }

    /// The score of a window; 0 when either has no contrast, `None` when the sizes differ or a pixel is invalid.
    pub fn score(&self, window: &Patch) -> Option<f32> {
        let template = &self.0;
        let same_size =
            window.width() as usize == template.width && window.as_raw().len() == template.values.len();
        if !same_size || !window.is_complete() {
            return None;
        }
        Some(template.score(window.as_raw(), template.width, 0).unwrap_or(0.0) as f32)
    }
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
    /// About the mean of the region.
    shift: f32,
    has_invalid: bool,
    /// Positions per row.
    width: usize,
    size: usize,
    count: f64,
}

/// Buffers of a band, used again for the next.
struct Scratch<'a> {
    input: Vec<f32>,
    /// Numerators, rows of whole tiles.
    sums: Vec<f32>,
    /// What was subtracted in each tile, relative to the shift of the region.
    tile_shifts: Vec<f64>,
    doubtful: Vec<bool>,
    integral: RollingIntegral<'a>,
}

impl<'a> Job<'a> {
    fn new(exact: Template, image: &'a GrayImage, region: PixelRect, width: usize) -> Self {
        let rounded: Vec<f32> = exact.values.iter().map(|t| *t as f32).collect();
        let count = rounded.len() as f64;
        let weights_sum: f64 = rounded.iter().map(|t| f64::from(*t)).sum();
        let squares: f64 = rounded.iter().map(|t| f64::from(*t).powi(2)).sum();
        let (shift, has_invalid) = Arch::new().dispatch(RoughMean { image, region });
        Self {
            weights: Weights::new(&rounded, exact.width),
            weights_sum,
            weights_norm: (squares - weights_sum * weights_sum / count).max(0.0).sqrt(),
            size: exact.width,
            exact,
            image,
            region,
            shift,
            has_invalid,
            width,
            count,
        }
    }

    /// Scores the band of positions that starts at row `top`; gives the number of positions without contrast.
    fn band(&self, scratch: &mut Scratch<'a>, top: usize, scores: &mut [f32]) -> u32 {
        Arch::new().dispatch(Band { job: self, scratch, top, scores })
    }

    fn scratch(&self) -> Scratch<'a> {
        let tiles = self.width.div_ceil(TILE_COLUMNS);
        Scratch {
            input: vec![0.0; self.weights.input_rows() * self.weights.input_columns()],
            sums: vec![0.0; TILE_ROWS * TILE_COLUMNS * tiles],
            tile_shifts: vec![0.0; tiles],
            doubtful: vec![false; self.width],
            integral: RollingIntegral::new(self.image, self.region, self.size, self.shift, self.has_invalid),
        }
    }

    /// The numerators of a band, tile by tile.
    #[inline(always)]
    fn numerators<S: Simd>(&self, simd: S, scratch: &mut Scratch<'a>, top: usize, rows: usize) {
        let stride = self.width.next_multiple_of(TILE_COLUMNS);
        for (tile, left) in (0..self.width).step_by(TILE_COLUMNS).enumerate() {
            let columns = TILE_COLUMNS.min(self.width - left);
            scratch.tile_shifts[tile] = self.load_tile(simd, left, top, columns, rows, &mut scratch.input);
            let (weights, input) = (&self.weights, scratch.input.as_slice());
            let output = &mut scratch.sums[left..];
            Tile { weights, input, columns, rows, output, stride }.with_simd(simd);
        }
    }

    /// Copies the pixels of a tile, less their mean, which is returned relative to the region's.
    #[inline(always)]
    fn load_tile<S: Simd>(
        &self,
        simd: S,
        left: usize,
        top: usize,
        columns: usize,
        rows: usize,
        input: &mut [f32],
    ) -> f64 {
        let (width, height) = (columns + self.size - 1, rows + self.size - 1);
        let pixels = |y: usize| &integral::row(self.image, &self.region, top + y)[left..left + width];
        let (shift, _) = integral::rough_mean(simd, (0..height).map(pixels));
        for (y, out) in input.chunks_exact_mut(self.weights.input_columns()).enumerate() {
            let (inside, outside) = out.split_at_mut(width);
            outside.fill(0.0);
            if y >= height {
                inside.fill(0.0);
                continue;
            }
            for (out, v) in inside.iter_mut().zip(pixels(y)) {
                *out = if v.is_finite() { v - shift } else { 0.0 };
            }
        }
        f64::from(shift) - f64::from(self.shift)
    }

    /// Scores of one row of positions from its numerators; says whether any of them is doubtful.
    #[inline(always)]
    fn score_row(&self, scratch: &mut Scratch<'a>, y: usize, scores: &mut [f32]) -> bool {
        let (sums, squares) = scratch.integral.totals();
        // Without contrast in the template every position takes the exact way, which counts it.
        let floor = (VARIANCE_FLOOR * squares[squares.len() - 1]).max(self.count * FLAT_STD * FLAT_STD);
        let floor = if self.exact.is_flat { f64::INFINITY } else { floor };
        let (per_count, offset_limit) = (1.0 / self.count, self.count / (MAX_OFFSET_STD * MAX_OFFSET_STD));
        let stride = self.width.next_multiple_of(TILE_COLUMNS);
        let mut any = false;
        for (tile, scores) in scores.chunks_mut(TILE_COLUMNS).enumerate() {
            let (left, columns, shift) = (tile * TILE_COLUMNS, scores.len(), scratch.tile_shifts[tile]);
            let right = left + self.size;
            let (l, r) = (&sums[left..left + columns], &sums[right..right + columns]);
            let (l2, r2) = (&squares[left..left + columns], &squares[right..right + columns]);
            let numerators = &scratch.sums[y * stride + left..][..columns];
            let doubtful = &mut scratch.doubtful[left..left + columns];
            for x in 0..columns {
                let mean = (r[x] - l[x]) * per_count;
                let variance = r2[x] - l2[x] - (r[x] - l[x]) * mean;
                let offset = mean - shift;
                let numerator = f64::from(numerators[x]) - self.weights_sum * offset;
                let norm = (variance as f32).sqrt() * self.weights_norm as f32;
                scores[x] = (numerator as f32 / norm).clamp(-1.0, 1.0);
                doubtful[x] = (variance <= floor) | (offset * offset * offset_limit > variance);
                any |= doubtful[x];
            }
        }
        any
    }

    /// Excludes positions with invalid pixels and computes the doubtful ones exactly; counts those without contrast.
    fn repair_row(&self, scratch: &Scratch<'a>, y: usize, scores: &mut [f32]) -> u32 {
        let stride = self.image.width() as usize;
        let start = (self.region.y as usize + y) * stride + self.region.x as usize;
        let mut flat = 0;
        for (x, (score, doubtful)) in scores.iter_mut().zip(&scratch.doubtful).enumerate() {
            if !scratch.integral.all_valid(x, self.size) {
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

/// The scores of a band of rows: all of it runs with the widest vectors of the processor.
struct Band<'s, 'a> {
    job: &'s Job<'a>,
    scratch: &'s mut Scratch<'a>,
    top: usize,
    scores: &'s mut [f32],
}

impl WithSimd for Band<'_, '_> {
    type Output = u32;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> u32 {
        let Self { job, scratch, top, scores } = self;
        job.numerators(simd, scratch, top, scores.len() / job.width);
        let mut flat = 0;
        for (y, scores) in scores.chunks_exact_mut(job.width).enumerate() {
            if y == 0 {
                scratch.integral.start(top);
            } else {
                scratch.integral.advance();
            }
            if job.score_row(scratch, y, scores) || job.has_invalid {
                flat += job.repair_row(scratch, top + y, scores);
            }
        }
        flat
    }
}

/// About the mean of a region, and whether it holds an invalid pixel.
struct RoughMean<'a> {
    image: &'a GrayImage,
    region: PixelRect,
}

impl WithSimd for RoughMean<'_> {
    type Output = (f32, bool);

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> (f32, bool) {
        integral::rough_mean(
            simd,
            (0..self.region.height as usize).map(|y| integral::row(self.image, &self.region, y)),
        )
    }
}

#[cfg(test)]
#[path = "zncc_tests.rs"]
mod tests;
