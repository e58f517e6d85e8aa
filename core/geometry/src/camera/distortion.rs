//! The radial polynomial of CAHVOR and CAHVORE, its inverse, and Newton's iteration.
//!
//! A radius χ (tangent, or the fisheye image of the angle) is imaged at (domain.md 2.2, 2.3; Gennery 2006)
//!
//! ```text
//! χ' = χ (1 + μ),   μ = r0 + r1 t + r2 t²,   t = χ²
//! ```
//!
//! The inverse solves `k1 u + k3 u³ + k5 u⁵ = 1` for the ratio u = χ/χ', with k1 = 1 + r0, k3 = r1 χ'² and k5 = r2
//! χ'⁴. Two departures from VICAR's code: Newton starts at u = 1 instead of 1 − (r0 + k3 + k5), from where it cannot
//! overshoot the fold of a polynomial with negative terms; and a radius beyond the first fold (where
//! dχ'/dχ = 1 + r0 + 3 r1 t + 5 r2 t² reaches zero) is rejected in both directions: beyond it the polynomial
//! decreases, so that points behind a hazcam would appear in its image, mirrored.

use crate::frames::Vector3;

/// Newton's step below which the iteration has converged, relative to max(1, |x|).
const CONVERGED: f64 = 1e-14;
/// Step that is accepted when the iterations are used up (VICAR's own tolerance).
const ACCEPTABLE: f64 = 1e-8;
/// Largest number of Newton steps (VICAR's limit).
const STEPS: usize = 100;
/// Smallest slope with which Newton's iteration continues (VICAR's limit).
const FLAT: f64 = 1e-15;

/// Radial distortion μ(t) = r0 + r1 t + r2 t² of the squared radius t.
#[derive(Clone, Copy)]
pub(super) struct Radial {
    r0: f64,
    r1: f64,
    r2: f64,
}

impl Radial {
    pub(super) fn new([r0, r1, r2]: [f64; 3]) -> Self {
        Self { r0, r1, r2 }
    }

    /// μ at the squared radius t.
    pub(super) fn factor(self, t: f64) -> f64 {
        self.r0 + t * (self.r1 + t * self.r2)
    }

    /// dμ/dt at the squared radius t.
    pub(super) fn factor_slope(self, t: f64) -> f64 {
        self.r1 + 2.0 * self.r2 * t
    }

    /// Whether the distorted radius increases with the undistorted one from the axis to the squared radius t.
    pub(super) fn is_one_to_one(self, t: f64) -> bool {
        let (a, b, c) = (1.0 + self.r0, 3.0 * self.r1, 5.0 * self.r2);
        let slope = |t: f64| a + t * (b + t * c);
        let turning = -b / (2.0 * c);
        let dips = c > 0.0 && turning > 0.0 && turning < t;
        slope(0.0) > 0.0 && slope(t) > 0.0 && (!dips || slope(turning) > 0.0)
    }

    /// The ratio u of the undistorted to the distorted radius, given the square of the latter; `None` without an inverse.
    pub(super) fn undo(self, t_seen: f64) -> Option<f64> {
        let (k1, k3, k5) = (1.0 + self.r0, self.r1 * t_seen, self.r2 * t_seen * t_seen);
        let ratio = newton(1.0, |u| {
            let u2 = u * u;
            (u * (k1 + u2 * (k3 + u2 * k5)) - 1.0, k1 + u2 * (3.0 * k3 + u2 * 5.0 * k5))
        })?;
        (ratio > 0.0 && self.is_one_to_one(ratio * ratio * t_seen)).then_some(ratio)
    }
}

/// The zero of a function that returns value and slope; `None` if the slope is not positive or the steps do not converge.
pub(super) fn newton(start: f64, value_and_slope: impl Fn(f64) -> (f64, f64)) -> Option<f64> {
    let mut x = start;
    let mut step = f64::INFINITY;
    for _ in 0..STEPS {
        let (value, slope) = value_and_slope(x);
        if slope.is_nan() || slope <= FLAT {
            return None;
        }
        step = value / slope;
        x -= step;
        if step.abs() <= CONVERGED * x.abs().max(1.0) {
            return Some(x);
        }
    }
    (step.abs() < ACCEPTABLE).then_some(x)
}

/// Normalises a vector; a unit vector is returned bit for bit, so that repeating this changes nothing.
pub(super) fn made_unit(vector: Vector3) -> Vector3 {
    let length_squared = vector.norm_squared();
    if (length_squared - 1.0).abs() <= 8.0 * f64::EPSILON { vector } else { vector / length_squared.sqrt() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn undoing_the_distortion_gives_the_radius_back() {
        let radial = Radial::new([0.02, -0.014, 0.021]);
        for radius in [0.0, 1e-6, 0.1, 0.5, 1.2_f64] {
            let seen = radius * (1.0 + radial.factor(radius * radius));
            let back = radial.undo(seen * seen).unwrap() * seen;
            assert!((back - radius).abs() < 1e-14, "{radius} came back as {back}");
        }
    }

    #[test]
    fn radii_beyond_the_fold_are_refused() {
        // dχ'/dχ = 1 − 0.3 t vanishes at t = 10/3, where χ' is 2/3 of χ.
        let radial = Radial::new([0.0, -0.1, 0.0]);
        let fold = (10.0_f64 / 3.0).sqrt();
        assert!(radial.is_one_to_one((fold * 0.999).powi(2)));
        assert!(!radial.is_one_to_one((fold * 1.001).powi(2)));
        let largest_seen = fold * 2.0 / 3.0;
        assert!(radial.undo((largest_seen * 0.999).powi(2)).is_some());
        assert!(radial.undo((largest_seen * 1.001).powi(2)).is_none());
        // Here the slope is positive again beyond the fold, at t = 10.
        assert!(!Radial::new([0.0, -0.2, 0.01]).is_one_to_one(20.0));
    }

    #[test]
    fn making_unit_twice_changes_nothing() {
        for vector in
            [Vector3::new(0.1, -0.7, 0.3), Vector3::new(3.0, 4.0, 12.0), Vector3::new(0.6, 0.0, 0.8)]
        {
            let once = made_unit(vector);
            assert!((once.norm() - 1.0).abs() < 1e-15);
            assert_eq!(made_unit(once), once);
        }
    }
}
