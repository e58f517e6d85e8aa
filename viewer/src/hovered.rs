//! The hovered location, as a location of the drive: every panel marks the same location in its own way.
//!
//! The panel under the pointer sends `Command::Hover` in every frame; the page keeps the last one, and all panels mark it
//! in the next frame. The hovered location is part of neither links nor undo.
//!
//! | hovered in | left image | right image | scores | strip | profile | map | timeline, plots |
//! |---|---|---|---|---|---|---|---|
//! | `Left` (left image) | | its epipolar curve | the position | the values there | | its line of sight | |
//! | `Right` (right image) | its epipolar curve | | | | the range | | |
//! | `Score` (scores) | the window | its epipolar curve | | the values there | | its line of sight | |
//! | `Range` (profile) | | the position | | | | | |
//! | `Step` (timeline, plots, map) | | | | | | the stop | the step |

use sightline_geometry::frames::Pixel;
use sightline_vision::image::PixelRect;

/// The hovered location.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Hovered {
    /// A pixel of the left image.
    Left(Pixel),
    /// A pixel of the right image.
    Right(Pixel),
    /// A template position: the pixel of the left image at the centre of the template.
    Score(Pixel),
    /// A range along the line of sight of the target, m.
    Range(f64),
    /// A step.
    Step(usize),
}

impl Hovered {
    /// The pixel of the left image; `None` for the other variants.
    pub fn left(self) -> Option<Pixel> {
        match self {
            Self::Left(pixel) | Self::Score(pixel) => Some(pixel),
            _ => None,
        }
    }
}

/// The `side` × `side` window about the pixel nearest to `centre`; `None` if it exceeds an image of this width and height.
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
