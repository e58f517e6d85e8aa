//! Pixels whose difference of Gaussians is greater, or less, than that of all 26 neighbours.
//!
//! ```text
//! D_l = G_(l+1) − G_l,   l = 0 … s + 1        extrema of l = 1 … s:   ± D_l(x, y) > T   and
//! ± D_l(x, y) > its 13 preceding neighbours, ≥ the 13 following ones, in the order of layer, row, column
//! ```
//! Of several equal adjacent pixels exactly one is found. The differences of three rows at a time are stored.

use std::ops::Range;

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::lanes::{Line, WIDEST, load, store};
use super::scale_space::{BORDER, Octave};

/// Rows of a parallel task.
const BAND: usize = 32;
/// Number of rows stored.
const HELD: usize = 3;

/// A pixel of an octave.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Candidate {
    /// l: layer of the difference of Gaussians.
    pub(super) layer: usize,
    pub(super) y: usize,
    pub(super) x: usize,
}

/// Finds the extrema in some rows of all layers with |D| above `threshold`, in the order of layer, row and column.
pub(super) fn extrema(octave: &Octave, rows: Range<usize>, threshold: f32) -> Vec<Candidate> {
    let end = rows.end;
    let tops: Vec<usize> = rows.step_by(BAND).collect();
    let band = |&top: &usize| {
        let mut found = Vec::new();
        Arch::new().dispatch(Band {
            octave,
            threshold,
            rows: [top, (top + BAND).min(end)],
            found: &mut found,
        });
        found
    };
    let mut found: Vec<Candidate> = tops.par_iter().flat_map_iter(band).collect();
    found.sort_unstable();
    found
}

/// Finds the extrema in some rows.
struct Band<'a> {
    octave: &'a Octave,
    threshold: f32,
    rows: [usize; 2],
    found: &'a mut Vec<Candidate>,
}

impl WithSimd for Band<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { octave, threshold, rows: [first, end], found } = self;
        let (layers, stride) = (octave.scales() + 2, octave.layers[0].stride);
        let line = stride + 2 * WIDEST;
        let mut lines = vec![Line::ZERO; layers * HELD * line / WIDEST];
        let lines: &mut [f32] = bytemuck::cast_slice_mut(&mut lines);
        let mut next = first - 1;
        for y in first..end {
            while next <= y + 1 {
                for layer in 0..layers {
                    let at = (layer * HELD + next % HELD) * line;
                    simd.vectorize(Difference {
                        finer: &octave.layers[layer].row(next)[..stride],
                        coarser: &octave.layers[layer + 1].row(next)[..stride],
                        difference: &mut lines[at..at + stride],
                    });
                }
                next += 1;
            }
            for layer in 1..layers - 1 {
                // Rows above, here and below, in the previous, this and the next layer.
                let around = NEIGHBOURS.map(|[l, v]| {
                    let at = ((layer + l - 1) * HELD + (y + v - 1) % HELD) * line;
                    &lines[at..at + line]
                });
                let width = octave.size()[0];
                simd.vectorize(Row { around, threshold, width, layer, y, found });
            }
        }
    }
}

/// Layer and row offsets of the neighbours, plus one.
const NEIGHBOURS: [[usize; 2]; 9] = [[0, 0], [0, 1], [0, 2], [1, 0], [1, 1], [1, 2], [2, 0], [2, 1], [2, 2]];

/// Computes a row of D.
struct Difference<'a> {
    finer: &'a [f32],
    coarser: &'a [f32],
    difference: &'a mut [f32],
}

impl WithSimd for Difference<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let (finer, coarser) = (S::as_simd_f32s(self.finer).0, S::as_simd_f32s(self.coarser).0);
        let difference = S::as_mut_simd_f32s(self.difference).0;
        for ((difference, finer), coarser) in difference.iter_mut().zip(finer).zip(coarser) {
            *difference = simd.sub_f32s(*coarser, *finer);
        }
    }
}

/// Finds the extrema in a row of a layer.
struct Row<'a> {
    around: [&'a [f32]; 9],
    threshold: f32,
    width: usize,
    layer: usize,
    y: usize,
    found: &'a mut Vec<Candidate>,
}

/// Clears the mask of lanes whose value is not beyond its neighbours in a row of D; offsets count from the column
/// before.
macro_rules! beyond {
    ($simd:ident, $mask:ident, [$sign:ident, $value:ident, $x:ident], $compare:ident, $row:expr, [$($offset:literal)*]) => {
        $(
            let other = $simd.xor_f32s($sign, load::<S>($row, $x + $offset - 1));
            $mask = $simd.and_m32s($mask, $simd.$compare($value, other));
        )*
    };
}

/// As `beyond!`, for neighbours that precede the pixel.
macro_rules! beyond_before {
    ($simd:ident, $mask:ident, $at:tt, $row:expr, $offsets:tt) => {
        beyond!($simd, $mask, $at, greater_than_f32s, $row, $offsets)
    };
}

/// As `beyond!`, for neighbours that follow the pixel.
macro_rules! beyond_after {
    ($simd:ident, $mask:ident, $at:tt, $row:expr, $offsets:tt) => {
        beyond!($simd, $mask, $at, greater_than_or_equal_f32s, $row, $offsets)
    };
}

impl WithSimd for Row<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { around, threshold, width, layer, y, found } = self;
        let end = width - BORDER;
        let (least, minus) = (simd.splat_f32s(threshold), simd.splat_f32s(-0.0));
        let mut x = BORDER;
        while x < end {
            let here = load::<S>(around[4], x);
            // Minima are maxima of −D.
            let sign = simd.and_f32s(minus, here);
            let value = simd.xor_f32s(sign, here);
            let mut mask = simd.greater_than_f32s(value, least);
            if simd.first_true_m32s(mask) < S::F32_LANES {
                beyond_before!(simd, mask, [sign, value, x], around[4], [0]);
                beyond_after!(simd, mask, [sign, value, x], around[4], [2]);
                beyond_before!(simd, mask, [sign, value, x], around[3], [0 1 2]);
                beyond_after!(simd, mask, [sign, value, x], around[5], [0 1 2]);
                if simd.first_true_m32s(mask) < S::F32_LANES {
                    beyond_before!(simd, mask, [sign, value, x], around[0], [0 1 2]);
                    beyond_before!(simd, mask, [sign, value, x], around[1], [0 1 2]);
                    beyond_before!(simd, mask, [sign, value, x], around[2], [0 1 2]);
                    beyond_after!(simd, mask, [sign, value, x], around[6], [0 1 2]);
                    beyond_after!(simd, mask, [sign, value, x], around[7], [0 1 2]);
                    beyond_after!(simd, mask, [sign, value, x], around[8], [0 1 2]);
                    if simd.first_true_m32s(mask) < S::F32_LANES {
                        let mut are = [0.0; WIDEST];
                        let ones = simd.select_f32s(mask, simd.splat_f32s(1.0), simd.splat_f32s(0.0));
                        store::<S>(&mut are, 0, ones);
                        for (i, _) in are.iter().enumerate().filter(|(i, is)| **is > 0.0 && x + i < end) {
                            found.push(Candidate { layer, y, x: x + i });
                        }
                    }
                }
            }
            x += S::F32_LANES;
        }
    }
}
