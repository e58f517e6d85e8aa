//! Single rows of sums, with Toom–Cook along the columns only.
//!
//! Used for the remaining rows of a tile if a group of four dilations would be mostly empty. A place has one accumulator
//! per point of the columns; the whole template passes over it.

use pulp::{Simd, WithSimd};

use super::lanes::{for_each, widest};
use super::points::MAX_SIDE;
use super::points::{COLUMN_POINTS, OF_ONES, join_columns};
use super::tile::{PHASES, Tile};

/// Rows of positions to sum.
pub(super) struct Rows<'a> {
    /// H, `[chunk][column][point][row of the chunk]`.
    pub(super) filter: &'a [[[f32; MAX_SIDE + 1]; COLUMN_POINTS]],
    /// Side of the template, and rows of a chunk.
    pub(super) size: usize,
    pub(super) side: usize,
    pub(super) tile: Tile,
    /// U at all points, and the value subtracted from the pixels.
    pub(super) planes: &'a [f32],
    pub(super) level: f32,
    /// The first row of positions, and one past the last.
    pub(super) rows: [usize; 2],
    /// Receives the sums, in phases.
    pub(super) output: &'a mut [f32],
}

impl WithSimd for Rows<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        let vectors = self.tile.columns / S::F32_LANES;
        for y in self.rows[0]..self.rows[1] {
            let mut x = 0;
            while x < vectors {
                let (at, width) = ([x * S::F32_LANES, y], widest::<S>().min(vectors - x));
                match width {
                    1 => self.block::<S, 1>(simd, at),
                    2 => self.block::<S, 2>(simd, at),
                    _ => self.block::<S, 3>(simd, at),
                }
                x += width;
            }
        }
    }
}

impl Rows<'_> {
    /// Sums `V` vectors of each phase.
    #[inline(always)]
    fn block<S: Simd, const V: usize>(&mut self, simd: S, [x, y]: [usize; 2]) {
        let Tile { columns, pixels, .. } = self.tile;
        let (span, plane) = (V * S::F32_LANES, self.tile.plane());
        let taps = self.size.div_ceil(PHASES);
        let mut sums = [[simd.splat_f32s(0.0); V]; COLUMN_POINTS];
        for row in 0..self.size {
            let (weights, lane) = (&self.filter[row / self.side * taps..][..taps], row % self.side);
            let from = (y + row) * pixels + x;
            for_each!(POINT in [0 1 2 3 4] {
                let level = simd.splat_f32s(self.level * OF_ONES[POINT]);
                let values = &self.planes[POINT * plane + from..][..taps - 1 + span];
                for tap in 0..taps {
                    let values = S::as_simd_f32s(&values[tap..tap + span]).0;
                    let weight = simd.splat_f32s(weights[tap][POINT][lane]);
                    for_each!(X in [0 1 2] {
                        if X < V {
                            let value =
                                if OF_ONES[POINT] == 0.0 { values[X] } else { simd.sub_f32s(values[X], level) };
                            sums[POINT][X] = simd.mul_add_e_f32s(weight, value, sums[POINT][X]);
                        }
                    });
                }
            });
        }
        let out = &mut self.output[(y - self.rows[0]) * self.tile.row_columns()..];
        let out = S::as_mut_simd_f32s(out).0;
        for_each!(X in [0 1 2] {
            if X < V {
                let sums = [sums[0][X], sums[1][X], sums[2][X], sums[3][X], sums[4][X]];
                let joined = join_columns::<S>(simd, sums);
                for_each!(PHASE in [0 1 2] {
                    out[(PHASE * columns + x) / S::F32_LANES + X] = joined[PHASE];
                });
            }
        });
    }
}
