//! Converts a row between adjacent columns and the three phases of a `tile`.

use pulp::{Simd, WithSimd};

use super::tile::PHASES;

/// Splits a row into its phases, each a third as long.
pub(in crate::correlate) struct Part<'a> {
    pub(in crate::correlate) row: &'a [f32],
    pub(in crate::correlate) phases: [&'a mut [f32]; PHASES],
}

impl WithSimd for Part<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { row, phases: [first, second, third] } = self;
        // A plain loop over slices of one length, which compilers turn into shuffles.
        for (x, triple) in row.as_chunks().0.iter().enumerate() {
            [first[x], second[x], third[x]] = *triple;
        }
    }
}

/// Joins the phases of a row, each a third as long.
pub(in crate::correlate) struct Join<'a> {
    pub(in crate::correlate) phases: [&'a [f32]; PHASES],
    pub(in crate::correlate) row: &'a mut [f32],
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
