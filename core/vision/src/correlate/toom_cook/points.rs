//! Values of pixels and taps at the points, and the sums from the products; equations in the parent module.

use pulp::{Simd, WithSimd};

use super::buffer::Buffer;
use super::lanes::{row_of, row_of_mut};
use super::tile::{PHASES, Tile};

/// Points of the rows: 0, ±α, ±γ and ∞.
pub(super) const ROW_POINTS: usize = 6;

/// Points of the columns: 0, 1, −1, −2 and ∞.
pub(super) const COLUMN_POINTS: usize = 5;

/// Products of a group of twelve sums: `[point of the rows][point of the columns]`.
pub(super) const PRODUCTS: usize = ROW_POINTS * COLUMN_POINTS;

/// U of a plane of ones at the points of the columns.
pub(super) const OF_ONES: [f32; COLUMN_POINTS] = [0.0, 6.0, 0.0, 0.0, 0.0];

/// Largest number of rows of sums in a block.
pub(super) const MAX_SIDE: usize = 7;

const ALPHA: f32 = std::f32::consts::FRAC_1_SQRT_2;
const GAMMA: f32 = std::f32::consts::SQRT_2;

/// One value per row of a block, and one more for even pairs.
pub(super) type Lanes = [f64; MAX_SIDE + 1];

/// G of three taps, D rows apart.
#[inline(always)]
pub(super) fn of_row_taps([h0, h1, h2]: [Lanes; 3]) -> [Lanes; ROW_POINTS] {
    let mut g = [[0.0; MAX_SIDE + 1]; ROW_POINTS];
    for i in 0..h0.len() {
        let (alpha, gamma) = (std::f64::consts::FRAC_1_SQRT_2 * h1[i], std::f64::consts::SQRT_2 * h1[i]);
        let (near, far) = (h0[i] + 0.5 * h2[i], h0[i] + 2.0 * h2[i]);
        g[0][i] = h0[i];
        g[1][i] = (near + alpha) * (-1.0 / 1.5);
        g[2][i] = (near - alpha) * (-1.0 / 1.5);
        g[3][i] = (far + gamma) * (1.0 / 6.0);
        g[4][i] = (far - gamma) * (1.0 / 6.0);
        g[5][i] = h2[i];
    }
    g
}

/// H of three adjacent taps.
#[inline(always)]
pub(super) fn of_column_taps([h0, h1, h2]: [Lanes; 3]) -> [Lanes; COLUMN_POINTS] {
    let mut h = [[0.0; MAX_SIDE + 1]; COLUMN_POINTS];
    for i in 0..h0.len() {
        h[0][i] = -0.5 * h0[i];
        h[1][i] = (h0[i] + h1[i] + h2[i]) * (1.0 / 6.0);
        h[2][i] = (h0[i] - h1[i] + h2[i]) * 0.5;
        h[3][i] = (h0[i] - 2.0 * h1[i] + 4.0 * h2[i]) * (-1.0 / 6.0);
        h[4][i] = h2[i];
    }
    h
}

/// Layout of rows and columns.
#[derive(Clone, Copy)]
pub(super) struct Spacing {
    pub(super) tile: Tile,
    /// D.
    pub(super) dilation: usize,
}

impl Spacing {
    /// Number of vectors in `dilations` · D rows of a phase.
    #[inline(always)]
    fn vectors<S: Simd>(self, dilations: usize) -> usize {
        dilations * self.dilation * self.tile.pixels / S::F32_LANES
    }

    /// Vectors starting at row `row` · D.
    #[inline(always)]
    fn rows<S: Simd>(self, values: &[f32], row: usize, vectors: usize) -> &[S::f32s] {
        row_of::<S>(values, row * self.dilation * self.tile.pixels, vectors)
    }
}

/// Computes U of some rows of pixels: one plane per point of the columns.
pub(super) struct ColumnValues<'a> {
    pub(super) tile: Tile,
    pub(super) input: &'a [f32],
    /// The first row, and one past the last.
    pub(super) rows: [usize; 2],
    pub(super) planes: &'a mut [f32],
}

impl WithSimd for ColumnValues<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { tile, input, rows, planes } = self;
        let (from, vectors) = (rows[0] * tile.pixels, (rows[1] - rows[0]) * tile.pixels / S::F32_LANES);
        let (u0, planes) = planes.split_at_mut(tile.plane());
        let (u1, planes) = planes.split_at_mut(tile.plane());
        let (u2, planes) = planes.split_at_mut(tile.plane());
        let (u3, u4) = planes.split_at_mut(tile.plane());
        let (u0, u1) = (row_of_mut::<S>(u0, from, vectors), row_of_mut::<S>(u1, from, vectors));
        let (u2, u3) = (row_of_mut::<S>(u2, from, vectors), row_of_mut::<S>(u3, from, vectors));
        let u4 = row_of_mut::<S>(u4, from, vectors);
        let phase = |phase: usize, on: usize| row_of::<S>(input, phase * tile.plane() + from + on, vectors);
        // Three columns to the right is the next value of the same phase. The last one of a row is not part of any sum.
        let (d0, d1, d2, d3, d4) = (phase(0, 0), phase(1, 0), phase(2, 0), phase(0, 1), phase(1, 1));
        let (two, three) = (simd.splat_f32s(2.0), simd.splat_f32s(3.0));
        for x in 0..vectors {
            let shared = simd.sub_f32s(d3[x], d1[x]);
            u0[x] = simd.mul_add_e_f32s(two, simd.sub_f32s(d2[x], d0[x]), shared);
            u1[x] = simd.mul_add_e_f32s(three, simd.add_f32s(d1[x], d2[x]), shared);
            u2[x] = simd.add_f32s(shared, simd.sub_f32s(d2[x], d1[x]));
            u3[x] = shared;
            u4[x] = simd.mul_add_e_f32s(two, shared, simd.sub_f32s(d4[x], d2[x]));
        }
    }
}

/// Computes T of a plane at all points of the rows.
pub(super) struct RowValues<'a> {
    pub(super) spacing: Spacing,
    pub(super) plane: &'a [f32],
    /// Value subtracted from the plane.
    pub(super) level: f32,
    /// T0 of 3 D rows, the last 2 D of which are T5 of the first, then 2 D rows each of T1 to T4.
    pub(super) values: &'a mut [Buffer; ROW_POINTS - 1],
}

impl WithSimd for RowValues<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { spacing, plane, level, values: [ends, t1, t2, t3, t4] } = self;
        let (most, vectors) = (spacing.vectors::<S>(3), spacing.vectors::<S>(2));
        let (u0, u2) = (spacing.rows::<S>(plane, 0, most), spacing.rows::<S>(plane, 2, most));
        let (u4, ends) = (spacing.rows::<S>(plane, 4, most), row_of_mut::<S>(ends, 0, most));
        let (u1, u3) = (spacing.rows::<S>(plane, 1, vectors), spacing.rows::<S>(plane, 3, vectors));
        let (t1, t2) = (row_of_mut::<S>(t1, 0, vectors), row_of_mut::<S>(t2, 0, vectors));
        let (t3, t4) = (row_of_mut::<S>(t3, 0, vectors), row_of_mut::<S>(t4, 0, vectors));
        let (middle, minus_two) = (simd.splat_f32s(-2.5), simd.splat_f32s(-2.0));
        let (minus_half, alpha, gamma) =
            (simd.splat_f32s(-0.5), simd.splat_f32s(ALPHA), simd.splat_f32s(GAMMA));
        let (minus_alpha, minus_gamma) = (simd.splat_f32s(-ALPHA), simd.splat_f32s(-GAMMA));
        let level = simd.splat_f32s(level);
        for x in 0..vectors {
            let (u0, u1) = (simd.sub_f32s(u0[x], level), simd.sub_f32s(u1[x], level));
            let (u2, u3) = (simd.sub_f32s(u2[x], level), simd.sub_f32s(u3[x], level));
            let u4 = simd.sub_f32s(u4[x], level);
            ends[x] = simd.mul_add_e_f32s(middle, u2, simd.add_f32s(u0, u4));
            let even = simd.mul_add_e_f32s(minus_two, u2, u4);
            let odd = simd.mul_add_e_f32s(minus_two, u1, u3);
            t1[x] = simd.mul_add_e_f32s(alpha, odd, even);
            t2[x] = simd.mul_add_e_f32s(minus_alpha, odd, even);
            let even = simd.mul_add_e_f32s(minus_half, u2, u4);
            let odd = simd.mul_add_e_f32s(minus_half, u1, u3);
            t3[x] = simd.mul_add_e_f32s(gamma, odd, even);
            t4[x] = simd.mul_add_e_f32s(minus_gamma, odd, even);
        }
        for x in vectors..most {
            let u2 = simd.sub_f32s(u2[x], level);
            let (u0, u4) = (simd.sub_f32s(u0[x], level), simd.sub_f32s(u4[x], level));
            ends[x] = simd.mul_add_e_f32s(middle, u2, simd.add_f32s(u0, u4));
        }
    }
}

/// Computes four rows of sums in three phases from the products, for every row of a dilation.
pub(super) struct Join<'a> {
    pub(super) spacing: Spacing,
    pub(super) products: &'a [f32],
    pub(super) output: &'a mut [f32],
}

impl WithSimd for Join<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { spacing: Spacing { tile, dilation }, products, output } = self;
        let vectors = tile.columns / S::F32_LANES;
        let (products, _) = S::as_simd_f32s(products).0.as_chunks::<PRODUCTS>();
        let output = S::as_mut_simd_f32s(output).0;
        for row in 0..dilation {
            for (x, p) in products[row * vectors..][..vectors].iter().enumerate() {
                let m = [
                    join_columns::<S>(simd, [p[0], p[1], p[2], p[3], p[4]]),
                    join_columns::<S>(simd, [p[5], p[6], p[7], p[8], p[9]]),
                    join_columns::<S>(simd, [p[10], p[11], p[12], p[13], p[14]]),
                    join_columns::<S>(simd, [p[15], p[16], p[17], p[18], p[19]]),
                    join_columns::<S>(simd, [p[20], p[21], p[22], p[23], p[24]]),
                    join_columns::<S>(simd, [p[25], p[26], p[27], p[28], p[29]]),
                ];
                for phase in 0..PHASES {
                    let m = [m[0][phase], m[1][phase], m[2][phase], m[3][phase], m[4][phase], m[5][phase]];
                    let [y0, y1, y2, y3] = join_rows::<S>(simd, m);
                    let (at, step) = ((row * PHASES + phase) * vectors + x, dilation * PHASES * vectors);
                    (output[at], output[at + step]) = (y0, y1);
                    (output[at + 2 * step], output[at + 3 * step]) = (y2, y3);
                }
            }
        }
    }
}

/// Three columns of sums from their five products.
#[inline(always)]
pub(super) fn join_columns<S: Simd>(
    simd: S,
    [p0, p1, p2, p3, p4]: [S::f32s; COLUMN_POINTS],
) -> [S::f32s; PHASES] {
    let (even, odd) = (simd.add_f32s(p1, p2), simd.sub_f32s(p1, p2));
    let (minus_two, four) = (simd.splat_f32s(-2.0), simd.splat_f32s(4.0));
    [
        simd.add_f32s(simd.add_f32s(p0, p3), even),
        simd.mul_add_e_f32s(minus_two, p3, odd),
        simd.mul_add_e_f32s(four, p3, simd.add_f32s(even, p4)),
    ]
}

/// Four rows of sums from their six products.
#[inline(always)]
fn join_rows<S: Simd>(simd: S, [m0, m1, m2, m3, m4, m5]: [S::f32s; ROW_POINTS]) -> [S::f32s; 4] {
    let (near, near_odd) = (simd.add_f32s(m1, m2), simd.sub_f32s(m1, m2));
    let (far, far_odd) = (simd.add_f32s(m3, m4), simd.sub_f32s(m3, m4));
    let (half, two) = (simd.splat_f32s(0.5), simd.splat_f32s(2.0));
    let (alpha, gamma) = (simd.splat_f32s(ALPHA), simd.splat_f32s(GAMMA));
    let (alpha3, gamma3) = (simd.splat_f32s(ALPHA.powi(3)), simd.splat_f32s(GAMMA.powi(3)));
    [
        simd.add_f32s(m0, simd.add_f32s(near, far)),
        simd.mul_add_e_f32s(alpha, near_odd, simd.mul_f32s(gamma, far_odd)),
        simd.mul_add_e_f32s(half, near, simd.mul_f32s(two, far)),
        simd.mul_add_e_f32s(alpha3, near_odd, simd.mul_add_e_f32s(gamma3, far_odd, m5)),
    ]
}
