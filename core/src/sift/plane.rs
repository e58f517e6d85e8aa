//! An image whose rows begin at cache lines, with room after the last one.

use super::lanes::{Line, WIDEST};

/// Lines of room after the last row: vectors may be read that begin on any pixel of it or right after.
const ROOM: usize = 2;

/// A grey image of the scale space; the numbers between the end of a row and the next have no meaning, but are finite.
#[derive(Default)]
pub(super) struct Plane {
    /// Columns, px.
    pub(super) width: usize,
    /// Rows, px.
    pub(super) height: usize,
    /// Numbers from one row to the next: an odd number of cache lines, so that pixels below each other do not all
    /// compete for the same places of the cache.
    pub(super) stride: usize,
    lines: Vec<Line>,
}

impl Plane {
    /// Makes it an image of this size; what it held has no meaning then.
    pub(super) fn resize(&mut self, width: usize, height: usize) {
        let row = width.div_ceil(WIDEST) | 1;
        (self.width, self.height, self.stride) = (width, height, row * WIDEST);
        let lines = row * height + ROOM;
        if self.lines.is_empty() {
            self.lines = vec![Line::ZERO; lines];
        }
        self.lines.resize(lines, Line::ZERO);
    }

    /// All numbers, row after row.
    #[inline(always)]
    pub(super) fn values(&self) -> &[f32] {
        bytemuck::cast_slice(&self.lines)
    }

    /// All rows.
    #[inline(always)]
    pub(super) fn rows_mut(&mut self) -> &mut [f32] {
        let numbers = self.stride * self.height;
        &mut bytemuck::cast_slice_mut(&mut self.lines)[..numbers]
    }

    /// The numbers of a row and whatever follows.
    #[inline(always)]
    pub(super) fn from_row(&self, y: usize) -> &[f32] {
        &self.values()[y * self.stride..]
    }

    /// One pixel.
    #[inline(always)]
    pub(super) fn at(&self, x: usize, y: usize) -> f32 {
        self.values()[y * self.stride + x]
    }
}
