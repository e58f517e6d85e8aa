//! The numerators of K-Eq 11, `Σ t(u, v) · j(x + u, y + v)`, with half of the multiplications: Toom–Cook filtering
//! along the rows (Winograd 1980; Lavin and Gray 2016 for the form F(4, 3)).
//!
//! The rows of a template are read as three taps, D rows apart: v = a + D·k, a < D, k < 3. Then four rows of sums that
//! stand D apart as well are products of polynomials, which six values determine:
//! ```text
//! d_k = row a + D·k of the image, k < 6       h_k = row a + D·k of the template, k < 3        α² = 1/2, γ² = 2
//! T0 = d0 − 5/2 d2 + d4       T5 = T0 of the row D below     (the points 0, ±α, ±γ and ∞)
//! T1, T2 = (d4 − 2 d2) ± α (d3 − 2 d1)                       T3, T4 = (d4 − d2/2) ± γ (d3 − d1/2)
//! G0 = h0      G1, G2 = −(h0 ± α h1 + h2/2) / 3/2            G3, G4 = (h0 ± γ h1 + 2 h2) / 6      G5 = h2
//! M_j = Σ_a G_j(a) ∗ T_j(a)                                  ∗: plain correlation along the columns
//! y0 = M0 + (M1 + M2) + (M3 + M4)                            y1 = α (M1 − M2) + γ (M3 − M4)
//! y2 = (M1 + M2)/2 + 2 (M3 + M4)                             y3 = α³ (M1 − M2) + γ³ (M3 − M4) + M5
//! ```
//! A row of T serves D rows of M, so that making T costs little, and D rows of sums times `V` vectors stay in the
//! registers while the template passes: one loaded piece of T serves up to D multiply-adds, one value of G serves V.
//!
//! **Work.** Six multiplications instead of twelve: 6 · D² · n for each column of 4 · D sums, n²/2 a sum where n = 3 D.
//!
//! **Digits.** With these points, mirror images of each other under x → 1/x, the error is that of plain `f32` sums
//! (7.3e-8 against 6.8e-8 of the tile's root mean square, on rendered images; ±1 and ±2 would give 1.0e-7). But it goes
//! with the brightness of the whole tile, not of the window alone: see `zncc`.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | D | `dilation` = `side` · `chunks` | rows |
//! | α, γ | `ALPHA`, `GAMMA` | – |
//! | n | `size`: side of the template | px |

use pulp::{Simd, WithSimd};

use super::lanes::{row_of, row_of_mut};

/// The points at which the polynomials are valued, besides 0 and ∞: ±1/√2 and ±√2.
const ALPHA: f32 = std::f32::consts::FRAC_1_SQRT_2;
const GAMMA: f32 = std::f32::consts::SQRT_2;

/// Products that four rows of sums need.
const PRODUCTS: usize = 6;

/// Rows of M that one block sums, at most.
const MAX_SIDE: usize = 7;

/// Columns of a tile of sums: whole blocks of three of the widest vectors.
pub(super) const TILE_COLUMNS: usize = 144;

/// A template as the six filters G, in the order in which a block reads them.
pub(super) struct Filters {
    /// Columns of the template.
    size: usize,
    /// Rows of M in a block, and rows of G that it takes at once.
    side: usize,
    /// How many times `side` the dilation is.
    chunks: usize,
    /// `[product][chunk][template column][row of the chunk]`.
    values: Vec<f32>,
}

impl Filters {
    /// The filters of a square template of `size` rows, row-major.
    pub(super) fn new(template: &[f32], size: usize) -> Self {
        let chunks = size.div_ceil(3).div_ceil(MAX_SIDE);
        let side = size.div_ceil(3).div_ceil(chunks);
        let row_values = |row: usize, column: usize| -> [f64; PRODUCTS] {
            let [h0, h1, h2] = [0, 1, 2].map(|k| {
                let row = row + k * side * chunks;
                if row < size { f64::from(template[row * size + column]) } else { 0.0 }
            });
            let (alpha, gamma) = (std::f64::consts::FRAC_1_SQRT_2 * h1, std::f64::consts::SQRT_2 * h1);
            let (near, far) = (h0 + 0.5 * h2, h0 + 2.0 * h2);
            [h0, (near + alpha) / -1.5, (near - alpha) / -1.5, (far + gamma) / 6.0, (far - gamma) / 6.0, h2]
        };
        let mut values = vec![0.0; PRODUCTS * side * chunks * size];
        for (row, column) in (0..side * chunks).flat_map(|row| (0..size).map(move |column| (row, column))) {
            let at = (row / side * size + column) * side + row % side;
            for (product, value) in row_values(row, column).into_iter().enumerate() {
                values[product * side * chunks * size + at] = value as f32;
            }
        }
        Self { size, side, chunks, values }
    }

    /// D.
    fn dilation(&self) -> usize {
        self.side * self.chunks
    }

    /// Rows of sums that a tile gives.
    pub(super) fn tile_rows(&self) -> usize {
        4 * self.dilation()
    }

    /// Rows of pixels that a tile needs.
    pub(super) fn input_rows(&self) -> usize {
        7 * self.dilation()
    }

    /// Columns of pixels that a tile needs, whole vectors.
    pub(super) fn input_columns(&self) -> usize {
        (TILE_COLUMNS + self.size - 1).next_multiple_of(16)
    }

    /// Buffers for [`Self::sum`].
    pub(super) fn scratch(&self) -> Scratch {
        Scratch {
            planes: [0; 2].map(|_| vec![0.0; 3 * self.dilation() * self.input_columns()]),
            products: vec![0.0; PRODUCTS * self.dilation() * TILE_COLUMNS],
        }
    }

    /// The sums of a tile.
    ///
    /// `input` holds `input_rows` × `input_columns` pixels, `output` takes `tile_rows` × `TILE_COLUMNS` sums, of which
    /// the first `columns` of each row are wanted.
    #[inline(always)]
    pub(super) fn sum<S: Simd>(
        &self,
        simd: S,
        scratch: &mut Scratch,
        input: &[f32],
        columns: usize,
        output: &mut [f32],
    ) {
        let rows = Rows { simd, stride: self.input_columns(), dilation: self.dilation() };
        let Scratch { planes: [first, second], products } = scratch;
        rows.end_points(input, first);
        self.product(simd, 0, first, columns, products);
        self.product(simd, 5, &first[self.dilation() * rows.stride..], columns, products);
        for (product, squared, point) in [(1, 2.0, ALPHA), (3, 0.5, GAMMA)] {
            rows.mirrored_points(input, squared, point, [first, second]);
            self.product(simd, product, first, columns, products);
            self.product(simd, product + 1, second, columns, products);
        }
        self.join(simd, products, columns, output);
    }

    /// M of one product: all its blocks.
    #[inline(always)]
    fn product<S: Simd>(&self, simd: S, product: usize, plane: &[f32], columns: usize, products: &mut [f32]) {
        match self.side {
            1 => self.blocks::<S, 1>(simd, product, plane, columns, products),
            2 => self.blocks::<S, 2>(simd, product, plane, columns, products),
            3 => self.blocks::<S, 3>(simd, product, plane, columns, products),
            4 => self.blocks::<S, 4>(simd, product, plane, columns, products),
            5 => self.blocks::<S, 5>(simd, product, plane, columns, products),
            6 => self.blocks::<S, 6>(simd, product, plane, columns, products),
            _ => self.blocks::<S, 7>(simd, product, plane, columns, products),
        }
    }

    #[inline(always)]
    fn blocks<S: Simd, const A: usize>(
        &self,
        simd: S,
        product: usize,
        plane: &[f32],
        columns: usize,
        products: &mut [f32],
    ) {
        let per_product = self.values.len() / PRODUCTS;
        let (filter, _) = self.values[product * per_product..][..per_product].as_chunks::<A>();
        let stride = self.input_columns();
        for group in 0..self.chunks {
            let top = group * A;
            let out = &mut products[(product * self.dilation() + top) * TILE_COLUMNS..][..A * TILE_COLUMNS];
            let mut x = 0;
            while x < columns {
                let vectors = (columns - x).div_ceil(S::F32_LANES).min(widest::<S>());
                let (plane, out) = (&plane[top * stride + x..], &mut out[x..]);
                match vectors {
                    1 => simd.vectorize(Block::<A, 1> { filter, size: self.size, plane, stride, out }),
                    2 => simd.vectorize(Block::<A, 2> { filter, size: self.size, plane, stride, out }),
                    _ => simd.vectorize(Block::<A, 3> { filter, size: self.size, plane, stride, out }),
                }
                x += vectors * S::F32_LANES;
            }
        }
    }

    /// The four rows of sums from the six products, for every row of a dilation; `output` has rows of `TILE_COLUMNS`.
    #[inline(always)]
    fn join<S: Simd>(&self, simd: S, products: &[f32], columns: usize, output: &mut [f32]) {
        let (dilation, vectors) = (self.dilation(), columns.div_ceil(S::F32_LANES));
        let (half, two) = (simd.splat_f32s(0.5), simd.splat_f32s(2.0));
        let (alpha, gamma) = (simd.splat_f32s(ALPHA), simd.splat_f32s(GAMMA));
        let (alpha3, gamma3) = (simd.splat_f32s(ALPHA.powi(3)), simd.splat_f32s(GAMMA.powi(3)));
        for row in 0..dilation {
            let start = |product: usize| (product * dilation + row) * TILE_COLUMNS;
            let (m0, m1) =
                (row_of::<S>(products, start(0), vectors), row_of::<S>(products, start(1), vectors));
            let (m2, m3) =
                (row_of::<S>(products, start(2), vectors), row_of::<S>(products, start(3), vectors));
            let (m4, m5) =
                (row_of::<S>(products, start(4), vectors), row_of::<S>(products, start(5), vectors));
            let (y0, rest) = output[row * TILE_COLUMNS..].split_at_mut(dilation * TILE_COLUMNS);
            let (y1, rest) = rest.split_at_mut(dilation * TILE_COLUMNS);
            let (y2, y3) = rest.split_at_mut(dilation * TILE_COLUMNS);
            let (y0, y1) = (row_of_mut::<S>(y0, 0, vectors), row_of_mut::<S>(y1, 0, vectors));
            let (y2, y3) = (row_of_mut::<S>(y2, 0, vectors), row_of_mut::<S>(y3, 0, vectors));
            for x in 0..vectors {
                let (near, near_odd) = (simd.add_f32s(m1[x], m2[x]), simd.sub_f32s(m1[x], m2[x]));
                let (far, far_odd) = (simd.add_f32s(m3[x], m4[x]), simd.sub_f32s(m3[x], m4[x]));
                y0[x] = simd.add_f32s(m0[x], simd.add_f32s(near, far));
                y1[x] = simd.mul_add_e_f32s(alpha, near_odd, simd.mul_f32s(gamma, far_odd));
                y2[x] = simd.mul_add_e_f32s(half, near, simd.mul_f32s(two, far));
                y3[x] = simd.mul_add_e_f32s(alpha3, near_odd, simd.mul_add_e_f32s(gamma3, far_odd, m5[x]));
            }
        }
    }
}

/// Buffers of one tile, used again for the next.
pub(super) struct Scratch {
    /// T of two products at a time.
    planes: [Vec<f32>; 2],
    /// M, rows of `TILE_COLUMNS`.
    products: Vec<f32>,
}

/// Vectors per row of a block: as many as the registers hold beside the operands.
#[inline(always)]
const fn widest<S: Simd>() -> usize {
    if S::REGISTER_COUNT >= 32 { 3 } else { 1 }
}

/// Makes rows of T from rows of pixels.
#[derive(Clone, Copy)]
struct Rows<S> {
    simd: S,
    stride: usize,
    dilation: usize,
}

impl<S: Simd> Rows<S> {
    /// Row `row` + k D of the pixels, `vectors` of them.
    #[inline(always)]
    fn row<'a>(&self, input: &'a [f32], row: usize, k: usize, vectors: usize) -> &'a [S::f32s] {
        row_of::<S>(input, (row + k * self.dilation) * self.stride, vectors)
    }

    /// T0 of 3 D rows, of which the last 2 D are T5 of the first.
    #[inline(always)]
    fn end_points(self, input: &[f32], plane: &mut [f32]) {
        let (simd, vectors) = (self.simd, self.stride / S::F32_LANES);
        let factor = simd.splat_f32s(-2.5);
        for row in 0..3 * self.dilation {
            let out = row_of_mut::<S>(plane, row * self.stride, vectors);
            let (d0, d2) = (self.row(input, row, 0, vectors), self.row(input, row, 2, vectors));
            let d4 = self.row(input, row, 4, vectors);
            for x in 0..vectors {
                out[x] = simd.mul_add_e_f32s(factor, d2[x], simd.add_f32s(d0[x], d4[x]));
            }
        }
    }

    /// T of the points `point` and −`point`: `(d4 − s d2) ± point (d3 − s d1)`, s the square of the other point.
    #[inline(always)]
    fn mirrored_points(self, input: &[f32], squared: f32, point: f32, [plus, minus]: [&mut [f32]; 2]) {
        let (simd, vectors) = (self.simd, self.stride / S::F32_LANES);
        let squared = simd.splat_f32s(-squared);
        let (point, opposite) = (simd.splat_f32s(point), simd.splat_f32s(-point));
        for row in 0..2 * self.dilation {
            let plus = row_of_mut::<S>(plus, row * self.stride, vectors);
            let minus = row_of_mut::<S>(minus, row * self.stride, vectors);
            let (d1, d2) = (self.row(input, row, 1, vectors), self.row(input, row, 2, vectors));
            let (d3, d4) = (self.row(input, row, 3, vectors), self.row(input, row, 4, vectors));
            for x in 0..vectors {
                let even = simd.mul_add_e_f32s(squared, d2[x], d4[x]);
                let odd = simd.mul_add_e_f32s(squared, d1[x], d3[x]);
                plus[x] = simd.mul_add_e_f32s(point, odd, even);
                minus[x] = simd.mul_add_e_f32s(opposite, odd, even);
            }
        }
    }
}

/// Repeats a block for the numbers that follow, each as a constant: what the sums are indexed by must be known
/// before anything else for them to stay in registers.
macro_rules! for_each {
    ($name:ident in [$($number:literal)*] $body:block) => {
        $({ const $name: usize = $number; $body })*
    };
}

/// One block of M to sum: `A` rows of `V` vectors.
struct Block<'a, const A: usize, const V: usize> {
    /// G of all chunks: `[chunk][column][row]`.
    filter: &'a [[f32; A]],
    size: usize,
    /// T from the block's first row and column.
    plane: &'a [f32],
    stride: usize,
    /// M, rows of `TILE_COLUMNS`.
    out: &'a mut [f32],
}

impl<const A: usize, const V: usize> WithSimd for Block<'_, A, V> {
    type Output = ();

    /// Two rows of T at a time, A apart: the upper one serves the rows of M down to its own, the lower one the others.
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let span = V * S::F32_LANES;
        let mut sums = [[simd.splat_f32s(0.0); V]; A];
        for (chunk, filter) in self.filter.chunks_exact(self.size).enumerate() {
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
        for_each!(N in [0 1 2 3 4 5 6] {
            if N < A {
                let out = S::as_mut_simd_f32s(&mut self.out[N * TILE_COLUMNS..][..span]).0;
                for_each!(X in [0 1 2] {
                    if X < V {
                        out[X] = sums[N][X];
                    }
                });
            }
        });
    }
}

#[cfg(test)]
#[path = "toom_cook_tests.rs"]
mod tests;
