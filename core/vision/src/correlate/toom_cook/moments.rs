//! Sum and sum of squares of every window of a tile: the denominators of K-Eq 11.
//!
//! ```text
//! down:    D(x, y) = Σ_{v<n} q(x, y + v)          across:   W(x, y) = Σ_{u<n} D(x + u, y)          q: d or d²
//! ```
//! Down, as van Herk (1992): rows are taken in groups of n; a window is the end of one group, summed upwards once for
//! all windows, and the beginning of the next, summed downwards: three additions per value for any n.
//!
//! Across, by triples of columns as in the phases of a `tile`: with n = 3 t + r the three windows that begin at columns
//! 3 X, 3 X + 1 and 3 X + 2 share the columns from 3 (X + 1) to 3 (X + t) − 1, which are t − 1 triples; each has at most
//! seven more columns, before and after.
//!
//! No sum contains a value from outside its window, so that a bright stone nearby does not reduce the precision of a
//! dark window: the relative error of each is about 1e-7 in `f32`.

use pulp::{Simd, WithSimd};

use super::buffer::Buffer;
use super::lanes::{WIDEST, row_of, row_of_mut};
use super::tile::{PHASES, TILE_COLUMNS, Tile};

/// Vectors that are summed side by side, so that no addition waits for the previous one.
const STRIP: usize = 4;

/// Sums over the windows of a tile: of q = d first, then of q = d².
pub(in crate::correlate) struct Moments {
    /// Side of a window, odd and at least 3.
    size: usize,
    /// Sums of d and d² from a row of the current group to its end, for a strip.
    ends: Buffer,
    /// D of every row, in the phases of the pixels.
    down: [Buffer; 2],
    /// Sums of D over triples of columns.
    triples: [Buffer; 2],
    /// Number of rows of D.
    rows: usize,
    /// W of a row.
    windows: [Buffer; 2],
}

impl Moments {
    /// Allocates buffers for up to `rows` rows of windows of `size` × `size` in tiles up to `largest`.
    pub(in crate::correlate) fn new(size: usize, rows: usize, largest: Tile) -> Self {
        let pair = |numbers: usize| [Buffer::new(numbers), Buffer::new(numbers)];
        Self {
            size,
            ends: Buffer::new(2 * size * STRIP * WIDEST),
            down: pair(rows * largest.row_pixels()),
            triples: pair(rows * largest.pixels),
            rows: 0,
            windows: pair(TILE_COLUMNS),
        }
    }

    /// Sums down the windows of position rows `first` to one before `last`, with `level` subtracted from the pixels
    /// `input`: D, and its triples.
    #[inline(always)]
    pub(in crate::correlate) fn down<S: Simd>(
        &mut self,
        simd: S,
        tile: Tile,
        input: &[f32],
        [first, last]: [usize; 2],
        level: f32,
    ) {
        let (vectors, rows) = (tile.pixels / S::F32_LANES, last - first);
        self.rows = rows;
        for phase in 0..PHASES {
            let plane = &input[phase * tile.plane()..][..tile.plane()];
            let (input, mut x) = (&plane[first * tile.pixels..], 0);
            while x < vectors {
                let to = phase * rows * vectors + x;
                let width = STRIP.min(vectors - x);
                match width {
                    1 => simd.vectorize(Down::<1> { moments: self, vectors, input, level, x, to, rows }),
                    2 => simd.vectorize(Down::<2> { moments: self, vectors, input, level, x, to, rows }),
                    3 => simd.vectorize(Down::<3> { moments: self, vectors, input, level, x, to, rows }),
                    _ => simd.vectorize(Down::<STRIP> { moments: self, vectors, input, level, x, to, rows }),
                }
                x += width;
            }
        }
        for (down, triples) in self.down.iter().zip(&mut self.triples) {
            simd.vectorize(Triples { down, triples: &mut triples[..rows * tile.pixels] });
        }
    }

    /// Approximate mean square of the summed pixels: every row of them counts once or twice.
    #[inline(always)]
    pub(in crate::correlate) fn mean_square<S: Simd>(&self, simd: S, tile: Tile) -> f32 {
        let (mut sum, mut rows, mut row) = (simd.splat_f32s(0.0), 0, 0);
        loop {
            for phase in 0..PHASES {
                let from = (phase * self.rows + row) * tile.pixels;
                for squares in row_of::<S>(&self.down[1], from, tile.columns / S::F32_LANES) {
                    sum = simd.add_f32s(sum, *squares);
                }
            }
            rows += self.size;
            if row + 1 == self.rows {
                break;
            }
            row = (row + self.size).min(self.rows - 1);
        }
        simd.reduce_sum_f32s(sum) / (rows * tile.row_columns()) as f32
    }

    /// Returns Σ d and Σ d² of the windows of row `row`, counted from the first row summed down.
    #[inline(always)]
    pub(in crate::correlate) fn across<S: Simd>(
        &mut self,
        simd: S,
        tile: Tile,
        row: usize,
    ) -> [&[S::f32s]; 2] {
        for ((down, triples), windows) in self.down.iter().zip(&self.triples).zip(&mut self.windows) {
            let (plane, times) = (self.rows * tile.pixels, self.size / PHASES);
            let (down, triples) = (&down[row * tile.pixels..], &triples[row * tile.pixels..]);
            match self.size % PHASES {
                0 => simd.vectorize(Across::<0> { times, tile, plane, down, triples, windows }),
                1 => simd.vectorize(Across::<1> { times, tile, plane, down, triples, windows }),
                _ => simd.vectorize(Across::<2> { times, tile, plane, down, triples, windows }),
            }
        }
        let vectors = tile.row_columns() / S::F32_LANES;
        let [sums, squares] = &self.windows;
        [row_of::<S>(sums, 0, vectors), row_of::<S>(squares, 0, vectors)]
    }
}

/// D of a strip of `X` vectors of a phase.
struct Down<'a, const X: usize> {
    moments: &'a mut Moments,
    /// Vectors per row of the phase.
    vectors: usize,
    /// The phase's pixels, and the value subtracted from them.
    input: &'a [f32],
    level: f32,
    /// Index of the strip's first vector in a row of pixels, and in D.
    x: usize,
    to: usize,
    rows: usize,
}

impl<const X: usize> WithSimd for Down<'_, X> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { vectors, x, mut to, .. } = self;
        let Moments { size, ends, down: [down, down_squares], .. } = self.moments;
        let (size, level) = (*size, simd.splat_f32s(self.level));
        let (input, ends) = (S::as_simd_f32s(self.input).0, S::as_mut_simd_f32s(ends).0);
        let (down, down_squares) = (S::as_mut_simd_f32s(down).0, S::as_mut_simd_f32s(down_squares).0);
        for top in (0..self.rows).step_by(size) {
            let wanted = size.min(self.rows - top);
            let (mut sum, mut square) = ([simd.splat_f32s(0.0); X], [simd.splat_f32s(0.0); X]);
            for row in (0..size).rev() {
                let d = &input[(top + row) * vectors + x..][..X];
                for i in 0..X {
                    let d = simd.sub_f32s(d[i], level);
                    sum[i] = simd.add_f32s(sum[i], d);
                    square[i] = simd.mul_add_e_f32s(d, d, square[i]);
                }
                if row < wanted {
                    let ends = &mut ends[2 * X * row..][..2 * X];
                    for i in 0..X {
                        (ends[i], ends[X + i]) = (sum[i], square[i]);
                    }
                }
            }
            (sum, square) = ([simd.splat_f32s(0.0); X], [simd.splat_f32s(0.0); X]);
            let mut from = (top + size) * vectors + x;
            for ends in ends[..2 * X * wanted].chunks_exact(2 * X) {
                let (down, down_squares) = (&mut down[to..to + X], &mut down_squares[to..to + X]);
                // The row below the current window is part of the next one.
                let d = &input[from..from + X];
                for i in 0..X {
                    let d = simd.sub_f32s(d[i], level);
                    down[i] = simd.add_f32s(ends[i], sum[i]);
                    down_squares[i] = simd.add_f32s(ends[X + i], square[i]);
                    sum[i] = simd.add_f32s(sum[i], d);
                    square[i] = simd.mul_add_e_f32s(d, d, square[i]);
                }
                from += vectors;
                to += vectors;
            }
        }
    }
}

/// Sums of triples of columns, in all rows.
struct Triples<'a> {
    /// D, in phases.
    down: &'a [f32],
    triples: &'a mut [f32],
}

impl WithSimd for Triples<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let (plane, vectors) = (self.triples.len(), self.triples.len() / S::F32_LANES);
        let (c0, c1) = (row_of::<S>(self.down, 0, vectors), row_of::<S>(self.down, plane, vectors));
        let (c2, out) =
            (row_of::<S>(self.down, 2 * plane, vectors), row_of_mut::<S>(self.triples, 0, vectors));
        for x in 0..vectors {
            out[x] = simd.add_f32s(c0[x], simd.add_f32s(c1[x], c2[x]));
        }
    }
}

/// Sums of windows of 3 t + `R` columns of a row.
struct Across<'a, const R: usize> {
    /// The number of triples, t.
    times: usize,
    tile: Tile,
    /// Length of a phase of D.
    plane: usize,
    /// D and its triples, starting at the row.
    down: &'a [f32],
    triples: &'a [f32],
    windows: &'a mut [f32],
}

impl<const R: usize> WithSimd for Across<'_, R> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        let (vectors, mut x) = (self.tile.columns / S::F32_LANES, 0);
        while x < vectors {
            let from = x * S::F32_LANES;
            let width = (vectors - x).min(3);
            match width {
                1 => self.strip::<S, 1>(simd, from),
                2 => self.strip::<S, 2>(simd, from),
                _ => self.strip::<S, 3>(simd, from),
            }
            x += width;
        }
    }
}

impl<const R: usize> Across<'_, R> {
    /// Computes W of `X` vectors of each phase, starting at the phase's column `x`.
    #[inline(always)]
    fn strip<S: Simd, const X: usize>(&mut self, simd: S, x: usize) {
        let Self { times, plane, tile: Tile { columns, .. }, .. } = *self;
        let triples = &self.triples[x..];
        let mut shared = [simd.splat_f32s(0.0); X];
        for t in 1..times {
            let triples = row_of::<S>(triples, t, X);
            for i in 0..X {
                shared[i] = simd.add_f32s(shared[i], triples[i]);
            }
        }
        let row = &self.down[x..];
        let (c0, c1, c2) =
            (row_of::<S>(row, 0, X), row_of::<S>(row, plane, X), row_of::<S>(row, 2 * plane, X));
        let (e0, e1) = (row_of::<S>(row, times, X), row_of::<S>(row, plane + times, X));
        // Columns that no window needs may be past the end.
        let e2 = if R > 0 { row_of::<S>(row, 2 * plane + times, X) } else { c2 };
        let e3 = if R > 1 { row_of::<S>(row, times + 1, X) } else { c0 };
        let (w0, others) = self.windows[x..].split_at_mut(columns);
        let (w1, w2) = others.split_at_mut(columns);
        let (w0, w1, w2) = (row_of_mut::<S>(w0, 0, X), row_of_mut::<S>(w1, 0, X), row_of_mut::<S>(w2, 0, X));
        for i in 0..X {
            let two_before = simd.add_f32s(c1[i], c2[i]);
            let three_before = simd.add_f32s(c0[i], two_before);
            let two_behind = simd.add_f32s(e0[i], e1[i]);
            let three_behind = simd.add_f32s(two_behind, e2[i]);
            let ends = match R {
                0 => [three_before, simd.add_f32s(two_before, e0[i]), simd.add_f32s(c2[i], two_behind)],
                1 => [
                    simd.add_f32s(three_before, e0[i]),
                    simd.add_f32s(two_before, two_behind),
                    simd.add_f32s(c2[i], three_behind),
                ],
                _ => [
                    simd.add_f32s(three_before, two_behind),
                    simd.add_f32s(two_before, three_behind),
                    simd.add_f32s(c2[i], simd.add_f32s(three_behind, e3[i])),
                ],
            };
            w0[i] = simd.add_f32s(shared[i], ends[0]);
            w1[i] = simd.add_f32s(shared[i], ends[1]);
            w2[i] = simd.add_f32s(shared[i], ends[2]);
        }
    }
}
