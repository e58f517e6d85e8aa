//! A block of one product: a few rows of vectors that stay in registers during the pass of the filter.

use pulp::{Simd, WithSimd};

use super::lanes::for_each;
use super::points::{MAX_SIDE, PRODUCTS};

/// One block to sum: `A` rows of `V` vectors.
pub(super) struct Block<'a, const A: usize, const V: usize> {
    /// The filter, all chunks: `[chunk][column][row]`.
    pub(super) filter: &'a [[f32; MAX_SIDE + 1]],
    /// Columns of the filter.
    pub(super) taps: usize,
    /// T, starting at the block's first row and column.
    pub(super) plane: &'a [f32],
    /// Length of a row of T.
    pub(super) stride: usize,
    /// The products of all places, starting at the block's first.
    pub(super) out: &'a mut [f32],
    /// Index of the product, and places per row.
    pub(super) from: [usize; 2],
}

impl<const A: usize, const V: usize> WithSimd for Block<'_, A, V> {
    type Output = ();

    /// Processes two rows of T at a time, A apart: the upper one contributes to the rows of sums down to its own, the
    /// lower one to the others.
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let span = V * S::F32_LANES;
        let mut sums = [[simd.splat_f32s(0.0); V]; A];
        for (chunk, filter) in self.filter.chunks_exact(self.taps).enumerate() {
            let plane = &self.plane[chunk * A * self.stride..];
            let length = filter.len() - 1 + span;
            for_each!(ROW in [0 1 2 3 4 5 6] {
                if ROW < A {
                    let upper = &plane[ROW * self.stride..][..length];
                    let lower = if ROW + 1 < A { &plane[(ROW + A) * self.stride..][..length] } else { upper };
                    for column in 0..filter.len() {
                        let (upper, lower) = (&upper[column..column + span], &lower[column..column + span]);
                        let (upper, lower) = (S::as_simd_f32s(upper).0, S::as_simd_f32s(lower).0);
                        for_each!(N in [0 1 2 3 4 5 6] {
                            if N < A {
                                let pixels = if ROW + 1 > N { upper } else { lower };
                                let weight = simd.splat_f32s(filter[column][(ROW + A - N) % A]);
                                for_each!(X in [0 1 2] {
                                    if X < V {
                                        sums[N][X] = simd.mul_add_e_f32s(weight, pixels[X], sums[N][X]);
                                    }
                                });
                            }
                        });
                    }
                }
            });
        }
        let [product, places] = self.from;
        let (out, _) = S::as_mut_simd_f32s(self.out).0.as_chunks_mut::<PRODUCTS>();
        for_each!(N in [0 1 2 3 4 5 6] {
            if N < A {
                let out = &mut out[N * places..][..V];
                for_each!(X in [0 1 2] {
                    if X < V {
                        out[X][product] = sums[N][X];
                    }
                });
            }
        });
    }
}
