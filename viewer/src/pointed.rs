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

use sightline_core::camera::Camera;
use sightline_core::frames::Pixel;
use sightline_core::image::PixelRect;

use crate::command::Command;
use crate::state::State;

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

impl State {
    /// The pixel of the left image that is pointed at, in whatever panel.
    pub fn pointed_left(&self) -> Option<Pixel> {
        self.pointed.filter(|_| self.marks)?.left()
    }

    /// The step that is pointed at, where that is another one than the cursor's.
    pub fn pointed_step(&self) -> Option<usize> {
        match self.pointed {
            Some(Pointed::Step(step)) if step != self.cursor.step && step < self.stop_count() => Some(step),
            _ => None,
        }
    }

    /// The two cameras of the cursor's step in the rover frame, once they are here.
    pub fn eyes(&self) -> Option<(&Camera, &Camera)> {
        if let Some(pointing) = self.trace().and_then(|trace| trace.point_mast.as_ref()) {
            return Some((&pointing.left, &pointing.right));
        }
        let stop = self.cache.stop(&self.stop_detail_key(self.cursor.step)?).ready()?;
        Some((&stop.left, &stop.right))
    }
}

/// Takes what was pointed at out of the commands of a frame.
pub fn taken_out(commands: &mut Vec<Command>) -> Option<Pointed> {
    let mut pointed = None;
    commands.retain(|command| match command {
        Command::Point(at) => {
            pointed = Some(*at);
            false
        }
        _ => true,
    });
    pointed
}

/// The side × side pixels about the pixel nearest to `centre`; none where they leave an image of this size.
pub fn window(centre: Pixel, side: u32, [width, height]: [u32; 2]) -> Option<PixelRect> {
    let half = (side / 2) as i32;
    let (x, y) = (centre.x.round() as i32 - half, centre.y.round() as i32 - half);
    let is_inside = x >= 0 && y >= 0 && x + side as i32 <= width as i32 && y + side as i32 <= height as i32;
    is_inside.then(|| PixelRect::new(x, y, side, side))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_thing_pointed_at_is_taken_and_the_other_commands_stay() {
        let (here, there) = (Pointed::Step(3), Pointed::Left(Pixel::new(1.0, 2.0)));
        let mut commands = vec![Command::Point(here), Command::FitAll, Command::Point(there)];
        assert_eq!(taken_out(&mut commands), Some(there));
        assert_eq!(commands, [Command::FitAll]);
        assert_eq!(taken_out(&mut commands), None);
    }

    #[test]
    fn a_window_lies_about_the_nearest_pixel_and_inside_the_image() {
        let at = |x: f64, y: f64| window(Pixel::new(x, y), 21, [64, 48]);
        assert_eq!(at(30.4, 20.6), Some(PixelRect::new(20, 11, 21, 21)));
        assert_eq!(at(9.4, 20.0), None);
        assert_eq!(at(10.0, 37.0), Some(PixelRect::new(0, 27, 21, 21)));
        assert_eq!(at(10.0, 38.0), None);
    }
}
