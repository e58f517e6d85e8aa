//! Whether a pixel's surroundings say anything about where along the row it is.
//!
//! ```text
//! t(p) = mean over 9 × 9 px of | I(x + 1, y) − I(x, y) |        fraction of full scale per px
//! ```
//! At the border the window is cut. Sums run over whole numbers (full scale 65535), so that they can be taken from row to
//! row by one more and one less without an error that adds up. What is invalid has no slope.

use rayon::prelude::*;

use crate::image::GrayImage;

/// Half of the window, px.
const HALF: usize = 4;
/// What 1 becomes.
const SCALE: f32 = 65535.0;

/// t of every pixel, row by row.
pub(super) fn texture(image: &GrayImage) -> Vec<f32> {
    let (width, height) = (image.width() as usize, image.height() as usize);
    let mut along = vec![0u32; width * height];
    let lines = along.par_chunks_exact_mut(width.max(1)).zip(image.as_raw().par_chunks_exact(width.max(1)));
    lines.for_each(|(line, row)| {
        // Casts make 0 of what is not a number.
        let slope = |x: usize| if x + 1 < width { ((row[x + 1] - row[x]).abs() * SCALE) as u32 } else { 0 };
        let mut sum: u32 = (0..HALF.min(width)).map(slope).sum();
        for (x, out) in line.iter_mut().enumerate() {
            sum += if x + HALF < width { slope(x + HALF) } else { 0 };
            sum -= if x > HALF { slope(x - HALF - 1) } else { 0 };
            *out = sum;
        }
    });
    let mut means = vec![0.0; width * height];
    means.par_chunks_exact_mut(width.max(1)).enumerate().for_each(|(y, out)| {
        let rows = y.saturating_sub(HALF)..(y + HALF + 1).min(height);
        let mut sums = vec![0u32; width];
        for line in rows.clone().map(|y| &along[y * width..][..width]) {
            for (sum, value) in sums.iter_mut().zip(line) {
                *sum += value;
            }
        }
        for (x, (out, sum)) in out.iter_mut().zip(sums).enumerate() {
            let columns = (x + HALF + 1).min(width) - x.saturating_sub(HALF);
            *out = sum as f32 / (SCALE * (columns * rows.len()) as f32);
        }
    });
    means
}
