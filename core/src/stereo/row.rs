//! What a row of pixels found, before anything is checked.

use super::lanes::Block;
use super::winner::Winner;

/// What a pixel of the left image found.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pixel {
    index: u16,
    least: u16,
    second: u16,
    /// The sums of the disparities before and after; `u16::MAX` where there is none.
    beside: [u16; 2],
    /// Sums that tell the fraction better.
    fine: Option<[u16; 3]>,
}

impl Pixel {
    /// The winner among the first `count` of `cells`.
    #[inline(always)]
    pub(super) fn of<const N: usize>(won: Winner, cells: &[Block<u16>; N], count: usize) -> Self {
        let cells = cells.as_flattened();
        let before = if won.index > 0 { cells[won.index - 1] } else { u16::MAX };
        let after = if won.index + 1 < count { cells[won.index + 1] } else { u16::MAX };
        Self {
            index: won.index as u16,
            least: won.least,
            second: won.second,
            beside: [before, after],
            fine: None,
        }
    }

    /// The place among the disparities.
    #[inline(always)]
    pub(super) fn index(self) -> usize {
        usize::from(self.index)
    }

    /// Takes other sums for the fraction, if there are any.
    #[inline(always)]
    pub(super) fn refine(&mut self, three: Option<[u16; 3]>) {
        self.fine = three;
    }

    /// Whether it is better than any that is no neighbour by the share `least` (0: off).
    #[inline(always)]
    pub(super) fn is_unique(self, least: f32) -> bool {
        least <= 0.0 || f32::from(self.least) < (1.0 - least) * f32::from(self.second)
    }

    /// The sums of the disparities before, at, and after the winner; `None` at either end of the range.
    #[inline(always)]
    pub(super) fn three(self) -> Option<[u16; 3]> {
        let [before, after] = self.beside;
        let has_both = before != u16::MAX && after != u16::MAX;
        has_both.then_some(self.fine.unwrap_or([before, self.least, after]))
    }
}

/// What a row found.
pub(super) struct RowResult {
    /// For each pixel of the left image.
    pub(super) pixels: Vec<Pixel>,
    /// The place among the disparities that its partner in the right image has.
    pub(super) right_index: Vec<u16>,
}

impl RowResult {
    pub(super) fn new(width: usize) -> Self {
        Self { pixels: vec![Pixel::default(); width], right_index: vec![0; width] }
    }
}
