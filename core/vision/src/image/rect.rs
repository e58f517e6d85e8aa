//! Rectangles of whole pixels: search windows, subframes, regions of interest.
//!
//! `x` and `y` are the first pixel, so the centres of the pixels span [x, x + width − 1] × [y, y + height − 1].

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use sightline_geometry::frames::Pixel;

/// A rectangle of whole pixels; it may extend over the border of an image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, ToSchema)]
pub struct PixelRect {
    /// Column of the first pixel, px.
    pub x: i32,
    /// Row of the first pixel, px.
    pub y: i32,
    /// Number of columns, px.
    pub width: u32,
    /// Number of rows, px.
    pub height: u32,
}

impl PixelRect {
    /// The rectangle with its first pixel at (`x`, `y`).
    pub const fn new(x: i32, y: i32, width: u32, height: u32) -> Self {
        Self { x, y, width, height }
    }

    /// All pixels of an image of `width` × `height`.
    pub const fn whole(width: u32, height: u32) -> Self {
        Self::new(0, 0, width, height)
    }

    /// The square of `size` × `size` pixels with its centre nearest to `centre`.
    pub fn centred(centre: Pixel, size: u32) -> Self {
        let half = (f64::from(size) - 1.0) / 2.0;
        Self::new((centre.x - half).round() as i32, (centre.y - half).round() as i32, size, size)
    }

    /// The intersection of both rectangles; `None` if it is empty.
    pub fn intersect(&self, other: &Self) -> Option<Self> {
        let (x, width) = overlap((self.x, self.width), (other.x, other.width))?;
        let (y, height) = overlap((self.y, self.height), (other.y, other.height))?;
        Some(Self { x, y, width, height })
    }

    /// The centre, px; between pixels if a side is even.
    pub fn centre(&self) -> Pixel {
        let middle = |start: i32, length: u32| f64::from(start) + (f64::from(length) - 1.0) / 2.0;
        Pixel::new(middle(self.x, self.width), middle(self.y, self.height))
    }

    /// Returns whether the pixel nearest to `at` is in the rectangle.
    pub fn contains(&self, at: Pixel) -> bool {
        let within = |v: f64, start: i32, length: u32| {
            let v = v.round() - f64::from(start);
            v >= 0.0 && v < f64::from(length)
        };
        within(at.x, self.x, self.width) && within(at.y, self.y, self.height)
    }

    /// Number of pixels.
    pub fn area(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }
}

/// Start and length of the intersection of two spans; in `i64`, because a rectangle may end beyond `i32::MAX`.
fn overlap(a: (i32, u32), b: (i32, u32)) -> Option<(i32, u32)> {
    let end = |(start, length): (i32, u32)| i64::from(start) + i64::from(length);
    let start = a.0.max(b.0);
    let length = end(a).min(end(b)) - i64::from(start);
    (length > 0).then_some((start, length as u32))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_centred_rectangle_of_odd_size_has_the_rounded_pixel_as_its_middle() {
        let rect = PixelRect::centred(Pixel::new(100.3, 49.6), 161);
        assert_eq!(rect, PixelRect::new(20, -30, 161, 161));
        assert_eq!(rect.centre(), Pixel::new(100.0, 50.0));
    }

    #[test]
    fn the_intersection_is_what_both_hold() {
        let image = PixelRect::whole(100, 80);
        assert_eq!(PixelRect::new(-5, 70, 20, 20).intersect(&image), Some(PixelRect::new(0, 70, 15, 10)));
        assert_eq!(PixelRect::new(100, 0, 5, 5).intersect(&image), None);
        assert_eq!(PixelRect::new(i32::MAX, 0, u32::MAX, 5).intersect(&image), None);
        assert_eq!(
            PixelRect::new(i32::MIN, 0, u32::MAX, 5).intersect(&image),
            Some(PixelRect::new(0, 0, 100, 5))
        );
    }
}
