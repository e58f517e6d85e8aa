//! Bytes side by side: as many as the widest vector of any processor holds, in room that begins at a cache line.
//!
//! The innermost loops of this folder run over arrays of [`LANES`] numbers without a branch; inside `pulp`'s dispatch
//! the compiler makes of them vectors as wide as the processor has. All numbers are whole, so that every width, and
//! every order of sums, gives the same bits.

use pulp::Simd;
#[cfg(target_arch = "x86_64")]
use pulp::x86::{V3, V4};

/// Bytes of the widest vector, which is a cache line.
pub(super) const LANES: usize = 64;

/// A cache line.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(64))]
struct Line([u8; LANES]);

/// Numbers where vectors of their size begin: to make a vector of numbers that lie anywhere, the profile that everything is built in
/// asks each time whether that is allowed.
macro_rules! aligned {
    ($($name:ident($numbers:ty, $align:literal);)*) => {$(
        #[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
        #[repr(C, align($align))]
        struct $name($numbers);
    )*};
}

aligned! {
    FewBytes([u8; 16], 16);
}

#[cfg(target_arch = "x86_64")]
aligned! {
    Words([u16; 32], 64);
    Marks([u8; 32], 32);
    FewWords([u16; 8], 16);
}

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

/// Bytes that follow each other in blocks, each with the one before it: the last of `before`, and all of `here` but the last.
#[inline(always)]
pub(super) fn moved_up<S: Simd>(simd: S, before: &[u8; LANES], here: &[u8; LANES]) -> [u8; LANES] {
    #[cfg(target_arch = "x86_64")]
    if size_of::<S::u8s>() == 64 {
        let v4 = same::<S, V4>(simd);
        let [before, here] = [before, here].map(|bytes| bytemuck::cast(Line(*bytes)));
        // First by whole quarters, then within them.
        let quarters = v4.avx512f._mm512_alignr_epi32::<12>(here, before);
        let Line(moved) = bytemuck::cast(v4.avx512bw._mm512_alignr_epi8::<15>(here, quarters));
        return moved;
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = simd;
    let mut moved = [before[LANES - 1]; LANES];
    moved[1..].copy_from_slice(&here[..LANES - 1]);
    moved
}

/// The same with the one after it: all of `here` but the first, and the first of `after`.
#[inline(always)]
pub(super) fn moved_down<S: Simd>(simd: S, here: &[u8; LANES], after: &[u8; LANES]) -> [u8; LANES] {
    #[cfg(target_arch = "x86_64")]
    if size_of::<S::u8s>() == 64 {
        let v4 = same::<S, V4>(simd);
        let [here, after] = [here, after].map(|bytes| bytemuck::cast(Line(*bytes)));
        let quarters = v4.avx512f._mm512_alignr_epi32::<4>(after, here);
        let Line(moved) = bytemuck::cast(v4.avx512bw._mm512_alignr_epi8::<1>(quarters, here));
        return moved;
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = simd;
    let mut moved = [after[0]; LANES];
    moved[..LANES - 1].copy_from_slice(&here[1..]);
    moved
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
    let both: [u16; 8] = bytemuck::cast(FewBytes(few));
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

/// Which numbers are at most `limit`: the first one's bit is the lowest.
#[inline(always)]
pub(super) fn at_most<S: Simd>(simd: S, values: &[u16; LANES], limit: u16) -> u64 {
    let (halves, _) = values.as_chunks();
    u64::from(half_at_most(simd, halves[0], limit)) | (u64::from(half_at_most(simd, halves[1], limit)) << 32)
}

/// The same of half as many.
#[inline(always)]
fn half_at_most<S: Simd>(simd: S, values: [u16; 32], limit: u16) -> u32 {
    #[cfg(target_arch = "x86_64")]
    if size_of::<S::u8s>() == 64 {
        let [values, limits] = [values, [limit; 32]].map(|words| bytemuck::cast(Words(words)));
        return same::<S, V4>(simd).avx512bw._mm512_cmple_epu16_mask(values, limits);
    }
    let mut marks = [0; 32];
    for i in 0..32 {
        marks[i] = if values[i] <= limit { u8::MAX } else { 0 };
    }
    #[cfg(target_arch = "x86_64")]
    if size_of::<S::u8s>() == 32 {
        return same::<S, V3>(simd).avx2._mm256_movemask_epi8(bytemuck::cast(Marks(marks))).cast_unsigned();
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = simd;
    // The product gathers the lowest bit of each of eight bytes in its highest byte.
    let mut bits = 0;
    for (k, eight) in marks.as_chunks::<8>().0.iter().enumerate() {
        let lowest = u64::from_le_bytes(*eight) & 0x0101_0101_0101_0101;
        bits |= ((lowest.wrapping_mul(0x0102_0408_1020_4080) >> 56) as u32) << (8 * k);
    }
    bits
}

/// The least of eight numbers, by the one instruction that finds it where the processor has it.
#[inline(always)]
fn least_of_few<S: Simd>(simd: S, few: [u16; 8]) -> u16 {
    #[cfg(target_arch = "x86_64")]
    {
        let sse4_1 = match size_of::<S::u8s>() {
            64 => Some(same::<S, V4>(simd).sse4_1),
            32 => Some(same::<S, V3>(simd).sse4_1),
            _ => None,
        };
        if let Some(sse4_1) = sse4_1 {
            let least: [u16; 8] = bytemuck::cast(sse4_1._mm_minpos_epu16(bytemuck::cast(FewWords(few))));
            return least[0];
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = simd;
    few.into_iter().fold(u16::MAX, u16::min)
}

/// The processor's features by the name that they have; that its vectors are as wide as the name says was asked before,
/// which the compiler answers, so that no other way remains.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn same<S: Simd, T: Simd>(simd: S) -> T {
    match (&simd as &dyn std::any::Any).downcast_ref() {
        Some(simd) => *simd,
        None => panic!("vectors of this width have another name"),
    }
}
