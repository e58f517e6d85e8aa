//! The window of square cells around the rover, aligned with the site.
//!
//! A cell has the numbers `⌊x/cell⌋` and `⌊y/cell⌋` along x and y of the site. The window contains `side` × `side` cells.
//! Their content is stored at these numbers modulo `side`, so that a window that moves keeps its common cells in place
//! (wrap-around). Positions within the window are counted row by row: x is the row, y the column.
//!
//! Frame: site, m.

use serde::{Deserialize, Serialize};

/// Window of cells around the rover.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Grid {
    /// Side of a cell, m.
    pub cell_m: f64,
    /// Cells along a side of the window.
    pub side: usize,
    /// Numbers of the first cell along x and y of the site.
    pub first: [i64; 2],
}

impl Grid {
    /// The window centred on a position.
    pub(super) fn around(position_m: [f64; 2], cell_m: f64, side: usize) -> Self {
        let first = position_m.map(|along| (along / cell_m).floor() as i64 - (side / 2) as i64);
        Self { cell_m, side, first }
    }

    /// Number of cells.
    pub(crate) fn len(&self) -> usize {
        self.side * self.side
    }

    /// Row and column of the cell at a position, site frame, m; `None` outside.
    pub(super) fn cell_at(&self, at_m: [f64; 2]) -> Option<[usize; 2]> {
        let within = |axis: usize| {
            let along = at_m[axis] / self.cell_m;
            let number = floor(along).saturating_sub(self.first[axis]);
            (!along.is_nan() && (0..self.side as i64).contains(&number)).then_some(number as usize)
        };
        Some([within(0)?, within(1)?])
    }

    /// Index of the cell at a position, site frame, m; `None` outside.
    pub(crate) fn index_at(&self, at_m: [f64; 2]) -> Option<usize> {
        self.cell_at(at_m).map(|[row, column]| row * self.side + column)
    }

    /// Centre of a cell, site frame, m.
    pub fn centre_m(&self, index: usize) -> [f64; 2] {
        let cell = [index / self.side, index % self.side];
        [0, 1].map(|axis| ((self.first[axis] + cell[axis] as i64) as f64 + 0.5) * self.cell_m)
    }

    /// Storage index of a cell, the same in every window of the same size.
    pub(super) fn slot(&self, row: usize, column: usize) -> usize {
        let side = self.side as i64;
        let at = |axis: usize, number: usize| (self.first[axis] + number as i64).rem_euclid(side) as usize;
        at(0, row) * self.side + at(1, column)
    }

    /// Whether the cell in a row and column is also in another window of the same cells.
    pub(super) fn is_in(&self, row: usize, column: usize, other: &Self) -> bool {
        let side = self.side as i64;
        [(0, row), (1, column)].into_iter().all(|(axis, number)| {
            let moved = self.first[axis] + number as i64 - other.first[axis];
            (0..side).contains(&moved)
        })
    }
}

/// A disc of cells: for each row from −r to r the half-width, in cells.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Disc {
    /// Half-widths of rows −r to r.
    half_widths: Vec<isize>,
}

impl Disc {
    /// The cells whose centres are at most `radius` cells from the centre of the middle one.
    pub(super) fn new(radius: f64) -> Self {
        // An integer radius includes the last cell in spite of rounding.
        let radius = radius + 1e-9;
        let rows = radius as isize;
        let half_width = |row: isize| (radius * radius - (row * row) as f64).max(0.0).sqrt() as isize;
        Self { half_widths: (-rows..=rows).map(half_width).collect() }
    }

    /// r, the number of rows on either side of the middle one.
    pub(super) fn rows(&self) -> isize {
        (self.half_widths.len() / 2) as isize
    }

    /// Half-width of a row; `None` beyond the disc.
    pub(super) fn half_width(&self, row: isize) -> Option<isize> {
        self.half_widths.get(usize::try_from(row + self.rows()).ok()?).copied()
    }

    /// Number of cells.
    pub(super) fn count(&self) -> usize {
        self.half_widths.iter().map(|half| 2 * *half as usize + 1).sum()
    }
}

/// ⌊x⌋, without the library call that `f64::floor` is on processors without SSE 4.1.
fn floor(x: f64) -> i64 {
    let towards_zero = x as i64;
    towards_zero.saturating_sub(i64::from(x < towards_zero as f64))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cell_keeps_its_slot_when_the_window_moves() {
        let before = Grid::around([0.03, -0.4], 0.1, 20);
        let after = Grid::around([0.55, -1.21], 0.1, 20);
        let mut common = 0;
        for at in [[0.05, -0.55], [0.45, -1.35], [-0.25, -0.35]] {
            let [a, b] = [&before, &after].map(|grid| grid.cell_at(at));
            if let (Some([row, column]), Some(b)) = (a, b) {
                assert_eq!(before.slot(row, column), after.slot(b[0], b[1]));
                assert!(before.is_in(row, column, &after));
                common += 1;
            }
        }
        assert_eq!(common, 3);
        assert!(before.cell_at([1.2, 0.0]).is_none());
        assert!(before.cell_at([0.0, f64::NAN]).is_none() && before.cell_at([f64::INFINITY, 0.0]).is_none());
        let index = before.index_at([0.05, -0.55]).unwrap();
        let centre = before.centre_m(index);
        assert!((centre[0] - 0.05).abs() < 1e-12 && (centre[1] + 0.55).abs() < 1e-12);
    }

    #[test]
    fn a_disc_has_the_cells_within_its_radius() {
        let disc = Disc::new(2.0);
        assert_eq!((disc.rows(), disc.count()), (2, 13));
        assert_eq!([-3, -2, -1, 0].map(|row| disc.half_width(row)), [None, Some(0), Some(1), Some(2)]);
    }

    #[test]
    fn floor_is_that_of_the_library() {
        for x in [-3.5, -3.0, -0.1, -0.0, 0.0, 0.3 / 0.1, 0.9, 2.0, 7.999_999_999, 1e300, -1e300] {
            assert_eq!(floor(x), x.floor() as i64, "{x}");
        }
    }
}
