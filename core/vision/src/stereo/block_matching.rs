//! Block matching: the cost of a disparity is the number of differing census bits in a square window.
//!
//! ```text
//! V(x, d) = Σ_{|v| ≤ r} C(x, y + v; d)        S(x, d) = Σ_{|u| ≤ r} V(x + u, d)
//! ```
//! | symbol | our name | unit |
//! |---|---|---|
//! | C | `census::sparse_costs` | bits |
//! | V | `columns` | bits |
//! | S | `sums` | bits, at most 24 · 31² |
//! | r | half of `StereoSettings::window_px` | px |
//!
//! V is updated from row to row by adding one row and subtracting one, S from pixel to pixel likewise by columns; the
//! costs of as many rows as the window has are stored for that. All of it is one sweep along the row: the costs of the
//! column that enters the window, its V, S, and the winner of the pixel in the middle. At the border the window is
//! clipped: all disparities of a pixel are summed over the same cells. Departure from JPL's correlator (domain.md 7):
//! census bits instead of band-passed grey values, since all pixels then have the same weight, on an edge or not.
//!
//! Rows are matched in independent bands of fixed height. Each band costs one window height more, and the bits do not
//! depend on the number of threads.
//!
//! **Lower bound of the time.** In vectors of 512 bits, for 64 cells: 23 operations for their bits, 9 for V, 4 for S, 6
//! for the right image's winners and 10 for the left one's, 0.8 per pixel and disparity, and 20 per pixel for its least
//! sum and the index of it. 1024 × 1024 pixels with 128 disparities are 2.1 M times 64 cells: 34 M cycles of four
//! operations, 8 ms at 4.1 GHz; 9 stores for 64 cells take 5 ms in parallel. A row reads and writes 128 kB of C, of
//! which a window of 11 rows takes 1.4 MB, more than the L2 cache, and 256 kB of V: 0.7 GB in all. Measured times:
//! `docs/benchmarks.md`.

use std::ops::Range;

use pulp::{Arch, Simd, WithSimd};

use super::census::{Planes, SPARSE, sparse_costs};
use super::lanes::{Block, LANES, Row, blocks};
use super::row::RowResult;
use super::scene::Scene;
use super::winner::{RightWinners, winner};

/// Rows of a band.
pub(super) const BAND: usize = 128;

/// Pixels whose winners are found together, so that the processor overlaps the latencies of their dependency chains.
const GROUP: usize = 16;

/// Buffers of a band.
pub(super) struct Band {
    left: Planes<SPARSE>,
    right: Planes<SPARSE>,
    /// C of as many rows as the window has; row y is at index y modulo their number.
    costs: Vec<Row<u8>>,
    columns: Row<u16>,
    right_winners: RightWinners,
    result: RowResult,
}

impl Band {
    pub(super) fn new(scene: &Scene<'_>) -> Self {
        let width = scene.size[0];
        Self {
            left: Planes::new(&scene.left, 0),
            right: Planes::new(&scene.right, scene.margin),
            costs: (0..scene.settings.window_px).map(|_| Row::new(width * scene.cells, 0)).collect(),
            columns: Row::new(width * scene.cells, 0),
            right_winners: RightWinners::new(scene.right_stride()),
            result: RowResult::new(width),
        }
    }
}

/// Matches a range of rows and passes each result to `take`, from top to bottom.
pub(super) fn match_rows<const N: usize>(
    scene: &Scene<'_>,
    band: &mut Band,
    rows: Range<usize>,
    mut take: impl FnMut(usize, &RowResult),
) {
    let window = band.costs.len();
    let half = window / 2;
    let first = rows.start.saturating_sub(half);
    band.columns.values_mut().fill(0);
    for next in first..rows.end + half {
        if scene.cancel.is_requested() {
            return;
        }
        let comes = next < scene.size[1];
        if comes {
            band.left.take(&scene.left, next);
            band.right.take(&scene.right, next);
        }
        let gives = next >= rows.start + half;
        // The entering row replaces the leaving one.
        Arch::new().dispatch(Sweep::<N> { scene, band, next, comes, goes: next >= first + window, gives });
        if gives {
            take(next - half, &band.result);
        }
    }
}

/// Adds the entering row, removes the leaving one, and evaluates the windows of the middle row.
struct Sweep<'a, const N: usize> {
    scene: &'a Scene<'a>,
    band: &'a mut Band,
    next: usize,
    /// Whether the entering row is inside the image.
    comes: bool,
    /// Whether a row leaves the window.
    goes: bool,
    /// Whether the window of the middle row is complete.
    gives: bool,
}

impl<const N: usize> WithSimd for Sweep<'_, N> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { scene, band, next, comes, goes, gives } = self;
        let Band { left, right, costs, columns, right_winners, result } = band;
        let (width, window) = (scene.size[0], costs.len());
        let half = window / 2;
        let ((left, _), (right, is_none)) = (left.views(), right.views());
        let bits = Bits { left: left.map(|plane| &plane[..width]), right, is_none };
        let mut columns = Columns::<N> {
            bits: comes.then_some(bits),
            first: scene.first,
            costs: &mut cells_mut(&mut costs[next % window])[..width],
            sums: &mut cells_mut(columns)[..width],
            kept: if goes { u8::MAX } else { 0 },
        };
        let mut sums = [[0; LANES]; N];
        for at in 0..if gives { half.min(width) } else { width } {
            columns.enter(at, &mut sums);
        }
        if !gives {
            return;
        }
        let beyond: &[Block<u16>; N] = blocks(scene.beyond.values(), 0);
        right_winners.clear();
        let mut asked = [[[0; LANES]; N]; GROUP];
        for (group, pixels) in result.pixels.chunks_mut(GROUP).enumerate() {
            let start = group.wrapping_mul(GROUP);
            for (k, asked) in asked[..pixels.len()].iter_mut().enumerate() {
                let x = start.wrapping_add(k);
                if x.wrapping_add(half) < width {
                    columns.enter(x.wrapping_add(half), &mut sums);
                }
                if x > half {
                    columns.leave(x.wrapping_sub(half).wrapping_sub(1), &mut sums);
                }
                for k in 0..N {
                    for i in 0..LANES {
                        asked[k][i] = sums[k][i] | beyond[k][i];
                    }
                }
                right_winners.offer(scene.first.wrapping_sub(x), asked);
            }
            for (pixel, asked) in pixels.iter_mut().zip(&asked) {
                *pixel = winner(simd, asked, scene.rival_share);
            }
        }
        right_winners.settle();
        result.see_right(right_winners.indices(), scene.first);
    }
}

/// The cells of a row, pixel by pixel.
#[inline(always)]
fn cells_mut<const N: usize, T: bytemuck::Pod>(row: &mut Row<T>) -> &mut [[Block<T>; N]] {
    row.values_mut().as_chunks_mut().0.as_chunks_mut().0
}

/// Census bits of a row.
struct Bits<'a> {
    left: [&'a [u8]; SPARSE],
    right: [&'a [u8]; SPARSE],
    is_none: &'a [u8],
}

/// V of a row, and its inputs.
struct Columns<'a, const N: usize> {
    /// Bits of the entering row; `None` below the image.
    bits: Option<Bits<'a>>,
    first: usize,
    /// C of the leaving row, overwritten by C of the entering one.
    costs: &'a mut [[Block<u8>; N]],
    sums: &'a mut [[Block<u16>; N]],
    /// 255 if a row leaves, else 0.
    kept: u8,
}

impl<const N: usize> Columns<'_, N> {
    /// Computes the new costs of column `at`, updates its V, and adds that to the sums.
    #[inline(always)]
    fn enter(&mut self, at: usize, sums: &mut [Block<u16>; N]) {
        let (old, mut new) = (self.costs[at], [[0; LANES]; N]);
        if let Some(Bits { left, right, is_none }) = &self.bits {
            let bits = [left[0][at], left[1][at], left[2][at]];
            sparse_costs(bits, (right, is_none), self.first.wrapping_sub(at), &mut new);
        }
        self.costs[at] = new;
        let column = &mut self.sums[at];
        for k in 0..N {
            for i in 0..LANES {
                // The difference of two costs is a signed byte.
                let change = new[k][i].wrapping_sub(old[k][i] & self.kept).cast_signed();
                let whole = column[k][i].wrapping_add_signed(i16::from(change));
                column[k][i] = whole;
                sums[k][i] = sums[k][i].wrapping_add(whole);
            }
        }
    }

    /// Subtracts column `at` from the sums.
    #[inline(always)]
    fn leave(&self, at: usize, sums: &mut [Block<u16>; N]) {
        let column = &self.sums[at];
        for k in 0..N {
            for i in 0..LANES {
                sums[k][i] = sums[k][i].wrapping_sub(column[k][i]);
            }
        }
    }
}
