//! Texture of a pixel's surroundings along the row.
//!
//! ```text
//! t(p) = mean over 9 × 9 px of | I(x + 1, y) − I(x, y) |        fraction of full scale per px
//! ```
//! At the border the window is clipped. Sums are integers (full scale 65535), so that they can be updated from row to
//! row without accumulating errors. Invalid pixels have gradient 0.

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use crate::image::GrayImage;

/// Half of the window, px.
const HALF: usize = 4;
/// Integer value of full scale.
const SCALE: f32 = 65535.0;

/// Rows that are processed together.
const BAND: usize = 64;

/// t of every pixel, row by row.
pub(super) fn texture(image: &GrayImage) -> Vec<f32> {
    let width = image.width() as usize;
    let mut means = vec![0.0; image.as_raw().len()];
    means.par_chunks_mut((BAND * width).max(1)).enumerate().for_each(|(band, means)| {
        Arch::new().dispatch(Band { image, first: band * BAND, means });
    });
    means
}

/// t of some rows.
struct Band<'a> {
    image: &'a GrayImage,
    /// The first row.
    first: usize,
    means: &'a mut [f32],
}

impl WithSimd for Band<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { image, first, means } = self;
        let (width, height) = (image.width() as usize, image.height() as usize);
        let rows = first..first + means.len() / width;
        // Column sums over the rows of the window, with a margin without gradient, and sums of these over its columns.
        let (mut down, mut across) = (vec![0i32; width + 2 * HALF], vec![0i32; width]);
        let row = |y: usize| &image.as_raw()[y * width..][..width];
        for y in rows.start.saturating_sub(HALF)..(rows.start + HALF).min(height) {
            change(row(y), 1, &mut down);
        }
        for (y, means) in rows.zip(means.chunks_exact_mut(width)) {
            if y + HALF < height {
                change(row(y + HALF), 1, &mut down);
            }
            across.fill(0);
            for shift in 0..=2 * HALF {
                let down = &down[shift..][..width];
                for x in 0..width {
                    across[x] = across[x].wrapping_add(down[x]);
                }
            }
            let count = (y + HALF + 1).min(height) - y.saturating_sub(HALF);
            let whole = 1.0 / (SCALE * ((2 * HALF + 1) * count) as f32);
            for x in 0..width {
                means[x] = across[x] as f32 * whole;
            }
            for x in (0..HALF.min(width)).chain(width.saturating_sub(HALF)..width) {
                let columns = (x + HALF + 1).min(width) - x.saturating_sub(HALF);
                means[x] = across[x] as f32 / (SCALE * (columns * count) as f32);
            }
            if let Some(gone) = y.checked_sub(HALF) {
                change(row(gone), -1, &mut down);
            }
        }
    }
}

/// Adds the gradients of a row to the sums, multiplied by `sign`.
#[inline(always)]
fn change(row: &[f32], sign: i32, sums: &mut [i32]) {
    let (left, right) = (&row[..row.len() - 1], &row[1..]);
    let sums = &mut sums[HALF..][..left.len()];
    for x in 0..left.len() {
        // The cast converts NaN to 0.
        let slope = ((right[x] - left[x]).abs() * SCALE) as i32;
        sums[x] = sums[x].wrapping_add(sign.wrapping_mul(slope));
    }
}
