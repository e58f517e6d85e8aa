//! The numerators of K-Eq 11 for a tile of positions: `Σ t(u, v) · j(x + u, y + v)`, in `f32` SIMD registers.
//!
//! A block of `ROWS` × `V` vectors of neighbouring positions is summed at once, so that each loaded piece of
//! the image serves `ROWS` rows and each template value serves `V` vectors. The template is stored in the order
//! in which the block reads it: for every image row and template column the `ROWS` values that the block's
//! rows need, zero where a row's window has not begun or has ended. That costs (n + ROWS − 1)/n of the needed
//! multiply-adds and leaves an inner loop without a branch.
//!
//! Every position has one accumulator, summed in a fixed order: the result does not depend on the block.

use pulp::{Simd, WithSimd};

/// Rows of positions that one block sums.
pub(super) const ROWS: usize = 4;

/// Columns of positions of a tile: four of the widest vectors.
pub(super) const TILE_COLUMNS: usize = 64;

/// Rows of positions of a tile; with a template of 21 rows its input fills a third of a 48 KB cache.
pub(super) const TILE_ROWS: usize = 24;

/// A template in the order in which a block reads it.
pub(super) struct Weights {
    size: usize,
    /// `[image row][template column][row of the block]`.
    values: Vec<[f32; ROWS]>,
}

impl Weights {
    /// The weights of a square template of `size` rows, row-major.
    pub(super) fn new(template: &[f32], size: usize) -> Self {
        let value = |row: usize, column: usize, block_row: usize| {
            let inside = row.checked_sub(block_row).filter(|r| *r < size);
            inside.map_or(0.0, |r| template[r * size + column])
        };
        let values = (0..size + ROWS - 1)
            .flat_map(|row| (0..size).map(move |column| std::array::from_fn(|r| value(row, column, r))))
            .collect();
        Self { size, values }
    }

    /// Columns that a tile's input must have.
    pub(super) fn input_columns(&self) -> usize {
        (TILE_COLUMNS + self.size - 1).next_multiple_of(16)
    }

    /// Rows that a tile's input must have.
    pub(super) fn input_rows(&self) -> usize {
        TILE_ROWS + self.size - 1
    }
}

/// One tile to sum.
pub(super) struct Tile<'a> {
    /// The template.
    pub(super) weights: &'a Weights,
    /// Pixels, `input_rows` × `input_columns`.
    pub(super) input: &'a [f32],
    /// Columns of positions wanted, at most `TILE_COLUMNS`.
    pub(super) columns: usize,
    /// Rows of positions wanted, at most `TILE_ROWS`.
    pub(super) rows: usize,
    /// The sums, rows of `stride`, which holds whole tiles; those beyond what is wanted are arbitrary.
    pub(super) output: &'a mut [f32],
    /// Numbers from one row of sums to the next.
    pub(super) stride: usize,
}

impl WithSimd for Tile<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        for y in (0..self.rows).step_by(ROWS) {
            let mut x = 0;
            while x < self.columns {
                let vectors = (self.columns - x).div_ceil(S::F32_LANES).min(widest::<S>());
                match vectors {
                    1 => self.block::<S, 1>(simd, x, y),
                    2 => self.block::<S, 2>(simd, x, y),
                    3 => self.block::<S, 3>(simd, x, y),
                    _ => self.block::<S, 4>(simd, x, y),
                }
                x += vectors * S::F32_LANES;
            }
        }
    }
}

/// Vectors per row of a block: as many as the registers hold beside the operands.
#[inline(always)]
const fn widest<S: Simd>() -> usize {
    if S::REGISTER_COUNT >= 32 { 4 } else { 2 }
}

impl Tile<'_> {
    #[inline(always)]
    fn block<S: Simd, const V: usize>(&mut self, simd: S, x: usize, y: usize) {
        let (size, stride, span) = (self.weights.size, self.weights.input_columns(), V * S::F32_LANES);
        let mut sums = [[simd.splat_f32s(0.0); V]; ROWS];
        for (row, weights) in self.weights.values.chunks_exact(size).enumerate() {
            let pixels = &self.input[(y + row) * stride + x..][..size - 1 + span];
            for (weights, pixels) in weights.iter().zip(pixels.windows(span)) {
                let Some(pixels) = S::as_simd_f32s(pixels).0.first_chunk::<V>() else { return };
                for r in 0..ROWS {
                    let weight = simd.splat_f32s(weights[r]);
                    for v in 0..V {
                        sums[r][v] = simd.mul_add_e_f32s(weight, pixels[v], sums[r][v]);
                    }
                }
            }
        }
        for (r, sums) in sums.into_iter().enumerate() {
            let out = &mut self.output[(y + r) * self.stride + x..][..span];
            S::as_mut_simd_f32s(out).0.copy_from_slice(&sums);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sums a tile of `rows` × `columns` positions and compares each with the definition.
    fn assert_sums<S: Simd>(simd: S, size: usize, rows: usize, columns: usize) {
        let value = |i: usize| ((i * 7919 + size) % 101) as f32 / 101.0 - 0.5;
        let template: Vec<f32> = (0..size * size).map(value).collect();
        let weights = Weights::new(&template, size);
        let stride = weights.input_columns();
        let input: Vec<f32> = (0..stride * weights.input_rows()).map(|i| value(3 * i + 1)).collect();
        let mut output = vec![0.0; TILE_ROWS * TILE_COLUMNS];
        let tile = Tile {
            weights: &weights,
            input: &input,
            columns,
            rows,
            output: &mut output,
            stride: TILE_COLUMNS,
        };
        simd.vectorize(tile);
        for (y, x) in (0..rows).flat_map(|y| (0..columns).map(move |x| (y, x))) {
            let products = template
                .iter()
                .enumerate()
                .map(|(i, t)| f64::from(*t) * f64::from(input[(y + i / size) * stride + x + i % size]));
            let expected: f64 = products.sum();
            let found = f64::from(output[y * TILE_COLUMNS + x]);
            assert!(
                (found - expected).abs() < 1e-4,
                "size {size} at ({x}, {y}): {found} instead of {expected}"
            );
        }
    }

    fn assert_all_sums<S: Simd>(simd: S) {
        for size in [1, 3, 5, 21, 41] {
            for (rows, columns) in [(1, 1), (3, 17), (4, 33), (24, 50), (23, 64)] {
                assert_sums(simd, size, rows, columns);
            }
        }
    }

    #[test]
    fn every_instruction_set_of_this_processor_gives_the_definition() {
        assert_all_sums(pulp::Scalar);
        #[cfg(target_arch = "x86_64")]
        {
            pulp::x86::V3::try_new().into_iter().for_each(assert_all_sums);
            pulp::x86::V4::try_new().into_iter().for_each(assert_all_sums);
        }
    }
}
