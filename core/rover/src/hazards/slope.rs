//! The slope of the ground around the rover, relative to which steps are measured.
//!
//! ```text
//! a = median (Δz − b Δy)/Δx   over pairs of cells `step_reach_m` apart along x
//! b = median (Δz − a Δx)/Δy   over pairs of cells as far apart along y
//! ```
//! Δx, Δy, Δz are the differences of the means of two known cells near the rover. Pairs at the edges of rocks and walls
//! are a minority and of both signs, so that they hardly change a median. The two medians are computed alternately, each
//! with the latest value of the other.
//!
//! Frame: axes of the site.

use super::settings::HazardSettings;

/// Half the side of the square around the rover whose cells are used, m: the ground of the next few motions.
const HALF_SIDE_M: f64 = 4.0;
/// Iterations of both medians; few suffice, because the cells' means are nearly on a lattice, which decouples them.
const REPEATED: usize = 3;
/// Smallest number of pairs for a slope.
const PAIRS_MIN: usize = 50;

/// The slope of the ground along x and y, m/m, from the means of each cell's points, m; 0 along an axis with too few pairs
/// of known cells.
pub(super) fn slope(means_m: &[Option<[f64; 3]>], side: usize, settings: &HazardSettings) -> [f64; 2] {
    let pairs = [0, 1].map(|axis| pairs(means_m, side, axis, settings));
    let mut slope = [0.0; 2];
    for _ in 0..REPEATED {
        for axis in [0, 1] {
            let other = 1 - axis;
            let along = |change: &[f64; 3]| (change[2] - slope[other] * change[other]) / change[axis];
            slope[axis] = median(pairs[axis].iter().map(along).collect());
        }
    }
    slope
}

/// The differences of the means of all pairs along an axis, m.
fn pairs(means_m: &[Option<[f64; 3]>], side: usize, axis: usize, settings: &HazardSettings) -> Vec<[f64; 3]> {
    let reach = ((settings.step_reach_m / settings.cell_m).round() as usize).max(1);
    let half = ((HALF_SIDE_M / settings.cell_m).round() as usize).min(side / 2);
    let near = side / 2 - half..side / 2 + half;
    let cells = near.clone().flat_map(|row| near.clone().map(move |column| [row, column]));
    let pair = |[row, column]: [usize; 2]| {
        let next = if axis == 0 { [row + reach, column] } else { [row, column + reach] };
        let mean = |[row, column]: [usize; 2]| means_m[row * side + column];
        let is_inside = next.iter().all(|number| *number < side);
        let [a, b] = [mean([row, column])?, is_inside.then(|| mean(next))??];
        Some([b[0] - a[0], b[1] - a[1], b[2] - a[2]])
    };
    cells.filter_map(pair).collect()
}

/// The median; 0 for fewer than [`PAIRS_MIN`] values.
fn median(mut values: Vec<f64>) -> f64 {
    if values.len() < PAIRS_MIN {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}
