//! From a row of neighbours to the three phases of a `tile`, and back.

use pulp::{Simd, WithSimd};

use super::tile::PHASES;

/// Parts a row into its phases, each of which holds a third as many numbers.
pub(super) struct Part<'a> {
    pub(super) row: &'a [f32],
    pub(super) phases: [&'a mut [f32]; PHASES],
}

impl WithSimd for Part<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { row, phases: [first, second, third] } = self;
        // A plain loop over slices of one length: compilers make shuffles of it.
        for (x, triple) in row.as_chunks().0.iter().enumerate() {
            [first[x], second[x], third[x]] = *triple;
        }
    }
}

/// Joins the phases of a row, each of which holds a third as many numbers.
pub(super) struct Join<'a> {
    pub(super) phases: [&'a [f32]; PHASES],
    pub(super) row: &'a mut [f32],
}

impl WithSimd for Join<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { phases: [first, second, third], row } = self;
        for (x, triple) in row.as_chunks_mut().0.iter_mut().enumerate() {
            *triple = [first[x], second[x], third[x]];
        }
    }
}
