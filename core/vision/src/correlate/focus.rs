//! Refines a match with a Gaussian window, so that pixels near the target's point have the largest weight (ours).
//!
//! A large template finds the target without ambiguity, but its surface is not flat: relief of height h beside the point
//! moves by `h Δθ` when the line of sight rotates by Δθ, and biases the match. Relief grows with the distance from the
//! point, about as its square on a curved surface, so that distant pixels have the largest bias. From the highest score
//! of the whole template the refinement therefore climbs a score in which each pixel has the weight
//! ```text
//! w(r) = exp(−r² / 2σ²)                       r: distance from the template's centre
//! ncc  = Σ w (I − Ī)(J − J̄) / sqrt(Σ w (I − Ī)² Σ w (J − J̄)²),   Ī = Σ w I / Σ w
//! ```
//! to the nearest maximum, which is fitted to sub-pixel precision as every peak is (`peak`). With σ = 0 all pixels have
//! the same weight, and the score is K-Eq 11.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | σ | `sigma_px` | px |
//! | w | `Focus::weights`, with sum 1 | – |

use std::collections::BTreeMap;

use nalgebra::{Matrix3, SMatrix, Vector2};

use super::peak::Fit;
use crate::image::GrayImage;
use crate::image::patch::{FLAT_STD, Patch};

/// Largest number of steps uphill before the match is rejected as divergent.
const CLIMB_LIMIT: usize = 6;

/// Weights of the pixels of a square window.
#[derive(Clone, Debug, PartialEq)]
pub struct Focus {
    size: u32,
    weights: Vec<f64>,
    is_even: bool,
}

/// A maximum of the weighted scores.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FocusedPeak {
    /// From the start of the climb to the maximum, px.
    pub offset_px: Vector2<f64>,
    /// Weighted score at the maximum.
    pub score: f64,
}

impl Focus {
    /// A Gaussian of `sigma_px` over a window of `size` × `size` px; 0: uniform weights.
    pub fn new(size: u32, sigma_px: f64) -> Self {
        let half = (f64::from(size) - 1.0) / 2.0;
        let weight = |x: u32, y: u32| -> f64 {
            let squared = (f64::from(x) - half).powi(2) + (f64::from(y) - half).powi(2);
            if sigma_px > 0.0 { (-squared / (2.0 * sigma_px * sigma_px)).exp() } else { 1.0 }
        };
        let mut weights: Vec<f64> = (0..size).flat_map(|y| (0..size).map(move |x| weight(x, y))).collect();
        let sum: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|w| *w /= sum);
        Self { size, weights, is_even: sigma_px <= 0.0 }
    }

    /// Returns whether the weights are uniform, so that there is nothing to refine.
    pub fn is_even(&self) -> bool {
        self.is_even
    }

    /// The weights, row by row, with sum 1.
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// Returns the patch with weighted mean 0 and weighted standard deviation 1; invalid pixels stay invalid and have no
    /// weight.
    ///
    /// `None` if it has another size or no contrast.
    pub fn normalise(&self, patch: &Patch) -> Option<Patch> {
        if patch.dimensions() != (self.size, self.size) {
            return None;
        }
        let valid = || patch.as_raw().iter().zip(&self.weights).filter(|(v, _)| v.is_finite());
        let total: f64 = valid().map(|(_, w)| w).sum();
        let mean = valid().map(|(v, w)| w * f64::from(*v)).sum::<f64>() / total;
        let variance = valid().map(|(v, w)| w * (f64::from(*v) - mean).powi(2)).sum::<f64>() / total;
        let std = Some(variance.sqrt()).filter(|std| *std >= FLAT_STD)?;
        let values = patch.as_raw().iter().map(|v| ((f64::from(*v) - mean) / std) as f32).collect();
        GrayImage::from_raw(self.size, self.size, values).map(Patch::from)
    }

    /// Weighted score of two patches, the first of which is normalised; `None` if either is unusable or flat.
    pub fn score(&self, normalised: &Patch, window: &Patch) -> Option<f64> {
        self.score_weighted(&self.weighted(normalised)?, window)
    }

    /// `w t` of a normalised template; `None` if it has another size or an invalid pixel.
    fn weighted(&self, normalised: &Patch) -> Option<Vec<f64>> {
        let is_usable = normalised.dimensions() == (self.size, self.size) && normalised.is_complete();
        is_usable
            .then(|| normalised.as_raw().iter().zip(&self.weights).map(|(t, w)| w * f64::from(*t)).collect())
    }

    /// Score of a window against `weighted`, in one pass over values minus the window's first, which preserves the
    /// digits of a small contrast. Columns are summed side by side, in a fixed order.
    fn score_weighted(&self, weighted: &[f64], window: &Patch) -> Option<f64> {
        if window.dimensions() != (self.size, self.size) {
            return None;
        }
        let (size, first) = (self.size as usize, f64::from(*window.as_raw().first()?));
        let mut columns = vec![0.0; 4 * size];
        let (means, rest) = columns.split_at_mut(size);
        let (squares, rest) = rest.split_at_mut(size);
        let (products, totals) = rest.split_at_mut(size);
        let rows = window.as_raw().chunks_exact(size);
        for ((row, weights), template) in
            rows.zip(self.weights.chunks_exact(size)).zip(weighted.chunks_exact(size))
        {
            for x in 0..size {
                let value = f64::from(row[x]) - first;
                means[x] += weights[x] * value;
                squares[x] += weights[x] * value * value;
                products[x] += template[x] * value;
                totals[x] += template[x];
            }
        }
        let [mean, squares, product, total] =
            [means, squares, products, totals].map(|columns| columns.iter().sum::<f64>());
        // An invalid pixel makes the sums non-finite: no score.
        let std = Some((squares - mean * mean).max(0.0).sqrt()).filter(|std| *std >= FLAT_STD)?;
        Some((product - mean * total) / std).filter(|score| score.is_finite())
    }

    /// Climbs from offset (0, 0) over the weighted scores of windows at whole-pixel offsets to the nearest maximum,
    /// which is fitted to sub-pixel precision if `sub_pixel` is set.
    ///
    /// `window_at(x, y)` is the window moved by that many pixels. `None` if there is no maximum within six steps, if it
    /// cannot be fitted (a straight edge has none along itself), or if a window beside it is flat or incomplete.
    pub fn climb(
        &self,
        template: &Patch,
        sub_pixel: bool,
        window_at: impl Fn(i32, i32) -> Option<Patch>,
    ) -> Option<FocusedPeak> {
        let template = self.weighted(&self.normalise(template)?)?;
        let mut scores: BTreeMap<[i32; 2], Option<f64>> = BTreeMap::new();
        let mut score = |x: i32, y: i32| -> Option<f64> {
            *scores
                .entry([x, y])
                .or_insert_with(|| window_at(x, y).and_then(|window| self.score_weighted(&template, &window)))
        };
        let [mut x, mut y] = [0, 0];
        for _ in 0..CLIMB_LIMIT {
            let near: Matrix3<f64> = around([x, y], &mut score)?;
            // Among equal scores the centre wins.
            let start = (near[(1, 1)], [0, 0]);
            let (_, step) = near.iter().enumerate().fold(start, |best, (index, &score)| {
                if score > best.0 { (score, [index as i32 / 3 - 1, index as i32 % 3 - 1]) } else { best }
            });
            if step == [0, 0] {
                let middle = Vector2::new(f64::from(x), f64::from(y));
                if !sub_pixel {
                    return Some(FocusedPeak { offset_px: middle, score: near[(1, 1)] });
                }
                let fit = Fit::quadratic(&near)?;
                let wide = around([x, y], &mut score).and_then(|scores| fit.refined(&scores));
                let fit = wide.unwrap_or(fit);
                return Some(FocusedPeak {
                    offset_px: middle + fit.offset,
                    score: fit.score.clamp(-1.0, 1.0),
                });
            }
            [x, y] = [x + step[0], y + step[1]];
        }
        None
    }
}

/// The N × N scores around a position, columns by x and rows by y; `None` if one is missing.
fn around<const N: usize>(
    [x, y]: [i32; 2],
    score: &mut impl FnMut(i32, i32) -> Option<f64>,
) -> Option<SMatrix<f64, N, N>> {
    let reach = (N / 2) as i32;
    let mut scores = SMatrix::zeros();
    for (row, column) in (0..N).flat_map(|row| (0..N).map(move |column| (row, column))) {
        scores[(row, column)] = score(x + column as i32 - reach, y + row as i32 - reach)?;
    }
    Some(scores)
}

#[cfg(test)]
#[path = "focus_tests.rs"]
mod tests;
