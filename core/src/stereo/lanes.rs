//! Bytes side by side: as many as the widest vector of any processor holds, in room that begins at a cache line.
//!
//! The innermost loops of this folder run over arrays of [`LANES`] numbers without a branch; inside `pulp`'s dispatch
//! the compiler makes of them vectors as wide as the processor has. All numbers are whole, so that every width, and
//! every order of sums, gives the same bits.

use pulp::Simd;

/// Bytes of the widest vector, which is a cache line.
pub(super) const LANES: usize = 64;

/// A cache line.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(64))]
struct Line([u8; LANES]);

/// Numbers in a row that begins at a cache line.
#[derive(Clone)]
pub(super) struct Row<T> {
    lines: Vec<Line>,
    count: usize,
    kind: std::marker::PhantomData<T>,
}

impl<T: bytemuck::Pod> Row<T> {
    /// `count` numbers, all `value`.
    pub(super) fn new(count: usize, value: T) -> Self {
        let lines = vec![Line([0; LANES]); (count * size_of::<T>()).div_ceil(LANES)];
        let mut row = Self { lines, count, kind: std::marker::PhantomData };
        row.values_mut().fill(value);
        row
    }

    #[inline(always)]
    pub(super) fn values(&self) -> &[T] {
        &bytemuck::cast_slice(&self.lines)[..self.count]
    }

    #[inline(always)]
    pub(super) fn values_mut(&mut self) -> &mut [T] {
        &mut bytemuck::cast_slice_mut(&mut self.lines)[..self.count]
    }
}

/// A block of numbers.
pub(super) type Block<T> = [T; LANES];

/// `N` blocks of numbers from `at` on.
#[inline(always)]
pub(super) fn blocks<const N: usize, T>(values: &[T], at: usize) -> &[Block<T>; N] {
    match values[at..].as_chunks().0.first_chunk() {
        Some(blocks) => blocks,
        None => panic!("a row is shorter than its cells"),
    }
}

/// `N` blocks of numbers from `at` on, to change.
#[inline(always)]
pub(super) fn blocks_mut<const N: usize, T>(values: &mut [T], at: usize) -> &mut [Block<T>; N] {
    match values[at..].as_chunks_mut().0.first_chunk_mut() {
        Some(blocks) => blocks,
        None => panic!("a row is shorter than its cells"),
    }
}

/// The least of bytes.
#[inline(always)]
pub(super) fn least_u8<S: Simd>(simd: S, values: &[u8; LANES]) -> u8 {
    let (mut half, mut few, mut pairs) = ([0; 32], [0; 16], [0; 8]);
    for i in 0..32 {
        half[i] = values[i].min(values[i + 32]);
    }
    for i in 0..16 {
        few[i] = half[i].min(half[i + 16]);
    }
    let both: [u16; 8] = bytemuck::cast(few);
    for i in 0..8 {
        pairs[i] = (both[i] & 0xFF).min(both[i] >> 8);
    }
    least_of_few(simd, pairs) as u8
}

/// The least of numbers of 16 bits.
#[inline(always)]
pub(super) fn least_u16<S: Simd>(simd: S, values: &[u16; LANES]) -> u16 {
    let (mut half, mut quarter, mut few) = ([0; 32], [0; 16], [0; 8]);
    for i in 0..32 {
        half[i] = values[i].min(values[i + 32]);
    }
    for i in 0..16 {
        quarter[i] = half[i].min(half[i + 16]);
    }
    for i in 0..8 {
        few[i] = quarter[i].min(quarter[i + 8]);
    }
    least_of_few(simd, few)
}

/// The least of eight numbers, by the one instruction that finds it where the processor has it.
#[inline(always)]
fn least_of_few<S: Simd>(simd: S, few: [u16; 8]) -> u16 {
    #[cfg(target_arch = "x86_64")]
    {
        use pulp::x86::{V3, V4};
        let simd: &dyn std::any::Any = &simd;
        let found = match simd.downcast_ref::<V4>() {
            Some(v4) => Some(v4.sse4_1),
            None => simd.downcast_ref::<V3>().map(|v3| v3.sse4_1),
        };
        if let Some(sse4_1) = found {
            let least: [u16; 8] = bytemuck::cast(sse4_1._mm_minpos_epu16(bytemuck::cast(few)));
            return least[0];
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = simd;
    few.into_iter().fold(u16::MAX, u16::min)
}
