//! Buffers aligned to cache lines, so that no whole vector crosses two lines.

use std::ops::{Deref, DerefMut};

use super::lanes::WIDEST;

/// A cache line, as long as the widest vector.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(64))]
struct Line([f32; WIDEST]);

/// A zero-initialised run of `f32`, rounded up to whole lines.
pub(in crate::correlate) struct Buffer(Vec<Line>);

impl Buffer {
    /// Allocates at least `numbers` values.
    pub(in crate::correlate) fn new(numbers: usize) -> Self {
        Self(vec![Line([0.0; WIDEST]); numbers.div_ceil(WIDEST)])
    }
}

impl Deref for Buffer {
    type Target = [f32];

    #[inline(always)]
    fn deref(&self) -> &[f32] {
        bytemuck::cast_slice(&self.0)
    }
}

impl DerefMut for Buffer {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [f32] {
        bytemuck::cast_slice_mut(&mut self.0)
    }
}
