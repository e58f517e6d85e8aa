//! What the pointer rests on, as a place of the drive and not of a panel: every panel shows the same place in its own way.
//!
//! A panel tells it with `Command::Point` in every frame in which the pointer is over it; the page takes the last one in,
//! and all panels show it in the next frame. It is no part of what is looked at: links and undo know nothing of it.
//!
//! | told by | left image | right image | scores | strip | profile | map | timeline, plots |
//! |---|---|---|---|---|---|---|---|
//! | `Left` (left image) | | its curve | the place | what is there | | its line of sight | |
//! | `Right` (right image) | its curve | | | | the range | | |
//! | `Score` (scores) | the window | its curve | | what is there | | its line of sight | |
//! | `Range` (profile) | | the place | | | | | |
//! | `Step` (timeline, plots, map) | | | | | | the stop | the step |

use sightline_geometry::frames::Pixel;
use sightline_vision::image::PixelRect;

/// What the pointer rests on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pointed {
    /// A pixel of the left image.
    Left(Pixel),
    /// A pixel of the right image.
    Right(Pixel),
    /// A position of the template: the pixel of the left image at its centre.
    Score(Pixel),
    /// A range along the line of sight of the target, m.
    Range(f64),
    /// A step.
    Step(usize),
}

impl Pointed {
    /// The pixel of the left image, where it is about one.
    pub fn left(self) -> Option<Pixel> {
        match self {
            Self::Left(pixel) | Self::Score(pixel) => Some(pixel),
            _ => None,
        }
    }
}

/// The side × side pixels about the pixel nearest to `centre`; none where they leave an image of this size.
pub(crate) fn window(centre: Pixel, side: u32, [width, height]: [u32; 2]) -> Option<PixelRect> {
    let half = (side / 2) as i32;
    let (x, y) = (centre.x.round() as i32 - half, centre.y.round() as i32 - half);
    let is_inside = x >= 0 && y >= 0 && x + side as i32 <= width as i32 && y + side as i32 <= height as i32;
    is_inside.then(|| PixelRect::new(x, y, side, side))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_lies_about_the_nearest_pixel_and_inside_the_image() {
        let at = |x: f64, y: f64| window(Pixel::new(x, y), 21, [64, 48]);
        assert_eq!(at(30.4, 20.6), Some(PixelRect::new(20, 11, 21, 21)));
        assert_eq!(at(9.4, 20.0), None);
        assert_eq!(at(10.0, 37.0), Some(PixelRect::new(0, 27, 21, 21)));
        assert_eq!(at(10.0, 38.0), None);
    }
}
