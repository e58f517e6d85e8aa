//! Objective of the shape registration: the mean absolute difference of depth (D-Eq 12, E31).
//!
//! ```text
//! J(p) = 1/n Σ_i | h_i(p) − z_i |      over the n pixels that both surfaces cover
//!        infinite where n < overlap_min of the pixels that the fixed surface covers                           E31, R196
//! T_p  = translation by c + t, rotation by the vector ω, translation by −c
//! ```
//! **Overlap.** The plain sum of D-Eq 12 falls when the surfaces are pulled apart. The mean does not, but it may still
//! select the pixels that fit; the least fraction of the fixed surface's pixels bounds that. The fraction is part of the
//! result. A pixel that only one surface covers is ignored: holes of stereo are no evidence.
//!
//! | symbol | our name | unit, frame |
//! |---|---|---|
//! | p = (t, ω) | [`Offset`] | m, rad; axes of the sensor; ω a rotation vector instead of Euler angles (E30) |
//! | c | `pivot` | m, sensor: the target, which decouples rotations from translations |
//! | z, h | depths | m, sensor |
//!
//! Source: D-Eq 8, 11, 12; R190, R194–R196; E31.

use nalgebra::{Translation3, UnitQuaternion, Vector6};
use pulp::{Arch, Simd, WithSimd};

use super::range_sensor::RangeSensor;
use super::rasterise::{Depths, Facets, Picture, rasterise};
use sightline_geometry::frames::{Point3, Pose, Vector3};

/// Number of partial sums.
const LANES: usize = 32;
/// Upper bound of a difference, m; beyond it, one surface does not cover the pixel.
const NOTHING_M: f32 = 1e6;

/// A small motion: translation t (m), then rotation vector ω (rad), in the axes of the sensor about a pivot.
pub type Offset = Vector6<f64>;

/// The motion of an offset about a pivot.
pub fn motion(offset: &Offset, pivot: &Point3) -> Pose {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(offset[3], offset[4], offset[5]));
    let shift = Vector3::new(offset[0], offset[1], offset[2]);
    Pose::from_parts(Translation3::from(pivot.coords + shift - turn * pivot.coords), turn)
}

/// The offset of a motion about a pivot; inverse of [`motion`].
pub fn offset(motion: &Pose, pivot: &Point3) -> Offset {
    let shift = motion * pivot - pivot;
    let turn = motion.rotation.scaled_axis();
    Offset::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z)
}

/// Value of the objective.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Agreement {
    /// J, m; infinite if the overlap is too small.
    pub mean_m: f64,
    /// Fraction of the fixed surface's pixels that both surfaces cover.
    pub overlap: f64,
}

/// The objective of one registration, with its buffers.
pub(super) struct Objective<'a> {
    pub(super) sensor: &'a RangeSensor,
    /// z of every pixel; infinite where the fixed surface does not cover it.
    pub(super) fixed_m: &'a [f32],
    pub(super) facets: &'a Facets,
    pub(super) pivot: Point3,
    pub(super) overlap_min: f64,
    fixed_pixels: usize,
    picture: Picture,
    moving_m: Vec<f32>,
}

impl<'a> Objective<'a> {
    pub(super) fn new(
        sensor: &'a RangeSensor,
        fixed_m: &'a [f32],
        facets: &'a Facets,
        pivot: Point3,
        overlap_min: f64,
    ) -> Self {
        let fixed_pixels = fixed_m.iter().filter(|depth| depth.is_finite()).count();
        let moving_m = vec![f32::INFINITY; fixed_m.len()];
        Self {
            sensor,
            fixed_m,
            facets,
            pivot,
            overlap_min,
            fixed_pixels,
            picture: Picture::default(),
            moving_m,
        }
    }

    /// Evaluates J at an offset.
    pub(super) fn at(&mut self, offset: &Offset) -> Agreement {
        self.moving_m.fill(f32::INFINITY);
        let motion = motion(offset, &self.pivot);
        rasterise(self.sensor, self.facets, &motion, &mut self.picture, &mut Depths(&mut self.moving_m));
        let differences = Differences { fixed_m: self.fixed_m, moving_m: &self.moving_m };
        let (sum_m, count) = Arch::new().dispatch(differences);
        agreement(sum_m, count, self.fixed_pixels, self.overlap_min)
    }

    /// h − z of every pixel at the last evaluation, m; NaN unless both surfaces cover the pixel.
    pub(super) fn differences_m(&self) -> Vec<f32> {
        let difference = |(h, z): (&f32, &f32)| if h.is_finite() && z.is_finite() { h - z } else { f32::NAN };
        self.moving_m.iter().zip(self.fixed_m).map(difference).collect()
    }
}

/// J of a sum over `count` of the fixed surface's pixels.
pub(super) fn agreement(sum_m: f64, count: usize, fixed_pixels: usize, overlap_min: f64) -> Agreement {
    let overlap = count as f64 / fixed_pixels.max(1) as f64;
    let mean_m = if count > 0 && overlap >= overlap_min { sum_m / count as f64 } else { f64::INFINITY };
    Agreement { mean_m, overlap }
}

/// Sum of absolute differences where both depths are finite, and the number of these pixels.
struct Differences<'a> {
    fixed_m: &'a [f32],
    moving_m: &'a [f32],
}

impl WithSimd for Differences<'_> {
    type Output = (f64, usize);

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> (f64, usize) {
        let mut sums = [0.0f32; LANES];
        let mut counts = [0u32; LANES];
        let (fixed, fixed_rest) = self.fixed_m.as_chunks::<LANES>();
        let (moving, moving_rest) = self.moving_m.as_chunks::<LANES>();
        for (z, h) in fixed.iter().zip(moving) {
            for lane in 0..LANES {
                // The difference of two infinities is NaN, for which the comparison is false.
                let difference = (h[lane] - z[lane]).abs();
                let is_common = difference < NOTHING_M;
                sums[lane] += if is_common { difference } else { 0.0 };
                counts[lane] += u32::from(is_common);
            }
        }
        for (lane, (z, h)) in fixed_rest.iter().zip(moving_rest).enumerate() {
            let difference = (h - z).abs();
            if difference < NOTHING_M {
                sums[lane] += difference;
                counts[lane] += 1;
            }
        }
        (sums.iter().map(|&sum| f64::from(sum)).sum(), counts.iter().sum::<u32>() as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_offset_and_its_motion_are_each_other_s_inverse() {
        let pivot = Point3::new(0.3, -0.2, 1.5);
        let there = Offset::new(0.02, -0.03, 0.01, 0.05, -0.02, 0.03);
        assert!((offset(&motion(&there, &pivot), &pivot) - there).norm() < 1e-12);
        assert!((motion(&there, &pivot) * pivot - pivot - Vector3::new(0.02, -0.03, 0.01)).norm() < 1e-12);
    }

    #[test]
    fn only_pixels_that_both_cover_count_and_too_few_are_no_agreement() {
        let mut fixed_m = vec![1.0; 50];
        let mut moving_m = vec![1.25; 50];
        fixed_m[..10].fill(f32::INFINITY);
        moving_m[5..30].fill(f32::INFINITY);
        let (sum_m, count) = Arch::new().dispatch(Differences { fixed_m: &fixed_m, moving_m: &moving_m });
        assert_eq!((sum_m, count), (5.0, 20));
        assert_eq!(agreement(sum_m, count, 40, 0.4), Agreement { mean_m: 0.25, overlap: 0.5 });
        assert_eq!(agreement(sum_m, count, 40, 0.6).mean_m, f64::INFINITY);
    }
}
