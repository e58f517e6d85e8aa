//! Census transform: the surroundings of a pixel in bits that are invariant to brightness and contrast.
//!
//! ```text
//! census:  bit k of pixel p = [ I(p + o_k) > I(p) ]                                          (Zabih & Woodfill 1994)
//! cost:    C(p, d) = bits that differ between p on the left and p − (d, 0) on the right
//! ```
//! | for | o_k | planes | C |
//! |---|---|---|---|
//! | semi-global matching | the other pixels of 9 × 7 | [`WHOLE`] | 0 … 62 |
//! | block matching | of these, even columns of the middle row and of the rows ±1 and ±3 | [`SPARSE`] | 0 … 24 |
//!
//! A window sums the bits of its pixels, and the neighbours of a pixel cover the positions that its own bits leave out:
//! a part of the pixels is enough there (ours; docs/stereo.md has the figures).
//!
//! The bits of a row are stored in planes of bytes, so that 64 disparities are compared side by side: the right image is
//! mirrored, and the partners of p for d, d + 1, d + 2 … are adjacent. The differences of a cell are first summed by
//! carry-save adders, which leaves four bit counts instead of eight, and two instead of three. Bits are computed row by
//! row on demand, which is faster than storing them.
//!
//! A cell whose partner is outside the right image or invalid costs less than half of the bits by which two unrelated
//! pixels differ, so that a surface continues beyond the border; a pixel whose best cell is such a one has no disparity.
//!
//! Pixels beyond the border have the value of the nearest one of their row or column; an invalid pixel has the value of
//! the last valid one of its row.
//!
//! | symbol | our name | unit |
//! |---|---|---|
//! | I | [`Sixteen`], 16 bits | full scale / 65535 |
//! | C | [`costs`], [`sparse_costs`] | bits |

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::lanes::{Block, LANES, Row, blocks, blocks_mut};
use crate::image::GrayImage;

/// Number of planes of the 62 bits.
pub(super) const WHOLE: usize = 8;
/// Number of planes of the 24 bits.
pub(super) const SPARSE: usize = 3;
/// Cost of a cell without a valid partner, of 62 bits and of 24.
const COST_NONE: [u8; 2] = [24, 9];
/// Half width and half height of the full census window, px.
const REACH: [usize; 2] = [4, 3];

/// An image in 16 bits with a margin at the sides.
pub(super) struct Sixteen {
    is_mirrored: bool,
    width: usize,
    height: usize,
    stride: usize,
    values: Vec<u16>,
    /// 255 for invalid pixels; without margin.
    is_none: Vec<u8>,
}

impl Sixteen {
    /// Converts an image, mirrored left to right if `is_mirrored`.
    pub(super) fn of(image: &GrayImage, is_mirrored: bool) -> Self {
        let (width, height) = (image.width() as usize, image.height() as usize);
        let stride = width.next_multiple_of(LANES) + 2 * REACH[0];
        let (mut values, mut is_none) = (vec![0; stride * height], vec![0; width * height]);
        let lines = values.par_chunks_exact_mut(stride).zip(is_none.par_chunks_exact_mut(width));
        lines.zip(image.as_raw().par_chunks_exact(width)).for_each(|((line, is_none), pixels)| {
            let inside = &mut line[REACH[0]..][..width];
            Arch::new().dispatch(Convert { pixels, values: inside, is_none });
            if is_mirrored {
                inside.reverse();
                is_none.reverse();
            }
            let (first, last) = (line[REACH[0]], line[REACH[0] + width - 1]);
            line[..REACH[0]].fill(first);
            line[REACH[0] + width..].fill(last);
        });
        Self { is_mirrored, width, height, stride, values, is_none }
    }

    /// Validity of the pixels of a row: 255 if invalid, else 0.
    #[inline(always)]
    pub(super) fn is_none(&self, y: usize) -> &[u8] {
        &self.is_none[y * self.width..][..self.width]
    }

    /// The row `y + dy`, clamped to the image.
    #[inline(always)]
    fn row(&self, y: usize, dy: isize) -> &[u16] {
        let y = y.saturating_add_signed(dy).min(self.height - 1);
        &self.values[y * self.stride..][..self.stride]
    }
}

/// Converts a row to integers.
struct Convert<'a> {
    pixels: &'a [f32],
    values: &'a mut [u16],
    is_none: &'a mut [u8],
}

impl WithSimd for Convert<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { pixels, values, is_none } = self;
        let (values, is_none) = (&mut values[..pixels.len()], &mut is_none[..pixels.len()]);
        let mut invalid = 0;
        for x in 0..pixels.len() {
            // Casts saturate, and convert NaN to 0.
            values[x] = ((pixels[x] * 65535.0 + 0.5) as i32).clamp(0, 65535) as u16;
            is_none[x] = if pixels[x].is_finite() { 0 } else { u8::MAX };
            invalid |= is_none[x];
        }
        if invalid != 0 {
            let valid = is_none.iter().position(|none| *none == 0);
            let mut last = valid.map_or(0, |x| values[x]);
            for (value, none) in values.iter_mut().zip(is_none) {
                last = if *none == 0 { *value } else { last };
                *value = last;
            }
        }
    }
}

/// Offsets of the pixels compared by each of `P` planes; padded with the pixel itself, which is never brighter.
fn pattern<const P: usize>() -> [[[isize; 2]; 8]; P] {
    let mut pattern = [[[0; 2]; 8]; P];
    let [reach_x, reach_y] = REACH.map(|reach| reach as isize);
    let is_sparse = |x: isize, y: isize| x % 2 == 0 && (y == 0 || y % 2 != 0);
    let pixels = (-reach_y..=reach_y).flat_map(|y| (-reach_x..=reach_x).map(move |x| [x, y]));
    let others = pixels.filter(|[x, y]| [*x, *y] != [0, 0] && (P != SPARSE || is_sparse(*x, *y)));
    for (place, other) in pattern.as_flattened_mut().iter_mut().zip(others) {
        *place = other;
    }
    pattern
}

/// The census bits of one row.
pub(super) struct Planes<const P: usize> {
    /// Bytes before the first pixel.
    margin: usize,
    pattern: [[[isize; 2]; 8]; P],
    bits: [Row<u8>; P],
    /// 255 for invalid pixels and in the margins.
    is_none: Row<u8>,
}

impl<const P: usize> Planes<P> {
    /// Buffers for a row of an image with `margin` bytes at both ends.
    pub(super) fn new(image: &Sixteen, margin: usize) -> Self {
        let stride = image.width.next_multiple_of(LANES) + 2 * margin;
        let bits = std::array::from_fn(|_| Row::new(stride, 0));
        Self { margin, pattern: pattern(), bits, is_none: Row::new(stride, u8::MAX) }
    }

    /// Computes the bits of row `y` of the image.
    pub(super) fn take(&mut self, image: &Sixteen, y: usize) {
        Arch::new().dispatch(Take { image, y, planes: self });
    }

    /// Returns the bits, and 255 for each invalid pixel.
    #[inline(always)]
    pub(super) fn views(&self) -> ([&[u8]; P], &[u8]) {
        let is_none = self.is_none.values();
        // Equal lengths save the kernels some bounds checks.
        (std::array::from_fn(|k| &self.bits[k].values()[..is_none.len()]), is_none)
    }
}

/// Computes the bits of a row.
struct Take<'a, const P: usize> {
    image: &'a Sixteen,
    y: usize,
    planes: &'a mut Planes<P>,
}

impl<const P: usize> WithSimd for Take<'_, P> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { image, y, planes } = self;
        let middle = &image.row(y, 0)[REACH[0]..];
        for (others, plane) in planes.pattern.iter().zip(&mut planes.bits) {
            let others = others.map(|[dx, dy]| {
                let dx = if image.is_mirrored { -dx } else { dx };
                &image.row(y, dy)[REACH[0].wrapping_add_signed(dx)..]
            });
            let plane = &mut plane.values_mut()[planes.margin..];
            for x in (0..image.width).step_by(LANES) {
                let ([here], [out]): (&[Block<u16>; 1], &mut [Block<u8>; 1]) =
                    (blocks(middle, x), blocks_mut(plane, x));
                let mut bits = [0; LANES];
                for (k, other) in others.iter().enumerate() {
                    let ([there], mask): (&[Block<u16>; 1], _) = (blocks(other, x), 1 << k);
                    for i in 0..LANES {
                        bits[i] |= if there[i] > here[i] { mask } else { 0 };
                    }
                }
                *out = bits;
            }
        }
        planes.is_none.values_mut()[planes.margin..][..image.width].copy_from_slice(image.is_none(y));
    }
}

/// Costs of a pixel for the disparities whose partners begin at `at` of the right planes; 255 where `beyond` is.
#[inline(always)]
pub(super) fn costs<const N: usize>(
    left: [u8; WHOLE],
    (right, is_none): (&[&[u8]; WHOLE], &[u8]),
    at: usize,
    beyond: &[Block<u8>; N],
    out: &mut [Block<u8>; N],
) {
    let [p0, p1, p2, p3, p4, p5, p6, p7]: [&[Block<u8>; N]; WHOLE] = [
        blocks(right[0], at),
        blocks(right[1], at),
        blocks(right[2], at),
        blocks(right[3], at),
        blocks(right[4], at),
        blocks(right[5], at),
        blocks(right[6], at),
        blocks(right[7], at),
    ];
    let none: &[Block<u8>; N] = blocks(is_none, at);
    for k in 0..N {
        let mut cells = [0; LANES];
        for i in 0..LANES {
            let (a, b, c, d) =
                (left[0] ^ p0[k][i], left[1] ^ p1[k][i], left[2] ^ p2[k][i], left[3] ^ p3[k][i]);
            let (e, f, g, h) =
                (left[4] ^ p4[k][i], left[5] ^ p5[k][i], left[6] ^ p6[k][i], left[7] ^ p7[k][i]);
            let ([abc, carry_abc], [def, carry_def]) = (add(a, b, c), add(d, e, f));
            let [ones, carry] = add(abc, def, g);
            let [twos, fours] = add(carry_abc, carry_def, carry);
            let once = count(ones).wrapping_add(count(h));
            let twice = count(fours).wrapping_shl(1).wrapping_add(count(twos));
            let bits = twice.wrapping_shl(1).wrapping_add(once);
            cells[i] = beyond[k][i] | (bits & !none[k][i]) | (COST_NONE[0] & none[k][i]);
        }
        out[k] = cells;
    }
}

/// As `costs`, with the planes of block matching and without `beyond`.
#[inline(always)]
pub(super) fn sparse_costs<const N: usize>(
    left: [u8; SPARSE],
    (right, is_none): (&[&[u8]; SPARSE], &[u8]),
    at: usize,
    out: &mut [Block<u8>; N],
) {
    let [p0, p1, p2]: [&[Block<u8>; N]; SPARSE] =
        [blocks(right[0], at), blocks(right[1], at), blocks(right[2], at)];
    let none: &[Block<u8>; N] = blocks(is_none, at);
    for k in 0..N {
        let mut cells = [0; LANES];
        for i in 0..LANES {
            let [ones, twos] = add(left[0] ^ p0[k][i], left[1] ^ p1[k][i], left[2] ^ p2[k][i]);
            let bits = count(twos).wrapping_shl(1).wrapping_add(count(ones));
            cells[i] = (bits & !none[k][i]) | (COST_NONE[1] & none[k][i]);
        }
        out[k] = cells;
    }
}

/// Carry-save adder on every bit position: the sum bits and the carry bits of three inputs.
#[inline(always)]
fn add(a: u8, b: u8, c: u8) -> [u8; 2] {
    let ab = a ^ b;
    [ab ^ c, (a & b) | (ab & c)]
}

#[inline(always)]
fn count(bits: u8) -> u8 {
    bits.count_ones() as u8
}
