//! The four similarity measures of a template and an image (R216, R219).
//!
//! | measure | score | effect of gain and bias |
//! |---|---|---|
//! | `ncc` | −1 to 1 | none (R69) |
//! | `sad` | −1 to 0 | lowers the score |
//! | `ssd` | −1 to 0 | lowers the score |
//! | `sdog` | −1 to 1 | none |
//!
//! Larger is better for all of them.

use super::difference::{sad_surface, ssd_surface};
use super::sdog::Sdog;
use super::surface::Surface;
use super::zncc::zncc_surface;
use crate::image::patch::{self, Patch};
use crate::image::{GrayImage, PixelRect};
use sightline_geometry::cancel::Cancel;

/// A similarity measure.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Similarity {
    /// Normalised cross-correlation.
    #[default]
    Ncc,
    /// Mean absolute difference, negated.
    Sad,
    /// Mean squared difference, negated.
    Ssd,
    /// Agreement of the signs of a difference of Gaussians.
    Sdog(Sdog),
}

impl Similarity {
    /// Width of the surroundings that the measure needs around the template, px.
    pub fn margin_px(&self) -> u32 {
        match self {
            Self::Sdog(sdog) => sdog.margin_px(),
            Self::Ncc | Self::Sad | Self::Ssd => 0,
        }
    }

    /// Scores at every position of `region` that contains the template: the middle `size` × `size` px of `wide`.
    ///
    /// `None` if `size` is even or larger than `wide`, if the template has an invalid pixel, or if it fits at no
    /// position.
    pub fn surface(&self, wide: &Patch, size: u32, image: &GrayImage, region: PixelRect) -> Option<Surface> {
        self.surface_until(wide, size, image, region, Cancel::default())
    }

    /// As [`Self::surface`]; soon after `cancel` is requested, returns a map with meaningless scores.
    pub fn surface_until(
        &self,
        wide: &Patch,
        size: u32,
        image: &GrayImage,
        region: PixelRect,
        cancel: Cancel<'_>,
    ) -> Option<Surface> {
        let template = patch::middle(wide, size)?;
        match self {
            Self::Ncc => zncc_surface(&template, image, region),
            Self::Sad => sad_surface(&template, image, region, cancel),
            Self::Ssd => ssd_surface(&template, image, region, cancel),
            Self::Sdog(sdog) if template.is_complete() => sdog.surface(wide, size, image, region, cancel),
            Self::Sdog(_) => None,
        }
    }
}

#[cfg(test)]
#[path = "similarity_tests.rs"]
mod tests;
