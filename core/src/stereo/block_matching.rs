//! Block matching: a disparity is as good as the bits of a square window agree.
//!
//! ```text
//! V(x, d) = Σ_{|v| ≤ r} C(x, y + v; d)        S(x, d) = Σ_{|u| ≤ r} V(x + u, d)
//! ```
//! | symbol | our name | unit |
//! |---|---|---|
//! | C | `census::costs` | bits |
//! | V | `columns` | bits |
//! | S | `sums` | bits, at most 62 · 31² |
//! | r | half of `StereoSettings::window_px` | px |
//!
//! V goes from row to row by one row more and one less, S from pixel to pixel by one column more and one less; the
//! costs of as many rows as the window has are held for that. At the border the window is cut: every disparity of a pixel
//! is summed over the same cells. Departure from JPL's correlator (domain.md 7): bits of a census instead of grey
//! values behind a band pass, since single pixels then count alike, whether they lie on an edge or not.
//!
//! Rows are matched in bands of fixed height, each by itself: what it costs is the window's height once more, and the bits
//! do not depend on the number of threads.

use std::ops::Range;

use pulp::{Arch, Simd, WithSimd};

use super::census;
use super::lanes::{Block, LANES, Row, blocks, blocks_mut};
use super::row::{Pixel, RowResult};
use super::scene::Scene;
use super::winner::{RightWinners, winner};

/// Rows of a band.
pub(super) const BAND: usize = 128;

/// The state of a band.
struct Band {
    /// Of as many rows as the window has; row y lies at y modulo that.
    costs: Vec<Row<u8>>,
    columns: Row<u16>,
    right: RightWinners,
}

/// The results of some rows, given to `take` from top to bottom.
pub(super) fn match_rows<const N: usize>(
    scene: &Scene<'_>,
    rows: Range<usize>,
    mut take: impl FnMut(usize, &RowResult),
) {
    let [width, height] = scene.size;
    let window = scene.settings.window_px as usize;
    let mut band = Band {
        costs: (0..window).map(|_| Row::new(width * scene.cells, 0)).collect(),
        columns: Row::new(width * scene.cells, 0),
        right: RightWinners::new(scene.right.stride),
    };
    let mut result = RowResult::new(width);
    let half = window / 2;
    for next in rows.start.saturating_sub(half)..rows.end + half {
        // The row that comes in takes the place of the one that goes out.
        let comes = (next < height).then_some(next);
        let goes = next >= rows.start.saturating_sub(half) + window;
        Arch::new().dispatch(Columns::<N> { scene, band: &mut band, next, comes, goes });
        if next >= rows.start + half {
            Arch::new().dispatch(Windows::<N> { scene, band: &mut band, result: &mut result });
            take(next - half, &result);
        }
    }
}

/// One row more, and one less.
struct Columns<'a, const N: usize> {
    scene: &'a Scene<'a>,
    band: &'a mut Band,
    next: usize,
    /// The row that comes in, where the image has it.
    comes: Option<usize>,
    /// Whether one goes out.
    goes: bool,
}

impl<const N: usize> WithSimd for Columns<'_, N> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { scene, band: Band { costs, columns, .. }, next, comes, goes } = self;
        let (width, cells, window) = (scene.size[0], N * LANES, costs.len());
        let row = costs[next % window].values_mut().chunks_exact_mut(cells);
        let columns = columns.values_mut().chunks_exact_mut(cells);
        let read = comes.map(|y| {
            (scene.left.row(y).map(|plane| &plane[scene.left.margin..][..width]), scene.right.row(y))
        });
        let kept = if goes { u16::MAX } else { 0 };
        for (x, (cost, column)) in (0..width).zip(row.zip(columns)) {
            let (cost, column): (&mut [Block<u8>; N], &mut [Block<u16>; N]) =
                (blocks_mut(cost, 0), blocks_mut(column, 0));
            for k in 0..N {
                for i in 0..LANES {
                    column[k][i] = column[k][i].wrapping_sub(u16::from(cost[k][i]) & kept);
                }
            }
            let Some((left, right)) = &read else { continue };
            let bits = [
                left[0][x], left[1][x], left[2][x], left[3][x], left[4][x], left[5][x], left[6][x],
                left[7][x],
            ];
            census::costs(
                bits,
                right,
                scene.first.wrapping_sub(x),
                blocks(scene.beyond_costs.values(), 0),
                cost,
            );
            for k in 0..N {
                for i in 0..LANES {
                    column[k][i] = column[k][i].wrapping_add(u16::from(cost[k][i]));
                }
            }
        }
    }
}

/// The windows of a row.
struct Windows<'a, const N: usize> {
    scene: &'a Scene<'a>,
    band: &'a mut Band,
    result: &'a mut RowResult,
}

impl<const N: usize> WithSimd for Windows<'_, N> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { scene, band: Band { columns, right, costs }, result } = self;
        let (width, cells, half) = (scene.size[0], N * LANES, costs.len() / 2);
        let beyond: &[Block<u16>; N] = blocks(scene.beyond.values(), 0);
        let columns = columns.values();
        let pixels = &mut result.pixels[..width];
        right.clear();
        let mut sums = [[0u16; LANES]; N];
        for x in 0..half.min(width) {
            let column: &[Block<u16>; N] = blocks(columns, x * cells);
            for k in 0..N {
                for i in 0..LANES {
                    sums[k][i] = sums[k][i].wrapping_add(column[k][i]);
                }
            }
        }
        for (x, pixel) in pixels.iter_mut().enumerate() {
            // Beyond the border a column is not there: what is read instead does not count.
            let (comes, goes) = (x + half < width, x > half);
            let more: &[Block<u16>; N] = blocks(columns, if comes { x + half } else { x } * cells);
            let less: &[Block<u16>; N] = blocks(columns, if goes { x - half - 1 } else { x } * cells);
            let (comes, goes) = (if comes { u16::MAX } else { 0 }, if goes { u16::MAX } else { 0 });
            let mut asked = [[0u16; LANES]; N];
            for k in 0..N {
                for i in 0..LANES {
                    let sum = sums[k][i].wrapping_add(more[k][i] & comes).wrapping_sub(less[k][i] & goes);
                    sums[k][i] = sum;
                    asked[k][i] = sum | beyond[k][i];
                }
            }
            right.offer(scene.first.wrapping_sub(x), &asked);
            *pixel = Pixel::of(winner(simd, &asked), &asked, scene.count);
        }
        for (x, pixel) in (0..width).zip(pixels) {
            result.right_index[x] = right.index(scene.first - x + pixel.index());
        }
    }
}
