//! The coarse search: shifts the moving mesh across the fixed one in steps of one pixel of the sensor (R198–R200).
//!
//! ```text
//! t  = x c_x + y c_y + z c_z                                                        D-Eq 13
//! Δz = median_i( z_i − h_i(x₀ + Δx, y₀ + Δy, z₀, r₀) )                              D-Eq 14 with E24
//! J(Δx, Δy) = 1/n Σ_i | h_i + Δz − z_i |      over the n common pixels, at least overlap_min of the fixed surface's
//! ```
//! The rotation is that of the start, which is about right. For an orthographic sensor, h at a shift by whole pixels is
//! the unshifted depth map read at other pixels: the mesh is rendered once, to an image widened by the search range. For
//! a pinhole it is rendered for each shift; a step is a pixel's width at the depth of the target.
//!
//! The search reads every second pixel of every second row: about 1,000 of 64 × 64, more than the shape of a rock needs.
//!
//! **Isolation.** `other` is the lowest minimum of J at least `apart_m` from the best; if it is nearly as low, the
//! surfaces fit in two places.
//!
//! | symbol | our name | unit, frame |
//! |---|---|---|
//! | Δx, Δy | [`CoarseSurface::step_m`] times whole numbers | m, sensor |
//! | Δz | [`CoarseSurface::shift_m`] | m, sensor |
//! | J | [`CoarseSurface::mean_m`] | m |
//!
//! Source: D§2, D-Eq 13, 14; R198–R200; E24, E31.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::objective::{Agreement, Offset, agreement, motion};
use super::range_sensor::{Projection, RangeSensor};
use super::rasterise::{Depths, Facets, Picture, rasterise};
use sightline_geometry::cancel::Cancel;
use sightline_geometry::frames::Point3;

/// Stride of the compared pixels, in x and in y.
const EVERY: usize = 2;

/// J over all shifts of the search.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CoarseSurface {
    /// Steps to each side; the map has 2 · this + 1 rows and columns, the first row at the least Δy.
    pub steps: usize,
    /// Shift from step to step, m.
    pub step_m: f64,
    /// J, m, row by row; infinite where the overlap is too small.
    pub mean_m: Vec<f32>,
    /// Δz, m, in the same order; 0 without overlap.
    pub shift_m: Vec<f32>,
    /// Largest fraction of the fixed surface's pixels that any shift covers.
    pub overlap_best: f64,
    /// Minimum of J; `None` if no shift has enough overlap.
    pub best: Option<Minimum>,
    /// The lowest other minimum that is far enough from `best`.
    pub other: Option<Minimum>,
}

/// A minimum of J over the shifts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Minimum {
    /// Δx, Δy, Δz, m, sensor.
    pub shift_m: [f64; 3],
    /// J, m.
    pub mean_m: f64,
    /// Whether it is on the border of the search.
    pub is_at_edge: bool,
}

impl Minimum {
    /// Returns the shift as an offset without rotation.
    pub fn offset(&self) -> Offset {
        let [x, y, z] = self.shift_m;
        Offset::new(x, y, z, 0.0, 0.0, 0.0)
    }
}

/// Input of the coarse search.
#[derive(Clone, Copy)]
pub(super) struct CoarseInput<'a> {
    pub(super) sensor: &'a RangeSensor,
    /// z, m; infinite where the fixed surface does not cover the pixel.
    pub(super) fixed_m: &'a [f32],
    /// The moving mesh at its start, in the sensor's frame.
    pub(super) facets: &'a Facets,
    pub(super) pivot: Point3,
    /// Half range of the search, m.
    pub(super) half_range_m: f64,
    /// Least distance between separate minima, m.
    pub(super) apart_m: f64,
    pub(super) overlap_min: f64,
    /// Once requested, no further shift is compared.
    pub(super) cancel: Cancel<'a>,
}

impl CoarseInput<'_> {
    /// Returns a row of shifts without overlap once cancellation is requested.
    fn cancelled_row(&self, side: usize) -> Option<Vec<(Agreement, f32)>> {
        self.cancel.is_requested().then(|| vec![(agreement(0.0, 0, 1, self.overlap_min), 0.0); side])
    }
}

/// Computes J over all shifts, and its minima.
pub(super) fn coarse_register(input: &CoarseInput<'_>) -> CoarseSurface {
    let step_m = input.sensor.pixel_m(input.pivot.z);
    let steps = (input.half_range_m / step_m).round().max(1.0) as usize;
    let cells = match input.sensor.projection {
        Projection::Orthographic { .. } => by_reading(input, steps),
        Projection::Pinhole { .. } => by_drawing(input, steps, step_m),
    };
    let mut surface = CoarseSurface {
        steps,
        step_m,
        mean_m: cells.iter().map(|(agreement, _)| agreement.mean_m as f32).collect(),
        shift_m: cells.iter().map(|&(_, shift_m)| shift_m).collect(),
        overlap_best: cells.iter().map(|(agreement, _)| agreement.overlap).fold(0.0, f64::max),
        best: None,
        other: None,
    };
    surface.find_minima(input.apart_m);
    surface
}

/// Indices and depths of the pixels to compare.
fn compared(sensor: &RangeSensor, fixed_m: &[f32]) -> Vec<(usize, f32)> {
    let is_compared = |&pixel: &usize| {
        (pixel % sensor.width).is_multiple_of(EVERY)
            && (pixel / sensor.width).is_multiple_of(EVERY)
            && fixed_m[pixel].is_finite()
    };
    (0..fixed_m.len()).filter(is_compared).map(|pixel| (pixel, fixed_m[pixel])).collect()
}

/// J and Δz of all shifts from one rendered depth map (orthographic sensor).
fn by_reading(input: &CoarseInput<'_>, steps: usize) -> Vec<(Agreement, f32)> {
    let wide = input.sensor.widened(steps);
    let mut moving_m = vec![f32::INFINITY; wide.width * wide.height];
    let still = motion(&Offset::zeros(), &input.pivot);
    rasterise(&wide, input.facets, &still, &mut Picture::default(), &mut Depths(&mut moving_m));
    // Index of each pixel in the wide image at the shift by −steps, which reads farthest to the right and below.
    let width = input.sensor.width;
    let pixels: Vec<(usize, f32)> = compared(input.sensor, input.fixed_m)
        .into_iter()
        .map(|(pixel, z)| ((pixel / width + 2 * steps) * wide.width + pixel % width + 2 * steps, z))
        .collect();
    let side = 2 * steps + 1;
    let row = |j: usize| {
        if let Some(cells) = input.cancelled_row(side) {
            return cells;
        }
        let mut differences = Vec::with_capacity(pixels.len());
        let mut cells = Vec::with_capacity(side);
        for i in 0..side {
            let back = j * wide.width + i;
            differences.clear();
            differences
                .extend(pixels.iter().map(|&(at, z)| z - moving_m[at - back]).filter(|d| d.is_finite()));
            cells.push(cell(&mut differences, pixels.len(), input.overlap_min));
        }
        cells
    };
    (0..side).into_par_iter().flat_map_iter(row).collect()
}

/// J and Δz of all shifts, rendering the mesh for each (pinhole).
fn by_drawing(input: &CoarseInput<'_>, steps: usize, step_m: f64) -> Vec<(Agreement, f32)> {
    let pixels = compared(input.sensor, input.fixed_m);
    let side = 2 * steps + 1;
    let row = |j: usize| {
        if let Some(cells) = input.cancelled_row(side) {
            return cells;
        }
        let mut moving_m = vec![f32::INFINITY; input.fixed_m.len()];
        let mut picture = Picture::default();
        let mut differences = Vec::with_capacity(pixels.len());
        let mut cells = Vec::with_capacity(side);
        for i in 0..side {
            let [x_m, y_m] = [i, j].map(|step| (step as f64 - steps as f64) * step_m);
            let shifted = motion(&Offset::new(x_m, y_m, 0.0, 0.0, 0.0, 0.0), &input.pivot);
            moving_m.fill(f32::INFINITY);
            rasterise(input.sensor, input.facets, &shifted, &mut picture, &mut Depths(&mut moving_m));
            differences.clear();
            differences.extend(pixels.iter().map(|&(at, z)| z - moving_m[at]).filter(|d| d.is_finite()));
            cells.push(cell(&mut differences, pixels.len(), input.overlap_min));
        }
        cells
    };
    (0..side).into_par_iter().flat_map_iter(row).collect()
}

/// J with the median of z − h as the shift in depth, and that shift.
fn cell(differences_m: &mut [f32], pixels: usize, overlap_min: f64) -> (Agreement, f32) {
    let count = differences_m.len();
    if count == 0 {
        return (agreement(0.0, 0, pixels, overlap_min), 0.0);
    }
    let (below, &mut shift_m, above) = differences_m.select_nth_unstable_by(count / 2, f32::total_cmp);
    // On either side of the median, all differences have the same sign.
    let low: f32 = below.iter().map(|difference| shift_m - difference).sum();
    let high: f32 = above.iter().map(|difference| difference - shift_m).sum();
    (agreement(f64::from(low + high), count, pixels, overlap_min), shift_m)
}

impl CoarseSurface {
    fn side(&self) -> usize {
        2 * self.steps + 1
    }

    fn minimum(&self, cell: usize) -> Minimum {
        let [i, j] = [cell % self.side(), cell / self.side()];
        let at = |step: usize| (step as f64 - self.steps as f64) * self.step_m;
        let last = self.side() - 1;
        Minimum {
            shift_m: [at(i), at(j), f64::from(self.shift_m[cell])],
            mean_m: f64::from(self.mean_m[cell]),
            is_at_edge: i == 0 || j == 0 || i == last || j == last,
        }
    }

    /// Returns whether no neighbour of a cell is lower.
    fn is_minimum(&self, cell: usize) -> bool {
        let side = self.side();
        let (i, j) = (cell % side, cell / side);
        let around = |n: usize| n.saturating_sub(1)..=(n + 1).min(side - 1);
        around(j).all(|row| around(i).all(|column| self.mean_m[row * side + column] >= self.mean_m[cell]))
    }

    fn find_minima(&mut self, apart_m: f64) {
        let lowest = |cells: &mut dyn Iterator<Item = usize>| {
            cells
                .filter(|&cell| self.mean_m[cell].is_finite())
                .min_by(|&a, &b| self.mean_m[a].total_cmp(&self.mean_m[b]))
        };
        let Some(best) = lowest(&mut (0..self.mean_m.len())).map(|cell| self.minimum(cell)) else { return };
        let is_apart = |cell: usize| {
            let [x, y, _] = self.minimum(cell).shift_m;
            (x - best.shift_m[0]).hypot(y - best.shift_m[1]) >= apart_m
        };
        let others = &mut (0..self.mean_m.len()).filter(|&cell| is_apart(cell) && self.is_minimum(cell));
        let other = lowest(others).map(|cell| self.minimum(cell));
        (self.best, self.other) = (Some(best), other);
    }
}
