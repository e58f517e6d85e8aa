//! Sum and sum of squares of every window of a tile, for the denominators of K-Eq 11.
//!
//! ```text
//! down:    D(x, y) = Σ_{v<n} q(x, y + v)          across:   W(x, y) = Σ_{u<n} D(x + u, y)          q: d or d²
//! ```
//! Down, after van Herk (1992): rows are taken in groups of n; a window is the end of one group, summed upwards once
//! for all, and the beginning of the next, summed downwards: three additions a number whatever n is. Across, from sums
//! of four neighbours: n/4 of them, and what is left of n one by one.
//!
//! No sum holds a number from outside its window, so that a bright stone nearby costs a dark window no digits: each
//! is good to about 1e-7 of itself in `f32`.

use pulp::{Simd, WithSimd};

use super::lanes::{row_of, row_of_mut};

/// Neighbours that are summed first.
const QUAD: usize = 4;

/// Rows that are summed across at once: few enough to stay in the nearest cache.
pub(super) const GROUP: usize = 4;

/// Columns of vectors that are summed down side by side, so that no addition waits for the one before.
const STRIP: usize = 3;

/// Numbers of the widest vector.
const WIDEST: usize = 16;

/// The windows of a tile: q = d first, then q = d².
pub(super) struct Moments {
    /// Side of a window.
    size: usize,
    /// Numbers from one row of pixels, and of all sums, to the next: whole vectors.
    stride: usize,
    /// Sums of d and d² from a row of the group at hand to its end, for a strip.
    ends: Vec<f32>,
    /// D of every row.
    down: [Vec<f32>; 2],
    /// Sums of four neighbours of D.
    quads: Vec<f32>,
    /// W of the rows summed last.
    windows: [Vec<f32>; 2],
}

impl Moments {
    /// Buffers for tiles of up to `rows` rows of windows of `size` × `size`, over pixels with rows of `stride`.
    pub(super) fn new(size: usize, rows: usize, stride: usize) -> Self {
        // Sums across run on over the end of a row into the next; the last row has more to run into.
        let rest = (size + 2 * QUAD).next_multiple_of(WIDEST);
        Self {
            size,
            stride,
            ends: vec![0.0; 2 * size * STRIP * WIDEST],
            down: [vec![0.0; rows * stride + rest], vec![0.0; rows * stride + rest]],
            quads: vec![0.0; GROUP * stride + rest],
            windows: [vec![0.0; GROUP * stride], vec![0.0; GROUP * stride]],
        }
    }

    /// Sums down: D of `rows` rows of positions, whose pixels are `input`.
    #[inline(always)]
    pub(super) fn down<S: Simd>(&mut self, simd: S, input: &[f32], rows: usize) {
        simd.vectorize(Down { moments: self, input, rows });
    }

    /// Sums across: W of up to `GROUP` rows from `top` on.
    #[inline(always)]
    pub(super) fn across<S: Simd>(&mut self, simd: S, top: usize, rows: usize) {
        let (size, count) = (self.size, rows * self.stride);
        for (down, windows) in self.down.iter().zip(&mut self.windows) {
            let (down, windows) = (&down[top * self.stride..], &mut windows[..count]);
            simd.vectorize(Across { size, down, quads: &mut self.quads, windows });
        }
    }

    /// Σ d and Σ d² of the windows of the `row`th of the rows summed last, `vectors` of them.
    #[inline(always)]
    pub(super) fn row<S: Simd>(&self, row: usize, vectors: usize) -> [&[S::f32s]; 2] {
        let [sums, squares] = &self.windows;
        [row_of::<S>(sums, row * self.stride, vectors), row_of::<S>(squares, row * self.stride, vectors)]
    }
}

struct Down<'a> {
    moments: &'a mut Moments,
    input: &'a [f32],
    rows: usize,
}

impl WithSimd for Down<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        let vectors = self.moments.stride / S::F32_LANES;
        let mut x = 0;
        while x < vectors {
            if x + STRIP <= vectors {
                self.strip::<S, STRIP>(simd, x);
                x += STRIP;
            } else {
                self.strip::<S, 1>(simd, x);
                x += 1;
            }
        }
    }
}

impl Down<'_> {
    /// D of `X` columns of vectors from `x` on.
    #[inline(always)]
    fn strip<S: Simd, const X: usize>(&mut self, simd: S, x: usize) {
        let Moments { size, stride, ends, down: [down, down_squares], .. } = &mut *self.moments;
        let (size, vectors) = (*size, *stride / S::F32_LANES);
        let (input, ends) = (S::as_simd_f32s(self.input).0, S::as_mut_simd_f32s(ends).0);
        let (down, down_squares) = (S::as_mut_simd_f32s(down).0, S::as_mut_simd_f32s(down_squares).0);
        for top in (0..self.rows).step_by(size) {
            let (mut sum, mut square) = ([simd.splat_f32s(0.0); X], [simd.splat_f32s(0.0); X]);
            let mut from = (top + size) * vectors + x;
            for ends in ends[..2 * X * size].chunks_exact_mut(2 * X).rev() {
                from -= vectors;
                let d = &input[from..from + X];
                for i in 0..X {
                    sum[i] = simd.add_f32s(sum[i], d[i]);
                    square[i] = simd.mul_add_e_f32s(d[i], d[i], square[i]);
                    (ends[i], ends[X + i]) = (sum[i], square[i]);
                }
            }
            (sum, square) = ([simd.splat_f32s(0.0); X], [simd.splat_f32s(0.0); X]);
            let (mut from, mut to) = ((top + size) * vectors + x, top * vectors + x);
            for ends in ends[..2 * X * size.min(self.rows - top)].chunks_exact(2 * X) {
                let (down, down_squares) = (&mut down[to..to + X], &mut down_squares[to..to + X]);
                // The row below the window at hand begins the next one.
                let d = &input[from..from + X];
                for i in 0..X {
                    down[i] = simd.add_f32s(ends[i], sum[i]);
                    down_squares[i] = simd.add_f32s(ends[X + i], square[i]);
                    sum[i] = simd.add_f32s(sum[i], d[i]);
                    square[i] = simd.mul_add_e_f32s(d[i], d[i], square[i]);
                }
                from += vectors;
                to += vectors;
            }
        }
    }
}

/// Sums of neighbours in one run over all rows: what a sum takes from the next row belongs to no window.
struct Across<'a> {
    size: usize,
    /// D.
    down: &'a [f32],
    quads: &'a mut [f32],
    windows: &'a mut [f32],
}

impl WithSimd for Across<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { size, down, quads, windows } = self;
        let vectors = windows.len() / S::F32_LANES;
        let windows = row_of_mut::<S>(windows, 0, vectors);
        gather::<S, QUAD>(simd, down, [0, 1], row_of_mut::<S>(quads, 0, vectors), false);
        let (whole, rest) = (size / QUAD, size % QUAD);
        let mut part = 0;
        while part < whole {
            let start = [part * QUAD, QUAD];
            part += match whole - part {
                1 => gather::<S, 1>(simd, quads, start, windows, part > 0),
                2 => gather::<S, 2>(simd, quads, start, windows, part > 0),
                3 => gather::<S, 3>(simd, quads, start, windows, part > 0),
                4 => gather::<S, 4>(simd, quads, start, windows, part > 0),
                _ => gather::<S, 5>(simd, quads, start, windows, part > 0),
            };
        }
        let start = [whole * QUAD, 1];
        match rest {
            1 => gather::<S, 1>(simd, down, start, windows, whole > 0),
            2 => gather::<S, 2>(simd, down, start, windows, whole > 0),
            3 => gather::<S, 3>(simd, down, start, windows, whole > 0),
            _ => 0,
        };
    }
}

/// Sums `N` numbers that stand `step` apart, the first `offset` from its place; adds them to `out`, or replaces it.
/// Gives `N`.
#[inline(always)]
fn gather<S: Simd, const N: usize>(
    simd: S,
    from: &[f32],
    [offset, step]: [usize; 2],
    out: &mut [S::f32s],
    adds: bool,
) -> usize {
    let count = out.len();
    let mut parts = [row_of::<S>(from, offset, count); N];
    for (n, part) in parts.iter_mut().enumerate() {
        *part = row_of::<S>(from, offset + n * step, count);
    }
    for x in 0..count {
        let mut sum = if adds { out[x] } else { simd.splat_f32s(0.0) };
        for part in &parts {
            sum = simd.add_f32s(sum, part[x]);
        }
        out[x] = sum;
    }
    N
}
