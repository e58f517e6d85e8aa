//! Image pyramids: each level half the size of the one below (Burt & Adelson 1983), as OpenCV's `pyrDown`.
//!
//! ```text
//! coarse(x, y) = Σ w(i) w(j) fine(2x + i, 2y + j),      w = (1, 4, 6, 4, 1) / 16,   i, j = −2 … 2
//! ```
//! Pixel (x, y) of a level is centred on pixel (2x, 2y) of the level below, without a half-pixel shift. The weights are
//! normalised over the valid pixels inside the image; a pixel is invalid if the one below its centre is.

use image::Luma;

use super::GrayImage;
use sightline_geometry::frames::Pixel;

/// Weights of the five taps.
const WEIGHTS: [f64; 5] = [1.0 / 16.0, 4.0 / 16.0, 6.0 / 16.0, 4.0 / 16.0, 1.0 / 16.0];

/// Halves the image: a side of n px becomes ⌈n/2⌉.
pub fn halve(image: &GrayImage) -> GrayImage {
    let (width, height) = (image.width().div_ceil(2), image.height().div_ceil(2));
    let (columns, rows) = (i64::from(image.width()), i64::from(image.height()));
    let mut across = Vec::with_capacity(width as usize * rows as usize);
    for row in image.as_raw().chunks_exact(columns as usize) {
        for x in 0..i64::from(width) {
            let near =
                |i: i64| (0..columns).contains(&(2 * x + i)).then(|| Weighted::of(row[(2 * x + i) as usize]));
            across.push(Weighted::sum(near));
        }
    }
    GrayImage::from_fn(width, height, |x, y| {
        let near = |i: i64| {
            let v = 2 * i64::from(y) + i;
            (0..rows).contains(&v).then(|| across[v as usize * width as usize + x as usize])
        };
        let Weighted { value, weight } = Weighted::sum(near);
        let is_valid = image.get_pixel(2 * x, 2 * y)[0].is_finite();
        Luma([if is_valid { (value / weight) as f32 } else { f32::NAN }])
    })
}

/// The image and its successive halves, finest first: at most `levels` in all.
pub fn pyramid(image: GrayImage, levels: usize) -> Vec<GrayImage> {
    let mut all = vec![image];
    while all.len() < levels {
        let Some(next) = all.last().filter(|last| last.width() > 1 && last.height() > 1).map(halve) else {
            break;
        };
        all.push(next);
    }
    all
}

/// Position of a pixel of the finest level, `level` levels above.
pub fn at_level(pixel: Pixel, level: usize) -> Pixel {
    let scale = f64::from(1_u32 << level);
    Pixel::new(pixel.x / scale, pixel.y / scale)
}

/// A weighted sum and the sum of its weights.
#[derive(Clone, Copy, Default)]
struct Weighted {
    value: f64,
    weight: f64,
}

impl Weighted {
    /// One pixel; an invalid one has weight 0.
    fn of(value: f32) -> Self {
        if value.is_finite() { Self { value: f64::from(value), weight: 1.0 } } else { Self::default() }
    }

    /// The sum over the existing offsets from −2 to 2.
    fn sum(near: impl Fn(i64) -> Option<Self>) -> Self {
        (-2..=2).zip(WEIGHTS).fold(Self::default(), |sum, (i, weight)| match near(i) {
            Some(one) => {
                Self { value: sum.value + weight * one.value, weight: sum.weight + weight * one.weight }
            }
            None => sum,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_stays_a_plane_and_a_pixel_lies_on_every_second_one_below() {
        let fine = GrayImage::from_fn(21, 16, |x, y| Luma([0.01 * x as f32 + 0.02 * y as f32]));
        let coarse = halve(&fine);
        assert_eq!(coarse.dimensions(), (11, 8));
        for (x, y, value) in
            coarse.enumerate_pixels().filter(|(x, y, _)| (1..10).contains(x) && (1..7).contains(y))
        {
            assert!((value[0] - fine.get_pixel(2 * x, 2 * y)[0]).abs() < 1e-6, "({x}, {y})");
        }
    }

    #[test]
    fn an_impulse_spreads_by_the_weights_and_an_invalid_pixel_does_not() {
        let mut fine = GrayImage::from_pixel(9, 9, Luma([0.0]));
        fine.put_pixel(4, 4, Luma([256.0]));
        let coarse = halve(&fine);
        assert_eq!(coarse.get_pixel(2, 2)[0], 36.0);
        assert_eq!(coarse.get_pixel(1, 2)[0], 6.0);
        assert_eq!(coarse.get_pixel(1, 1)[0], 1.0);
        let mut holed = GrayImage::from_pixel(9, 9, Luma([0.5]));
        holed.put_pixel(4, 4, Luma([f32::NAN]));
        let invalid = halve(&holed).iter().filter(|v| v.is_nan()).count();
        assert_eq!(invalid, 1);
        assert!(halve(&holed).iter().filter(|v| v.is_finite()).all(|v| (v - 0.5).abs() < 1e-6));
    }

    #[test]
    fn a_pyramid_has_the_levels_asked_for() {
        let sizes: Vec<u32> = pyramid(GrayImage::new(100, 60), 3).iter().map(GrayImage::width).collect();
        assert_eq!(sizes, [100, 50, 25]);
    }
}
