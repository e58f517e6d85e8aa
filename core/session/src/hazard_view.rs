//! The goodness map of a stop as clients receive it.

use serde::{Deserialize, Serialize};
use sightline_rover::driving::{RangeData, StopHazards};
use sightline_rover::hazards::{CellBasis, HazardTerm};
use utoipa::ToSchema;

/// Goodness of an unknown cell.
pub const UNKNOWN: i8 = -1;

/// The goodness map of a stop: square cells in the site frame, row by row (x, north), in each row along y (east).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct HazardView {
    /// The stop.
    pub step: usize,
    /// Number of points by stereo at this stop; null without range data.
    pub range_points: Option<usize>,
    /// Why there are no range data; null otherwise.
    pub missing: Option<String>,
    /// Side of a cell, m.
    pub cell_m: f64,
    /// Number of rows, and of cells in a row.
    pub side: usize,
    /// x and y of the corner with the least of both, site frame, m.
    pub corner_m: [f64; 2],
    /// Goodness, from 0 (bad) to 100; −1 if it is unknown.
    pub goodness_percent: Vec<i8>,
    /// The term that limits the goodness; null for a cell of full goodness.
    pub limited_by: Vec<Option<HazardTerm>>,
    /// The value of that term: tilt in deg, roughness and step in m, certainty from 0 to 1.
    pub value: Vec<f32>,
    /// The basis of the goodness: measured, unknown, assumed or exempt.
    pub basis: Vec<CellBasis>,
    /// Measured height, z of the site frame (down), m; null if too few points were measured.
    pub height_m: Vec<Option<f32>>,
}

impl HazardView {
    /// The view of the hazards of a stop.
    pub fn of(hazards: &StopHazards) -> Self {
        let map = &hazards.map;
        let limiting = |cell| sightline_rover::hazards::GoodnessCell::limiting(cell, &map.settings);
        let percent = |goodness: f32| (100.0 * goodness).round().clamp(0.0, 100.0) as i8;
        let (range_points, missing) = match &hazards.range {
            RangeData::Points(count) => (Some(*count), None),
            RangeData::Missing(why) => (None, Some(why.clone())),
        };
        Self {
            step: hazards.step,
            range_points,
            missing,
            cell_m: map.grid.cell_m,
            side: map.grid.side,
            corner_m: map.grid.first.map(|number| number as f64 * map.grid.cell_m),
            goodness_percent: map
                .cells
                .iter()
                .map(|cell| if cell.basis == CellBasis::Unknown { UNKNOWN } else { percent(cell.goodness) })
                .collect(),
            limited_by: map.cells.iter().map(|cell| limiting(cell).map(|(term, _)| term)).collect(),
            // Three decimals suffice for display.
            value: map
                .cells
                .iter()
                .map(|cell| limiting(cell).map_or(0.0, |(_, value)| (1000.0 * value).round() / 1000.0) as f32)
                .collect(),
            basis: map.cells.iter().map(|cell| cell.basis).collect(),
            height_m: map
                .cells
                .iter()
                .map(|cell| cell.height_m.map(|height_m| (1000.0 * height_m).round() / 1000.0))
                .collect(),
        }
    }

    /// The index of the cell at a position, x and y of the site frame, m; `None` outside the map.
    pub fn index_at(&self, at_m: [f64; 2]) -> Option<usize> {
        let number = |axis: usize| {
            let number = ((at_m[axis] - self.corner_m[axis]) / self.cell_m).floor();
            (number >= 0.0 && number < self.side as f64).then_some(number as usize)
        };
        Some(number(0)? * self.side + number(1)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_position_is_in_the_cell_of_its_row_and_column() {
        let view = HazardView {
            step: 0,
            range_points: None,
            missing: None,
            cell_m: 0.5,
            side: 4,
            corner_m: [-1.0, 2.0],
            goodness_percent: vec![UNKNOWN; 16],
            limited_by: vec![None; 16],
            value: vec![0.0; 16],
            basis: vec![CellBasis::Unknown; 16],
            height_m: vec![None; 16],
        };
        assert_eq!(view.index_at([-0.9, 2.1]), Some(0));
        assert_eq!(view.index_at([-0.4, 3.9]), Some(7));
        assert_eq!(view.index_at([-1.1, 2.1]), None);
        assert_eq!(view.index_at([0.0, 4.0]), None);
    }
}
