//! Steps: the largest height difference of two nearby cells in the disc, relative to the slope of the ground.
//!
//! ```text
//! step(p) = max (|d(c) − d(c + o)| − k √(σ²(c) + σ²(c + o)))      c ∈ D_p ∩ (D_p − o),  0 < |o| ≤ reach
//! d(c)    = h(c) − a x(c) − b y(c)
//! s²(c)   = Σz²/n − z̄² − σ²(c)
//! edge(c) = max(z̄(c) − √3 s(c), z_top(c))
//! h(c)    = edge(c) if s(c) > face_spread_m + 2 σ(c) and no cell beside c is as high within face_spread_m, else z̄(c)
//! ```
//! A camera near the ground sees the face of a rock, and little of its top. The points of a face are spread uniformly from
//! its foot to its upper edge: s = H/√12 for a height H, and z̄ is half way up (z down). No point is above that edge,
//! z_top. If a cell beside it shows the top, the step to that cell is found anyway, and cells that are partly top and
//! partly ground keep their mean.
//!
//! Without the subtraction of the slope, a rock would be too low from its uphill side, by up to the fall of the ground
//! over `reach`, and too high from its downhill side.
//!
//! For each offset o the differences form one image, and the maximum over the intersection of both discs is computed row
//! by row: a run of l cells is covered by two runs of 2^k ≤ l, whose maxima are computed once for the whole image.
//!
//! | symbol | meaning |
//! |---|---|
//! | a, b | slope of the ground along x and y (`slope.rs`) |
//! | x(c), y(c) | mean position of the points of cell c, m |
//! | z̄(c), σ²(c) | mean height of the n points of cell c, m, and its expected variance, m² |
//! | s(c) | standard deviation of their heights beyond that error, m |
//! | k | `step_sigmas` |
//! | D_p | disc of the rover's radius around cell p |
//!
//! Source: domain.md 8.2.

use rayon::prelude::*;

use super::grid::Disc;
use super::map::HazardMap;
use super::settings::HazardSettings;
use super::slope::slope;

/// The largest step in the disc around every cell, row by row, m; 0 without a pair of known cells.
pub(super) fn steps(map: &HazardMap, disc: &Disc, reach: &Disc, settings: &HazardSettings) -> Vec<f32> {
    let side = map.grid.side;
    let heights = heights(map, settings);
    let k2 = settings.step_sigmas.powi(2);
    let variances: Vec<f32> = (0..side * side)
        .map(|index| (k2 * map.cell(index / side, index % side).variance_m2()) as f32)
        .collect();
    let cells = Cells { heights, variances, side };
    let offsets: Vec<[isize; 2]> = (0..=reach.rows())
        .flat_map(|row| {
            let half = reach.half_width(row).unwrap_or(-1);
            // One of each pair of opposite offsets.
            (-half..=half).map(move |column| [row, column])
        })
        .filter(|[row, column]| *row > 0 || *column > 0)
        .collect();
    let larger = |mut a: Vec<f32>, b: Vec<f32>| {
        raise(&mut a, &b);
        a
    };
    let nothing = || vec![0.0; side * side];
    offsets.into_par_iter().map(|offset| largest(&cells, offset, disc)).reduce(nothing, larger)
}

/// Height of every cell relative to the slope of the ground, row by row, z down, m; NaN if unknown.
fn heights(map: &HazardMap, settings: &HazardSettings) -> Vec<f32> {
    let (side, cell_m) = (map.grid.side, map.grid.cell_m);
    let mean = |[row, column]: [usize; 2]| {
        let cell = map.cell(row, column);
        (cell.count() >= settings.weight_min).then(|| {
            let [x, y, z] = cell.mean();
            let centre = |number: usize| (number as f64 + 0.5) * cell_m;
            [centre(row) + x, centre(column) + y, z]
        })
    };
    let height = |at: [usize; 2]| {
        let mean_m = mean(at)?[2];
        let Some(edge_m) = map.upper_edge_m(at[0], at[1], settings.face_spread_m) else {
            return Some(mean_m);
        };
        let around = |index: usize| index.saturating_sub(1)..(index + 2).min(side);
        let mut near = around(at[0]).flat_map(|row| around(at[1]).map(move |column| [row, column]));
        // z is down.
        let has_top =
            near.any(|other| mean(other).is_some_and(|top| top[2] <= edge_m + settings.face_spread_m));
        Some(if has_top { mean_m } else { edge_m })
    };
    let cells = || (0..side * side).map(|index| [index / side, index % side]);
    let means_m: Vec<Option<[f64; 3]>> = cells().map(mean).collect();
    let [a, b] = slope(&means_m, side, settings);
    let above = |(at, mean): ([usize; 2], &Option<[f64; 3]>)| {
        let [x, y, _] = (*mean)?;
        Some((height(at)? - a * x - b * y) as f32)
    };
    cells().zip(&means_m).map(|cell| above(cell).unwrap_or(f32::NAN)).collect()
}

/// Replaces every value by the larger of the two.
#[inline]
fn raise(values: &mut [f32], others: &[f32]) {
    for (value, other) in values.iter_mut().zip(others) {
        *value = if *other > *value { *other } else { *value };
    }
}

/// The cells row by row: heights, m (NaN if unknown), and k² times their variances, m².
struct Cells {
    heights: Vec<f32>,
    variances: Vec<f32>,
    side: usize,
}

/// The largest difference over all pairs of one offset, in the disc around every cell.
fn largest(cells: &Cells, offset: [isize; 2], disc: &Disc) -> Vec<f32> {
    let side = cells.side;
    let margin = disc.rows() as usize;
    let width = side + 2 * margin;
    let runs = Runs::new(differences(cells, offset, margin), width, margin);
    let mut steps = vec![0.0f32; side * side];
    for (row, steps) in steps.chunks_exact_mut(side).enumerate() {
        for beside in -disc.rows()..=disc.rows() {
            let (Some(row), Some(own), Some(other)) = (
                row.checked_add_signed(beside).filter(|row| *row < side),
                disc.half_width(beside),
                disc.half_width(beside + offset[0]),
            ) else {
                continue;
            };
            let (low, high) = ((-own).max(-other - offset[1]), own.min(other - offset[1]));
            if low <= high {
                runs.raise_row(steps, row, [low, high]);
            }
        }
    }
    steps
}

/// The excess of |h(c) − h(c + o)| over its error, with a margin of zeros on both sides of every row; 0 if one of the
/// cells is unknown.
fn differences(cells: &Cells, [down, along]: [isize; 2], margin: usize) -> Vec<f32> {
    let side = cells.side;
    let width = side + 2 * margin;
    let mut differences = vec![0.0f32; side * width];
    for (row, line) in differences.chunks_exact_mut(width).enumerate() {
        let other = row + down as usize;
        if other >= side {
            break;
        }
        let from = (-along).max(0) as usize;
        let to = (side as isize - along.max(0)) as usize;
        // Cells from..to of the row, and their partners.
        let own = row * side + from..row * side + to;
        let partners = ((other * side + from) as isize + along) as usize..;
        let line = &mut line[margin + from..margin + to];
        let a = cells.heights[own.clone()].iter().zip(&cells.variances[own]);
        let b = cells.heights[partners.clone()].iter().zip(&cells.variances[partners]);
        for (difference, ((a, a_variance), (b, b_variance))) in line.iter_mut().zip(a.zip(b)) {
            let height = (a - b).abs() - (a_variance + b_variance).sqrt();
            *difference = if height > 0.0 { height } else { 0.0 };
        }
    }
    differences
}

/// Maxima of an image over runs of 1, 2, 4 … pixels of a row, indexed by the first pixel of the run.
struct Runs {
    levels: Vec<Vec<f32>>,
    width: usize,
    margin: usize,
}

impl Runs {
    fn new(image: Vec<f32>, width: usize, margin: usize) -> Self {
        let mut levels = vec![image];
        let mut length = 1;
        while 2 * length <= 2 * margin + 1 {
            let mut doubled = levels[levels.len() - 1].clone();
            let before = &levels[levels.len() - 1];
            for (line, before) in doubled.chunks_exact_mut(width).zip(before.chunks_exact(width)) {
                raise(line, &before[length..]);
            }
            levels.push(doubled);
            length *= 2;
        }
        Self { levels, width, margin }
    }

    /// Raises the values of a row to the maxima over columns `low` to `high` beside each.
    fn raise_row(&self, values: &mut [f32], row: usize, [low, high]: [isize; 2]) {
        let length = (high - low + 1) as usize;
        let level = length.ilog2() as usize;
        let line = &self.levels[level][row * self.width..(row + 1) * self.width];
        let first = (self.margin as isize + low) as usize;
        raise(values, &line[first..]);
        let second = first + length - (1 << level);
        if second > first {
            raise(values, &line[second..]);
        }
    }
}
