//! A tile of positions and the pixels under it, by column modulo three.
//!
//! ```text
//! phase p, p < 3, of a row holds its columns 3 X + p:    p₀ p₀ p₀ … | p₁ p₁ p₁ … | p₂ p₂ p₂ …
//! ```
//! Three columns on is then one number on in the same phase, for pixels, sums and scores alike: `toom_cook` takes the
//! columns of a template three at a time, and `moments` sums windows by threes.
//!
//! Of pixels, and of what is made of them, first come all rows of the first phase, `pixels` numbers each, then those of
//! the second and of the third, so that most work is one run over numbers that follow each other. Sums have the phases
//! of a row side by side, `columns` numbers each. Both are whole vectors.

use super::lanes::WIDEST;

/// Phases of a row.
pub(in crate::correlate) const PHASES: usize = 3;

/// Columns of positions of the largest tile: in each phase three of the widest vectors.
pub(in crate::correlate) const TILE_COLUMNS: usize = PHASES * 3 * WIDEST;

/// The extent of a tile.
#[derive(Clone, Copy)]
pub(in crate::correlate) struct Tile {
    /// Numbers of a phase in a row of sums.
    pub(in crate::correlate) columns: usize,
    /// Numbers of a phase in a row of pixels.
    pub(in crate::correlate) pixels: usize,
    /// Rows of pixels.
    pub(in crate::correlate) pixel_rows: usize,
}

impl Tile {
    /// A tile of up to [`TILE_COLUMNS`] columns of positions for windows of `size` columns.
    pub(in crate::correlate) fn new(size: usize, columns: usize, pixel_rows: usize) -> Self {
        let columns = columns.div_ceil(PHASES).next_multiple_of(WIDEST);
        let pixels = (columns + size.div_ceil(PHASES)).next_multiple_of(WIDEST);
        Self { columns, pixels, pixel_rows }
    }

    /// Numbers of a row of sums.
    pub(in crate::correlate) fn row_columns(self) -> usize {
        PHASES * self.columns
    }

    /// Numbers of a row of pixels.
    pub(in crate::correlate) fn row_pixels(self) -> usize {
        PHASES * self.pixels
    }

    /// Numbers of all pixels of a phase.
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
