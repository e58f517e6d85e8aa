//! The score map of one template over a search region (R63).
//!
//! A score belongs to the pixel at the *centre* of the template. A position whose window touches an invalid pixel is
//! excluded (R66): its score is NaN.

use crate::image::GrayImage;
use sightline_geometry::frames::Pixel;

/// Scores of a template at every position of a region, −1 to 1.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Surface {
    /// Pixel of the template's centre at index (0, 0): column, row.
    pub origin: [i32; 2],
    /// Positions per row.
    pub width: u32,
    /// Rows of positions.
    pub height: u32,
    /// Scores, row by row; NaN = position excluded.
    pub scores: Vec<f32>,
    /// Number of positions without contrast, of the window or of the template; they score 0 (R66).
    pub flat_positions: u32,
    /// Side of the template, px.
    pub template_size: u32,
}

impl Surface {
    /// The score at index (`ix`, `iy`); `None` outside the map or if the position is excluded.
    pub fn at(&self, ix: u32, iy: u32) -> Option<f32> {
        if ix >= self.width || iy >= self.height {
            return None;
        }
        let score = self.scores[iy as usize * self.width as usize + ix as usize];
        (!score.is_nan()).then_some(score)
    }

    /// The pixel of the template's centre at index (`ix`, `iy`).
    pub fn pixel_of(&self, ix: u32, iy: u32) -> Pixel {
        Pixel::new(f64::from(self.origin[0]) + f64::from(ix), f64::from(self.origin[1]) + f64::from(iy))
    }

    /// The index whose template centre is the pixel (`x`, `y`); `None` outside the map.
    pub fn index_of(&self, x: i32, y: i32) -> Option<(u32, u32)> {
        let index = |v: i32, origin: i32, length: u32| {
            u32::try_from(i64::from(v) - i64::from(origin)).ok().filter(|i| *i < length)
        };
        Some((index(x, self.origin[0], self.width)?, index(y, self.origin[1], self.height)?))
    }

    /// Index and score of the highest valid position, the first in reading order among equals.
    pub fn maximum(&self) -> Option<(u32, u32, f32)> {
        let mut best: Option<(usize, f32)> = None;
        for (index, score) in self.scores.iter().enumerate() {
            if best.map_or(!score.is_nan(), |(_, highest)| *score > highest) {
                best = Some((index, *score));
            }
        }
        best.map(|(i, score)| ((i % self.width as usize) as u32, (i / self.width as usize) as u32, score))
    }

    /// Number of positions that are not excluded.
    pub fn valid_positions(&self) -> usize {
        self.scores.iter().filter(|s| !s.is_nan()).count()
    }

    /// The scores as an image, for display and export; `None` if width, height and scores disagree.
    pub fn to_image(&self) -> Option<GrayImage> {
        GrayImage::from_raw(self.width, self.height, self.scores.clone())
    }
}
