//! Single scores in two passes (K-Eq 11, R62, R66): the definition as written.
//!
//! [`Template`] computes single scores in double precision; its sums run over columns first, side by side, in a fixed
//! order. [`Alone`] computes the positions of a score map for which the sums of a whole tile lose too many digits: about
//! the window's own mean the differences are exact in `f32`, and their sums are accurate to 1e-7.

use pulp::{Simd, WithSimd};

use crate::image::patch::{FLAT_STD, Patch};

/// A template with zero mean and unit norm: `t = (I − Ī) / sqrt(Σ(I − Ī)²)`.
pub(in crate::correlate) struct Template {
    /// Number of columns.
    pub(in crate::correlate) width: usize,
    /// Row-major values; all zero for a template without contrast.
    pub(in crate::correlate) values: Vec<f64>,
    /// Whether the template has no contrast.
    pub(in crate::correlate) is_flat: bool,
}

impl Template {
    /// Normalises a patch; `None` if it is empty or contains an invalid pixel.
    pub(in crate::correlate) fn new(patch: &Patch) -> Option<Self> {
        let pixels = patch.as_raw();
        let sum = sum_of(pixels, |v| v);
        if pixels.is_empty() || !sum.is_finite() {
            return None;
        }
        let count = pixels.len() as f64;
        let mean = sum / count;
        let squares = sum_of(pixels, |v| (v - mean) * (v - mean));
        let is_flat = squares < count * FLAT_STD * FLAT_STD;
        let scale = if is_flat { 0.0 } else { 1.0 / squares.sqrt() };
        let values = pixels.iter().map(|v| (f64::from(*v) - mean) * scale).collect();
        Some(Self { width: patch.width() as usize, values, is_flat })
    }

    /// The score of a window of the template's size without invalid pixels; `None` if either has no contrast.
    pub(in crate::correlate) fn score(&self, pixels: &[f32]) -> Option<f64> {
        let rows = || pixels.chunks_exact(self.width);
        if self.is_flat || pixels.iter().all(|v| *v == pixels[0]) {
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

/// Number of partial sums in [`sum_of`].
const LANES: usize = 8;

/// Sum of `term` over numbers, in a fixed order.
#[inline(always)]
pub(in crate::correlate) fn sum_of(numbers: &[f32], term: impl Fn(f64) -> f64) -> f64 {
    let (lanes, rest) = numbers.as_chunks::<LANES>();
    let mut sums = [0.0; LANES];
    for numbers in lanes {
        for i in 0..LANES {
            sums[i] += term(f64::from(numbers[i]));
        }
    }
    sums.iter().sum::<f64>() + rest.iter().map(|v| term(f64::from(*v))).sum::<f64>()
}

/// A single window of a score map, to be scored in two passes.
pub(in crate::correlate) struct Alone<'a> {
    /// The template as rounded to `f32`, row-major; its side; its sum and norm.
    pub(in crate::correlate) template: &'a [f32],
    pub(in crate::correlate) size: usize,
    pub(in crate::correlate) sum: f32,
    pub(in crate::correlate) norm: f32,
    /// Pixels starting at the window's first; those of the window are valid.
    pub(in crate::correlate) pixels: &'a [f32],
    /// Columns of the image.
    pub(in crate::correlate) stride: usize,
    /// Buffer for the window, as long as the template.
    pub(in crate::correlate) window: &'a mut [f32],
}

impl WithSimd for Alone<'_> {
    type Output = Option<f32>;

    /// Returns the score; `None` if the window has no contrast.
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Option<f32> {
        let Self { template, size, window, .. } = self;
        for row in 0..size {
            window[row * size..][..size].copy_from_slice(&self.pixels[row * self.stride..][..size]);
        }
        let count = window.len() as f32;
        let (window, window_rest) = S::as_simd_f32s(window);
        let (template, template_rest) = S::as_simd_f32s(template);
        let mut total = simd.splat_f32s(0.0);
        for v in window {
            total = simd.add_f32s(total, *v);
        }
        let mean = (simd.reduce_sum_f32s(total) + window_rest.iter().sum::<f32>()) / count;
        let (shift, zero) = (simd.splat_f32s(mean), simd.splat_f32s(0.0));
        let (mut products, mut sums, mut squares) = (zero, zero, zero);
        for (t, v) in template.iter().zip(window) {
            let d = simd.sub_f32s(*v, shift);
            products = simd.mul_add_e_f32s(*t, d, products);
            sums = simd.add_f32s(sums, d);
            squares = simd.mul_add_e_f32s(d, d, squares);
        }
        let mut product = simd.reduce_sum_f32s(products);
        let (mut sum, mut square) = (simd.reduce_sum_f32s(sums), simd.reduce_sum_f32s(squares));
        for (t, v) in template_rest.iter().zip(window_rest) {
            let d = v - mean;
            (product, sum, square) = (product + t * d, sum + d, square + d * d);
        }
        let variance = square - sum * sum / count;
        let score = (product - self.sum * sum / count) / (variance.sqrt() * self.norm);
        (variance >= count * (FLAT_STD * FLAT_STD) as f32).then(|| score.clamp(-1.0, 1.0))
    }
}
