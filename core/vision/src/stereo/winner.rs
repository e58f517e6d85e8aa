//! The winner of a pixel: the cheapest disparity, and whether it is unique.
//!
//! ```text
//! d₁ = argmin S(d)      unique where  S(d) > S(d₁) + ⌊S(d₁) u / (1 − u)⌋  for all d with |d − d₁| > 1
//! ```
//! | symbol | our name | unit |
//! |---|---|---|
//! | S | `cells` | bits, summed over paths or a window |
//! | d₁ | [`Pixel::index`] | px, from the first disparity on |
//! | u | `StereoSettings::uniqueness_min` | – |
//! | u / (1 − u) | [`rival_share`] | 1 / 65536 |
//!
//! The same sums serve the right image: those of its pixel q are S(q + d, d), which occur while the left pixels are
//! processed ([`RightWinners`]). Of equal sums the smaller disparity wins on the left; on the right it may be any of
//! them.

use pulp::Simd;

use super::lanes::{Block, LANES, Row, at_most, blocks_mut, least_u16};
use super::row::Pixel;

/// Fraction by which another sum must exceed the least one, in 65536ths.
pub(super) fn rival_share(uniqueness_min: f64) -> u64 {
    // At 1 every sum but zero has rivals.
    (65536.0 * uniqueness_min / (1.0 - uniqueness_min).max(1e-6)).round() as u64
}

/// The cheapest of `cells`; cells without a disparity contain `u16::MAX`.
#[inline(always)]
pub(super) fn winner<S: Simd, const N: usize>(simd: S, cells: &[Block<u16>; N], rival_share: u64) -> Pixel {
    let mut low = [u16::MAX; LANES];
    for block in cells {
        for i in 0..LANES {
            low[i] = low[i].min(block[i]);
        }
    }
    let least = least_u16(simd, &low);
    let limit = u64::from(least).wrapping_add(u64::from(least).wrapping_mul(rival_share) >> 16);
    let limit = limit.min(u64::from(u16::MAX - 1)) as u16;
    let (mut index, mut low_count) = (0, 0);
    for k in (0..N).rev() {
        let places = at_most(simd, &cells[k], least);
        let first = k.wrapping_mul(LANES).wrapping_add(places.trailing_zeros() as usize);
        index = if places != 0 { first } else { index };
        low_count += at_most(simd, &cells[k], limit).count_ones();
    }
    let cells = cells.as_flattened();
    let before = if index > 0 { cells[index.wrapping_sub(1)] } else { u16::MAX };
    let after = if index.wrapping_add(1) < cells.len() { cells[index.wrapping_add(1)] } else { u16::MAX };
    // The count includes the winner and its low neighbours, which are no rivals.
    let own_count = 1 + u32::from(before <= limit) + u32::from(after <= limit);
    Pixel::new(index as u16, [before, least, after], low_count == own_count)
}

/// Copies of the right image's winners, used in turn: a vector load waits for a preceding store that overlaps it, and
/// the places of consecutive pixels overlap in all but one.
const TURNS: usize = 4;

/// The cheapest disparities of the pixels of a row of the right image, in the mirrored order of its planes.
pub(super) struct RightWinners {
    least: [Row<u16>; TURNS],
    index: [Row<u16>; TURNS],
}

impl RightWinners {
    /// Buffers for a mirrored row with its margins.
    pub(super) fn new(stride: usize) -> Self {
        let rows = || std::array::from_fn(|_| Row::new(stride, 0));
        Self { least: rows(), index: rows() }
    }

    /// Resets the winners before a row.
    #[inline(always)]
    pub(super) fn clear(&mut self) {
        for least in &mut self.least {
            least.values_mut().fill(u16::MAX);
        }
    }

    /// Compares the sums of a left pixel, whose partners begin at `at`, with the best ones so far.
    #[inline(always)]
    pub(super) fn offer<const N: usize>(&mut self, at: usize, cells: &[Block<u16>; N]) {
        let least: &mut [Block<u16>; N] = blocks_mut(self.least[at % TURNS].values_mut(), at);
        let index: &mut [Block<u16>; N] = blocks_mut(self.index[at % TURNS].values_mut(), at);
        for k in 0..N {
            let first = (k as u16).wrapping_mul(LANES as u16);
            for i in 0..LANES {
                let is_better = cells[k][i] < least[k][i];
                index[k][i] = if is_better { first.wrapping_add(i as u16) } else { index[k][i] };
                least[k][i] = least[k][i].min(cells[k][i]);
            }
        }
    }

    /// Merges the copies, after all left pixels of the row.
    #[inline(always)]
    pub(super) fn settle(&mut self) {
        let ([best, least @ ..], [best_index, index @ ..]) = (&mut self.least, &mut self.index);
        let (best, best_index) = (best.values_mut(), best_index.values_mut());
        for (least, index) in least.iter().zip(index) {
            let count = best.len();
            let (best_index, least, index) =
                (&mut best_index[..count], &least.values()[..count], &index.values()[..count]);
            for i in 0..count {
                best_index[i] = if least[i] < best[i] { index[i] } else { best_index[i] };
                best[i] = best[i].min(least[i]);
            }
        }
    }

    /// Disparity index of each pixel of the mirrored row; call [`Self::settle`] first.
    #[inline(always)]
    pub(super) fn indices(&self) -> &[u16] {
        self.index[0].values()
    }
}
