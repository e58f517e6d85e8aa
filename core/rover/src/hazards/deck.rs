//! Rocks that reach the deck: they must remain beside it, and it is wider than the disc under which the ground is assessed.
//!
//! ```text
//! deck step(p) = max step(q)      over the cells q with |q − p| ≤ deck_overhang_m and step(q) > deck_clearance_m
//! ```
//! 0 without such a cell. A step in the disc around q is at most `rover_radius_m + deck_overhang_m` from p: the rover's
//! origin, whose disc covers the deck in any heading. The leading disc covers the front of the deck already.
//!
//! Source: ours; dimensions of MER (domain.md 5.4).

use super::grid::Disc;

/// The highest step above `clearance_m` in the disc `overhang` around every cell, row by row, m; 0 without one.
pub(super) fn deck_steps(steps: &[f32], side: usize, overhang: &Disc, clearance_m: f32) -> Vec<f32> {
    let mut deck_steps = vec![0.0f32; steps.len()];
    for (index, step_m) in steps.iter().enumerate().filter(|(_, step_m)| **step_m > clearance_m) {
        let column = index % side;
        for beside in -overhang.rows()..=overhang.rows() {
            let row = (index / side).checked_add_signed(beside).filter(|row| *row < side);
            let (Some(row), Some(half)) = (row, overhang.half_width(beside)) else { continue };
            let half = half as usize;
            let line = &mut deck_steps[row * side..(row + 1) * side];
            for value in &mut line[column.saturating_sub(half)..(column + half + 1).min(side)] {
                *value = value.max(*step_m);
            }
        }
    }
    deck_steps
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_as_high_as_the_deck_reach_as_far_as_it() {
        let side = 12;
        let mut steps = vec![0.0f32; side * side];
        (steps[5 * side + 4], steps[11]) = (0.6, 0.4);
        let found = deck_steps(&steps, side, &Disc::new(2.0), 0.5);
        for (index, value) in found.iter().enumerate() {
            let (row, column) = (index / side, index % side);
            let away = (row as f64 - 5.0).hypot(column as f64 - 4.0);
            let expected = if away <= 2.0 { 0.6 } else { 0.0 };
            assert_eq!(*value, expected, "{row}, {column}");
        }
    }

    #[test]
    fn the_window_ends_a_step_at_its_border() {
        let side = 5;
        let mut steps = vec![0.0f32; side * side];
        steps[0] = 0.7;
        let found = deck_steps(&steps, side, &Disc::new(1.0), 0.5);
        let high: Vec<usize> = (0..side * side).filter(|index| found[*index] > 0.0).collect();
        assert_eq!(high, [0, 1, side]);
    }
}
