//! The goodness map as input of paths: bad cells, and the distance of every cell from them.
//!
//! ```text
//! clearance = + distance of the nearest bad cell      on cells that are not bad
//!             − distance of the nearest other cell    on bad cells
//! quality   = goodness · (½ + ½ min(1, clearance/clearance_m))
//! ```
//! A cell is bad for the disc at the rover's origin also if a step nearby reaches the deck.
//!
//! Distances are those of paths over neighbouring cells (1 and √2), at most 8 % too long [Borgefors86].
//!
//! Frame: site, m.

use crate::hazards::goodness::{CellBasis, GoodnessCell, GoodnessMap};

use super::limits::VetoLimits;
use super::settings::NavigatorSettings;

/// A cell without data, for points outside the window.
const OUTSIDE: GoodnessCell = GoodnessCell {
    tilt_deg: 0.0,
    roughness_m: 0.0,
    step_m: 0.0,
    deck_step_m: 0.0,
    certainty: 0.0,
    age_m: 0.0,
    height_m: None,
    top_m: None,
    goodness: 0.0,
    basis: CellBasis::Unknown,
};

/// Clearance if the window has no bad cell, m.
const FAR_M: f32 = 1e6;

/// The discs of the footprint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    /// The disc at the rover's origin, with the deck.
    Origin,
    /// The discs ahead of it and behind it.
    End,
}

impl Part {
    /// The part of a disc by its number, 0 at the rover's origin.
    pub(super) const fn of(number: usize) -> Self {
        if number == 0 { Self::Origin } else { Self::End }
    }

    /// The cell as this disc meets it.
    fn met(self, cell: &GoodnessCell) -> GoodnessCell {
        match self {
            Self::Origin => GoodnessCell { step_m: cell.step_m.max(cell.deck_step_m), ..*cell },
            Self::End => *cell,
        }
    }
}

/// A goodness map with the limits of the navigator.
pub(super) struct Ground<'a> {
    pub(super) map: &'a GoodnessMap,
    pub(super) limits: VetoLimits,
    /// Clearance of the cells for each [`Part`], row by row, m; negative on bad cells.
    clearance_m: [Vec<f32>; 2],
}

/// The ground at a position.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spot {
    /// Index of the cell; `None` outside the window.
    pub(super) index: Option<usize>,
    pub(super) cell: GoodnessCell,
    /// Negative on a bad cell.
    pub(super) clearance_m: f64,
}

impl<'a> Ground<'a> {
    pub(super) fn new(map: &'a GoodnessMap, limits: VetoLimits) -> Self {
        let side = map.grid.side;
        let cell_m = map.grid.cell_m as f32;
        let clearance_m = [Part::Origin, Part::End].map(|part| {
            let is_bad = |cell: &GoodnessCell| limits.exceeded(&part.met(cell)).is_some();
            let bad: Vec<bool> = map.cells.iter().map(is_bad).collect();
            let [from_bad, from_other] = [true, false].map(|wanted| distances(&bad, wanted, side));
            let all = bad.iter().zip(from_bad.iter().zip(&from_other));
            let clearance_m = all.map(|(is_bad, (bad, other))| {
                let cells = if *is_bad { -other } else { *bad };
                (cells * cell_m).clamp(-FAR_M, FAR_M)
            });
            clearance_m.collect()
        });
        Self { map, limits, clearance_m }
    }

    /// The ground under a disc at a position, site frame, m.
    pub(super) fn spot(&self, at_m: [f64; 2], part: Part) -> Spot {
        let Some(index) = self.map.grid.index_at(at_m) else {
            return Spot { index: None, cell: OUTSIDE, clearance_m: f64::from(FAR_M) };
        };
        self.spot_of(index, part)
    }

    /// Whether a term of a cell exceeds its limit for a disc.
    pub(super) fn is_bad(&self, index: usize, part: Part) -> bool {
        self.clearance_m[part as usize][index] < 0.0
    }

    /// Whether the ground under a disc at a position, site frame, m, is bad; false outside the window.
    pub(super) fn is_bad_at(&self, at_m: [f64; 2], part: Part) -> bool {
        self.map.grid.index_at(at_m).is_some_and(|index| self.is_bad(index, part))
    }

    /// The ground of a cell under a disc.
    pub(super) fn spot_of(&self, index: usize, part: Part) -> Spot {
        let clearance_m = f64::from(self.clearance_m[part as usize][index]);
        Spot { index: Some(index), cell: part.met(&self.map.cells[index]), clearance_m }
    }
}

impl Spot {
    /// Whether a term exceeds its limit.
    pub(super) fn is_bad(&self) -> bool {
        self.clearance_m < 0.0
    }

    /// Goodness, reduced near bad cells, 0 to 1.
    pub(super) fn quality(&self, settings: &NavigatorSettings) -> f64 {
        if self.is_bad() {
            return 0.0;
        }
        let is_near = self.clearance_m < settings.clearance_m;
        let share = if is_near { self.clearance_m / settings.clearance_m } else { 1.0 };
        f64::from(self.cell.goodness) * (0.5 + 0.5 * share)
    }
}

/// Distance of every cell from the nearest one whose flag is `wanted`, in cells: one pass down, one pass up.
fn distances(bad: &[bool], wanted: bool, side: usize) -> Vec<f32> {
    let mut distance: Vec<f32> = bad.iter().map(|bad| if *bad == wanted { 0.0 } else { FAR_M }).collect();
    let diagonal = std::f32::consts::SQRT_2;
    for row in 0..side {
        for column in 0..side {
            let at = row * side + column;
            let mut least = distance[at];
            if row > 0 {
                least = least.min(distance[at - side] + 1.0);
                if column > 0 {
                    least = least.min(distance[at - side - 1] + diagonal);
                }
                if column + 1 < side {
                    least = least.min(distance[at - side + 1] + diagonal);
                }
            }
            if column > 0 {
                least = least.min(distance[at - 1] + 1.0);
            }
            distance[at] = least;
        }
    }
    for row in (0..side).rev() {
        for column in (0..side).rev() {
            let at = row * side + column;
            let mut least = distance[at];
            if row + 1 < side {
                least = least.min(distance[at + side] + 1.0);
                if column > 0 {
                    least = least.min(distance[at + side - 1] + diagonal);
                }
                if column + 1 < side {
                    least = least.min(distance[at + side + 1] + diagonal);
                }
            }
            if column + 1 < side {
                least = least.min(distance[at + 1] + 1.0);
            }
            distance[at] = least;
        }
    }
    distance
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_within_8_percent_of_the_euclidean_ones() {
        let side = 41;
        let mut bad = vec![false; side * side];
        for at in [[20, 20], [3, 37]] {
            bad[at[0] * side + at[1]] = true;
        }
        for (index, found) in distances(&bad, true, side).into_iter().enumerate() {
            let from = |at: [f64; 2]| ((index / side) as f64 - at[0]).hypot((index % side) as f64 - at[1]);
            let exact = from([20.0, 20.0]).min(from([3.0, 37.0]));
            let found = f64::from(found);
            assert!(found >= exact - 1e-4 && found <= 1.083 * exact + 1e-4, "{index}: {found} {exact}");
        }
    }
}
