//! Scores of a row of positions from its sums (K-Eq 11), with a mark for those that need a more exact computation.
//!
//! ```text
//! ncc = (Σ t j' − Σ t · Σ j'/N) / (|t| sqrt(Σ j'² − (Σ j')²/N))          t: the template as rounded to f32
//! ```
//! Pixels are fractions of full scale, minus the level of their group of rows; scores are dimensionless.

use pulp::{Simd, WithSimd};

use super::exact::Template;
use super::lanes::{row_of, row_of_mut};
use super::moments::Moments;
use super::phases::Join;
use super::tile::Tile;
use crate::image::patch::FLAT_STD;

/// Largest difference of a window's mean from its group's level, in standard deviations of the window. The error of Σ
/// j'² − (Σ j')²/N is about 1e-7 of Σ j'², so that the score errs by 2e-6 at this limit.
const MAX_OFFSET_STD: f32 = 6.0;

/// Largest root mean square of a group of rows, minus its level, in standard deviations of a window: the sums of
/// `toom_cook` err by at most 1.2e-6 of it, most by 1e-7.
const MAX_TILE_STD: f32 = 24.0;

/// Value outside the range of scores: marks one that is too uncertain and that `exact` must compute.
pub(in crate::correlate) const DOUBTFUL: f32 = 2.0;

/// Constants that convert the sums of a group of rows into scores.
pub(in crate::correlate) struct Limits {
    /// 1 / N.
    per_count: f32,
    /// Sum of the rounded template, and 1 / its norm.
    weights_sum: f32,
    per_norm: f32,
    /// Lower bounds of N times the variance of a position that is not doubtful: absolute, and over the square of the
    /// mean's offset.
    floor: f32,
    offset_limit: f32,
}

impl Limits {
    /// Limits for a template, with the sum and norm of its rounded values, and a group of this mean square.
    pub(in crate::correlate) fn of(
        template: &Template,
        mean_square: f32,
        [weights_sum, weights_norm]: [f32; 2],
    ) -> Self {
        let count = template.values.len() as f32;
        let floor = count * (mean_square / MAX_TILE_STD.powi(2)).max((FLAT_STD * FLAT_STD) as f32);
        Self {
            per_count: 1.0 / count,
            weights_sum,
            per_norm: 1.0 / weights_norm,
            // Without contrast in the template every position is computed by `exact`, which counts it.
            floor: if template.is_flat { f32::INFINITY } else { floor },
            offset_limit: count / MAX_OFFSET_STD.powi(2),
        }
    }
}

/// Scores one row; returns whether any of them is [`DOUBTFUL`].
pub(in crate::correlate) struct ScoreRow<'a> {
    pub(in crate::correlate) limits: &'a Limits,
    pub(in crate::correlate) tile: Tile,
    /// Index of the row in its group.
    pub(in crate::correlate) y: usize,
    /// Numerators of the row, in phases.
    pub(in crate::correlate) numerators: &'a [f32],
    pub(in crate::correlate) moments: &'a mut Moments,
    /// Buffers for the scores, in phases and in column order, in whole vectors.
    pub(in crate::correlate) phases: &'a mut [f32],
    pub(in crate::correlate) row: &'a mut [f32],
    /// Receives the scores.
    pub(in crate::correlate) scores: &'a mut [f32],
}

impl WithSimd for ScoreRow<'_> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> bool {
        let Self { limits, tile, y, numerators, moments, phases, row, scores: out } = self;
        let (columns, vectors) = (tile.row_columns(), tile.row_columns() / S::F32_LANES);
        let numerators = row_of::<S>(numerators, 0, vectors);
        let [sums, squares] = moments.across(simd, tile, y);
        let scores = row_of_mut::<S>(phases, 0, vectors);
        let (per_count, weights_sum) =
            (simd.splat_f32s(limits.per_count), simd.splat_f32s(-limits.weights_sum));
        let (floor, offset_limit) = (simd.splat_f32s(limits.floor), simd.splat_f32s(limits.offset_limit));
        let (per_norm, doubtful) = (simd.splat_f32s(limits.per_norm), simd.splat_f32s(DOUBTFUL));
        let (one, minus_one) = (simd.splat_f32s(1.0), simd.splat_f32s(-1.0));
        let mut highest = minus_one;
        for x in 0..vectors {
            let mean = simd.mul_f32s(sums[x], per_count);
            let variance = simd.sub_f32s(squares[x], simd.mul_f32s(mean, sums[x]));
            let numerator = simd.mul_add_e_f32s(weights_sum, mean, numerators[x]);
            let score = simd.mul_f32s(simd.mul_f32s(numerator, per_norm), inverse_sqrt(simd, variance));
            let score = simd.max_f32s(simd.min_f32s(score, one), minus_one);
            let limit = simd.mul_f32s(simd.mul_f32s(mean, mean), offset_limit);
            let is_sure = simd.less_than_f32s(simd.max_f32s(floor, limit), variance);
            let score = simd.select_f32s(is_sure, score, doubtful);
            scores[x] = score;
            highest = simd.max_f32s(highest, score);
        }
        simd.vectorize(Join { phases: tile.phases(phases), row: &mut row[..columns] });
        out.copy_from_slice(&row[..out.len()]);
        simd.reduce_max_f32s(highest) >= DOUBTFUL
    }
}

/// 1/√x for a positive, normal x, too small by at most 7e-7 of itself; any value otherwise.
///
/// Halves the exponent, approximates the logarithm of the mantissa by a line, then takes two Newton steps, the first
/// with the factors of Kadlec (2010), which leaves 6.5e-4. The processor's square root and division take three times as
/// long.
#[inline(always)]
fn inverse_sqrt<S: Simd>(simd: S, x: S::f32s) -> S::f32s {
    let half_bits = simd.wrapping_dyn_shr_u32s(simd.transmute_u32s_f32s(x), simd.splat_u32s(1));
    let minus_bits = simd.not_u32s(half_bits);
    let line = simd.transmute_f32s_u32s(simd.add_u32s(simd.splat_u32s(0x5f1f_fff9 + 1), minus_bits));
    let (first, second) = (simd.splat_f32s(-0.703_952_25), simd.splat_f32s(1.681_914_1));
    let factor = simd.mul_add_e_f32s(simd.mul_f32s(simd.mul_f32s(first, x), line), line, second);
    let y = simd.mul_f32s(line, factor);
    let half = simd.mul_f32s(simd.splat_f32s(-0.5), x);
    simd.mul_f32s(y, simd.mul_add_e_f32s(simd.mul_f32s(half, y), y, simd.splat_f32s(1.5)))
}
