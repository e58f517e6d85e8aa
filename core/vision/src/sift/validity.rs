//! Rejects features near invalid pixels.
//!
//! The scale space needs a value everywhere: an invalid pixel takes the value of the nearest valid one in its row; a row
//! without any is a copy of the last row above that has one, or of the first such row below. No feature may depend on
//! such a value, so a keypoint is rejected if an invalid pixel is within its *reach*: half the diagonal of the
//! descriptor's window, 2.5 · 3σ · √2, plus 3σ for the blur.

use std::borrow::Cow;

use super::{Keypoint, extent};
use crate::image::GrayImage;

/// Reach of the blur, in σ.
const BLUR_REACH: f32 = 3.0;

/// Positions of the invalid pixels.
pub(super) struct Validity {
    width: usize,
    height: usize,
    /// Number of invalid pixels left of each pixel in its row, with one more entry than pixels; empty if all are valid.
    before: Vec<u32>,
}

impl Validity {
    /// Finds the invalid pixels of an image; `None` if all are.
    pub(super) fn of(image: &GrayImage) -> Option<Self> {
        let (width, height) = (image.width() as usize, image.height() as usize);
        let invalid = image.as_raw().iter().filter(|v| !v.is_finite()).count();
        if invalid == width * height {
            return None;
        }
        let mut before = Vec::new();
        if invalid > 0 {
            before.reserve((width + 1) * height);
            for row in image.as_raw().chunks_exact(width) {
                let mut count = 0;
                before.push(count);
                for value in row {
                    count += u32::from(!value.is_finite());
                    before.push(count);
                }
            }
        }
        Some(Self { width, height, before })
    }

    /// Returns the image with a value at every pixel.
    pub(super) fn mended<'a>(&self, image: &'a GrayImage) -> Cow<'a, GrayImage> {
        if self.before.is_empty() {
            return Cow::Borrowed(image);
        }
        let mut mended = image.clone();
        let values: &mut [f32] = &mut mended;
        let mut is_empty = vec![false; self.height];
        for (row, is_empty) in values.chunks_exact_mut(self.width).zip(&mut is_empty) {
            *is_empty = !mend_row(row);
        }
        // Downwards from each row that has values, then upwards from the first.
        for y in 1..self.height {
            if is_empty[y] && !is_empty[y - 1] {
                values.copy_within((y - 1) * self.width..y * self.width, y * self.width);
                is_empty[y] = false;
            }
        }
        let first = is_empty.iter().position(|&empty| !empty).unwrap_or(0);
        for y in 0..first {
            values.copy_within(first * self.width..(first + 1) * self.width, y * self.width);
        }
        Cow::Owned(mended)
    }

    /// Returns whether all pixels within the keypoint's reach are valid.
    pub(super) fn allows(&self, keypoint: &Keypoint) -> bool {
        if self.before.is_empty() {
            return true;
        }
        let reach = (extent::REACH + BLUR_REACH) * keypoint.sigma_px;
        let rows = clipped(keypoint.y - reach, keypoint.y + reach, self.height);
        rows.into_iter().all(|y| {
            let half = (reach * reach - (y as f32 - keypoint.y).powi(2)).max(0.0).sqrt();
            let columns = clipped(keypoint.x - half, keypoint.x + half, self.width);
            let before = &self.before[y * (self.width + 1)..];
            before[columns.start] == before[columns.end]
        })
    }
}

/// The integers from `low` to `high` that are pixels of a side.
fn clipped(low: f32, high: f32, side: usize) -> std::ops::Range<usize> {
    let end = (high.floor() + 1.0).clamp(0.0, side as f32) as usize;
    (low.ceil().max(0.0) as usize).min(end)..end
}

/// Gives each invalid pixel the value of the nearest valid one; returns false if there is none.
fn mend_row(row: &mut [f32]) -> bool {
    let valid: Vec<usize> = (0..row.len()).filter(|&x| row[x].is_finite()).collect();
    let (Some(&first), Some(&last)) = (valid.first(), valid.last()) else { return false };
    let (left, right) = (row[first], row[last]);
    row[..first].fill(left);
    row[last + 1..].fill(right);
    for pair in valid.windows(2) {
        let (from, to) = (pair[0], pair[1]);
        let middle = (from + to).div_ceil(2);
        let (left, right) = (row[from], row[to]);
        row[from + 1..middle].fill(left);
        row[middle..to].fill(right);
    }
    true
}
