//! What a pixel's surroundings look like, in bits that brightness and contrast do not change.
//!
//! ```text
//! census:  bit k of pixel p = [ I(p + o_k) > I(p) ]                                          (Zabih & Woodfill 1994)
//! cost:    C(p, d) = bits that differ between p on the left and p − (d, 0) on the right
//! ```
//! | for | o_k | planes | C |
//! |---|---|---|---|
//! | semi-global matching | the other pixels of 9 × 7 | [`WHOLE`] | 0 … 62 |
//! | block matching | of these every second column of the middle row and of the rows 1 and 3 beside it | [`SPARSE`] | 0 … 24 |
//!
//! A window sums the bits of its pixels, and what one of them leaves out its neighbours look at: a part of the pixels is
//! enough there (ours; docs/stereo.md has the figures).
//!
//! The bits of a row lie in planes of bytes, so that sixty-four disparities are compared side by side: the right
//! image is mirrored, and the partners of p for d, d + 1, d + 2 … follow each other. The differences of a cell are first
//! added as a carry-save adder adds them, which leaves four counts of bits instead of eight, and two instead of three. Bits are
//! made row by row when they are asked for, which is quicker than to hold them.
//!
//! A cell whose partner lies outside of the right image or is invalid costs less than the half of the bits by which
//! two pixels that have nothing to do with each other differ, so that a surface goes on beyond the border; a pixel that finds it
//! the cheapest has no answer.
//!
//! Beside the border a missing pixel is the nearest one of its row or column; an invalid one is the last valid one of its
//! row.
//!
//! | symbol | our name | unit |
//! |---|---|---|
//! | I | [`Sixteen`], 16 bits | full scale / 65535 |
//! | C | [`costs`], [`sparse_costs`] | bits |

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::lanes::{Block, LANES, Row, blocks, blocks_mut};
use crate::image::GrayImage;

/// Planes of 62 bits.
pub(super) const WHOLE: usize = 8;
/// Planes of 24 bits.
pub(super) const SPARSE: usize = 3;
/// What a cell costs whose partner is none, of 62 bits and of 24.
const COST_NONE: [u8; 2] = [24, 9];
/// How far the widest census reaches to the sides and up and down, px.
const REACH: [usize; 2] = [4, 3];

/// An image of 16 bits with a margin at the sides.
pub(super) struct Sixteen {
    is_mirrored: bool,
    width: usize,
    height: usize,
    stride: usize,
    values: Vec<u16>,
    /// 255 where the image is invalid, without margin.
    is_none: Vec<u8>,
}

impl Sixteen {
    /// An image, mirrored left to right if `is_mirrored`.
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

    /// Which pixels of a row are none: 255 or 0.
    #[inline(always)]
    pub(super) fn is_none(&self, y: usize) -> &[u8] {
        &self.is_none[y * self.width..][..self.width]
    }

    /// The row `y + dy`, or the nearest one.
    #[inline(always)]
    fn row(&self, y: usize, dy: isize) -> &[u16] {
        let y = y.saturating_add_signed(dy).min(self.height - 1);
        &self.values[y * self.stride..][..self.stride]
    }
}

/// Makes whole numbers of a row.
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
            // Casts cut to the range, and make 0 of what is not a number.
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

/// The other pixels that each of `P` planes looks at; where one has fewer than eight, the pixel itself, which is never brighter.
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

/// The bits of one row.
pub(super) struct Planes<const P: usize> {
    /// Bytes before the first pixel.
    margin: usize,
    pattern: [[[isize; 2]; 8]; P],
    bits: [Row<u8>; P],
    /// 255 for what is none, as the margin is.
    is_none: Row<u8>,
}

impl<const P: usize> Planes<P> {
    /// Room for a row of an image with `margin` bytes at both ends.
    pub(super) fn new(image: &Sixteen, margin: usize) -> Self {
        let stride = image.width.next_multiple_of(LANES) + 2 * margin;
        let bits = std::array::from_fn(|_| Row::new(stride, 0));
        Self { margin, pattern: pattern(), bits, is_none: Row::new(stride, u8::MAX) }
    }

    /// Takes row `y` of the image.
    pub(super) fn take(&mut self, image: &Sixteen, y: usize) {
        Arch::new().dispatch(Take { image, y, planes: self });
    }

    /// The bits, and which pixels are none.
    #[inline(always)]
    pub(super) fn views(&self) -> ([&[u8]; P], &[u8]) {
        let is_none = self.is_none.values();
        // As long as each other, which spares the kernels some comparisons.
        (std::array::from_fn(|k| &self.bits[k].values()[..is_none.len()]), is_none)
    }
}

/// Makes the bits of a row.
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

/// The costs of a pixel for the disparities whose partners begin at `at` of the right planes; 255 where `beyond` has it.
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

/// The same by the planes of block matching, without `beyond`.
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

/// Three bits added in every place: the sum's lower bits, and those that are carried.
#[inline(always)]
fn add(a: u8, b: u8, c: u8) -> [u8; 2] {
    let ab = a ^ b;
    [ab ^ c, (a & b) | (ab & c)]
}

#[inline(always)]
fn count(bits: u8) -> u8 {
    bits.count_ones() as u8
}
