//! The four measures by which a template and an image are compared (R216, R219), behind one name.
//!
//! | measure | score | sees a change of light as |
//! |---|---|---|
//! | `ncc` | −1 to 1 | nothing (R69) |
//! | `sad` | −1 to 0 | a difference |
//! | `ssd` | −1 to 0 | a difference |
//! | `sdog` | −1 to 1 | nothing |
//!
//! Larger is better for all of them.

use super::difference::{sad_surface, ssd_surface};
use super::sdog::Sdog;
use super::surface::Surface;
use super::zncc::zncc_surface;
use crate::image::patch::{self, Patch};
use crate::image::{GrayImage, PixelRect};
use sightline_geometry::cancel::Cancel;

/// A measure of likeness.
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
    /// How far around the template its surroundings are looked at, px.
    pub fn margin_px(&self) -> u32 {
        match self {
            Self::Sdog(sdog) => sdog.margin_px(),
            Self::Ncc | Self::Sad | Self::Ssd => 0,
        }
    }

    /// Scores at every position of `region` that holds the template: the middle `size` × `size` px of `wide`.
    ///
    /// `None` when `size` is even or larger than `wide`, when the template has an invalid pixel, or when no
    /// position holds it.
    pub fn surface(&self, wide: &Patch, size: u32, image: &GrayImage, region: PixelRect) -> Option<Surface> {
        self.surface_until(wide, size, image, region, Cancel::default())
    }

    /// The same; soon after `cancel` is requested, returns a surface whose scores mean nothing.
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
