//! Slices of `f32` as the processor's vectors.

use pulp::Simd;

/// Lanes of the widest vector of any processor.
pub(in crate::correlate) const WIDEST: usize = 16;

/// Returns `count` vectors starting at `start`.
#[inline(always)]
pub(in crate::correlate) fn row_of<S: Simd>(values: &[f32], start: usize, count: usize) -> &[S::f32s] {
    &S::as_simd_f32s(&values[start..start + count * S::F32_LANES]).0[..count]
}

/// Returns `count` mutable vectors starting at `start`.
#[inline(always)]
pub(in crate::correlate) fn row_of_mut<S: Simd>(
    values: &mut [f32],
    start: usize,
    count: usize,
) -> &mut [S::f32s] {
    &mut S::as_mut_simd_f32s(&mut values[start..start + count * S::F32_LANES]).0[..count]
}

/// Vectors per row of a block: as many as fit into the registers beside the operands.
#[inline(always)]
pub(in crate::correlate) const fn widest<S: Simd>() -> usize {
    if S::REGISTER_COUNT >= 32 { 3 } else { 1 }
}

/// Repeats a block of code with each number as a constant: the indices of sums must be compile-time constants for them
/// to stay in registers.
macro_rules! for_each {
    ($name:ident in [$($number:literal)*] $body:block) => {
        $({ const $name: usize = $number; $body })*
    };
}

pub(in crate::correlate) use for_each;
