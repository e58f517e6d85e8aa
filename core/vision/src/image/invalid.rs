//! Number of invalid pixels in a window, in four reads: an integral image (Crow 1984) of counts.
//!
//! ```text
//! I(x, y) = number of invalid pixels above y and left of x
//! invalid in n × n pixels from (x, y) = I(x + n, y + n) − I(x, y + n) − I(x + n, y) + I(x, y)
//! ```

use pulp::{Arch, Simd, WithSimd};

use super::{GrayImage, PixelRect};

/// Counts of the invalid pixels of a region.
#[derive(Clone, Debug)]
pub struct InvalidCounts {
    /// Length of a row of I: one more than the number of pixels.
    stride: usize,
    /// I.
    counts: Vec<u32>,
}

impl InvalidCounts {
    /// Counts of a region inside the image; `None` if all its pixels are valid.
    pub fn of(image: &GrayImage, region: PixelRect) -> Option<Self> {
        let (width, height) = (region.width as usize, region.height as usize);
        let row = |y: usize| {
            let start = (region.y as usize + y) * image.width() as usize + region.x as usize;
            &image.as_raw()[start..start + width]
        };
        if (0..height).all(|y| Arch::new().dispatch(IsWhole(row(y)))) {
            return None;
        }
        let stride = width + 1;
        let mut counts = vec![0; stride * (height + 1)];
        for y in 0..height {
            let mut in_row = 0;
            for (x, v) in row(y).iter().enumerate() {
                in_row += u32::from(!v.is_finite());
                counts[(y + 1) * stride + x + 1] = counts[y * stride + x + 1] + in_row;
            }
        }
        Some(Self { stride, counts })
    }

    /// Returns whether all of `size` × `size` pixels from `first` (column, row of the region) are valid.
    pub fn none_in(&self, [x, y]: [usize; 2], size: usize) -> bool {
        let at = |x: usize, y: usize| self.counts[y * self.stride + x];
        at(x + size, y + size) + at(x, y) == at(x, y + size) + at(x + size, y)
    }
}

/// Returns whether all values are finite; reads every one, vectorised.
struct IsWhole<'a>(&'a [f32]);

impl WithSimd for IsWhole<'_> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> bool {
        let (vectors, rest) = S::as_simd_f32s(self.0);
        // 0 · v is 0 for a finite v, and NaN for any other.
        let (zero, mut sum) = (simd.splat_f32s(0.0), simd.splat_f32s(0.0));
        for v in vectors {
            sum = simd.mul_add_e_f32s(*v, zero, sum);
        }
        simd.reduce_sum_f32s(sum) == 0.0 && rest.iter().all(|v| v.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_with_and_without_invalid_pixels_are_told_apart() {
        let mut image = GrayImage::from_pixel(13, 11, image::Luma([0.5]));
        let region = PixelRect::new(2, 1, 9, 8);
        assert!(InvalidCounts::of(&image, region).is_none());
        image.put_pixel(0, 0, image::Luma([f32::NAN]));
        assert!(InvalidCounts::of(&image, region).is_none(), "a pixel outside of the region does not matter");
        image.put_pixel(6, 5, image::Luma([f32::NAN]));
        image.put_pixel(10, 8, image::Luma([f32::INFINITY]));
        let counts = InvalidCounts::of(&image, region).unwrap();
        for (y, x) in (0..=5).flat_map(|y| (0..=6).map(move |x| (y, x))) {
            let pixels = (y..y + 3).flat_map(|v| (x..x + 3).map(move |u| (u, v)));
            let expected =
                pixels.into_iter().all(|(u, v)| image.get_pixel(u as u32 + 2, v as u32 + 1)[0].is_finite());
            assert_eq!(counts.none_in([x, y], 3), expected, "at ({x}, {y})");
        }
    }
}
