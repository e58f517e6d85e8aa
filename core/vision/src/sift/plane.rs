//! An image of which some rows are held, each from the beginning of a cache line.

use super::lanes::{Line, WIDEST};

/// Lines of room after the last row: vectors may be read that begin on any pixel of it or right after.
const ROOM: usize = 2;

/// A grey image, made row after row; of those made, the last [`Plane::held`] can be read. The numbers between the end of
/// a row and the next have no meaning, but are finite.
#[derive(Default)]
pub(super) struct Plane {
    /// Columns, px.
    pub(super) width: usize,
    /// Rows, px.
    pub(super) height: usize,
    /// Rows made.
    pub(super) made: usize,
    /// Numbers from one row to the next: an odd number of cache lines, so that pixels below each other do not all
    /// compete for the same places of the cache.
    pub(super) stride: usize,
    /// Rows held.
    held: usize,
    lines: Vec<Line>,
}

impl Plane {
    /// Makes it an image of this size without any rows yet, of which at most `held` will be held.
    pub(super) fn begin(&mut self, [width, height]: [usize; 2], held: usize) {
        let row = width.div_ceil(WIDEST) | 1;
        let held = held.clamp(1, height.max(1));
        (self.width, self.height, self.stride) = (width, height, row * WIDEST);
        (self.made, self.held) = (0, held);
        let lines = row * held + ROOM;
        if self.lines.len() < lines {
            // Fresh zeros come without being written, where there is nothing to keep.
            self.lines = vec![Line::ZERO; lines];
        }
    }

    /// All numbers.
    #[inline(always)]
    pub(super) fn values(&self) -> &[f32] {
        bytemuck::cast_slice(&self.lines)
    }

    /// Where a row begins among all numbers.
    #[inline(always)]
    pub(super) fn start(&self, y: usize) -> usize {
        (y % self.held) * self.stride
    }

    /// The numbers of a row and whatever follows.
    #[inline(always)]
    pub(super) fn row(&self, y: usize) -> &[f32] {
        &self.values()[self.start(y)..]
    }

    /// The rows from the first that is not made yet to the one before `end`, which are made with this: first rows and
    /// the numbers of the rows from there on.
    pub(super) fn make(&mut self, end: usize) -> [(usize, &mut [f32]); 2] {
        let (first, count) = (self.made, end.saturating_sub(self.made));
        self.made += count;
        let at = first % self.held;
        let before = count.min(self.held - at);
        let values: &mut [f32] = bytemuck::cast_slice_mut(&mut self.lines);
        let (wrapped, rest) = values.split_at_mut(at * self.stride);
        [
            (first, &mut rest[..before * self.stride]),
            (first + before, &mut wrapped[..(count - before) * self.stride]),
        ]
    }
}
