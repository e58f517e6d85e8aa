//! Copies the pixels of a tile: minus their approximate mean, which preserves digits, and in phases.

use pulp::{Simd, WithSimd};

use super::lanes::{WIDEST, row_of, row_of_mut};
use super::phases::Part;
use super::tile::{PHASES, Tile};

/// Samples along each side of a tile from which its mean is estimated.
const SAMPLES: usize = 5;

/// Copies some rows of a tile's pixels; only with `CHECKED` are invalid pixels replaced.
pub(in crate::correlate) struct Load<'a, const CHECKED: bool> {
    /// Pixels of the image, starting at the tile's first.
    pub(in crate::correlate) pixels: &'a [f32],
    /// Columns of the image.
    pub(in crate::correlate) pitch: usize,
    /// Rows and columns of pixels in the tile.
    pub(in crate::correlate) size: [usize; 2],
    pub(in crate::correlate) tile: Tile,
    /// Value subtracted from the pixels.
    pub(in crate::correlate) mean: f32,
    /// The first row to copy, and one past the last.
    pub(in crate::correlate) rows: [usize; 2],
    /// Buffer for a row.
    pub(in crate::correlate) row: &'a mut [f32],
    /// Receives the pixels, in phases; padding and invalid pixels are 0.
    pub(in crate::correlate) input: &'a mut [f32],
}

impl<const CHECKED: bool> WithSimd for Load<'_, CHECKED> {
    /// Sum of the copied pixels, not finite if any of them is invalid.
    type Output = f32;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f32 {
        let (tile, pitch, [height, width]) = (self.tile, self.pitch, self.size);
        let (shift, infinity) = (simd.splat_f32s(self.mean), simd.splat_f32s(f32::INFINITY));
        let (whole, rest) = (width / S::F32_LANES, width % S::F32_LANES);
        let mut is_pixel = [0.0; WIDEST];
        is_pixel[..rest].fill(1.0);
        let is_pixel = row_of::<S>(&is_pixel, 0, 1)[0];
        let (first, others) = self.input[..PHASES * tile.plane()].split_at_mut(tile.plane());
        let (second, third) = others.split_at_mut(tile.plane());
        self.row.fill(0.0);
        let row = &mut self.row[..tile.row_pixels()];
        let (mut sum, end) = (simd.splat_f32s(0.0), self.rows[1].min(height));
        for y in self.rows[0]..end {
            let pixels = &self.pixels[y * pitch..][..width];
            let vectors = row_of::<S>(pixels, 0, whole);
            let shifted = row_of_mut::<S>(row, 0, whole + usize::from(rest > 0));
            for x in 0..whole {
                let mut d = simd.sub_f32s(vectors[x], shift);
                if CHECKED {
                    d = valid_or_zero(simd, d, infinity);
                }
                sum = simd.add_f32s(sum, d);
                shifted[x] = d;
            }
            if rest > 0 {
                let last = simd.partial_load_f32s(&pixels[width - rest..]);
                let mut d = simd.mul_f32s(is_pixel, simd.sub_f32s(last, shift));
                if CHECKED {
                    d = valid_or_zero(simd, d, infinity);
                }
                sum = simd.add_f32s(sum, d);
                shifted[whole] = d;
            }
            let at = y * tile.pixels..(y + 1) * tile.pixels;
            let phases = [&mut first[at.clone()], &mut second[at.clone()], &mut third[at]];
            simd.vectorize(Part { row, phases });
        }
        for phase in [first, second, third] {
            phase[end * tile.pixels..self.rows[1].max(end) * tile.pixels].fill(0.0);
        }
        simd.reduce_sum_f32s(sum)
    }
}

/// Approximate mean of `height` × `width` pixels from evenly spaced samples; a rough value suffices.
#[inline(always)]
pub(in crate::correlate) fn rough_mean(pixels: &[f32], pitch: usize, [height, width]: [usize; 2]) -> f32 {
    let (mut sum, mut count) = (0.0, 0.0);
    for v in 0..SAMPLES {
        for u in 0..SAMPLES {
            let (row, column) = (v * (height - 1) / (SAMPLES - 1), u * (width - 1) / (SAMPLES - 1));
            let value = pixels[row * pitch + column];
            if value.is_finite() {
                sum += value;
                count += 1.0;
            }
        }
    }
    if count > 0.0 { sum / count } else { 0.0 }
}

#[inline(always)]
fn valid_or_zero<S: Simd>(simd: S, value: S::f32s, infinity: S::f32s) -> S::f32s {
    simd.select_f32s(simd.less_than_f32s(simd.abs_f32s(value), infinity), value, simd.splat_f32s(0.0))
}
