//! Integral images: sums, sums of squares and counts of invalid pixels of any rectangle in four reads (Crow 1984).
//!
//! ```text
//! S(x, y) = Σ_{i<x, j<y} (v(i, j) − shift)          and the same with the square
//! ```
//! The variance of a window is a small difference of large sums, so the values are taken relative to the mean
//! of the region and summed in `f64`. Invalid pixels add nothing and are counted.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | v | pixel value | fraction of full scale |
//! | shift | `shift` | fraction of full scale |

use super::{GrayImage, PixelRect};

/// Integral images of a region of an image.
#[derive(Clone, Debug)]
pub struct Integral {
    /// What was subtracted from every pixel: the mean of the region's valid pixels.
    pub shift: f64,
    stride: usize,
    sums: Vec<f64>,
    squares: Vec<f64>,
    /// Left empty when every pixel is valid, which is nearly always.
    invalid: Vec<u32>,
}

impl Integral {
    /// The integral images of `region`, which lies inside `image`.
    pub fn new(image: &GrayImage, region: &PixelRect) -> Self {
        let rows = |y: u32| row(image, region, y);
        let (mut sum, mut valid) = (0.0, 0_u64);
        for y in 0..region.height {
            let (row_sum, row_valid) = sum_of_valid(rows(y));
            sum += row_sum;
            valid += u64::from(row_valid);
        }
        let shift = if valid == 0 { 0.0 } else { sum / valid as f64 };
        let stride = region.width as usize + 1;
        let zeros = || vec![0.0; stride * (region.height as usize + 1)];
        let mut integral = Self { shift, stride, sums: zeros(), squares: zeros(), invalid: Vec::new() };
        for y in 0..region.height {
            integral.fill_row(y as usize + 1, rows(y));
        }
        if valid < region.area() {
            integral.invalid = invalid_counts(region, rows);
        }
        integral
    }

    fn fill_row(&mut self, y: usize, pixels: &[f32]) {
        let (start, stride) = (y * self.stride, self.stride);
        let (mut sum, mut square) = (0.0, 0.0);
        let (above, here) = self.sums[start - stride..start + stride].split_at_mut(stride);
        let (squares_above, squares_here) = self.squares[start - stride..start + stride].split_at_mut(stride);
        for (x, value) in pixels.iter().enumerate() {
            let v = if value.is_finite() { f64::from(*value) - self.shift } else { 0.0 };
            (sum, square) = (sum + v, square + v * v);
            here[x + 1] = above[x + 1] + sum;
            squares_here[x + 1] = squares_above[x + 1] + square;
        }
    }

    /// Sum and sum of squares of the shifted valid pixels of `width` × `height` from (`x`, `y`) of the region.
    pub fn sums(&self, x: usize, y: usize, width: usize, height: usize) -> [f64; 2] {
        let (top, bottom) = (y * self.stride + x, (y + height) * self.stride + x);
        [&self.sums, &self.squares].map(|s| s[bottom + width] - s[bottom] - (s[top + width] - s[top]))
    }

    /// Whether all pixels of `width` × `height` from (`x`, `y`) of the region are valid.
    pub fn all_valid(&self, x: usize, y: usize, width: usize, height: usize) -> bool {
        let (top, bottom) = (y * self.stride + x, (y + height) * self.stride + x);
        let n = &self.invalid;
        n.is_empty() || n[bottom + width] + n[top] == n[bottom] + n[top + width]
    }

    /// Whether the region holds an invalid pixel.
    pub fn has_invalid(&self) -> bool {
        !self.invalid.is_empty()
    }

    /// Sums and sums of squares of everything above and to the left of each corner of row `y`: one number more
    /// than there are pixels in a row. For loops that need many windows of one row.
    pub fn corner_row(&self, y: usize) -> (&[f64], &[f64]) {
        let row = y * self.stride..(y + 1) * self.stride;
        (&self.sums[row.clone()], &self.squares[row])
    }

    /// Sum of squares over the whole region: the size of the numbers of which differences are taken.
    pub fn total_squares(&self) -> f64 {
        self.squares.last().copied().unwrap_or(0.0)
    }
}

/// Row `y` of the region.
pub(crate) fn row<'a>(image: &'a GrayImage, region: &PixelRect, y: u32) -> &'a [f32] {
    let start = (region.y as usize + y as usize) * image.width() as usize + region.x as usize;
    &image.as_raw()[start..start + region.width as usize]
}

fn sum_of_valid(row: &[f32]) -> (f64, u32) {
    // Eight sums side by side let the additions overlap; their order is fixed, so the result is too.
    let mut lanes = [(0.0, 0_u32); 8];
    for chunk in row.chunks(8) {
        for (lane, v) in lanes.iter_mut().zip(chunk) {
            let valid = v.is_finite();
            lane.0 += if valid { f64::from(*v) } else { 0.0 };
            lane.1 += u32::from(valid);
        }
    }
    lanes.iter().fold((0.0, 0), |sum, lane| (sum.0 + lane.0, sum.1 + lane.1))
}

fn invalid_counts<'a>(region: &PixelRect, rows: impl Fn(u32) -> &'a [f32]) -> Vec<u32> {
    let stride = region.width as usize + 1;
    let mut counts = vec![0; stride * (region.height as usize + 1)];
    for y in 0..region.height {
        let (start, mut count) = ((y as usize + 1) * stride, 0);
        for (x, v) in rows(y).iter().enumerate() {
            count += u32::from(!v.is_finite());
            counts[start + x + 1] = counts[start + x + 1 - stride] + count;
        }
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_of_every_rectangle_equal_direct_sums_and_invalid_pixels_are_counted() {
        let mut image =
            GrayImage::from_fn(13, 11, |x, y| image::Luma([((x * 7 + y * 13) % 10) as f32 / 10.0]));
        image.put_pixel(6, 5, image::Luma([f32::NAN]));
        let region = PixelRect::new(2, 1, 9, 8);
        let integral = Integral::new(&image, &region);
        for (y, x, h, w) in [(0, 0, 8, 9), (1, 2, 3, 4), (4, 4, 1, 1), (5, 0, 3, 4), (0, 0, 0, 0)] {
            let (mut sums, mut all_valid) = ([0.0, 0.0], true);
            for (j, i) in (y..y + h).flat_map(|j| (x..x + w).map(move |i| (j, i))) {
                let v = f64::from(image.get_pixel(i as u32 + 2, j as u32 + 1)[0]) - integral.shift;
                all_valid &= v.is_finite();
                if v.is_finite() {
                    sums = [sums[0] + v, sums[1] + v * v];
                }
            }
            let found = integral.sums(x, y, w, h);
            assert!((found[0] - sums[0]).abs() < 1e-12 && (found[1] - sums[1]).abs() < 1e-12);
            assert_eq!(integral.all_valid(x, y, w, h), all_valid);
        }
    }
}
