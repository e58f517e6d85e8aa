//! Numbers that begin at a cache line, so that no whole vector of theirs lies across two.

use std::ops::{Deref, DerefMut};

use super::lanes::WIDEST;

/// A cache line, which is as long as the widest vector.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(64))]
struct Line([f32; WIDEST]);

/// A run of numbers, at first all 0, rounded up to whole lines.
pub(in crate::correlate) struct Buffer(Vec<Line>);

impl Buffer {
    /// Room for `numbers` numbers.
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
