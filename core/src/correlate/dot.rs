//! The numerators of K-Eq 11 for a few rows of positions: `Σ t(u, v) · j(x + u, y + v)`, as the formula stands.
//!
//! What is left over where a tile of `toom_cook` would be mostly empty. Every position has one accumulator; each
//! multiply-add reads its piece of the image anew, which nearly always lies across two cache lines, so that half of
//! the processor's multiply-adds is the most that can be had here.

use pulp::Simd;

/// Vectors that are summed side by side.
const VECTORS: usize = 4;

/// Rows of positions to sum, over pixels with `input_stride` columns.
pub(super) struct Rows<'a> {
    /// A square template, row-major.
    pub(super) template: &'a [f32],
    /// Its side.
    pub(super) size: usize,
    /// Pixels, from the first position's window on; rows are whole vectors.
    pub(super) input: &'a [f32],
    /// Numbers from one row of pixels to the next.
    pub(super) input_stride: usize,
}

impl Rows<'_> {
    /// Sums `rows` × `columns` positions into rows of `stride` numbers, which are overwritten up to the next whole vector.
    #[inline(always)]
    pub(super) fn sum<S: Simd>(
        &self,
        simd: S,
        [rows, columns]: [usize; 2],
        output: &mut [f32],
        stride: usize,
    ) {
        for y in 0..rows {
            let mut x = 0;
            while x < columns {
                let vectors = (columns - x).div_ceil(S::F32_LANES).min(VECTORS);
                let out = &mut output[y * stride + x..];
                match vectors {
                    1 => self.block::<S, 1>(simd, [x, y], out),
                    2 => self.block::<S, 2>(simd, [x, y], out),
                    3 => self.block::<S, 3>(simd, [x, y], out),
                    _ => self.block::<S, VECTORS>(simd, [x, y], out),
                }
                x += vectors * S::F32_LANES;
            }
        }
    }

    #[inline(always)]
    fn block<S: Simd, const V: usize>(&self, simd: S, [x, y]: [usize; 2], out: &mut [f32]) {
        let span = V * S::F32_LANES;
        let mut sums = [simd.splat_f32s(0.0); V];
        for (row, weights) in self.template.chunks_exact(self.size).enumerate() {
            let pixels = &self.input[(y + row) * self.input_stride + x..][..self.size - 1 + span];
            for (weight, pixels) in weights.iter().zip(pixels.windows(span)) {
                let weight = simd.splat_f32s(*weight);
                for (sum, pixels) in sums.iter_mut().zip(S::as_simd_f32s(pixels).0) {
                    *sum = simd.mul_add_e_f32s(weight, *pixels, *sum);
                }
            }
        }
        S::as_mut_simd_f32s(&mut out[..span]).0.copy_from_slice(&sums);
    }
}
