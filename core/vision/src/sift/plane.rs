//! An image of which some rows are stored, each aligned to a cache line.

use super::lanes::{Line, WIDEST};

/// Cache lines after the last row: vectors may be loaded at any pixel of it or right after.
const ROOM: usize = 2;

/// A grey image, computed row by row; of the computed rows, the last [`Plane::held`] can be read. Values between the end
/// of a row and the next are meaningless, but finite.
#[derive(Default)]
pub(super) struct Plane {
    /// Columns, px.
    pub(super) width: usize,
    /// Rows, px.
    pub(super) height: usize,
    /// Number of rows computed.
    pub(super) made: usize,
    /// Length of a row in memory: an odd number of cache lines, so that the pixels of a column do not all map to the
    /// same cache sets.
    pub(super) stride: usize,
    /// Number of rows stored.
    held: usize,
    lines: Vec<Line>,
}

impl Plane {
    /// Resets to an image of this size without any rows, of which at most `held` will be stored.
    pub(super) fn begin(&mut self, [width, height]: [usize; 2], held: usize) {
        let row = width.div_ceil(WIDEST) | 1;
        let held = held.clamp(1, height.max(1));
        (self.width, self.height, self.stride) = (width, height, row * WIDEST);
        (self.made, self.held) = (0, held);
        let lines = row * held + ROOM;
        if self.lines.len() < lines {
            // `vec!` obtains zeroed memory without writing it.
            self.lines = vec![Line::ZERO; lines];
        }
    }

    /// All values.
    #[inline(always)]
    pub(super) fn values(&self) -> &[f32] {
        bytemuck::cast_slice(&self.lines)
    }

    /// Index of the first value of a row.
    #[inline(always)]
    pub(super) fn start(&self, y: usize) -> usize {
        (y % self.held) * self.stride
    }

    /// The values of a row, followed by the rest of the buffer.
    #[inline(always)]
    pub(super) fn row(&self, y: usize) -> &[f32] {
        &self.values()[self.start(y)..]
    }

    /// Marks the rows from the first not yet computed to the one before `end` as computed, and returns them to be
    /// filled: index of the first row and values, in two parts because the buffer is circular.
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
