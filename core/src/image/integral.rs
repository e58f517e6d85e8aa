//! A rolling integral image: sums over every window of a strip of rows in two reads (after Crow 1984).
//!
//! Of the integral image only what one row of windows needs is held: sums over the `height` rows of each column,
//! and their running total along the row,
//! ```text
//! C(x) = Σ_{rows of the strip} (v(x, y) − shift)        S(x) = Σ_{i<x} C(i)        and the same with the square
//! ```
//! so that a window of w columns from x sums to S(x + w) − S(x). The strip moves down by adding a row and
//! taking one away. A whole integral image would cost more in fresh memory than in additions, and its corners
//! grow with the image, of which the variance of a window is a small difference: sums are in `f64`, of
//! values relative to `shift`. Invalid pixels add nothing and are counted.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | v | pixel value | fraction of full scale |
//! | shift | `shift` | fraction of full scale |

use pulp::Simd;

use super::{GrayImage, PixelRect};

/// Sums over the columns of a strip of rows, and their running totals.
#[derive(Clone, Debug)]
pub struct RollingIntegral<'a> {
    image: &'a GrayImage,
    region: PixelRect,
    /// Rows of the strip.
    height: usize,
    /// First row of the strip, from the region's first.
    top: usize,
    shift: f32,
    column_sums: Vec<f64>,
    column_squares: Vec<f64>,
    sums: Vec<f64>,
    squares: Vec<f64>,
    /// Left empty when every pixel of the region is valid, which is nearly always.
    column_invalid: Vec<u32>,
    invalid: Vec<u32>,
}

impl<'a> RollingIntegral<'a> {
    /// Strips of `height` rows of `region`, which lies inside `image`; [`Self::start`] comes next.
    ///
    /// `shift` is any value near the region's; `has_invalid` says whether a pixel of it is invalid.
    pub fn new(
        image: &'a GrayImage,
        region: PixelRect,
        height: usize,
        shift: f32,
        has_invalid: bool,
    ) -> Self {
        let width = region.width as usize;
        let counts = if has_invalid { width } else { 0 };
        Self {
            image,
            region,
            height,
            top: 0,
            shift,
            column_sums: vec![0.0; width],
            column_squares: vec![0.0; width],
            sums: vec![0.0; width + 1],
            squares: vec![0.0; width + 1],
            column_invalid: vec![0; counts],
            invalid: vec![0; if has_invalid { width + 1 } else { 0 }],
        }
    }

    /// Puts the strip's first row at `top`, summed afresh.
    #[inline(always)]
    pub fn start(&mut self, top: usize) {
        self.top = top;
        self.column_sums.fill(0.0);
        self.column_squares.fill(0.0);
        self.column_invalid.fill(0);
        for y in top..top + self.height {
            self.add(row(self.image, &self.region, y), 1.0);
        }
        self.total();
    }

    /// Moves the strip down by one row.
    #[inline(always)]
    pub fn advance(&mut self) {
        self.add(row(self.image, &self.region, self.top), -1.0);
        self.add(row(self.image, &self.region, self.top + self.height), 1.0);
        self.top += 1;
        self.total();
    }

    /// Running totals along the strip of the shifted values and of their squares: one more than columns.
    #[inline(always)]
    pub fn totals(&self) -> (&[f64], &[f64]) {
        (&self.sums, &self.squares)
    }

    /// Whether all pixels of the strip's `width` columns from `x` are valid.
    pub fn all_valid(&self, x: usize, width: usize) -> bool {
        self.invalid.is_empty() || self.invalid[x] == self.invalid[x + width]
    }

    /// Adds (`sign` 1) or takes away (−1) a row.
    #[inline(always)]
    fn add(&mut self, pixels: &[f32], sign: f64) {
        let shift = self.shift;
        for ((sum, square), v) in self.column_sums.iter_mut().zip(&mut self.column_squares).zip(pixels) {
            let v = f64::from(if v.is_finite() { *v } else { shift }) - f64::from(shift);
            *sum += sign * v;
            *square += sign * (v * v);
        }
        for (count, v) in self.column_invalid.iter_mut().zip(pixels) {
            let invalid = u32::from(!v.is_finite());
            *count = if sign > 0.0 { *count + invalid } else { *count - invalid };
        }
    }

    #[inline(always)]
    fn total(&mut self) {
        let (mut sum, mut square) = (0.0, 0.0);
        let columns = self.column_sums.iter().zip(&self.column_squares);
        for ((s, q), (column, column_square)) in
            self.sums[1..].iter_mut().zip(&mut self.squares[1..]).zip(columns)
        {
            (sum, square) = (sum + column, square + column_square);
            (*s, *q) = (sum, square);
        }
        let mut count = 0;
        for (total, column) in self.invalid.iter_mut().skip(1).zip(&self.column_invalid) {
            count += column;
            *total = count;
        }
    }
}

/// Row `y` of the region, counted from its first.
#[inline(always)]
pub(crate) fn row<'a>(image: &'a GrayImage, region: &PixelRect, y: usize) -> &'a [f32] {
    let start = (region.y as usize + y) * image.width() as usize + region.x as usize;
    &image.as_raw()[start..start + region.width as usize]
}

/// Mean of the valid values of some rows, and whether a value is invalid; the mean is 0 when none is valid.
///
/// Sums of `f32` side by side: good to a few digits, for a shift that may be any value nearby.
#[inline(always)]
pub(crate) fn rough_mean<'a, S: Simd>(simd: S, rows: impl Iterator<Item = &'a [f32]>) -> (f32, bool) {
    let (zero, one) = (simd.splat_f32s(0.0), simd.splat_f32s(1.0));
    let infinity = simd.splat_f32s(f32::INFINITY);
    let (mut sums, mut counts, mut total) = (zero, zero, 0);
    for row in rows {
        total += row.len();
        let (vectors, rest) = S::as_simd_f32s(row);
        for v in vectors {
            let is_valid = simd.less_than_f32s(simd.abs_f32s(*v), infinity);
            sums = simd.add_f32s(sums, simd.select_f32s(is_valid, *v, zero));
            counts = simd.add_f32s(counts, simd.select_f32s(is_valid, one, zero));
        }
        // The rest counts only where its validity does: it is too short to move the mean.
        total -= rest.iter().filter(|v| v.is_finite()).count();
    }
    let count = simd.reduce_sum_f32s(counts);
    let mean = if count > 0.0 { simd.reduce_sum_f32s(sums) / count } else { 0.0 };
    (mean, (count as usize) < total)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_of_every_window_equal_direct_sums_and_invalid_pixels_are_counted() {
        let mut image =
            GrayImage::from_fn(13, 11, |x, y| image::Luma([((x * 7 + y * 13) % 10) as f32 / 10.0]));
        image.put_pixel(6, 5, image::Luma([f32::NAN]));
        let (region, shift) = (PixelRect::new(2, 1, 9, 8), 0.375);
        let mut strip = RollingIntegral::new(&image, region, 3, shift, true);
        for start in [0, 2] {
            strip.start(start);
            for y in start..=5 {
                for (x, w) in (0..9).flat_map(|x| (0..=9 - x).map(move |w| (x, w))) {
                    let pixels = (y..y + 3).flat_map(|j| row(&image, &region, j)[x..x + w].iter());
                    let (valid, invalid): (Vec<f32>, Vec<f32>) = pixels.partition(|v| v.is_finite());
                    let sum: f64 = valid.iter().map(|v| f64::from(v - shift)).sum();
                    let square: f64 = valid.iter().map(|v| f64::from(v - shift).powi(2)).sum();
                    let (sums, squares) = strip.totals();
                    assert!((sums[x + w] - sums[x] - sum).abs() < 1e-6);
                    assert!((squares[x + w] - squares[x] - square).abs() < 1e-6);
                    assert_eq!(strip.all_valid(x, w), invalid.is_empty());
                }
                if y < 5 {
                    strip.advance();
                }
            }
        }
    }

    #[test]
    fn the_rough_mean_leaves_invalid_values_out_and_reports_them() {
        let mean = |rows: &[Vec<f32>]| rough_mean(pulp::Scalar, rows.iter().map(Vec::as_slice));
        assert_eq!(mean(&[vec![0.25; 37], vec![0.75; 37]]), (0.5, false));
        assert_eq!(mean(&[vec![f32::NAN; 20], vec![0.75; 37]]), (0.75, true));
        assert_eq!(mean(&[vec![f32::NAN]]), (0.0, true));
    }
}
