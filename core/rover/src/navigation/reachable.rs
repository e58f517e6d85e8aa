//! The cells that no closed line of bad ground separates from the rover.
//!
//! ```text
//! reachable   cells connected with that of the rover over their eight neighbours, none of them bad
//!             and, if one of these is on the border of the window, all that are connected with the border: the ground
//!             outside is unknown
//! ```
//! Since the samples of a path are closer together than a cell is wide, a path without a bad sample stays in its region. A
//! region whose exit is too narrow for the rover is left to the search (`search.rs`).
//!
//! Frame: site, m.

use super::ground::{Ground, Part};

/// The cells that bad ground does not separate from the rover.
#[derive(Clone)]
pub(super) struct Reachable {
    /// Row by row; `None` if the rover is on a bad cell or outside the window: then no cell is excluded.
    cells: Option<Vec<bool>>,
}

impl Reachable {
    /// The cells reachable from a position, site frame, m.
    pub(super) fn new(ground: &Ground<'_>, from_m: [f64; 2]) -> Self {
        let Some(start) =
            ground.map.grid.index_at(from_m).filter(|index| !ground.is_bad(*index, Part::Origin))
        else {
            return Self { cells: None };
        };
        let side = ground.map.grid.side;
        let mut cells = vec![false; ground.map.grid.len()];
        cells[start] = true;
        let mut open = vec![start];
        let mut is_border_reached = false;
        while let Some(index) = open.pop() {
            let (row, column) = (index / side, index % side);
            if is_border(row, column, side) && !is_border_reached {
                is_border_reached = true;
                let border = (0..cells.len()).filter(|index| is_border(index / side, index % side, side));
                for at in border.filter(|index| !ground.is_bad(*index, Part::Origin)) {
                    if !std::mem::replace(&mut cells[at], true) {
                        open.push(at);
                    }
                }
            }
            for row in row.saturating_sub(1)..=(row + 1).min(side - 1) {
                for column in column.saturating_sub(1)..=(column + 1).min(side - 1) {
                    let at = row * side + column;
                    if !cells[at] && !ground.is_bad(at, Part::Origin) {
                        cells[at] = true;
                        open.push(at);
                    }
                }
            }
        }
        Self { cells: Some(cells) }
    }

    /// Whether a cell is reachable.
    pub(super) fn contains(&self, index: usize) -> bool {
        self.cells.as_ref().is_none_or(|cells| cells[index])
    }
}

fn is_border(row: usize, column: usize, side: usize) -> bool {
    [row, column].into_iter().any(|number| number == 0 || number + 1 == side)
}

#[cfg(test)]
mod tests {
    use super::super::limits::VetoLimits;
    use super::super::settings::NavigatorSettings;
    use super::super::tests::{known_to, pose};
    use super::*;
    use crate::hazards::HazardSettings;

    /// Whether positions are reachable from the origin over ground of a height function.
    fn reached(height: impl Fn(f64, f64) -> f64, places: &[[f64; 2]]) -> Vec<bool> {
        let (stance, settings) = (pose([0.0, 0.0], 0.0), HazardSettings::default());
        // Beyond the corners of the window.
        let map = known_to(12.0, &stance, &settings, height);
        let ground = Ground::new(&map, VetoLimits::new(&map.settings, &NavigatorSettings::default()));
        let reachable = Reachable::new(&ground, [0.0, 0.0]);
        places.iter().map(|at| reachable.contains(map.grid.index_at(*at).expect("in the window"))).collect()
    }

    #[test]
    fn a_closed_wall_separates_and_one_with_a_gate_does_not() {
        let is_wall = |x: f64, y: f64| (1.4..1.9).contains(&(x - 3.5).hypot(y));
        let ring = |x: f64, y: f64| if is_wall(x, y) { -0.4 } else { 0.0 };
        let gate = |x: f64, y: f64| if is_wall(x, y) && (x - 3.5 + y).abs() > 1.3 { -0.4 } else { 0.0 };
        let places = [[3.5, 0.0], [1.6, 0.0], [3.5, -3.5], [7.5, 7.5]];
        assert_eq!(reached(ring, &places), [false, false, true, true], "the second place is on the wall");
        assert_eq!(reached(gate, &places), [true, false, true, true]);
    }

    #[test]
    fn regions_that_meet_outside_the_window_are_connected() {
        let wall = |x: f64, _: f64| if (2.0..2.5).contains(&x) { -0.4 } else { 0.0 };
        assert_eq!(reached(wall, &[[4.0, 0.0], [2.2, 0.0], [2.2, 7.9]]), [true, false, false]);
        // The rover is enclosed and reaches nothing else.
        let closed = |x: f64, y: f64| if x.hypot(y) > 1.4 && x.hypot(y) < 1.9 { -0.4 } else { 0.0 };
        assert_eq!(reached(closed, &[[0.3, 0.0], [4.0, 0.0], [7.9, 0.0]]), [true, false, false]);
    }
}
