//! Layout of a tile of positions and of the pixels under it: by column modulo three.
//!
//! ```text
//! phase p, p < 3, of a row: its columns 3 X + p    p₀ p₀ p₀ … | p₁ p₁ p₁ … | p₂ p₂ p₂ …
//! ```
//! Three columns to the right is then the next value of the same phase, for pixels, sums and scores: `toom_cook`
//! processes the columns of a template three at a time, and `moments` sums windows by triples.
//!
//! Pixels, and values derived from them, are stored phase by phase: all rows of the first phase, `pixels` values each,
//! then those of the second and of the third, so that most loops run over consecutive values. Sums have the phases of a
//! row side by side, `columns` values each. Both are whole vectors.

use super::lanes::WIDEST;

/// Number of phases of a row.
pub(in crate::correlate) const PHASES: usize = 3;

/// Columns of positions of the largest tile: three of the widest vectors per phase.
pub(in crate::correlate) const TILE_COLUMNS: usize = PHASES * 3 * WIDEST;

/// Size of a tile.
#[derive(Clone, Copy)]
pub(in crate::correlate) struct Tile {
    /// Values per phase in a row of sums.
    pub(in crate::correlate) columns: usize,
    /// Values per phase in a row of pixels.
    pub(in crate::correlate) pixels: usize,
    /// Number of rows of pixels.
    pub(in crate::correlate) pixel_rows: usize,
}

impl Tile {
    /// A tile of up to [`TILE_COLUMNS`] columns of positions for windows of `size` columns.
    pub(in crate::correlate) fn new(size: usize, columns: usize, pixel_rows: usize) -> Self {
        let columns = columns.div_ceil(PHASES).next_multiple_of(WIDEST);
        let pixels = (columns + size.div_ceil(PHASES)).next_multiple_of(WIDEST);
        Self { columns, pixels, pixel_rows }
    }

    /// Length of a row of sums.
    pub(in crate::correlate) fn row_columns(self) -> usize {
        PHASES * self.columns
    }

    /// Length of a row of pixels.
    pub(in crate::correlate) fn row_pixels(self) -> usize {
        PHASES * self.pixels
    }

    /// Number of pixels of a phase.
    pub(in crate::correlate) fn plane(self) -> usize {
        self.pixel_rows * self.pixels
    }

    /// The three phases of a row of sums.
    #[inline(always)]
    pub(in crate::correlate) fn phases(self, row: &[f32]) -> [&[f32]; PHASES] {
        let (first, others) = row[..self.row_columns()].split_at(self.columns);
        let (second, third) = others.split_at(self.columns);
        [first, second, third]
    }
}
