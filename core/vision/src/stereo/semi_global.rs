//! Semi-global matching: a disparity is cheap if its census bits agree and if the preceding pixels along several paths
//! have nearly the same disparity.
//!
//! ```text
//! L_r(p, d) = C(p, d) + min( L_r(p − r, d),  L_r(p − r, d ± 1) + P1,  m + P2 ) − m       m = min_k L_r(p − r, k)
//! S(p, d)   = Σ_r L_r(p, d)                                                    Hirschmüller 2008, Eq. 13, 14
//! P2        = max( P2_least, P2_even − a |I(p) − I(p − r)| )
//! ```
//! | symbol | our name | unit |
//! |---|---|---|
//! | C | `census::costs` | bits |
//! | L_r, m | [`Ring`]'s cells and floors | bits, at most 62 + P2 |
//! | S | `sums` | bits |
//! | P1, P2_even, P2_least, a | `small_step`, `large_step`, `large_step_least`, `large_step_slope` | bits; bits/full scale |
//! | r | from the left, from the right, from above left, above and above right; with eight paths also from below | – |
//!
//! **One pass.** For each of the three paths from above one row of L is stored, and one row of costs and of sums. From
//! left to right the costs are computed and four paths advance; the fifth runs from right to left and completes the
//! sums. L fits into bytes, since C ≤ 62 and P2 ≤ 180, so that 64 disparities are one vector; those that pad the last
//! vector cost 255 and no path uses them.
//!
//! **Layout of the rows of L.** A path from above reads the cells of pixel x − 1, x or x + 1 and writes those of x. In a
//! ring of W + 2 places every pixel writes one place before the one that it reads: it overwrites cells that the previous
//! pixel read, and no load overlaps the 64 bytes of a recent store. The path along the row would load bytes that two
//! recent stores have written; [`Side`] therefore shifts L by one disparity in vectors instead.
//!
//! **Eight paths** are the same pass from below, upside down; its four paths are stored for the whole image and added to
//! those of the first pass.
//!
//! **Lower bound of the time.** In vectors of 512 bits, for 64 cells of five paths: 49 operations for their bits, 6 for
//! each path, 5 for their least, 8 that shift L of the side by one disparity, 26 for the sums, 6 for the right image's
//! winners and 10 for the left one's: 134, or 2.1 per pixel and disparity; and 75 per pixel for six minima of a vector.
//! 1024 × 1024 pixels with 128 disparities take 90 M cycles of four operations, 22 ms at 4.1 GHz; 10 stores for 64 cells
//! take 5 ms in parallel. The working set, three rows of L, C and S, fits into the L2 cache (0.8 MB). Measured times:
//! `docs/benchmarks.md`.

use pulp::{Arch, Simd, WithSimd};

use super::census::{Planes, WHOLE, costs};
use super::lanes::{Block, LANES, Row, blocks, blocks_mut, least_u8, moved_down, moved_up};
use super::row::RowResult;
use super::scene::Scene;
use super::settings::{StereoPaths, StereoSettings};
use super::subpixel::three_along_row;
use super::winner::{RightWinners, winner};

/// Number of paths from above.
const ABOVE: usize = 3;

/// P2 of the pixels of a row, each against its neighbour at x + `shift` in `there`; P2_even without a neighbour.
#[inline(always)]
fn large_steps(settings: &StereoSettings, here: &[f32], there: &[f32], shift: isize, out: &mut [u8]) {
    let (even, least) = (settings.large_step as f32, settings.large_step_least as f32);
    let slope = settings.large_step_slope as f32;
    // Beside an invalid pixel P2 is P2_least: `min` ignores NaN.
    let (from, to) = (shift.min(0).unsigned_abs(), shift.max(0).unsigned_abs());
    let middle = here.len().saturating_sub(from + to);
    out.fill(settings.large_step as u8);
    let (out, here, there) = (&mut out[from..][..middle], &here[from..][..middle], &there[to..][..middle]);
    for x in 0..middle {
        out[x] = (even - (slope * (here[x] - there[x]).abs()).min(even - least)) as u8;
    }
}

/// A row of L of one path. A place contains 64 bytes of 255, for disparities outside the range, and the cells.
///
/// Rows move down by 0, 1 or 2 places, so that a path from x − 1, x or x + 1 always reads the place after the one that
/// it writes. Unwritten places are zero, the initial value of a path.
struct Ring {
    /// Place of the first pixel of the row being written.
    base: usize,
    /// Number of places between a row and the row above.
    shift: usize,
    cells: Row<u8>,
    /// m of each place.
    floors: Vec<u8>,
}

impl Ring {
    fn new([width, height]: [usize; 2], cells: usize, shift: usize) -> Self {
        let places = width + 2 + shift * height;
        let mut row = Row::new(places * (LANES + cells) + LANES, u8::MAX);
        for place in row.values_mut().chunks_exact_mut(LANES + cells) {
            place[LANES..].fill(0);
        }
        Self { base: shift * height, shift, cells: row, floors: vec![0; places] }
    }

    /// Returns the cells of pixel `x` to write and the preceding cells of its path; `large` and `small` are P2 and P1.
    #[inline(always)]
    fn open<const N: usize>(
        &mut self,
        x: usize,
        [large, small]: [u8; 2],
    ) -> (&mut [Block<u8>; N], Before<'_, N>) {
        let (cells, floor) = (N * LANES, self.floors[self.base.wrapping_add(x).wrapping_add(1)]);
        let (place, block) = (self.base.wrapping_add(x), LANES.wrapping_add(cells));
        let (before, after) = self.cells.values_mut().split_at_mut(place.wrapping_add(1).wrapping_mul(block));
        let start = before.len().wrapping_sub(cells);
        (blocks_mut(&mut before[start..], 0), Before::new(after, floor, large, small))
    }

    #[inline(always)]
    fn close(&mut self, x: usize, floor: u8) {
        self.floors[self.base.wrapping_add(x)] = floor;
    }
}

/// L_r of the preceding pixel at d − 1, d and d + 1, and the penalties.
#[derive(Clone, Copy)]
struct Before<'a, const N: usize> {
    less: &'a [Block<u8>; N],
    same: &'a [Block<u8>; N],
    more: &'a [Block<u8>; N],
    floor: u8,
    cap: u8,
    small: u8,
}

impl<'a, const N: usize> Before<'a, N> {
    /// From cells with a margin of 64 bytes.
    #[inline(always)]
    fn new(from: &'a [u8], floor: u8, large: u8, small: u8) -> Self {
        Self {
            less: blocks(from, LANES - 1),
            same: blocks(from, LANES),
            more: blocks(from, LANES + 1),
            floor,
            cap: floor.wrapping_add(large),
            small,
        }
    }

    /// Computes one block of L_r.
    #[inline(always)]
    fn step(&self, block: usize, cost: &Block<u8>) -> Block<u8> {
        let (less, same, more) = (&self.less[block], &self.same[block], &self.more[block]);
        let mut cells = [0; LANES];
        for i in 0..LANES {
            let beside = less[i].min(more[i]).saturating_add(self.small);
            cells[i] = same[i].min(beside).min(self.cap).wrapping_sub(self.floor).saturating_add(cost[i]);
        }
        cells
    }
}

/// The path along the row: L of the preceding pixel at d − 1, d and d + 1, in vectors because the next pixel depends on
/// it.
struct Side<const N: usize> {
    less: [Block<u8>; N],
    same: [Block<u8>; N],
    more: [Block<u8>; N],
    floor: u8,
}

impl<const N: usize> Side<N> {
    /// The initial state of a path.
    fn new() -> Self {
        let none = [[0; LANES]; N];
        Self { less: none, same: none, more: none, floor: 0 }
    }

    #[inline(always)]
    fn before(&self, [large, small]: [u8; 2]) -> Before<'_, N> {
        let Self { less, same, more, floor } = self;
        Before { less, same, more, floor: *floor, cap: floor.wrapping_add(large), small }
    }

    /// Advances to a pixel with the given `cells`, whose least L is among `low`.
    #[inline(always)]
    fn go<S: Simd>(&mut self, simd: S, cells: &[Block<u8>; N], low: &Block<u8>) {
        self.floor = least_u8(simd, low);
        self.same = *cells;
        let none = [u8::MAX; LANES];
        for k in 0..N {
            let before = if k > 0 { &cells[k - 1] } else { &none };
            let after = if k + 1 < N { &cells[k + 1] } else { &none };
            self.less[k] = moved_up(simd, before, &cells[k]);
            self.more[k] = moved_down(simd, &cells[k], after);
        }
    }
}

#[inline(always)]
fn lower(low: &mut Block<u8>, cells: &Block<u8>) {
    for i in 0..LANES {
        low[i] = low[i].min(cells[i]);
    }
}

/// The state of a pass.
struct Pass {
    /// Census bits of the row, left and right.
    bits: [Planes<WHOLE>; 2],
    rings: [Ring; ABOVE],
    costs: Row<u8>,
    sums: Row<u16>,
    /// P2 from the left, from above left, above, above right.
    large: [Vec<u8>; ABOVE + 1],
    right: RightWinners,
}

impl Pass {
    fn new(scene: &Scene<'_>) -> Self {
        let (cells, [width, height]) = (scene.cells, scene.size);
        Self {
            bits: [Planes::new(&scene.left, 0), Planes::new(&scene.right, scene.margin)],
            rings: [2, 1, 0].map(|shift| Ring::new([width, height], cells, shift)),
            costs: Row::new(width * cells, 0),
            sums: Row::new(width * cells, 0),
            large: std::array::from_fn(|_| vec![0; width]),
            right: RightWinners::new(scene.right_stride()),
        }
    }

    /// Advances to row `y`, whose paths come from row `from_y`.
    fn begin(&mut self, scene: &Scene<'_>, y: usize, from_y: Option<usize>) {
        for ring in &mut self.rings {
            ring.base -= ring.shift;
        }
        self.bits[0].take(&scene.left, y);
        self.bits[1].take(&scene.right, y);
        Arch::new().dispatch(Begin { scene, pass: self, y, from_y });
    }
}

/// Computes P2 of a row.
struct Begin<'a> {
    scene: &'a Scene<'a>,
    pass: &'a mut Pass,
    y: usize,
    from_y: Option<usize>,
}

impl WithSimd for Begin<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { scene, pass, y, from_y } = self;
        let width = scene.size[0];
        let row = |y: usize| &scene.image.as_raw()[y * width..][..width];
        let above = row(from_y.unwrap_or(y));
        let [side, left, middle, right] = &mut pass.large;
        large_steps(scene.settings, row(y), row(y), -1, side);
        large_steps(scene.settings, row(y), above, -1, left);
        large_steps(scene.settings, row(y), above, 0, middle);
        large_steps(scene.settings, row(y), above, 1, right);
    }
}

/// Matches all rows and passes each result to `take`, from top to bottom.
pub(super) fn match_rows<const N: usize>(scene: &Scene<'_>, mut take: impl FnMut(usize, &RowResult)) {
    let [width, height] = scene.size;
    let mut result = RowResult::new(width);
    let mut pass = Pass::new(scene);
    let eight = scene.settings.paths == StereoPaths::Eight;
    let mut below: Vec<u16> = vec![0; if eight { width * height * scene.cells } else { 0 }];
    if eight {
        for (y, keep) in (0..height).rev().zip(below.rchunks_exact_mut(width * scene.cells)) {
            if scene.cancel.is_requested() {
                return;
            }
            pass.begin(scene, y, Some(y + 1).filter(|y| *y < height));
            Arch::new().dispatch(FromLeft::<N> { scene, pass: &mut pass, side_counts: false });
            keep.copy_from_slice(pass.sums.values());
        }
        pass = Pass::new(scene);
    }
    for y in 0..height {
        if scene.cancel.is_requested() {
            return;
        }
        pass.begin(scene, y, y.checked_sub(1));
        Arch::new().dispatch(FromLeft::<N> { scene, pass: &mut pass, side_counts: true });
        if eight {
            let row = &below[y * width * scene.cells..][..width * scene.cells];
            for (sum, below) in pass.sums.values_mut().iter_mut().zip(row) {
                *sum = sum.wrapping_add(*below);
            }
        }
        Arch::new().dispatch(FromRight::<N> { scene, pass: &mut pass, result: &mut result });
        take(y, &result);
    }
}

/// From left to right: costs, the path from the left, and those from the row above.
struct FromLeft<'a, const N: usize> {
    scene: &'a Scene<'a>,
    pass: &'a mut Pass,
    /// Whether the path from the left is part of the sums.
    side_counts: bool,
}

impl<const N: usize> WithSimd for FromLeft<'_, N> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { scene, pass, side_counts } = self;
        let width = scene.size[0];
        let Pass { bits: [left, right], rings: [a, b, c], costs: row, sums, large, .. } = pass;
        let (left, (right, is_none)) = (left.views().0.map(|plane| &plane[..width]), right.views());
        let beyond = blocks(scene.beyond_costs.values(), 0);
        let (small, counted) = (scene.settings.small_step as u8, if side_counts { u8::MAX } else { 0 });
        let large = large.each_ref().map(|row| &row[..width]);
        let (row, _) = row.values_mut().as_chunks_mut::<LANES>().0.as_chunks_mut::<N>();
        let (sums, _) = sums.values_mut().as_chunks_mut::<LANES>().0.as_chunks_mut::<N>();
        let mut side = Side::<N>::new();
        for (x, (cost, sums)) in (0..width).zip(row.iter_mut().zip(sums)) {
            let bits = std::array::from_fn(|k| left[k][x]);
            costs(bits, (&right, is_none), scene.first.wrapping_sub(x), beyond, cost);
            let (mut s_to, s_from) = ([[0; LANES]; N], side.before([large[0][x], small]));
            let (a_to, a_from) = a.open::<N>(x, [large[1][x], small]);
            let (b_to, b_from) = b.open::<N>(x, [large[2][x], small]);
            let (c_to, c_from) = c.open::<N>(x, [large[3][x], small]);
            let [mut low_s, mut low_a, mut low_b, mut low_c] = [[u8::MAX; LANES]; 4];
            for k in 0..N {
                let (s, a) = (s_from.step(k, &cost[k]), a_from.step(k, &cost[k]));
                let (b, c) = (b_from.step(k, &cost[k]), c_from.step(k, &cost[k]));
                let mut sum = [0; LANES];
                for i in 0..LANES {
                    let above = u16::from(a[i]).wrapping_add(u16::from(b[i])).wrapping_add(u16::from(c[i]));
                    sum[i] = above.wrapping_add(u16::from(s[i] & counted));
                }
                sums[k] = sum;
                lower(&mut low_s, &s);
                lower(&mut low_a, &a);
                lower(&mut low_b, &b);
                lower(&mut low_c, &c);
                (s_to[k], a_to[k], b_to[k], c_to[k]) = (s, a, b, c);
            }
            side.go(simd, &s_to, &low_s);
            a.close(x, least_u8(simd, &low_a));
            b.close(x, least_u8(simd, &low_b));
            c.close(x, least_u8(simd, &low_c));
        }
    }
}

/// From right to left: the last path, and the winners.
struct FromRight<'a, const N: usize> {
    scene: &'a Scene<'a>,
    pass: &'a mut Pass,
    result: &'a mut RowResult,
}

impl<const N: usize> WithSimd for FromRight<'_, N> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { scene, pass, result } = self;
        let width = scene.size[0];
        let (small, cells) = (scene.settings.small_step as u8, N * LANES);
        let Pass { costs, sums, large: [large, ..], right, .. } = pass;
        let beyond: &[Block<u16>; N] = blocks(scene.beyond.values(), 0);
        let large = &large[..width];
        let pixels = &mut result.pixels[..width];
        right.clear();
        let mut side = Side::<N>::new();
        let rows = costs.values().chunks_exact(cells).zip(sums.values().chunks_exact(cells));
        for (x, (cost, sums)) in (0..width).zip(rows).rev() {
            let (cost, sums): (&[Block<u8>; N], &[Block<u16>; N]) = (blocks(cost, 0), blocks(sums, 0));
            let step = if x + 1 == width { large[x] } else { large[x + 1] };
            let (mut to, before) = ([[0; LANES]; N], side.before([step, small]));
            // Sums in an array of their own are vectorised; those in the row would be read one by one.
            let (mut low, mut whole) = ([u8::MAX; LANES], [[0u16; LANES]; N]);
            for k in 0..N {
                let l = before.step(k, &cost[k]);
                lower(&mut low, &l);
                to[k] = l;
                for i in 0..LANES {
                    whole[k][i] = sums[k][i].wrapping_add(u16::from(l[i])) | beyond[k][i];
                }
            }
            side.go(simd, &to, &low);
            right.offer(scene.first.wrapping_sub(x), &whole);
            pixels[x] = winner(simd, &whole, scene.rival_share);
        }
        for (x, pixel) in (0..width).zip(pixels.iter_mut()) {
            pixel.refine(three_along_row(costs.values(), [width, cells], x, pixel.index()));
        }
        right.settle();
        result.see_right(right.indices(), scene.first);
    }
}
