//! Sums of all cells inside a disc, for every cell of the map.
//!
//! ```text
//! P[i][j] = Σ_{j' < j} m[i][j']      sum[i][j] = Σ_d (P[i + d][j + w_d + 1] − P[i + d][j − w_d])
//! ```
//! | symbol | meaning |
//! |---|---|
//! | m | sums of a cell, relative to the centre of the window |
//! | d, w_d | row of the disc and its half-width |
//!
//! The work for a cell grows with the radius instead of its square. Prefix sums: [Crow84], here along rows alone.

use rayon::prelude::*;

use super::grid::Disc;
use super::map::HazardMap;
use super::moments::{Moments, SUMS};

/// Number of sums of a cell and of its flag, which is 1 if it is known.
const WITH_KNOWN: usize = SUMS + 1;
type Sums = [f64; WITH_KNOWN];

/// Statistics of the disc around a cell.
#[derive(Clone, Copy, Debug)]
pub(super) struct DiscSums {
    /// Sums over its points, relative to the centre of the window.
    pub(super) moments: Moments,
    /// Number of known cells.
    pub(super) known: f64,
}

/// The sums of the discs around all cells, row by row.
pub(super) fn disc_sums(map: &HazardMap, disc: &Disc, weight_min: f64) -> Vec<DiscSums> {
    let side = map.grid.side;
    let prefixes: Vec<Vec<Sums>> =
        (0..side).into_par_iter().map(|row| row_prefixes(map, row, weight_min)).collect();
    let rows: Vec<Vec<DiscSums>> =
        (0..side).into_par_iter().map(|row| sums_of_row(&prefixes, disc, row)).collect();
    rows.concat()
}

/// Prefix sums over the cells of a row: entry j contains the columns before j.
fn row_prefixes(map: &HazardMap, row: usize, weight_min: f64) -> Vec<Sums> {
    let (side, cell_m) = (map.grid.side, map.grid.cell_m);
    let from_middle = |number: usize| (number as f64 + 0.5 - 0.5 * side as f64) * cell_m;
    let mut prefixes = Vec::with_capacity(side + 1);
    let mut sums = [0.0; WITH_KNOWN];
    prefixes.push(sums);
    for column in 0..side {
        let cell = map.cell(row, column);
        if cell.count() > 0.0 {
            let shifted = cell.shifted(from_middle(row), from_middle(column));
            for (sum, value) in sums.iter_mut().zip(shifted.0) {
                *sum += value;
            }
            if cell.count() >= weight_min {
                sums[SUMS] += 1.0;
            }
        }
        prefixes.push(sums);
    }
    prefixes
}

fn sums_of_row(prefixes: &[Vec<Sums>], disc: &Disc, row: usize) -> Vec<DiscSums> {
    let side = prefixes.len();
    let mut sums = vec![[0.0; WITH_KNOWN]; side];
    for offset in -disc.rows()..=disc.rows() {
        let (Some(prefix), Some(half)) =
            (row.checked_add_signed(offset).and_then(|row| prefixes.get(row)), disc.half_width(offset))
        else {
            continue;
        };
        let half = half as usize;
        for (column, sum) in sums.iter_mut().enumerate() {
            let from = &prefix[column.saturating_sub(half)];
            let to = &prefix[(column + half + 1).min(side)];
            for ((sum, to), from) in sum.iter_mut().zip(to).zip(from) {
                *sum += to - from;
            }
        }
    }
    let split = |sums: Sums| {
        let moments = Moments(std::array::from_fn(|k| sums[k]));
        DiscSums { moments, known: sums[SUMS] }
    };
    sums.into_iter().map(split).collect()
}
