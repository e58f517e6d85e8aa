//! One score in double precision and two passes (K-Eq 11, R62, R66): the definition, written out.
//!
//! It serves single scores, and the positions of a surface where the fast sums lose too many digits.
//! The sums run over columns first, side by side, in an order that never changes.

use crate::image::patch::{FLAT_STD, Patch};

/// A template with zero mean and unit norm: `t = (I − Ī) / sqrt(Σ(I − Ī)²)`.
pub(super) struct Template {
    /// Columns.
    pub(super) width: usize,
    /// Row-major values; all zero for a template without contrast.
    pub(super) values: Vec<f64>,
    /// Whether the template has no contrast.
    pub(super) is_flat: bool,
}

impl Template {
    /// The template of a patch; `None` when it is empty or holds an invalid pixel.
    pub(super) fn new(patch: &Patch) -> Option<Self> {
        let mean = patch.mean().filter(|_| patch.is_complete())?;
        let is_flat = patch.is_flat();
        let mut values: Vec<f64> = patch.as_raw().iter().map(|v| f64::from(*v) - mean).collect();
        let norm = values.iter().map(|t| t * t).sum::<f64>().sqrt();
        values.iter_mut().for_each(|t| *t = if is_flat { 0.0 } else { *t / norm });
        Some(Self { width: patch.width() as usize, values, is_flat })
    }

    /// The score of the window whose first pixel is `start` in `pixels` of `stride` columns; `None` for a
    /// window without contrast. All its pixels are valid.
    pub(super) fn score(&self, pixels: &[f32], stride: usize, start: usize) -> Option<f64> {
        let height = self.values.len() / self.width;
        let rows = || (0..height).map(|row| &pixels[start + row * stride..][..self.width]);
        if self.is_flat || rows().all(|row| row.iter().all(|v| *v == pixels[start])) {
            return None;
        }
        let mut columns = vec![0.0; self.width];
        for row in rows() {
            columns.iter_mut().zip(row).for_each(|(sum, v)| *sum += f64::from(*v));
        }
        let count = self.values.len() as f64;
        let mean = columns.iter().sum::<f64>() / count;
        let mut columns = vec![[0.0; 2]; self.width];
        for (row, template) in rows().zip(self.values.chunks_exact(self.width)) {
            for ((sums, v), t) in columns.iter_mut().zip(row).zip(template) {
                let d = f64::from(*v) - mean;
                *sums = [sums[0] + t * d, sums[1] + d * d];
            }
        }
        let [product, squares] = columns.iter().fold([0.0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
        (squares >= count * FLAT_STD * FLAT_STD).then(|| (product / squares.sqrt()).clamp(-1.0, 1.0))
    }
}
