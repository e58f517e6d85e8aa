//! How far the steps of SIFT reach from an extremum: what the scale space must keep for the descriptor.

/// Cells of a descriptor along each side.
pub(super) const CELLS: usize = 4;
/// Width of a cell, in σ.
pub(super) const CELL: f32 = 3.0;
/// Half the side of the window in cells: half a cell beyond the outermost centre counts in part.
pub(super) const WINDOW: f32 = 0.5 * (CELLS as f32 + 1.0);
/// Half the diagonal of the descriptor's window, in σ.
pub(super) const REACH: f32 = CELL * WINDOW * std::f32::consts::SQRT_2;
/// Pixels from where the refinement of an extremum began at most: what lies farther away is another extremum.
pub(super) const MOVE_MAX: usize = 5;
