//! SIFT descriptor: 4 × 4 histograms of gradient directions in 8 bins around a keypoint.
//!
//! In a frame rotated by the keypoint's direction θ, with cells 3σ wide, pixel (x, y) at (dx, dy) from the keypoint has
//!
//! ```text
//! c = ( dx cos θ + dy sin θ)/(3σ) + 3/2       r = (−dx sin θ + dy cos θ)/(3σ) + 3/2
//! o = 8 (θ − direction)/2π                    m = |∇G| exp(−(dx² + dy²)/(2 (6σ)²))
//! h(i, j, k) = Σ m t(r − i) t(c − j) t(o − k),    t(a) = max(0, 1 − |a|),   i, j = 0 … 3,  k = 0 … 7 (a circle)
//! ```
//! | symbol | our name | unit |
//! |---|---|---|
//! | σ, θ | `sigma`, `orientation_rad` | px of the octave, rad |
//! | r, c, o | row, column and direction as cells | – |
//! | h(i, j, k) | element 8 (4i + j) + k of the [`Descriptor`] | – |
//!
//! h is normalised, clamped at 0.2, normalised again and stored as 512 times itself, at most 255. Directions are counted
//! against the rotation of the frame (o grows as the direction falls), as in OpenCV and Lowe's program, so that the
//! elements are comparable. The keypoint's position is used at sub-pixel precision; OpenCV uses the nearest pixel.
//!
//! The sum is a product of matrices: 16 cells × 8 directions, summed over the pixels. Pixels are side by side in a
//! vector, 16 sums of a row of cells stay in registers, and a vector of pixels is skipped for the rows of cells that it
//! does not touch.

use std::f32::consts::TAU;

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::extent::{CELL, CELLS, REACH, WINDOW};
use super::gradient::{gaussian_weights, inner, polar, rows_around};
use super::lanes::{Line, WIDEST, load, places};
use super::plane::Plane;
use super::scale_space::Octave;
use super::{Keypoint, Place};

/// h as 128 bytes.
pub type Descriptor = [u8; NUMBERS];

/// Number of directions; number of elements of a descriptor.
const DIRECTIONS: usize = 8;
const NUMBERS: usize = CELLS * CELLS * DIRECTIONS;
/// Directions summed at a time.
const HALF: usize = DIRECTIONS / 2;
/// Standard deviation of the weights, in cells.
const WEIGHT_SIGMA: f32 = 0.5 * CELLS as f32;
/// Upper bound of an element as a fraction of the norm, and norm of the stored descriptor.
const LARGEST: f32 = 0.2;
const LENGTH: f32 = 512.0;

/// Factors per vector of pixels: t(r − i) m, t(c − j), t(o − k).
const PARTS: usize = CELLS + CELLS + DIRECTIONS;

/// Computes the descriptors of keypoints of an octave.
pub(super) fn describe(octave: &Octave, keypoints: &[(Place, Keypoint)]) -> Vec<Descriptor> {
    let scale = octave.input_px() as f32;
    let describe_one = |samples: &mut Samples, (_, keypoint): &(Place, Keypoint)| {
        let window = Window {
            layer: &octave.layers[usize::from(keypoint.layer)],
            place: [keypoint.x / scale, keypoint.y / scale],
            sigma: keypoint.sigma_px / scale,
            orientation_rad: keypoint.orientation_rad,
        };
        let mut histogram = [0.0; NUMBERS];
        Arch::new().dispatch(Describe { window, samples, histogram: &mut histogram });
        bytes_of(&histogram)
    };
    keypoints.par_iter().map_init(Samples::default, describe_one).collect()
}

/// Converts h to a descriptor.
fn bytes_of(histogram: &[f32; NUMBERS]) -> Descriptor {
    let length = |values: &[f32; NUMBERS]| values.iter().map(|v| v * v).sum::<f32>().sqrt();
    let most = LARGEST * length(histogram);
    let cut = histogram.map(|value| value.min(most));
    let scale = LENGTH / length(&cut).max(f32::MIN_POSITIVE);
    cut.map(|value| (value * scale).round() as u8)
}

/// Position, scale and direction of a descriptor, px of the octave.
struct Window<'a> {
    layer: &'a Plane,
    place: [f32; 2],
    sigma: f32,
    orientation_rad: f32,
}

/// The pixels of a window as the factors of the sum.
#[derive(Default)]
struct Samples {
    /// `PARTS` vectors for each vector of pixels.
    parts: Vec<Line>,
    /// Indices of the vectors of pixels that touch each row of cells.
    touching: [Vec<usize>; CELLS],
    /// exp(−dx²/(2 (6σ)²)) of the columns, and the same for the rows.
    across: Vec<f32>,
    down: Vec<f32>,
}

/// Computes h of a window.
struct Describe<'a> {
    window: Window<'a>,
    samples: &'a mut Samples,
    histogram: &'a mut [f32; NUMBERS],
}

impl WithSimd for Describe<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { window, samples, histogram } = self;
        take(simd, &window, samples);
        let parts: &[f32] = bytemuck::cast_slice(&samples.parts);
        for (row, (touching, numbers)) in
            samples.touching.iter().zip(histogram.chunks_exact_mut(CELLS * DIRECTIONS)).enumerate()
        {
            for half in 0..2 {
                simd.vectorize(Sum { parts, touching, row, half, numbers });
            }
        }
    }
}

/// Computes the factors of a window's pixels.
#[inline(always)]
fn take<S: Simd>(simd: S, window: &Window<'_>, samples: &mut Samples) {
    let Window { layer, place: [x, y], sigma, orientation_rad } = *window;
    let cell = CELL * sigma;
    let (sin, cos) = orientation_rad.sin_cos();
    let frame = [cos / cell, sin / cell];
    let columns = inner(x, REACH * sigma, layer.width);
    let rows = inner(y, REACH * sigma, layer.height);
    let Samples { parts, touching, across, down } = samples;
    gaussian_weights(columns.clone(), x, WEIGHT_SIGMA * cell, WIDEST, across);
    gaussian_weights(rows.clone(), y, WEIGHT_SIGMA * cell, 0, down);
    touching.iter_mut().for_each(Vec::clear);
    let vectors_in_row = across.len().div_ceil(S::F32_LANES);
    let room = down.len() * vectors_in_row * PARTS * S::F32_LANES / WIDEST;
    if parts.len() < room {
        parts.resize(room, Line::ZERO);
    }
    let parts: &mut [f32] = bytemuck::cast_slice_mut(parts);
    let mut taken = 0;
    for (row, weight) in rows.zip(down.iter()) {
        let dy = row as f32 - y;
        let [low, high] = span(frame, dy);
        let first = ((x + low).ceil().max(*columns.start() as f32)) as usize;
        let last = ((x + high).floor().max(0.0) as usize).min(*columns.end());
        let around = rows_around(layer, row);
        let mut column = first;
        while column <= last {
            let dx = column as f32 - x;
            let part = &mut parts[taken * PARTS * S::F32_LANES..][..PARTS * S::F32_LANES];
            let (length, direction) = polar(simd, around, column);
            let weights = load::<S>(across, column - columns.start());
            let weights = simd.mul_f32s(weights, simd.splat_f32s(*weight));
            factors(simd, [length, direction, weights], frame, orientation_rad, [dx, dy], part);
            let from = row_of_cells(frame, dx, dy);
            let to = row_of_cells(frame, dx + (S::F32_LANES - 1) as f32, dy);
            for (i, touching) in touching.iter_mut().enumerate() {
                if from.max(to) > i as f32 - 1.0 && from.min(to) < i as f32 + 1.0 {
                    touching.push(taken);
                }
            }
            taken += 1;
            column += S::F32_LANES;
        }
    }
}

/// r.
#[inline(always)]
fn row_of_cells([cos, sin]: [f32; 2], dx: f32, dy: f32) -> f32 {
    dy * cos - dx * sin + 0.5 * (CELLS as f32 - 1.0)
}

/// Range of dx in which a row is inside the window.
#[inline(always)]
fn span([cos, sin]: [f32; 2], dy: f32) -> [f32; 2] {
    let mut span = [f32::NEG_INFINITY, f32::INFINITY];
    // |slope dx + offset| ≤ half the side.
    for (slope, offset) in [(cos, dy * sin), (-sin, dy * cos)] {
        let (a, b) = ((-WINDOW - offset) / slope, (WINDOW - offset) / slope);
        if a.is_finite() && b.is_finite() {
            span = [span[0].max(a.min(b)), span[1].min(a.max(b))];
        } else if offset.abs() > WINDOW {
            return [f32::INFINITY, f32::NEG_INFINITY];
        }
    }
    span
}

/// Computes the factors of a vector of pixels, the first of which is at (dx, dy): t(r − i) m, t(c − j), t(o − k).
#[inline(always)]
fn factors<S: Simd>(
    simd: S,
    [length, direction, weights]: [S::f32s; 3],
    [cos, sin]: [f32; 2],
    orientation_rad: f32,
    [dx, dy]: [f32; 2],
    part: &mut [f32],
) {
    let part = S::as_mut_simd_f32s(part).0;
    let zero = simd.splat_f32s(0.0);
    let dx = simd.add_f32s(simd.splat_f32s(dx), places::<S>());
    let middle = 0.5 * (CELLS as f32 - 1.0);
    let column = simd.mul_add_e_f32s(dx, simd.splat_f32s(cos), simd.splat_f32s(dy * sin + middle));
    let row = simd.mul_add_e_f32s(dx, simd.splat_f32s(-sin), simd.splat_f32s(dy * cos + middle));
    let turn = simd.sub_f32s(simd.splat_f32s(orientation_rad), direction);
    let turn = simd.mul_f32s(turn, simd.splat_f32s(DIRECTIONS as f32 / TAU));
    // Adds a full circle to negative values: 4 minus 4 with the sign of the value.
    let half = simd.splat_f32s(HALF as f32);
    let signed = simd.or_f32s(half, simd.and_f32s(turn, simd.splat_f32s(-0.0)));
    let turn = simd.add_f32s(turn, simd.sub_f32s(half, signed));
    let mass = simd.mul_f32s(length, weights);
    for i in 0..CELLS {
        // 1 − |a| is the minimum of 1 − a and 1 + a.
        let (below, above) = (simd.splat_f32s(1.0 - i as f32), simd.splat_f32s(1.0 + i as f32));
        let tent = simd.min_f32s(simd.add_f32s(row, below), simd.sub_f32s(above, row));
        part[i] = simd.mul_f32s(mass, simd.max_f32s(tent, zero));
        let tent = simd.min_f32s(simd.add_f32s(column, below), simd.sub_f32s(above, column));
        part[CELLS + i] = simd.max_f32s(tent, zero);
    }
    for k in 0..DIRECTIONS {
        let (below, above) = (simd.splat_f32s(1.0 - k as f32), simd.splat_f32s(1.0 + k as f32));
        let mut tent = simd.min_f32s(simd.add_f32s(turn, below), simd.sub_f32s(above, turn));
        if k == 0 {
            // Values just below a full circle are also near bin 0.
            tent = simd.max_f32s(tent, simd.sub_f32s(turn, simd.splat_f32s(DIRECTIONS as f32 - 1.0)));
        }
        part[2 * CELLS + k] = simd.max_f32s(tent, zero);
    }
}

/// Sums half of the directions of a row of cells.
struct Sum<'a> {
    parts: &'a [f32],
    touching: &'a [usize],
    row: usize,
    half: usize,
    numbers: &'a mut [f32],
}

impl WithSimd for Sum<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { parts, touching, row, half, numbers } = self;
        let parts = S::as_simd_f32s(parts).0;
        let mut sums = [[simd.splat_f32s(0.0); HALF]; CELLS];
        for &one in touching {
            let part = &parts[one * PARTS..][..PARTS];
            let directions = &part[2 * CELLS + half * HALF..][..HALF];
            for j in 0..CELLS {
                let mass = simd.mul_f32s(part[row], part[CELLS + j]);
                for k in 0..HALF {
                    sums[j][k] = simd.mul_add_e_f32s(mass, directions[k], sums[j][k]);
                }
            }
        }
        for (j, sums) in sums.iter().enumerate() {
            for (k, &sum) in sums.iter().enumerate() {
                numbers[j * DIRECTIONS + half * HALF + k] = simd.reduce_sum_f32s(sum);
            }
        }
    }
}
