//! Extrema of the difference of Gaussians at sub-pixel precision, without those of low contrast or on edges.
//!
//! ```text
//! x̂ = −H⁻¹ g              g, H: gradient and second derivatives of D along (x, y, layer), by central differences
//! |x̂_i| > ½               moves to the neighbour and repeats, at most 5 times
//! |D(x̂)| ≥ contrast_min   D(x̂) = D + ½ gᵀ x̂
//! Tr(H_xy)²/Det(H_xy) < (r + 1)²/r,   Det > 0
//! ```
//! | symbol | our name | unit |
//! |---|---|---|
//! | x̂ | [`Extremum::offset`] | px of the octave, layers |
//! | r | `edge_ratio_max` of the settings | – |
//!
//! Two neighbouring pixels may converge to the same extremum, which is then found twice. Two may also lead to each other
//! if the extremum is just between them; it is then lost, as in Lowe's method and OpenCV.

use std::ops::Range;

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::SiftSettings;
use super::extent::MOVE_MAX;
use super::plane::Plane;
use super::scale_space::{BORDER, Octave};
use super::scan::{self, Candidate};

/// Largest number of refinement steps.
const STEPS_MAX: usize = 5;
/// Contrast of the pixel itself, as a fraction of the least contrast.
const PIXEL_SHARE: f64 = 0.5;

/// An extremum at sub-pixel precision.
#[derive(Clone, Copy, Debug)]
pub(super) struct Extremum {
    /// The nearest pixel and layer.
    pub(super) pixel: Candidate,
    /// Offset from there, along (x, y, layer).
    offset: [f64; 3],
    /// D(x̂).
    pub(super) contrast: f64,
}

impl Extremum {
    /// Position (x, y), px of the octave.
    pub(super) fn place(&self) -> [f64; 2] {
        [self.pixel.x as f64 + self.offset[0], self.pixel.y as f64 + self.offset[1]]
    }

    /// Scale as a fractional layer.
    pub(super) fn layer_exact(&self) -> f64 {
        self.pixel.layer as f64 + self.offset[2]
    }
}

/// Finds the extrema in some rows of an octave, in the order of layer, row and column.
pub(super) fn find(octave: &Octave, rows: Range<usize>, settings: &SiftSettings) -> Vec<Extremum> {
    let threshold = (PIXEL_SHARE * settings.contrast_min) as f32;
    let candidates = scan::extrema(octave, rows, threshold);
    let mut extrema: Vec<Extremum> =
        candidates.par_iter().filter_map(|&candidate| refine(octave, candidate, settings)).collect();
    extrema.sort_by_key(|extremum| extremum.pixel);
    extrema
}

/// Refines the extremum near a pixel; `None` if it is rejected.
fn refine(octave: &Octave, candidate: Candidate, settings: &SiftSettings) -> Option<Extremum> {
    let Candidate { layer, y, x } = candidate;
    let [width, height] = octave.size();
    let mut at = [x, y, layer];
    let is_inside = |[x, y, layer]: [usize; 3]| {
        (BORDER..width - BORDER).contains(&x)
            && (BORDER..height - BORDER).contains(&y)
            && (1..=octave.scales()).contains(&layer)
            && x.abs_diff(candidate.x).max(y.abs_diff(candidate.y)) <= MOVE_MAX
    };
    for _ in 0..STEPS_MAX {
        let around = Around::of(octave, at);
        let (gradient, hessian) = (around.gradient(), around.hessian());
        let offset = hessian.lu().solve(&-gradient)?;
        if offset.amax() > 0.5 {
            for (at, step) in at.iter_mut().zip(offset.iter()) {
                // A step past the first pixel saturates at 0, which is outside too.
                *at = (*at as f64 + step.round()) as usize;
            }
            if !is_inside(at) {
                return None;
            }
            continue;
        }
        let contrast = around.value(0, 0, 0) + 0.5 * gradient.dot(&offset);
        let is_kept = contrast.abs() >= settings.contrast_min && !is_edge(&hessian, settings.edge_ratio_max);
        let [x, y, layer] = at;
        return is_kept.then_some(Extremum {
            pixel: Candidate { layer, y, x },
            offset: offset.into(),
            contrast,
        });
    }
    None
}

/// Returns whether D is strongly curved in one direction only.
fn is_edge(hessian: &Matrix3<f64>, ratio_max: f64) -> bool {
    let trace = hessian[(0, 0)] + hessian[(1, 1)];
    let determinant = hessian[(0, 0)] * hessian[(1, 1)] - hessian[(0, 1)] * hessian[(1, 0)];
    determinant <= 0.0 || trace * trace * ratio_max >= (ratio_max + 1.0).powi(2) * determinant
}

/// D of a pixel and its 26 neighbours.
struct Around([[[f64; 3]; 3]; 3]);

impl Around {
    fn of(octave: &Octave, [x, y, layer]: [usize; 3]) -> Self {
        let mut values = [[[0.0; 3]; 3]; 3];
        for (l, layer_values) in values.iter_mut().enumerate() {
            let (finer, coarser) = (&octave.layers[layer + l - 1], &octave.layers[layer + l]);
            for (v, row) in layer_values.iter_mut().enumerate() {
                let pixels = |plane: &Plane| -> [f64; 3] {
                    let row = &plane.row(y + v - 1)[x - 1..x + 2];
                    [f64::from(row[0]), f64::from(row[1]), f64::from(row[2])]
                };
                let (finer, coarser) = (pixels(finer), pixels(coarser));
                *row = [coarser[0] - finer[0], coarser[1] - finer[1], coarser[2] - finer[2]];
            }
        }
        Self(values)
    }

    /// D at an offset along (x, y, layer).
    fn value(&self, x: i32, y: i32, layer: i32) -> f64 {
        self.0[(layer + 1) as usize][(y + 1) as usize][(x + 1) as usize]
    }

    fn gradient(&self) -> Vector3<f64> {
        Vector3::new(
            self.value(1, 0, 0) - self.value(-1, 0, 0),
            self.value(0, 1, 0) - self.value(0, -1, 0),
            self.value(0, 0, 1) - self.value(0, 0, -1),
        ) * 0.5
    }

    fn hessian(&self) -> Matrix3<f64> {
        let twice = 2.0 * self.value(0, 0, 0);
        let along = |[x, y, l]: [i32; 3]| self.value(x, y, l) + self.value(-x, -y, -l) - twice;
        let across = |[x, y, l]: [i32; 3], [u, v, m]: [i32; 3]| {
            let both = |sign: i32| self.value(x + sign * u, y + sign * v, l + sign * m);
            let other = |sign: i32| self.value(sign * u - x, sign * v - y, sign * m - l);
            0.25 * (both(1) - both(-1) - other(1) + other(-1))
        };
        let (x, y, l) = ([1, 0, 0], [0, 1, 0], [0, 0, 1]);
        let (xy, xl, yl) = (across(x, y), across(x, l), across(y, l));
        Matrix3::new(along(x), xy, xl, xy, along(y), yl, xl, yl, along(l))
    }
}
