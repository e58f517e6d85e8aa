//! Winners of a row of pixels, before the gates.

/// Winner of a pixel of the left image.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pixel {
    index: u16,
    /// Sums of the disparity before, its own, and the one after; `u16::MAX` beyond the range.
    three: [u16; 3],
    is_unique: bool,
    /// Sums that give a more accurate fraction; `None` without them.
    fine: Option<[u16; 3]>,
}

impl Pixel {
    /// The winner's index, the sums before, at and after it, and whether no other disparity is nearly as good.
    #[inline(always)]
    pub(super) fn new(index: u16, three: [u16; 3], is_unique: bool) -> Self {
        Self { index, three, is_unique, fine: None }
    }

    /// Index of the disparity, counted from the first one.
    #[inline(always)]
    pub(super) fn index(self) -> usize {
        usize::from(self.index)
    }

    /// Sets other sums for the fraction.
    #[inline(always)]
    pub(super) fn refine(&mut self, three: Option<[u16; 3]>) {
        self.fine = three;
    }

    /// Returns whether no disparity except its neighbours is nearly as good.
    #[inline(always)]
    pub(super) fn is_unique(self) -> bool {
        self.is_unique
    }

    /// The sums of the disparities before, at, and after the winner; `None` at either end of the range.
    #[inline(always)]
    pub(super) fn three(self) -> Option<[u16; 3]> {
        let has_both = self.three[0] != u16::MAX && self.three[2] != u16::MAX;
        has_both.then_some(self.fine.unwrap_or(self.three))
    }
}

/// Winners of a row.
pub(super) struct RowResult {
    /// One per pixel of the left image.
    pub(super) pixels: Vec<Pixel>,
    /// Disparity index of each pixel's partner in the right image.
    pub(super) right_index: Vec<u16>,
}

impl RowResult {
    pub(super) fn new(width: usize) -> Self {
        Self { pixels: vec![Pixel::default(); width], right_index: vec![0; width] }
    }

    /// Stores the winners of the right image, in the mirrored order of its planes; the partners of pixel 0 begin at
    /// `first`.
    #[inline(always)]
    pub(super) fn see_right(&mut self, indices: &[u16], first: usize) {
        for (x, (pixel, right)) in self.pixels.iter().zip(&mut self.right_index).enumerate() {
            *right = indices[(first - x) + pixel.index()];
        }
    }
}
