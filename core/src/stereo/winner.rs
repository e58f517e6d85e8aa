//! The disparity of a pixel: the cheapest, whether it is the only one, and the fraction below a pixel.
//!
//! ```text
//! d₁ = argmin S(d)      s₂ = min { S(d) : |d − d₁| > 1 }      unique where  S(d₁) < (1 − u) s₂
//! ```
//! | symbol | our name | unit |
//! |---|---|---|
//! | S | `cells` | bits, summed over paths or a window |
//! | d₁ | [`Winner::index`] | px, from the first disparity on |
//! | u | `StereoSettings::uniqueness_min` | – |
//!
//! The same sums serve the right image: those of its pixel q are S(q + d, d), which are met while the left pixels go
//! by ([`RightWinners`]). Of equal sums the smaller disparity wins on the left; on the right it may be any of them.

use pulp::Simd;

use super::lanes::{Block, LANES, Row, blocks_mut, least_u16};

/// The cheapest disparity of a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Winner {
    /// Its place among the disparities.
    pub(super) index: usize,
    /// Its sum.
    pub(super) least: u16,
    /// The least sum of those that are not next to it.
    pub(super) second: u16,
}

/// The cheapest of `cells`.
#[inline(always)]
pub(super) fn winner<S: Simd, const N: usize>(simd: S, cells: &[Block<u16>; N]) -> Winner {
    let mut low = [u16::MAX; LANES];
    for block in cells {
        for i in 0..LANES {
            low[i] = low[i].min(block[i]);
        }
    }
    let least = least_u16(simd, &low);
    let mut places = [u16::MAX; LANES];
    for (k, block) in cells.iter().enumerate() {
        let first = (k as u16).wrapping_mul(LANES as u16);
        for i in 0..LANES {
            let place = first.wrapping_add(i as u16);
            places[i] = places[i].min(if block[i] == least { place } else { u16::MAX });
        }
    }
    let index = least_u16(simd, &places);
    let mut others = [u16::MAX; LANES];
    for (k, block) in cells.iter().enumerate() {
        let first = (k as u16).wrapping_mul(LANES as u16).wrapping_add(1).wrapping_sub(index);
        for i in 0..LANES {
            let off = first.wrapping_add(i as u16);
            others[i] = others[i].min(if off > 2 { block[i] } else { u16::MAX });
        }
    }
    Winner { index: usize::from(index), least, second: least_u16(simd, &others) }
}

/// Copies of the right image's winners that take turns: a vector cannot be loaded before what overlaps it is
/// stored, and the places of two pixels that follow each other are all but one the same.
const TURNS: usize = 4;

/// The cheapest disparities of the pixels of a row of the right image, in the mirrored order of its planes.
pub(super) struct RightWinners {
    least: [Row<u16>; TURNS],
    index: [Row<u16>; TURNS],
}

impl RightWinners {
    /// Room for a mirrored row with its margins.
    pub(super) fn new(stride: usize) -> Self {
        let rows = || std::array::from_fn(|_| Row::new(stride, 0));
        Self { least: rows(), index: rows() }
    }

    /// Forgets the row before.
    #[inline(always)]
    pub(super) fn clear(&mut self) {
        for least in &mut self.least {
            least.values_mut().fill(u16::MAX);
        }
    }

    /// The sums of a left pixel whose partners begin at `at`.
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

    /// The place among the disparities that the pixel at `at` of the mirrored row has.
    #[inline(always)]
    pub(super) fn index(&self, at: usize) -> u16 {
        let mut best = (u16::MAX, u16::MAX);
        for turn in 0..TURNS {
            best = best.min((self.least[turn].values()[at], self.index[turn].values()[at]));
        }
        best.1
    }
}
