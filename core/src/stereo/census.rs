//! What a pixel's surroundings look like, in bits that brightness and contrast do not change.
//!
//! ```text
//! census:  bit k of pixel p = [ I(p + o_k) > I(p) ],  o_k the other pixels of 9 × 7          (Zabih & Woodfill 1994)
//! cost:    C(p, d) = bits that differ between p on the left and p − (d, 0) on the right      0 … 62
//! ```
//! The bits of a row lie in eight planes of bytes, so that sixty-four disparities are compared side by side: the right
//! image is mirrored, and the partners of p for d, d + 1, d + 2 … follow each other. Of the eight differences of a cell
//! the bits are added as a carry-save adder adds them, which leaves four counts to be taken instead of eight.
//!
//! A cell whose partner lies outside of the right image or is invalid costs [`COST_NONE`]; a pixel that finds it the cheapest
//! has no answer.
//!
//! Beside the border a missing pixel is the nearest one of its row or column; an invalid one is the last valid one of its
//! row.
//!
//! | symbol | our name | unit |
//! |---|---|---|
//! | I | `Bits::of`'s image, 16 bits | full scale / 65535 |
//! | C | [`costs`] | bits |

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::lanes::{Block, LANES, Row, blocks, blocks_mut};
use crate::image::GrayImage;

/// Bytes of bits of a pixel.
pub(super) const PLANES: usize = 8;
/// What a cell costs whose partner is none: less than the 31 bits of two pixels that have nothing to do with each other, so
/// that a surface goes on beyond the border.
const COST_NONE: u8 = 24;
/// How far the census reaches to the sides and up and down, px.
const REACH: [usize; 2] = [4, 3];

/// The bits of an image, row by row.
pub(super) struct Bits {
    /// Bytes from one row of a plane to the next.
    pub(super) stride: usize,
    /// Bytes before the first pixel of a row.
    pub(super) margin: usize,
    rows: Vec<[Row<u8>; PLANES + 1]>,
}

impl Bits {
    /// The bits of an image, mirrored left to right if `is_mirrored`, with `margin` bytes at both ends of every row.
    pub(super) fn of(image: &GrayImage, is_mirrored: bool, margin: usize) -> Self {
        let whole = Sixteen::of(image, is_mirrored);
        let width = image.width() as usize;
        let stride = margin + width.next_multiple_of(LANES) + margin;
        let row = |y: usize| {
            let mut planes: [Row<u8>; PLANES + 1] = std::array::from_fn(|_| Row::new(stride, 0));
            Arch::new().dispatch(OfRow { whole: &whole, y, is_mirrored, margin, planes: &mut planes });
            planes
        };
        let rows = (0..image.height() as usize).into_par_iter().map(row).collect();
        Self { stride, margin, rows }
    }

    /// The planes of a row; the last one says with 255 which pixels are none.
    #[inline(always)]
    pub(super) fn row(&self, y: usize) -> [&[u8]; PLANES + 1] {
        std::array::from_fn(|k| self.rows[y][k].values())
    }
}

/// An image of 16 bits with a margin at the sides.
struct Sixteen {
    width: usize,
    height: usize,
    stride: usize,
    values: Vec<u16>,
    /// 255 where the image is invalid, without margin.
    is_none: Vec<u8>,
}

impl Sixteen {
    fn of(image: &GrayImage, is_mirrored: bool) -> Self {
        let (width, height) = (image.width() as usize, image.height() as usize);
        let stride = width.next_multiple_of(LANES) + 2 * REACH[0];
        let (mut values, mut is_none) = (vec![0; stride * height], vec![0; width * height]);
        let lines = values.par_chunks_exact_mut(stride).zip(is_none.par_chunks_exact_mut(width));
        lines.zip(image.as_raw().par_chunks_exact(width)).for_each(|((line, is_none), pixels)| {
            let mut last = pixels.iter().copied().find(|value| value.is_finite()).unwrap_or(0.0);
            for (x, &pixel) in pixels.iter().enumerate() {
                let at = if is_mirrored { width - 1 - x } else { x };
                if pixel.is_finite() {
                    last = pixel;
                } else {
                    is_none[at] = u8::MAX;
                }
                line[REACH[0] + at] = (last * 65535.0 + 0.5) as u16;
            }
            let (first, last) = (line[REACH[0]], line[REACH[0] + width - 1]);
            line[..REACH[0]].fill(first);
            line[REACH[0] + width..].fill(last);
        });
        Self { width, height, stride, values, is_none }
    }

    /// The row `y + dy`, or the nearest one.
    #[inline(always)]
    fn row(&self, y: usize, dy: isize) -> &[u16] {
        let y = y.saturating_add_signed(dy).min(self.height - 1);
        &self.values[y * self.stride..][..self.stride]
    }
}

/// The bits of one row.
struct OfRow<'a> {
    whole: &'a Sixteen,
    y: usize,
    is_mirrored: bool,
    margin: usize,
    planes: &'a mut [Row<u8>; PLANES + 1],
}

impl WithSimd for OfRow<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { whole, y, is_mirrored, margin, planes } = self;
        let middle = whole.row(y, 0);
        let mut bit = 0;
        for dy in -(REACH[1] as isize)..=REACH[1] as isize {
            let row = whole.row(y, dy);
            for dx in -(REACH[0] as isize)..=REACH[0] as isize {
                if (dx, dy) == (0, 0) {
                    continue;
                }
                let shift = REACH[0].wrapping_add_signed(if is_mirrored { -dx } else { dx });
                let plane = planes[bit / 8].values_mut();
                let mask = 1 << (bit % 8);
                for x in (0..whole.width).step_by(LANES) {
                    let ([there], [here]) = (blocks(row, x + shift), blocks(middle, x + REACH[0]));
                    let [out] = blocks_mut(plane, margin + x);
                    for i in 0..LANES {
                        out[i] |= if there[i] > here[i] { mask } else { 0 };
                    }
                }
                bit += 1;
            }
        }
        let last = planes[PLANES].values_mut();
        last.fill(u8::MAX);
        last[margin..][..whole.width].copy_from_slice(&whole.is_none[y * whole.width..][..whole.width]);
    }
}

/// The costs of a pixel for the disparities whose partners begin at `at` of the right planes; 255 where `beyond` has it.
#[inline(always)]
pub(super) fn costs<const N: usize>(
    left: [u8; PLANES],
    right: &[&[u8]; PLANES + 1],
    at: usize,
    beyond: &[Block<u8>; N],
    out: &mut [Block<u8>; N],
) {
    let [p0, p1, p2, p3, p4, p5, p6, p7, none]: [&[Block<u8>; N]; PLANES + 1] = [
        blocks(right[0], at),
        blocks(right[1], at),
        blocks(right[2], at),
        blocks(right[3], at),
        blocks(right[4], at),
        blocks(right[5], at),
        blocks(right[6], at),
        blocks(right[7], at),
        blocks(right[8], at),
    ];
    for k in 0..N {
        let mut cells = [0; LANES];
        for i in 0..LANES {
            let (a, b, c, d) =
                (left[0] ^ p0[k][i], left[1] ^ p1[k][i], left[2] ^ p2[k][i], left[3] ^ p3[k][i]);
            let (e, f, g, h) =
                (left[4] ^ p4[k][i], left[5] ^ p5[k][i], left[6] ^ p6[k][i], left[7] ^ p7[k][i]);
            let (ab, abc) = (a ^ b, a ^ b ^ c);
            let carry_abc = (a & b) | (ab & c);
            let (de, def) = (d ^ e, d ^ e ^ f);
            let carry_def = (d & e) | (de & f);
            let (s, ones) = (abc ^ def, abc ^ def ^ g);
            let carry_g = (abc & def) | (s & g);
            let (t, twos) = (carry_abc ^ carry_def, carry_abc ^ carry_def ^ carry_g);
            let fours = (carry_abc & carry_def) | (t & carry_g);
            let once = (ones.count_ones() as u8).wrapping_add(h.count_ones() as u8);
            let twice = (fours.count_ones() as u8).wrapping_shl(1).wrapping_add(twos.count_ones() as u8);
            let bits = twice.wrapping_shl(1).wrapping_add(once);
            cells[i] = beyond[k][i] | if none[k][i] != 0 { COST_NONE } else { bits };
        }
        out[k] = cells;
    }
}
