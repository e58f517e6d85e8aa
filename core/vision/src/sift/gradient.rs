//! Magnitude and direction of the gradient of many pixels at once, and Gaussian weights.
//!
//! ```text
//! dx = I(x + 1, y) − I(x − 1, y)     dy = I(x, y + 1) − I(x, y − 1)
//! length = sqrt(dx² + dy²)           direction = atan2(dy, dx), from −π to π
//! ```
//! With q = (|dy| − |dx|)/(|dx| + |dy|) the direction is π/4 + atan q in the first quadrant; the signs of dx and dy
//! select the quadrant. The arc tangent for |q| ≤ 1 is an odd polynomial of degree 11, accurate to 2e-6 rad; the bins of
//! the histograms are at least 0.17 rad wide.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};

use pulp::Simd;

use super::lanes::load;
use super::plane::Plane;

/// Coefficients of q¹¹, q⁹ … q: minimax fit over 0 … 1.
const ARC_TANGENT: [f32; 6] =
    [-0.011_719_08, 0.052_647_203, -0.116_426_34, 0.193_540_32, -0.332_622_83, 0.999_977_23];
/// Avoids 0/0 in flat areas.
const TINY: f32 = 1e-30;

/// A pixel's row and those above and below it, starting at their first column.
pub(super) fn rows_around(plane: &Plane, y: usize) -> [&[f32]; 3] {
    [plane.row(y - 1), plane.row(y), plane.row(y + 1)]
}

/// Magnitude and direction of the vector of pixels starting at column `x` ≥ 1.
#[inline(always)]
pub(super) fn polar<S: Simd>(simd: S, [above, here, below]: [&[f32]; 3], x: usize) -> (S::f32s, S::f32s) {
    let dx = simd.sub_f32s(load::<S>(here, x + 1), load::<S>(here, x - 1));
    let dy = simd.sub_f32s(load::<S>(below, x), load::<S>(above, x));
    let length = simd.sqrt_f32s(simd.mul_add_e_f32s(dx, dx, simd.mul_f32s(dy, dy)));
    (length, direction(simd, dx, dy))
}

/// atan2(dy, dx).
#[inline(always)]
fn direction<S: Simd>(simd: S, dx: S::f32s, dy: S::f32s) -> S::f32s {
    // Signs are copied as bits: selects would be slower.
    let (sign, length) = (simd.splat_f32s(-0.0), simd.splat_f32s(f32::from_bits(0x7FFF_FFFF)));
    let (wide, high) = (simd.and_f32s(dx, length), simd.and_f32s(dy, length));
    let both = simd.add_f32s(simd.add_f32s(wide, high), simd.splat_f32s(TINY));
    let q = simd.div_f32s(simd.sub_f32s(high, wide), both);
    let square = simd.mul_f32s(q, q);
    let mut value = simd.splat_f32s(ARC_TANGENT[0]);
    for coefficient in &ARC_TANGENT[1..] {
        value = simd.mul_add_e_f32s(value, square, simd.splat_f32s(*coefficient));
    }
    // From the vertical: π/2 − (π/4 + atan q), with the sign of dx.
    let upright = simd.negate_mul_add_e_f32s(value, q, simd.splat_f32s(FRAC_PI_4));
    let upright = simd.xor_f32s(upright, simd.and_f32s(dx, sign));
    let lower = simd.sub_f32s(simd.splat_f32s(FRAC_PI_2), upright);
    simd.xor_f32s(lower, simd.and_f32s(dy, sign))
}

/// exp(−(i − centre)²/(2σ²)) of the integers `pixels`, then `after` zeros.
pub(super) fn gaussian_weights(
    pixels: std::ops::RangeInclusive<usize>,
    centre: f32,
    sigma: f32,
    after: usize,
    weights: &mut Vec<f32>,
) {
    weights.clear();
    let sharpness = 0.5 / (f64::from(sigma) * f64::from(sigma));
    let from = *pixels.start() as f64 - f64::from(centre);
    // The ratio of consecutive weights itself changes by a constant factor.
    let mut weight = (-sharpness * from * from).exp();
    let mut factor = (-sharpness * (2.0 * from + 1.0)).exp();
    let change = (-2.0 * sharpness).exp();
    for _ in pixels {
        weights.push(weight as f32);
        weight *= factor;
        factor *= change;
    }
    weights.resize(weights.len() + after, 0.0);
}

/// The pixels of a side within `reach` of `centre`, without the first and the last of the side.
pub(super) fn inner(centre: f32, reach: f32, side: usize) -> std::ops::RangeInclusive<usize> {
    let first = (centre - reach).ceil().max(1.0) as usize;
    let last = ((centre + reach).floor().max(0.0) as usize).min(side.saturating_sub(2));
    first..=last
}

#[cfg(test)]
mod tests {
    use pulp::{Arch, WithSimd};

    use super::super::lanes::{WIDEST, store};
    use super::*;

    struct Direction([f32; 2]);

    impl WithSimd for Direction {
        type Output = f32;

        fn with_simd<S: Simd>(self, simd: S) -> f32 {
            let mut values = [0.0; WIDEST];
            let value = direction(simd, simd.splat_f32s(self.0[0]), simd.splat_f32s(self.0[1]));
            store::<S>(&mut values, 0, value);
            values[0]
        }
    }

    #[test]
    fn directions_are_those_of_the_arc_tangent_all_around() {
        for step in -3600..3600 {
            let angle = f64::from(step) * std::f64::consts::PI / 3600.0;
            for length in [1e-6, 0.3, 70.0] {
                let (dx, dy) = ((length * angle.cos()) as f32, (length * angle.sin()) as f32);
                let found = f64::from(Arch::new().dispatch(Direction([dx, dy])));
                let expected = f64::from(dy).atan2(f64::from(dx));
                assert!((found - expected).abs() < 2.5e-6, "{angle}: {found}, not {expected}");
            }
        }
        assert!(Arch::new().dispatch(Direction([0.0, 0.0])).is_finite());
    }

    #[test]
    fn weights_are_those_of_the_exponential() {
        let mut weights = Vec::new();
        for (centre, sigma) in [(40.3, 2.4), (47.9, 21.0), (33.0, 6.5)] {
            gaussian_weights(1..=80, centre, sigma, 3, &mut weights);
            assert_eq!(weights.len(), 83);
            for (i, weight) in (1..=80).zip(&weights) {
                let expected = (-0.5 * ((f64::from(i) - f64::from(centre)) / f64::from(sigma)).powi(2)).exp();
                assert!((f64::from(*weight) - expected).abs() < 1e-6, "{centre} {sigma} {i}");
            }
            assert_eq!(weights[80..], [0.0; 3]);
        }
    }
}
