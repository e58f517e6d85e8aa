//! Slices of numbers as the processor's vectors.

use pulp::Simd;

/// The `count` vectors from `start` on.
#[inline(always)]
pub(super) fn row_of<S: Simd>(values: &[f32], start: usize, count: usize) -> &[S::f32s] {
    &S::as_simd_f32s(&values[start..start + count * S::F32_LANES]).0[..count]
}

/// The `count` vectors from `start` on.
#[inline(always)]
pub(super) fn row_of_mut<S: Simd>(values: &mut [f32], start: usize, count: usize) -> &mut [S::f32s] {
    &mut S::as_mut_simd_f32s(&mut values[start..start + count * S::F32_LANES]).0[..count]
}
