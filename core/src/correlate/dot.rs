//! The numerators of K-Eq 11 for a few rows of positions: `Σ t(u, v) · j(x + u, y + v)`, as the formula stands.
//!
//! What is left over where a group of rows of `toom_cook` would be mostly empty. Every position has one accumulator; a
//! loaded piece of the image serves the three phases.

use pulp::{Simd, WithSimd};

use super::lanes::{for_each, widest};
use super::tile::{PHASES, Tile};

/// Rows of positions to sum.
pub(super) struct Rows<'a> {
    /// A square template, row-major.
    pub(super) template: &'a [f32],
    /// Its side.
    pub(super) size: usize,
    pub(super) tile: Tile,
    /// Pixels of the tile, in phases, and what they are taken less.
    pub(super) input: &'a [f32],
    pub(super) level: f32,
    /// First row of positions, and one beyond the last.
    pub(super) rows: [usize; 2],
    /// Takes the sums, in phases.
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
        let level = simd.splat_f32s(self.level);
        let mut sums = [[simd.splat_f32s(0.0); V]; PHASES];
        for (row, weights) in self.template.chunks_exact(self.size).enumerate() {
            let row = &self.input[(y + row) * pixels + x..];
            // Column `from` of the pixels, counted from the window of phase 0, is a column less for each phase on.
            for from in 0..weights.len() + PHASES - 1 {
                let place = from % PHASES * plane + from / PHASES;
                let (pixels, mut shifted) = (S::as_simd_f32s(&row[place..place + span]).0, [level; V]);
                for_each!(X in [0 1 2] {
                    if X < V {
                        shifted[X] = simd.sub_f32s(pixels[X], level);
                    }
                });
                for_each!(PHASE in [0 1 2] {
                    if let Some(weight) = weights.get(from.wrapping_sub(PHASE)) {
                        let weight = simd.splat_f32s(*weight);
                        for_each!(X in [0 1 2] {
                            if X < V {
                                sums[PHASE][X] = simd.mul_add_e_f32s(weight, shifted[X], sums[PHASE][X]);
                            }
                        });
                    }
                });
            }
        }
        let out = &mut self.output[(y - self.rows[0]) * self.tile.row_columns()..];
        for_each!(PHASE in [0 1 2] {
            let out = &mut out[PHASE * columns + x..][..span];
            S::as_mut_simd_f32s(out).0.copy_from_slice(&sums[PHASE]);
        });
    }
}
