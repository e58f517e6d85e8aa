//! Sampling of an image at many positions: windows, warped windows, and strips along a curve.
//!
//! Every value equals [`Kernel::sample`] up to rounding. At nearly all positions the sixteen taps of the cubic exist and
//! are valid; these are summed column by column in `f64`,
//! ```text
//! I(x, y) = Σ_c w_c(x) Σ_r w_r(y) p(r, c)
//! ```
//! four columns side by side in vector registers, in a fixed order. The others, at the border or touching an invalid
//! pixel, are delegated to [`Kernel::sample`]. At a whole pixel every kernel returns the pixel itself, so that a window
//! there is a copy.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | p | pixels of the image | fraction of full scale |
//! | w_c, w_r | `cubic_weights` of the fractions of x and y | – |

use nalgebra::Matrix2;
use pulp::{Arch, Simd, WithSimd};

use super::GrayImage;
use super::sample::{Kernel, cubic_weights};
use sightline_geometry::frames::Pixel;

/// Samples `image` at `place(u, v)` for every pixel (u, v) of an output of `width` × `height` px; NaN where it has no
/// value.
pub fn at_places(
    image: &GrayImage,
    [width, height]: [u32; 2],
    kernel: Kernel,
    place: impl Fn(u32, u32) -> Pixel,
) -> GrayImage {
    let mut values = vec![f32::NAN; width as usize * height as usize];
    if width > 0 {
        Arch::new().dispatch(Fill { image, width, kernel, place, values: &mut values });
    }
    GrayImage::from_raw(width, height, values).unwrap_or_default()
}

/// The square window of side 2·half + 1 about `centre` that samples `centre + map o` at offset o.
pub fn window(image: &GrayImage, centre: Pixel, map: &Matrix2<f64>, half: u32, kernel: Kernel) -> GrayImage {
    let (size, half_px) = (2 * half + 1, f64::from(half));
    if *map == Matrix2::identity() && centre.x.fract() == 0.0 && centre.y.fract() == 0.0 {
        return copy(image, centre.offset(-half_px, -half_px), size);
    }
    at_places(image, [size, size], kernel, |u, v| {
        let (u, v) = (f64::from(u) - half_px, f64::from(v) - half_px);
        centre.offset(map.m11 * u + map.m12 * v, map.m21 * u + map.m22 * v)
    })
}

/// The pixels of the square of side `size` whose first one is the whole pixel `first`.
fn copy(image: &GrayImage, first: Pixel, size: u32) -> GrayImage {
    let (width, height) = (i64::from(image.width()), i64::from(image.height()));
    // The cast saturates; an image cannot be that large.
    let (left, top) = (first.x as i64, first.y as i64);
    let mut values = vec![f32::NAN; size as usize * size as usize];
    for (v, out) in (0..).zip(values.chunks_exact_mut((size as usize).max(1))) {
        let y = top.saturating_add(v);
        let (from, to) = (left.max(0), left.saturating_add(i64::from(size)).min(width));
        if (0..height).contains(&y) && from < to {
            let row = &image.as_raw()[(y * width + from) as usize..(y * width + to) as usize];
            out[(from - left) as usize..][..row.len()].copy_from_slice(row);
        }
    }
    values.iter_mut().filter(|v| !v.is_finite()).for_each(|v| *v = f32::NAN);
    GrayImage::from_raw(size, size, values).unwrap_or_default()
}

/// Samples all positions with the widest vectors of the processor.
struct Fill<'a, F> {
    image: &'a GrayImage,
    width: u32,
    kernel: Kernel,
    place: F,
    values: &'a mut [f32],
}

impl<F: Fn(u32, u32) -> Pixel> WithSimd for Fill<'_, F> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { image, width, kernel, place, values } = self;
        let interior = Interior::new(image);
        for (v, row) in (0..).zip(values.chunks_exact_mut(width as usize)) {
            for (u, out) in (0..).zip(row) {
                let at = place(u, v);
                let inside = if kernel == Kernel::Bicubic { interior.bicubic(at) } else { f32::NAN };
                *out = if inside.is_finite() { inside } else { kernel.sample(image, at).unwrap_or(f32::NAN) };
            }
        }
    }
}

/// The positions of an image at which all sixteen taps of the cubic exist.
struct Interior<'a> {
    pixels: &'a [f32],
    stride: usize,
    /// Upper bounds of the positions, exclusive; the lower bound is 1.
    end: [f64; 2],
}

impl<'a> Interior<'a> {
    fn new(image: &'a GrayImage) -> Self {
        Self {
            pixels: image.as_raw(),
            stride: image.width() as usize,
            end: [f64::from(image.width()) - 2.0, f64::from(image.height()) - 2.0],
        }
    }

    /// The bicubic value; NaN outside the interior and beside an invalid pixel.
    #[inline(always)]
    fn bicubic(&self, at: Pixel) -> f32 {
        if !(at.x >= 1.0 && at.y >= 1.0 && at.x < self.end[0] && at.y < self.end[1]) {
            return f32::NAN;
        }
        let (column, row) = (at.x as i32, at.y as i32);
        let x_weights = cubic_weights(at.x - f64::from(column));
        let y_weights = cubic_weights(at.y - f64::from(row));
        // Indices inside the image cannot overflow.
        let above = (row as usize).wrapping_sub(1).wrapping_mul(self.stride);
        let Some(rows) = self.pixels.get(above.wrapping_add(column as usize).wrapping_sub(1)..) else {
            return f32::NAN;
        };
        let taps =
            |row: usize| rows.get(row.wrapping_mul(self.stride)..).and_then(|row| row.first_chunk::<4>());
        let (Some(a), Some(b), Some(c), Some(d)) = (taps(0), taps(1), taps(2), taps(3)) else {
            return f32::NAN;
        };
        let sums: [f64; 4] = std::array::from_fn(|i| {
            (y_weights[0] * f64::from(a[i]) + y_weights[1] * f64::from(b[i]))
                + (y_weights[2] * f64::from(c[i]) + y_weights[3] * f64::from(d[i]))
        });
        let products: [f64; 4] = std::array::from_fn(|i| sums[i] * x_weights[i]);
        ((products[0] + products[2]) + (products[1] + products[3])) as f32
    }
}

#[cfg(test)]
mod tests {
    use image::Luma;

    use super::*;

    fn noise(width: u32, height: u32) -> GrayImage {
        GrayImage::from_fn(width, height, |x, y| {
            let h = (x.wrapping_mul(0x9E37_79B1) ^ y.wrapping_mul(0x85EB_CA77)).wrapping_mul(0x2C1B_3C6D);
            Luma([(h >> 8) as f32 / 16_777_216.0])
        })
    }

    #[test]
    fn every_place_has_the_value_of_the_kernel_border_and_invalid_pixels_included() {
        let mut image = noise(40, 30);
        image.put_pixel(20, 15, Luma([f32::NAN]));
        for kernel in [Kernel::Bicubic, Kernel::Bilinear] {
            let place = |u: u32, v: u32| Pixel::new(0.37 * f64::from(u) - 1.5, 0.41 * f64::from(v) - 2.0);
            let read = at_places(&image, [120, 84], kernel, place);
            let mut outside = 0;
            for (u, v, found) in read.enumerate_pixels() {
                match kernel.sample(&image, place(u, v)) {
                    Some(value) => assert!((found[0] - value).abs() < 2e-7, "{kernel:?} at ({u}, {v})"),
                    None => {
                        assert!(found[0].is_nan(), "{kernel:?} at ({u}, {v})");
                        outside += 1;
                    }
                }
            }
            assert!(outside > 1000 && outside < 9000, "{outside}");
        }
    }

    #[test]
    fn a_window_at_a_whole_pixel_holds_the_pixels_themselves_and_nothing_beyond_the_image() {
        let image = noise(40, 30);
        for centre in
            [Pixel::new(7.0, 9.0), Pixel::new(1.0, 28.0), Pixel::new(-3.0, 40.0), Pixel::new(1e300, -1e300)]
        {
            let window = window(&image, centre, &Matrix2::identity(), 5, Kernel::Bicubic);
            for (u, v, found) in window.enumerate_pixels() {
                let place = centre.offset(f64::from(u) - 5.0, f64::from(v) - 5.0);
                let expected = Kernel::Bicubic.sample(&image, place);
                assert_eq!(Some(found[0]).filter(|v| !v.is_nan()), expected);
            }
        }
    }
}
