//! Slices of `f32` as the processor's vectors, and memory aligned to cache lines.

use pulp::Simd;

/// Lanes of the widest vector of any processor, a cache line.
pub(super) const WIDEST: usize = 16;

/// A cache line.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(64))]
pub(super) struct Line(pub(super) [f32; WIDEST]);

impl Line {
    /// 16 zeros.
    pub(super) const ZERO: Self = Self([0.0; WIDEST]);
}

/// Loads the vector that begins at `at`.
#[inline(always)]
pub(super) fn load<S: Simd>(values: &[f32], at: usize) -> S::f32s {
    S::as_simd_f32s(&values[at..at + S::F32_LANES]).0[0]
}

/// Stores a vector at `at`.
#[inline(always)]
pub(super) fn store<S: Simd>(values: &mut [f32], at: usize, vector: S::f32s) {
    S::as_mut_simd_f32s(&mut values[at..at + S::F32_LANES]).0[0] = vector;
}

/// 0, 1, 2 … : the index of each lane.
#[inline(always)]
pub(super) fn places<S: Simd>() -> S::f32s {
    const PLACES: [f32; WIDEST] = [0., 1., 2., 3., 4., 5., 6., 7., 8., 9., 10., 11., 12., 13., 14., 15.];
    load::<S>(&PLACES, 0)
}
