//! Reach of the steps of SIFT around an extremum: the rows that the scale space must keep for the descriptor.

/// Cells of a descriptor along each side.
pub(super) const CELLS: usize = 4;
/// Width of a cell, in σ.
pub(super) const CELL: f32 = 3.0;
/// Half the side of the window in cells: it extends half a cell beyond the outermost cells, for interpolation.
pub(super) const WINDOW: f32 = 0.5 * (CELLS as f32 + 1.0);
/// Half the diagonal of the descriptor's window, in σ.
pub(super) const REACH: f32 = CELL * WINDOW * std::f32::consts::SQRT_2;
/// Largest distance of an extremum from the start of its refinement, px; farther away it is another extremum.
pub(super) const MOVE_MAX: usize = 5;
