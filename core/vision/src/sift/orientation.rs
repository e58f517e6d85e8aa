//! Dominant gradient directions around a keypoint.
//!
//! ```text
//! h(b) = Σ |∇G| exp(−d²/(2 (1.5σ)²))    over pixels whose direction is nearest to 2π b/36, up to 3 · 1.5σ away
//! smoothed by (1 4 6 4 1)/16; every peak ≥ orientation_peak · the highest; parabola through it and its neighbours
//! ```
//! | symbol | our name | unit |
//! |---|---|---|
//! | σ | `sigma` | px of the octave |
//! | d | distance from the keypoint's sub-pixel position | px of the octave |

use std::f32::consts::{PI, TAU};

use pulp::{Arch, Simd, WithSimd};

use super::gradient::{gaussian_weights, inner, polar, rows_around};
use super::lanes::{WIDEST, load, store};
use super::plane::Plane;

/// Bins of the histogram over the full circle.
const BINS: usize = 36;
/// Length of the array of bins: a power of two.
const ROOM: usize = 64;
/// 2²³: `f32` values from here on have no fraction.
const WHOLE: f32 = 8_388_608.0;
/// Standard deviation and radius of the weights, in σ.
const WEIGHT_SIGMA: f32 = 1.5;
const REACH: f32 = 3.0 * WEIGHT_SIGMA;

/// The directions at a position (x, y), rad from −π to π; empty in a flat area.
pub(super) fn directions(layer: &Plane, [x, y]: [f64; 2], sigma: f32, peak_share: f32) -> Vec<f32> {
    let mut histogram = [0.0; ROOM];
    Arch::new().dispatch(Fill { layer, place: [x as f32, y as f32], sigma, histogram: &mut histogram });
    // Bin 36 is bin 0 after a full turn.
    histogram[0] += histogram[BINS];
    let at = |bin: usize, offset: usize| histogram[(bin + BINS + offset - 2) % BINS];
    let smooth: [f32; BINS] = std::array::from_fn(|bin| {
        (6.0 * at(bin, 2) + 4.0 * (at(bin, 1) + at(bin, 3)) + at(bin, 0) + at(bin, 4)) / 16.0
    });
    let highest = smooth.iter().copied().fold(0.0, f32::max);
    let direction = |bin: usize| {
        let (left, here, right) = (smooth[(bin + BINS - 1) % BINS], smooth[bin], smooth[(bin + 1) % BINS]);
        // Of two equal adjacent bins the first is the peak, and the parabola's vertex is half-way to the other.
        let is_peak = here > left && here >= right && here >= peak_share * highest;
        let exact = bin as f32 + 0.5 * (left - right) / (left - 2.0 * here + right);
        is_peak.then(|| wrapped(exact * (TAU / BINS as f32) - PI))
    };
    (0..BINS).filter_map(direction).collect()
}

/// Wraps an angle to −π … π.
fn wrapped(angle: f32) -> f32 {
    if angle < -PI {
        angle + TAU
    } else if angle >= PI {
        angle - TAU
    } else {
        angle
    }
}

/// Computes h, starting at direction −π.
struct Fill<'a> {
    layer: &'a Plane,
    place: [f32; 2],
    sigma: f32,
    histogram: &'a mut [f32; ROOM],
}

impl WithSimd for Fill<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { layer, place: [x, y], sigma, histogram } = self;
        let reach = (REACH * sigma).round();
        let columns = inner(x.round(), reach, layer.width);
        let rows = inner(y.round(), reach, layer.height);
        let (mut across, mut down) = (Vec::new(), Vec::new());
        gaussian_weights(columns.clone(), x, WEIGHT_SIGMA * sigma, WIDEST, &mut across);
        gaussian_weights(rows.clone(), y, WEIGHT_SIGMA * sigma, 0, &mut down);
        let count = across.len() - WIDEST;
        // Adding 2²³ rounds to an integer, which is then in the lowest bits.
        let (scale, start) = (simd.splat_f32s(BINS as f32 / TAU), simd.splat_f32s(0.5 * BINS as f32 + WHOLE));
        let (mut bins, mut weights) = ([0.0_f32; WIDEST], [0.0_f32; WIDEST]);
        for (row, weight) in rows.zip(&down) {
            let around = rows_around(layer, row);
            let mut i = 0;
            while i < count {
                let (length, direction) = polar(simd, around, columns.start() + i);
                let weight = simd.mul_f32s(simd.splat_f32s(*weight), load::<S>(&across, i));
                store::<S>(&mut bins, 0, simd.mul_add_e_f32s(direction, scale, start));
                store::<S>(&mut weights, 0, simd.mul_f32s(length, weight));
                for (bin, weight) in bins.iter().zip(&weights).take(S::F32_LANES) {
                    histogram[bin.to_bits() as usize % ROOM] += weight;
                }
                i += S::F32_LANES;
            }
        }
    }
}
