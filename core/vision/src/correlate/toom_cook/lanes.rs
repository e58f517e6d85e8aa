//! Slices of numbers as the processor's vectors.

use pulp::Simd;

/// Numbers of the widest vector of any processor.
pub(in crate::correlate) const WIDEST: usize = 16;

/// The `count` vectors from `start` on.
#[inline(always)]
pub(in crate::correlate) fn row_of<S: Simd>(values: &[f32], start: usize, count: usize) -> &[S::f32s] {
    &S::as_simd_f32s(&values[start..start + count * S::F32_LANES]).0[..count]
}

/// The `count` vectors from `start` on.
#[inline(always)]
pub(in crate::correlate) fn row_of_mut<S: Simd>(
    values: &mut [f32],
    start: usize,
    count: usize,
) -> &mut [S::f32s] {
    &mut S::as_mut_simd_f32s(&mut values[start..start + count * S::F32_LANES]).0[..count]
}

/// Vectors per row of a block: as many as the registers hold beside the operands.
#[inline(always)]
pub(in crate::correlate) const fn widest<S: Simd>() -> usize {
    if S::REGISTER_COUNT >= 32 { 3 } else { 1 }
}

/// Repeats a block of code for the numbers that follow, each as a constant: what the sums are indexed by must be known
/// before anything else for them to stay in registers.
macro_rules! for_each {
    ($name:ident in [$($number:literal)*] $body:block) => {
        $({ const $name: usize = $number; $body })*
    };
}

pub(in crate::correlate) use for_each;
