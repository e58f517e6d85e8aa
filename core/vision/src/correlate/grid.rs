//! Positions of a square template whose whole window is inside a region and the image.

use super::surface::Surface;
use crate::image::{GrayImage, PixelRect};

/// The positions, row by row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Grid {
    /// The region, clipped to the image.
    pub(super) region: PixelRect,
    /// Positions per row.
    pub(super) width: u32,
    /// Rows of positions.
    pub(super) height: u32,
    /// Side of the template, px.
    pub(super) size: u32,
}

impl Grid {
    /// `None` if the template is not square, has an even side, or fits at no position.
    pub(super) fn new(template: (u32, u32), image: &GrayImage, region: PixelRect) -> Option<Self> {
        let (size, height) = template;
        if height != size || size.is_multiple_of(2) {
            return None;
        }
        let region = region.intersect(&PixelRect::whole(image.width(), image.height()))?;
        let width = (region.width + 1).checked_sub(size).filter(|w| *w > 0)?;
        let height = (region.height + 1).checked_sub(size).filter(|h| *h > 0)?;
        Some(Self { region, width, height, size })
    }

    /// Number of positions.
    pub(super) fn len(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// The pixel of the template's centre at the first position.
    pub(super) fn origin(&self) -> [i32; 2] {
        let half = (self.size / 2) as i32;
        [self.region.x + half, self.region.y + half]
    }

    /// The scores of all positions as a score map.
    pub(super) fn surface(&self, scores: Vec<f32>, flat_positions: u32) -> Surface {
        Surface {
            origin: self.origin(),
            width: self.width,
            height: self.height,
            scores,
            flat_positions,
            template_size: self.size,
        }
    }
}
