//! Portable vectors: blocks as wide as the widest vector of any processor, in memory aligned to cache lines.
//!
//! The innermost loops of this folder run over arrays of [`LANES`] numbers without a branch; inside `pulp`'s dispatch
//! the compiler turns them into vectors as wide as the processor has. All numbers are integers, so that every width, and
//! every order of summation, gives the same bits.

use pulp::Simd;
#[cfg(target_arch = "x86_64")]
use pulp::x86::{V3, V4};

/// Bytes of the widest vector, which is a cache line.
pub(super) const LANES: usize = 64;

/// A cache line.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(64))]
struct Line([u8; LANES]);

/// Arrays aligned like vectors of their size: a cast from a less aligned array to a vector costs an alignment check in
/// the build profile of the project.
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

/// Numbers in a row that is aligned to a cache line.
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

/// Returns `N` blocks of numbers starting at `at`.
#[inline(always)]
pub(super) fn blocks<const N: usize, T>(values: &[T], at: usize) -> &[Block<T>; N] {
    match values[at..].as_chunks().0.first_chunk() {
        Some(blocks) => blocks,
        None => panic!("a row is shorter than its cells"),
    }
}

/// Returns `N` mutable blocks of numbers starting at `at`.
#[inline(always)]
pub(super) fn blocks_mut<const N: usize, T>(values: &mut [T], at: usize) -> &mut [Block<T>; N] {
    match values[at..].as_chunks_mut().0.first_chunk_mut() {
        Some(blocks) => blocks,
        None => panic!("a row is shorter than its cells"),
    }
}

/// Shifts a block up by one byte: the last byte of `before`, then all of `here` but the last.
#[inline(always)]
pub(super) fn moved_up<S: Simd>(simd: S, before: &[u8; LANES], here: &[u8; LANES]) -> [u8; LANES] {
    #[cfg(target_arch = "x86_64")]
    if size_of::<S::u8s>() == 64 {
        let v4 = same::<S, V4>(simd);
        let [before, here] = [before, here].map(|bytes| bytemuck::cast(Line(*bytes)));
        // First by whole 32-bit words, then within them.
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

/// Shifts a block down by one byte: all of `here` but the first, then the first byte of `after`.
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

/// Minimum of bytes.
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

/// Minimum of 16-bit numbers.
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

/// Bit mask of the numbers that are at most `limit`; the lowest bit is the first number.
#[inline(always)]
pub(super) fn at_most<S: Simd>(simd: S, values: &[u16; LANES], limit: u16) -> u64 {
    let (halves, _) = values.as_chunks();
    u64::from(half_at_most(simd, halves[0], limit)) | (u64::from(half_at_most(simd, halves[1], limit)) << 32)
}

/// The same for half a block.
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

/// Minimum of eight numbers, by a single instruction where the processor has it.
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

/// Converts the SIMD token to its concrete type. Callers check the vector width first; the compiler evaluates that check
/// and removes the other branch.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn same<S: Simd, T: Simd>(simd: S) -> T {
    match (&simd as &dyn std::any::Any).downcast_ref() {
        Some(simd) => *simd,
        None => panic!("vectors of this width have another name"),
    }
}
