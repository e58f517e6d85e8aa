//! The ground around every cell as a plane, from which the heights of steps are measured: the slope itself is not a step.
//!
//! ```text
//! S(c) = z + a Δx + b Δy      least squares over the means of the known cells of a square around c, at the mean of c
//! ```
//! A rock at the border of the known ground tilts the plane. The fit is therefore repeated without the cells that are farther than
//! `step_ok_m` from the first plane; the first one stays where less than half of them are left. The sums over a square are four values of sums over
//! rectangles from the corner of the window [Crow84].
//!
//! Frame: heights z of the site from the reference of the map, m.

use rayon::prelude::*;

use super::moments::{Moments, SUMS};
use super::settings::HazardSettings;

/// Half the side of the square, m: several times the widest rock that a rover meets, and less than the hills.
const HALF_SIDE_M: f64 = 2.0;

/// The height of the plane around every cell at the mean of its points, row by row, m, NaN where unknown; of cells on a line their
/// mean height. `means_m` are those of the points of each cell, from the corner of the window.
pub(super) fn slopes(means_m: &[Option<[f64; 3]>], side: usize, settings: &HazardSettings) -> Vec<f32> {
    let half = (HALF_SIDE_M / settings.cell_m).round() as usize;
    let first = planes(means_m, means_m, side, half);
    let is_ground = |mean_m: &[f64; 3], plane_m: f64| (mean_m[2] - plane_m).abs() <= settings.step_ok_m;
    let ground: Vec<Option<[f64; 3]>> = means_m
        .iter()
        .zip(&first)
        .map(|(mean, plane)| mean.filter(|mean| is_ground(mean, plane.height_m)))
        .collect();
    let second = planes(means_m, &ground, side, half);
    let best = |(first, second): (&Around, &Around)| {
        let is_most = 2.0 * second.count >= first.count;
        (if is_most { second.height_m } else { first.height_m }) as f32
    };
    first.iter().zip(&second).map(best).collect()
}

/// The plane of the ground around a cell.
struct Around {
    /// Its height at the mean of the cell, m; NaN without one.
    height_m: f64,
    /// Number of cells that it goes through.
    count: f64,
}

/// The plane through the cells `of` around each cell `at`.
fn planes(at: &[Option<[f64; 3]>], of: &[Option<[f64; 3]>], side: usize, half: usize) -> Vec<Around> {
    let corner = corner_sums(of, side);
    let width = side + 1;
    let height = |(index, mean_m): (usize, &Option<[f64; 3]>)| {
        let Some([x, y, _]) = *mean_m else { return Around { height_m: f64::NAN, count: 0.0 } };
        let [[from_row, to_row], [from_column, to_column]] = [index / side, index % side]
            .map(|number| [number.saturating_sub(half), (number + half + 1).min(side)]);
        let at = |row: usize, column: usize| &corner[row * width + column].0;
        let (all, above) = (at(to_row, to_column), at(from_row, to_column));
        let (left, both) = (at(to_row, from_column), at(from_row, from_column));
        let sums = Moments(std::array::from_fn(|k| all[k] - above[k] - left[k] + both[k]));
        Around { height_m: sums.height_at([x, y]), count: sums.count() }
    };
    at.par_iter().enumerate().map(height).collect()
}

/// Sums over the known cells before each row and column.
fn corner_sums(means_m: &[Option<[f64; 3]>], side: usize) -> Vec<Moments> {
    let width = side + 1;
    let mut sums = vec![Moments::default(); width * width];
    for row in 0..side {
        let mut of_row = Moments::default();
        for column in 0..side {
            if let Some(mean_m) = means_m[row * side + column] {
                of_row.add(mean_m, 0.0, 0.0);
            }
            let above = sums[row * width + column + 1].0;
            let sum: [f64; SUMS] = std::array::from_fn(|k| above[k] + of_row.0[k]);
            sums[(row + 1) * width + column + 1] = Moments(sum);
        }
    }
    sums
}
