//! Zero-mean normalised cross-correlation (K-Eq 11, R62–R66), exhaustive over a region.
//!
//! ```text
//! ncc = Σ t j' / sqrt(Σ j'² − (Σ j')²/N)      t: template, zero mean and unit norm;  j': shifted window
//! ```
//! Because t has zero mean, the shift of the window is free; it is the mean of the tile of positions at hand, and
//! everything is summed in `f32`: numerators by `toom_cook`, Σ j' and Σ j'² by `moments`. What the rounded template
//! lacks of zero mean is put right afterwards. Where a window is so flat, or so far from its tile's mean, that these
//! sums would lose digits, the position is computed again by itself, in two passes (`exact`). Every score is within 1e-5
//! of the definition in exact numbers.
//!
//! Windows without contrast score 0 and are counted; windows that touch an invalid pixel are excluded (R66).
//! Each score depends on the region and its own tile only, so the number of threads changes nothing.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | t | `Template::values`, `Weights` | – |
//! | j' | window of the image, shifted | fraction of full scale |
//! | N | `count`: pixels of the template | – |

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::dot;
use super::exact::{Alone, Template};
use super::lanes::{row_of, row_of_mut};
use super::moments::{GROUP, Moments};
pub use super::surface::Surface;
use super::toom_cook::{self, Filters, TILE_COLUMNS};
use crate::image::invalid::InvalidCounts;
use crate::image::patch::{FLAT_STD, Patch};
use crate::image::{GrayImage, PixelRect};

/// A window's mean may differ from its tile's by this many of its standard deviations: the difference of Σ j'² and
/// (Σ j')²/N errs by about 1e-7 of Σ j'², so that the score errs by 2e-6 at this limit.
const MAX_OFFSET_STD: f32 = 6.0;

/// The root mean square of a tile, less its mean, may be this many of a window's standard deviations: the sums of
/// `toom_cook` err by at most 1.2e-6 of it, most by 1e-7.
const MAX_TILE_STD: f32 = 24.0;

/// In the place of a score that has to be computed by itself.
const DOUBTFUL: f32 = 2.0;

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
    let (rows, work) = (job.filters.tile_rows(), scores.len() * job.exact.values.len());
    let band = rows * width as usize;
    let flat_positions = if work < PARALLEL_WORK {
        let mut scratch = job.scratch();
        scores.chunks_mut(band).enumerate().map(|(i, band)| job.band(&mut scratch, i * rows, band)).sum()
    } else {
        let bands = scores.par_chunks_mut(band).enumerate();
        bands.map_init(|| job.scratch(), |scratch, (i, band)| job.band(scratch, i * rows, band)).sum()
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
        Some(template.score(window.as_raw()).unwrap_or(0.0) as f32)
    }
}

/// What all positions share.
struct Job<'a> {
    exact: Template,
    /// The template as rounded to `f32`.
    rounded: Vec<f32>,
    filters: Filters,
    /// Sum and norm of `rounded`.
    weights_sum: f32,
    weights_norm: f32,
    image: &'a GrayImage,
    region: PixelRect,
    /// Nothing when every pixel of the region is valid, which is nearly always.
    invalid: Option<InvalidCounts>,
    /// Positions per row.
    width: usize,
    size: usize,
    count: f32,
}

/// Buffers of a tile, used again for the next.
struct Scratch {
    /// Pixels less their mean.
    input: Vec<f32>,
    /// Numerators, rows of `TILE_COLUMNS`.
    numerators: Vec<f32>,
    moments: Moments,
    toom_cook: toom_cook::Scratch,
    /// Scores of a row.
    scores: Vec<f32>,
    /// A window by itself.
    window: Vec<f32>,
}

impl<'a> Job<'a> {
    fn new(exact: Template, image: &'a GrayImage, region: PixelRect, width: usize) -> Self {
        let rounded: Vec<f32> = exact.values.iter().map(|t| *t as f32).collect();
        let count = rounded.len() as f64;
        let weights_sum: f64 = rounded.iter().map(|t| f64::from(*t)).sum();
        let squares: f64 = rounded.iter().map(|t| f64::from(*t).powi(2)).sum();
        Self {
            filters: Filters::new(&rounded, exact.width),
            rounded,
            weights_sum: weights_sum as f32,
            weights_norm: (squares - weights_sum * weights_sum / count).max(0.0).sqrt() as f32,
            size: exact.width,
            exact,
            image,
            region,
            invalid: InvalidCounts::of(image, region),
            width,
            count: count as f32,
        }
    }

    /// Scores the band of positions that starts at row `top`; gives the number of positions without contrast.
    fn band(&self, scratch: &mut Scratch, top: usize, scores: &mut [f32]) -> u32 {
        Arch::new().dispatch(Band { job: self, scratch, top, scores })
    }

    fn scratch(&self) -> Scratch {
        let (rows, columns) = (self.filters.tile_rows(), self.filters.input_columns());
        Scratch {
            input: vec![0.0; self.filters.input_rows() * columns],
            numerators: vec![0.0; rows * TILE_COLUMNS],
            moments: Moments::new(self.size, rows, columns),
            toom_cook: self.filters.scratch(),
            scores: vec![0.0; TILE_COLUMNS],
            window: vec![0.0; self.rounded.len()],
        }
    }

    /// The numerators of a tile of rows × columns positions.
    #[inline(always)]
    fn numerators<S: Simd>(&self, simd: S, scratch: &mut Scratch, [rows, columns]: [usize; 2]) {
        let Scratch { input, numerators, toom_cook, .. } = scratch;
        if 3 * rows <= self.size {
            let (template, input_stride) = (self.rounded.as_slice(), self.filters.input_columns());
            let rest = dot::Rows { template, size: self.size, input, input_stride };
            rest.sum(simd, [rows, columns], numerators, TILE_COLUMNS);
        } else {
            self.filters.sum(simd, toom_cook, input, columns, numerators);
        }
    }

    /// Excludes positions with invalid pixels and computes the doubtful ones by themselves; counts those without contrast.
    #[inline(always)]
    fn repair_row<S: Simd>(
        &self,
        simd: S,
        window: &mut [f32],
        [left, y]: [usize; 2],
        scores: &mut [f32],
    ) -> u32 {
        let stride = self.image.width() as usize;
        let start = (self.region.y as usize + y) * stride + self.region.x as usize + left;
        let mut flat = 0;
        for (x, score) in scores.iter_mut().enumerate() {
            if self.invalid.as_ref().is_some_and(|counts| !counts.none_in([left + x, y], self.size)) {
                *score = f32::NAN;
            } else if *score == DOUBTFUL {
                let alone = simd.vectorize(Alone {
                    template: &self.rounded,
                    size: self.size,
                    sum: self.weights_sum,
                    norm: self.weights_norm,
                    pixels: &self.image.as_raw()[start + x..],
                    stride,
                    window,
                });
                let alone = alone.filter(|_| !self.exact.is_flat);
                flat += u32::from(alone.is_none());
                *score = alone.unwrap_or(0.0);
            }
        }
        flat
    }
}

/// The scores of a band of rows: all of it runs with the widest vectors of the processor.
struct Band<'s, 'a> {
    job: &'s Job<'a>,
    scratch: &'s mut Scratch,
    top: usize,
    scores: &'s mut [f32],
}

impl WithSimd for Band<'_, '_> {
    type Output = u32;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> u32 {
        let Self { job, scratch, top, scores } = self;
        let (rows, mut flat) = (scores.len() / job.width, 0);
        for left in (0..job.width).step_by(TILE_COLUMNS) {
            let columns = TILE_COLUMNS.min(job.width - left);
            let mean_square = simd.vectorize(Load { job, at: [left, top], size: [rows, columns], scratch });
            job.numerators(simd, scratch, [rows, columns]);
            scratch.moments.down(simd, &scratch.input, rows);
            for y in 0..rows {
                if y % GROUP == 0 {
                    scratch.moments.across(simd, y, GROUP.min(rows - y));
                }
                let any = simd.vectorize(ScoreRow { job, mean_square, y, columns, scratch });
                let scores = &mut scores[y * job.width + left..][..columns];
                scores.copy_from_slice(&scratch.scores[..columns]);
                if any || job.invalid.is_some() {
                    flat += job.repair_row(simd, &mut scratch.window, [left, top + y], scores);
                }
            }
        }
        flat
    }
}

/// Copies the pixels of a tile, less about their mean; gives the mean square of what was copied (its whole vectors).
struct Load<'s, 'a> {
    job: &'s Job<'a>,
    /// First column and row of positions.
    at: [usize; 2],
    /// Rows and columns of positions.
    size: [usize; 2],
    scratch: &'s mut Scratch,
}

impl WithSimd for Load<'_, '_> {
    type Output = f32;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f32 {
        let (job, [left, top], [rows, columns]) = (self.job, self.at, self.size);
        let (width, height) = (columns + job.size - 1, rows + job.size - 1);
        let (stride, pitch) = (job.filters.input_columns(), job.image.width() as usize);
        let first = (job.region.y as usize + top) * pitch + job.region.x as usize + left;
        let pixels = job.image.as_raw().as_slice();
        let mean = self.rough_mean(pixels, first, pitch, [width, height]);
        let input = &mut self.scratch.input;
        let (shift, whole) = (simd.splat_f32s(mean), width / S::F32_LANES);
        let mut squares = simd.splat_f32s(0.0);
        for y in 0..height {
            let row = &pixels[first + y * pitch..][..width];
            let out = &mut input[y * stride..][..stride];
            if job.invalid.is_some() {
                for x in 0..width {
                    out[x] = if row[x].is_finite() { row[x] - mean } else { 0.0 };
                }
                for d in row_of::<S>(out, 0, whole) {
                    squares = simd.mul_add_e_f32s(*d, *d, squares);
                }
            } else {
                let (vectors, shifted) = (row_of::<S>(row, 0, whole), row_of_mut::<S>(out, 0, whole));
                for x in 0..whole {
                    let d = simd.sub_f32s(vectors[x], shift);
                    squares = simd.mul_add_e_f32s(d, d, squares);
                    shifted[x] = d;
                }
                for x in whole * S::F32_LANES..width {
                    out[x] = row[x] - mean;
                }
            }
            out[width..].fill(0.0);
        }
        input[height * stride..].fill(0.0);
        simd.reduce_sum_f32s(squares) / (whole.max(1) * S::F32_LANES * height) as f32
    }
}

impl Load<'_, '_> {
    /// The mean of 8 × 8 of the pixels, spread evenly: any value nearby serves.
    #[inline(always)]
    fn rough_mean(&self, pixels: &[f32], first: usize, pitch: usize, [width, height]: [usize; 2]) -> f32 {
        let (mut sum, mut count) = (0.0, 0.0);
        for v in 0..8 {
            for u in 0..8 {
                let value = pixels[first + v * (height - 1) / 7 * pitch + u * (width - 1) / 7];
                if value.is_finite() {
                    sum += value;
                    count += 1.0;
                }
            }
        }
        if count > 0.0 { sum / count } else { 0.0 }
    }
}

/// Scores of one row of a tile from its sums; says whether any of them is doubtful.
struct ScoreRow<'s, 'a> {
    job: &'s Job<'a>,
    mean_square: f32,
    y: usize,
    columns: usize,
    scratch: &'s mut Scratch,
}

impl WithSimd for ScoreRow<'_, '_> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> bool {
        let Self { job, mean_square, y, columns, scratch } = self;
        let Scratch { numerators, moments, scores, .. } = scratch;
        let vectors = columns.div_ceil(S::F32_LANES);
        let numerators = row_of::<S>(numerators, y * TILE_COLUMNS, vectors);
        let [sums, squares] = moments.row::<S>(y % GROUP, vectors);
        let scores = row_of_mut::<S>(scores, 0, vectors);
        // Without contrast in the template every position takes the exact way, which counts it.
        let floor = job.count * (mean_square / MAX_TILE_STD.powi(2)).max((FLAT_STD * FLAT_STD) as f32);
        let floor = simd.splat_f32s(if job.exact.is_flat { f32::INFINITY } else { floor });
        let (one, doubtful) = (simd.splat_f32s(1.0), simd.splat_f32s(DOUBTFUL));
        let (minus_one, mut highest) = (simd.splat_f32s(-1.0), simd.splat_f32s(-1.0));
        let per_count = simd.splat_f32s(1.0 / job.count);
        let weights_sum = simd.splat_f32s(-job.weights_sum);
        let weights_norm = simd.splat_f32s(job.weights_norm);
        let offset_limit = simd.splat_f32s(job.count / MAX_OFFSET_STD.powi(2));
        for x in 0..vectors {
            let mean = simd.mul_f32s(sums[x], per_count);
            let square = simd.mul_f32s(mean, sums[x]);
            let variance = simd.sub_f32s(squares[x], square);
            let numerator = simd.mul_add_e_f32s(weights_sum, mean, numerators[x]);
            let score = simd.div_f32s(numerator, simd.mul_f32s(simd.sqrt_f32s(variance), weights_norm));
            let score = simd.max_f32s(simd.min_f32s(score, one), minus_one);
            let limit = simd.mul_f32s(simd.mul_f32s(mean, mean), offset_limit);
            let is_sure = simd.less_than_f32s(simd.max_f32s(floor, limit), variance);
            let score = simd.select_f32s(is_sure, score, doubtful);
            scores[x] = score;
            highest = simd.max_f32s(highest, score);
        }
        simd.reduce_max_f32s(highest) >= DOUBTFUL
    }
}

#[cfg(test)]
#[path = "zncc_tests.rs"]
mod tests;
