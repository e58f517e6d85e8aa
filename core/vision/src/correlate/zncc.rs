//! Zero-mean normalised cross-correlation (K-Eq 11, R62–R66), exhaustive over a region.
//!
//! ```text
//! ncc = Σ t j' / sqrt(Σ j'² − (Σ j')²/N)      t: template, zero mean and unit norm;  j': shifted window
//! ```
//! Because t has zero mean, the shift of the window is free; it is the approximate mean of the surrounding pixels, and
//! everything is summed in `f32`: numerators by `toom_cook`, Σ j' and Σ j'² by `moments`. The residual mean of the
//! rounded template is corrected afterwards. If a window is so flat, or so far from that mean, that these sums would
//! lose digits, the position is recomputed in two passes (`exact`). Every score is within 1e-5 of the definition in
//! exact arithmetic.
//!
//! A score map is divided into bands of rows, a band into tiles of columns, whose pixels are copied and prepared at
//! once; the rows of a tile are scored in the groups of `toom_cook`, each with its own level and limits.
//!
//! Windows without contrast score 0 and are counted; windows that touch an invalid pixel are excluded (R66).
//! Each score depends on the region and its own band only, so that the result does not depend on the number of threads.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | t | `Template::values`, `rounded` | – |
//! | j' | window of the image, shifted | fraction of full scale |
//! | N | `size`²: pixels of the template | – |

use std::cell::Cell;
use std::sync::OnceLock;

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

pub use super::surface::Surface;
use super::toom_cook::buffer::Buffer;
use super::toom_cook::exact::{Alone, Template, sum_of};
use super::toom_cook::load::{Load, rough_mean};
use super::toom_cook::moments::Moments;
use super::toom_cook::score::{DOUBTFUL, Limits, ScoreRow};
use super::toom_cook::tile::{PHASES, TILE_COLUMNS, Tile};
use super::toom_cook::{self, Filters};
use crate::image::invalid::InvalidCounts;
use crate::image::patch::Patch;
use crate::image::{GrayImage, PixelRect};

/// Approximate number of position rows in a band.
const BAND_ROWS: usize = 140;

/// Rows of pixels that are copied and prepared at once: few enough for the L1 cache.
const LOADED_ROWS: usize = 16;

/// Number of multiply-adds from which a second thread is worth its wake-up.
const PARALLEL_WORK: usize = 2_000_000;

/// Scores of a square template with an odd side at every position whose whole window is inside `region` and the image.
///
/// `None` if the template is not square, has an even side or an invalid pixel, or fits at no position.
pub fn zncc_surface(template: &Patch, image: &GrayImage, region: PixelRect) -> Option<Surface> {
    let size = template.width();
    if template.height() != size || size.is_multiple_of(2) {
        return None;
    }
    let exact = Template::new(template)?;
    let region = region.intersect(&PixelRect::whole(image.width(), image.height()))?;
    let width = (region.width + 1).checked_sub(size).filter(|w| *w > 0)?;
    let height = (region.height + 1).checked_sub(size).filter(|h| *h > 0)?;
    let job = Job::new(exact, image, region, [width as usize, height as usize]);
    let mut scores = vec![0.0; width as usize * height as usize];
    let (rows, work) = (job.band_rows(), scores.len() * job.exact.values.len());
    let band = rows * width as usize;
    let flat_positions = if work < PARALLEL_WORK || scores.len() <= band {
        let mut scratch = Kept::of(&job);
        scores.chunks_mut(band).enumerate().map(|(i, band)| job.band(&mut scratch, i * rows, band)).sum()
    } else {
        let bands = scores.par_chunks_mut(band).enumerate();
        bands.map_init(|| Kept::of(&job), |scratch, (i, band)| job.band(scratch, i * rows, band)).sum()
    };
    let half = (size / 2) as i32;
    let origin = [region.x + half, region.y + half];
    Some(Surface { origin, width, height, scores, flat_positions, template_size: size })
}

/// The score of two patches of the same size (any size, for windows at sub-pixel positions).
///
/// 0 if either has no contrast; `None` if the sizes differ, or either is empty or has an invalid pixel.
pub fn zncc(template: &Patch, window: &Patch) -> Option<f32> {
    Reference::new(template)?.score(window)
}

/// A patch prepared for many single scores in double precision.
pub struct Reference(Template);

impl Reference {
    /// `None` if the patch is empty or has an invalid pixel.
    pub fn new(patch: &Patch) -> Option<Self> {
        Template::new(patch).map(Self)
    }

    /// The score of a window; 0 if either has no contrast, `None` if the sizes differ or a pixel is invalid.
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

/// Data shared by all positions.
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
    /// Computed at the first tile with an invalid pixel, which is rare.
    invalid: OnceLock<Option<InvalidCounts>>,
    /// Positions per row, and number of rows.
    width: usize,
    height: usize,
    size: usize,
}

/// Buffers of a tile, reused for the next.
struct Scratch {
    /// Side of the templates for which they are allocated.
    size: usize,
    /// Pixels minus their approximate mean, in phases.
    input: Buffer,
    /// Numerators, in phases.
    numerators: Buffer,
    moments: Moments,
    toom_cook: toom_cook::Scratch,
    /// A row of pixels, padded to whole vectors, or of scores.
    row: Buffer,
    /// Scores of a row, in phases.
    scores: Buffer,
    /// A single window, for `exact`.
    window: Vec<f32>,
}

thread_local! {
    /// The buffers that the thread used last: allocating them would take a tenth of the time of a small score map.
    static KEPT: Cell<Option<Box<Scratch>>> = const { Cell::new(None) };
}

/// Buffers that return to their thread when dropped.
struct Kept(Option<Box<Scratch>>);

impl Kept {
    fn of(job: &Job<'_>) -> Self {
        let kept = KEPT.take().filter(|scratch| scratch.size == job.size);
        Self(Some(kept.unwrap_or_else(|| Box::new(job.scratch()))))
    }
}

impl Drop for Kept {
    fn drop(&mut self) {
        KEPT.set(self.0.take());
    }
}

impl<'a> Job<'a> {
    fn new(exact: Template, image: &'a GrayImage, region: PixelRect, [width, height]: [usize; 2]) -> Self {
        let rounded: Vec<f32> = exact.values.iter().map(|t| *t as f32).collect();
        let count = rounded.len() as f64;
        let weights_sum = sum_of(&rounded, |t| t);
        let squares = sum_of(&rounded, |t| t * t);
        Self {
            filters: Filters::new(&rounded, exact.width),
            rounded,
            weights_sum: weights_sum as f32,
            weights_norm: (squares - weights_sum * weights_sum / count).max(0.0).sqrt() as f32,
            size: exact.width,
            exact,
            image,
            region,
            invalid: OnceLock::new(),
            width,
            height,
        }
    }

    /// Scores the band of positions that starts at row `top`; returns the number of positions without contrast.
    fn band(&self, kept: &mut Kept, top: usize, scores: &mut [f32]) -> u32 {
        let Some(scratch) = kept.0.as_deref_mut() else { return 0 };
        Arch::new().dispatch(Band { job: self, scratch, top, scores })
    }

    /// Rows of positions of a band: about as many as keep its data in the L2 cache.
    fn band_rows(&self) -> usize {
        let group = self.filters.group_rows();
        let rows = (BAND_ROWS / group).max(1) * group;
        // A few additional rows do not form a band of their own.
        if self.height <= rows + self.few_rows() { self.height } else { rows }
    }

    /// Largest number of position rows that are faster one by one.
    fn few_rows(&self) -> usize {
        self.size / 3
    }

    /// Number of `toom_cook` groups in `rows` rows of positions; too few remaining rows are summed one by one.
    fn groups(&self, rows: usize) -> usize {
        let group = self.filters.group_rows();
        rows / group + usize::from(rows % group > self.few_rows())
    }

    /// Rows of pixels required by `rows` rows of positions, and the one below, which `moments` reads.
    fn pixel_rows(&self, rows: usize) -> usize {
        self.filters.pixel_rows(self.groups(rows)).max(rows + self.size)
    }

    fn scratch(&self) -> Scratch {
        let rows =
            (BAND_ROWS / self.filters.group_rows()).max(1) * self.filters.group_rows() + self.few_rows();
        let tile = Tile::new(self.size, TILE_COLUMNS, self.pixel_rows(rows));
        Scratch {
            size: self.size,
            input: Buffer::new(tile.pixel_rows * tile.row_pixels()),
            numerators: Buffer::new(self.filters.group_rows() * TILE_COLUMNS),
            moments: Moments::new(self.size, self.filters.group_rows(), tile),
            toom_cook: self.filters.scratch(tile),
            row: Buffer::new(tile.row_pixels()),
            scores: Buffer::new(TILE_COLUMNS),
            window: vec![0.0; self.rounded.len()],
        }
    }

    /// Computes the numerators of up to a group of rows of a tile, from the first of `rows` to one before the last.
    #[inline(always)]
    fn numerators<S: Simd>(&self, simd: S, scratch: &mut Scratch, tile: Tile, rows: [usize; 2], level: f32) {
        let Scratch { numerators: output, toom_cook, .. } = scratch;
        if rows[1] - rows[0] <= self.few_rows() {
            self.filters.sum_rows(simd, toom_cook, tile, (rows, level), output);
        } else {
            self.filters.sum(simd, toom_cook, tile, (rows[0], level), output);
        }
    }

    /// The invalid pixels of the region.
    fn invalid(&self) -> Option<&InvalidCounts> {
        self.invalid.get_or_init(|| InvalidCounts::of(self.image, self.region)).as_ref()
    }

    /// Excludes positions with invalid pixels and recomputes the doubtful ones; returns the number of those without
    /// contrast.
    #[inline(always)]
    fn repair_row<S: Simd>(
        &self,
        simd: S,
        window: &mut [f32],
        [left, y]: [usize; 2],
        scores: &mut [f32],
        invalid: Option<&InvalidCounts>,
    ) -> u32 {
        let stride = self.image.width() as usize;
        let start = (self.region.y as usize + y) * stride + self.region.x as usize + left;
        let mut flat = 0;
        for (x, score) in scores.iter_mut().enumerate() {
            if invalid.is_some_and(|counts| !counts.none_in([left + x, y], self.size)) {
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

    /// Copies and prepares the pixels of a tile of `rows` × `columns` positions; returns the region's invalid pixels if
    /// the tile has any.
    #[inline(always)]
    fn load<S: Simd>(
        &self,
        simd: S,
        scratch: &mut Scratch,
        tile: Tile,
        at: [usize; 2],
        extent: [usize; 2],
    ) -> Option<&InvalidCounts> {
        if self.load_rows::<S, false>(simd, scratch, tile, at, extent) {
            return None;
        }
        self.load_rows::<S, true>(simd, scratch, tile, at, extent);
        self.invalid()
    }

    /// Copies the pixels; returns whether all of them are valid.
    #[inline(always)]
    fn load_rows<S: Simd, const CHECKED: bool>(
        &self,
        simd: S,
        scratch: &mut Scratch,
        tile: Tile,
        [left, top]: [usize; 2],
        extent: [usize; 2],
    ) -> bool {
        let pitch = self.image.width() as usize;
        let pixels =
            &self.image.as_raw()[(self.region.y as usize + top) * pitch + self.region.x as usize + left..];
        let size = extent.map(|positions| positions + self.size - 1);
        let mean = rough_mean(pixels, pitch, size);
        let Scratch { row, input, toom_cook, .. } = scratch;
        let mut sum = 0.0;
        for first in (0..tile.pixel_rows).step_by(LOADED_ROWS) {
            let rows = [first, (first + LOADED_ROWS).min(tile.pixel_rows)];
            sum += simd.vectorize(Load::<CHECKED> { pixels, pitch, size, tile, mean, rows, row, input });
            self.filters.begin(simd, toom_cook, tile, input, rows);
        }
        sum.is_finite()
    }
}

/// The scores of a band of rows, computed with the widest vectors of the processor.
struct Band<'s, 'a> {
    job: &'s Job<'a>,
    scratch: &'s mut Scratch,
    top: usize,
    scores: &'s mut [f32],
}

impl WithSimd for Band<'_, '_> {
    type Output = u32;

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) -> u32 {
        // A loop, because code called by a closure would not be compiled for these vectors.
        let mut flat = 0;
        for left in (0..self.job.width).step_by(TILE_COLUMNS) {
            flat += self.tile(simd, left);
        }
        flat
    }
}

impl Band<'_, '_> {
    /// Scores the tile that starts at column `left`; returns the number of positions without contrast.
    #[inline(always)]
    fn tile<S: Simd>(&mut self, simd: S, left: usize) -> u32 {
        let Self { job, scratch, top, scores } = self;
        let rows = scores.len() / job.width;
        let columns = TILE_COLUMNS.min(job.width - left);
        let tile = Tile::new(job.size, columns, job.pixel_rows(rows));
        let invalid = job.load(simd, scratch, tile, [left, *top], [rows, columns]);
        let (group, mut flat) = (job.filters.group_rows(), 0);
        for first in (0..rows).step_by(group) {
            let last = (first + group).min(rows);
            // The brightness nearby, not that of the whole tile: a window loses digits with its difference from this
            // level.
            let extent = [last - first + job.size - 1, (columns + job.size - 1) / PHASES];
            let level = rough_mean(&scratch.input[first * tile.pixels..], tile.pixels, extent);
            scratch.moments.down(simd, tile, &scratch.input, [first, last], level);
            job.numerators(simd, scratch, tile, [first, last], level);
            let Scratch { numerators, moments, scores: phases, row, window, .. } = &mut **scratch;
            let mean_square = moments.mean_square(simd, tile);
            let limits = Limits::of(&job.exact, mean_square, [job.weights_sum, job.weights_norm]);
            let numerators = numerators.chunks_exact(tile.row_columns());
            for (y, numerators) in (0..last - first).zip(numerators) {
                let scores = &mut scores[(first + y) * job.width + left..][..columns];
                let scored = ScoreRow { limits: &limits, tile, y, numerators, moments, phases, row, scores };
                if simd.vectorize(scored) || invalid.is_some() {
                    flat += job.repair_row(simd, window, [left, *top + first + y], scores, invalid);
                }
            }
        }
        flat
    }
}

#[cfg(test)]
#[path = "zncc_tests.rs"]
mod tests;
