//! The numerators of K-Eq 11, `Σ t(u, v) · j(x + u, y + v)`, with 5/18 of the multiplications: Toom–Cook filtering
//! along the rows and along the columns (Winograd 1980; Lavin and Gray 2016 for F(4, 3) and F(3, 3)).
//!
//! **Columns.** Three adjacent columns of sums are products of polynomials, which five values determine:
//! ```text
//! d_k = column 3X + k of the image, k < 5     h_k = column 3X + k of the template, k < 3     (points 0, 1, −1, −2, ∞)
//! U3 = d3 − d1     U1 = U3 + 3 (d1 + d2)      U2 = U3 + (d2 − d1)      U0 = U3 + 2 (d2 − d0)     U4 = 2 U3 + (d4 − d2)
//! H0 = −h0/2       H1 = (h0 + h1 + h2)/6      H2 = (h0 − h1 + h2)/2    H3 = −(h0 − 2 h1 + 4 h2)/6          H4 = h2
//! m0 = P0 + P1 + P2 + P3                      m1 = P1 − P2 − 2 P3      m2 = P1 + P2 + 4 P3 + P4
//! ```
//! **Rows.** The same for four rows of sums, D rows apart, in each U and H; the rows of a template are three taps, also
//! D rows apart, v = a + D·k, a < D, k < 3. Six values determine them:
//! ```text
//! u_k = row a + D·k of U, k < 6               h_k = row a + D·k of H, k < 3                   α² = 1/2, γ² = 2
//! T0 = u0 − 5/2 u2 + u4       T5 = T0, D rows below           (the points 0, ±α, ±γ and ∞)
//! T1, T2 = (u4 − 2 u2) ± α (u3 − 2 u1)                       T3, T4 = (u4 − u2/2) ± γ (u3 − u1/2)
//! G0 = h0      G1, G2 = −(h0 ± α h1 + h2/2) / 3/2            G3, G4 = (h0 ± γ h1 + 2 h2) / 6      G5 = h2
//! y0 = M0 + (M1 + M2) + (M3 + M4)                            y1 = α (M1 − M2) + γ (M3 − M4)
//! y2 = (M1 + M2)/2 + 2 (M3 + M4)                             y3 = α³ (M1 − M2) + γ³ (M3 − M4) + M5
//! ```
//! The remainder is thirty plain correlations Σ_a G(a) ∗ T(a), each of D rows and a third of the columns. D rows of sums
//! times `V` vectors stay in registers during the pass of the template: one loaded vector of T serves up to D
//! multiply-adds, one value of G serves V. One plane of U, and the values computed from it, stay in the L1 cache.
//!
//! **Work.** For 12 · D rows and columns of sums 30 multiplications instead of 108: 5/18 · n² per sum with n = 3 D.
//!
//! **Digits.** The error is that of plain `f32` sums, since each sum has fewer terms (on smooth noise 4.1e-8 of the
//! tile's root mean square, plain sums 4.4e-8). But it is proportional to the brightness of the whole tile, not of the
//! window alone: see `zncc`.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | D | `dilation` = `side` · `chunks` | rows |
//! | α, γ | `points::ALPHA`, `points::GAMMA` | – |
//! | n | `size`: side of the template | px |

mod block;
mod points;
mod rows;
pub(super) mod tile;
mod phases;
pub(super) mod moments;
pub(super) mod load;
pub(super) mod score;
pub(super) mod buffer;
mod lanes;
pub(super) mod exact;

use pulp::{Arch, Simd, WithSimd};

use block::Block;
use buffer::Buffer;
use lanes::{WIDEST, widest};
use points::{COLUMN_POINTS, ColumnValues, Join, Lanes, MAX_SIDE, PRODUCTS, ROW_POINTS, RowValues, Spacing};
use rows::Rows;
use tile::{PHASES, TILE_COLUMNS, Tile};

/// A template as the thirty filters G, in the order in which a block reads them.
pub(super) struct Filters {
    /// Side of the template, px.
    size: usize,
    /// Rows of sums in a block, and rows of G that it processes at once.
    side: usize,
    /// Dilation divided by `side`.
    chunks: usize,
    /// `[product][chunk][column][row of the chunk]`.
    values: Vec<[f32; MAX_SIDE + 1]>,
    /// H for groups with too few rows of sums: `[chunk][column][point][row of the chunk]`.
    rows: Vec<[[f32; MAX_SIDE + 1]; COLUMN_POINTS]>,
}

impl Filters {
    /// The filters of a square template of `size` rows, row-major.
    pub(super) fn new(template: &[f32], size: usize) -> Self {
        let chunks = size.div_ceil(3).div_ceil(MAX_SIDE);
        let side = size.div_ceil(3).div_ceil(chunks);
        let taps = size.div_ceil(PHASES);
        let mut values = vec![[0.0; MAX_SIDE + 1]; PRODUCTS * chunks * taps];
        let mut rows = vec![[[0.0; MAX_SIDE + 1]; COLUMN_POINTS]; 3 * chunks * taps];
        Arch::new().dispatch(Fill { template, size, side, chunks, values: &mut values, rows: &mut rows });
        Self { size, side, chunks, values, rows }
    }

    /// D.
    fn dilation(&self) -> usize {
        self.side * self.chunks
    }

    /// Rows of sums that [`Self::sum`] returns at once.
    pub(super) fn group_rows(&self) -> usize {
        4 * self.dilation()
    }

    /// Rows of pixels required by `groups` groups.
    pub(super) fn pixel_rows(&self, groups: usize) -> usize {
        groups * self.group_rows() + 3 * self.dilation()
    }

    /// Buffers for tiles up to `largest`.
    pub(super) fn scratch(&self, largest: Tile) -> Scratch {
        let rows = |count: usize| Buffer::new(count * self.dilation() * largest.pixels);
        Scratch {
            planes: Buffer::new(COLUMN_POINTS * largest.plane()),
            values: [rows(3), rows(2), rows(2), rows(2), rows(2)],
            products: Buffer::new(PRODUCTS * self.dilation() * largest.columns),
        }
    }

    /// Computes U for rows of a tile, from the first to one past the last, whose pixels are `input`.
    #[inline(always)]
    pub(super) fn begin<S: Simd>(
        &self,
        simd: S,
        scratch: &mut Scratch,
        tile: Tile,
        input: &[f32],
        rows: [usize; 2],
    ) {
        simd.vectorize(ColumnValues { tile, input, rows, planes: &mut scratch.planes });
    }

    /// Computes the sums of `group_rows` rows of positions, starting at row `top` of the tile, with `level` subtracted
    /// from the pixels.
    #[inline(always)]
    pub(super) fn sum<S: Simd>(
        &self,
        simd: S,
        scratch: &mut Scratch,
        tile: Tile,
        (top, level): (usize, f32),
        output: &mut [f32],
    ) {
        let spacing = Spacing { tile, dilation: self.dilation() };
        let Scratch { planes, values, products } = scratch;
        let length = self.pixel_rows(1) * tile.pixels;
        for column_point in 0..COLUMN_POINTS {
            let plane = &planes[column_point * tile.plane() + top * tile.pixels..][..length];
            let level = level * points::OF_ONES[column_point];
            simd.vectorize(RowValues { spacing, plane, level, values });
            for (point, values) in values.iter().enumerate() {
                self.product(simd, [point, column_point], tile, values, products);
            }
            let last = &values[0][self.dilation() * tile.pixels..];
            self.product(simd, [ROW_POINTS - 1, column_point], tile, last, products);
        }
        simd.vectorize(Join { spacing, products, output });
    }

    /// Computes the sums of single rows of positions, from the first to one past the last, with 5/9 of the
    /// multiplications.
    #[inline(always)]
    pub(super) fn sum_rows<S: Simd>(
        &self,
        simd: S,
        scratch: &Scratch,
        tile: Tile,
        (rows, level): ([usize; 2], f32),
        output: &mut [f32],
    ) {
        let Self { size, side, .. } = *self;
        let (filter, planes) = (self.rows.as_slice(), &scratch.planes);
        simd.vectorize(Rows { filter, size, side, tile, planes, level, rows, output });
    }

    /// Computes P of a point of the rows and one of the columns, with values `plane`.
    #[inline(always)]
    fn product<S: Simd>(
        &self,
        simd: S,
        [point, column_point]: [usize; 2],
        tile: Tile,
        plane: &[f32],
        products: &mut [f32],
    ) {
        let product = point * COLUMN_POINTS + column_point;
        match self.side {
            1 => self.blocks::<S, 1>(simd, product, tile, plane, products),
            2 => self.blocks::<S, 2>(simd, product, tile, plane, products),
            3 => self.blocks::<S, 3>(simd, product, tile, plane, products),
            4 => self.blocks::<S, 4>(simd, product, tile, plane, products),
            5 => self.blocks::<S, 5>(simd, product, tile, plane, products),
            6 => self.blocks::<S, 6>(simd, product, tile, plane, products),
            _ => self.blocks::<S, 7>(simd, product, tile, plane, products),
        }
    }

    #[inline(always)]
    fn blocks<S: Simd, const A: usize>(
        &self,
        simd: S,
        product: usize,
        tile: Tile,
        plane: &[f32],
        products: &mut [f32],
    ) {
        let per_product = self.values.len() / PRODUCTS;
        let filter = &self.values[product * per_product..][..per_product];
        let (taps, stride) = (self.size.div_ceil(PHASES), tile.pixels);
        let vectors = tile.columns / S::F32_LANES;
        for chunk in 0..self.chunks {
            let top = chunk * A;
            let mut x = 0;
            while x < vectors {
                let plane = &plane[top * stride + x * S::F32_LANES..];
                let out = &mut products[(top * vectors + x) * PRODUCTS * S::F32_LANES..];
                let (width, from) = (widest::<S>().min(vectors - x), [product, vectors]);
                match width {
                    1 => simd.vectorize(Block::<A, 1> { filter, taps, plane, stride, out, from }),
                    2 => simd.vectorize(Block::<A, 2> { filter, taps, plane, stride, out, from }),
                    _ => simd.vectorize(Block::<A, 3> { filter, taps, plane, stride, out, from }),
                }
                x += width;
            }
        }
    }
}

/// Computes the filters.
struct Fill<'a> {
    template: &'a [f32],
    size: usize,
    side: usize,
    chunks: usize,
    values: &'a mut [[f32; MAX_SIDE + 1]],
    rows: &'a mut [[[f32; MAX_SIDE + 1]; COLUMN_POINTS]],
}

impl WithSimd for Fill<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, _: S) {
        let taps = self.size.div_ceil(PHASES);
        for chunk in 0..self.chunks {
            for tap in 0..taps {
                let (h0, h1) = (self.column_points(chunk, tap), self.column_points(self.chunks + chunk, tap));
                let h2 = self.column_points(2 * self.chunks + chunk, tap);
                for column_point in 0..COLUMN_POINTS {
                    let g = points::of_row_taps([h0[column_point], h1[column_point], h2[column_point]]);
                    for (point, g) in g.iter().enumerate() {
                        let product = point * COLUMN_POINTS + column_point;
                        let to = &mut self.values[(product * self.chunks + chunk) * taps + tap];
                        for (to, g) in to.iter_mut().zip(g) {
                            *to = *g as f32;
                        }
                    }
                }
            }
        }
    }
}

impl Fill<'_> {
    /// H for the three columns of a tap, with the rows of a chunk side by side; also stored in `rows`.
    #[inline(always)]
    fn column_points(&mut self, chunk: usize, tap: usize) -> [Lanes; COLUMN_POINTS] {
        let mut taps = [Lanes::default(); PHASES];
        let top = chunk * self.side;
        let rows = self.side.min(self.size.saturating_sub(top));
        for (phase, taps) in taps.iter_mut().enumerate() {
            let column = PHASES * tap + phase;
            if column < self.size {
                for (i, value) in taps[..rows].iter_mut().enumerate() {
                    *value = f64::from(self.template[(top + i) * self.size + column]);
                }
            }
        }
        let points = points::of_column_taps(taps);
        let to = &mut self.rows[chunk * self.size.div_ceil(PHASES) + tap];
        for (to, values) in to.iter_mut().zip(&points) {
            for (to, value) in to.iter_mut().zip(values) {
                *to = *value as f32;
            }
        }
        points
    }
}

/// Buffers of one tile, reused for the next.
pub(super) struct Scratch {
    /// U at all points of the columns.
    planes: Buffer,
    /// T of one plane, at the points of the rows.
    values: [Buffer; ROW_POINTS - 1],
    /// P: the vectors of all products of one place are adjacent.
    products: Buffer,
}

const _: () = assert!(TILE_COLUMNS.is_multiple_of(PHASES * WIDEST));

#[cfg(test)]
mod tests;
