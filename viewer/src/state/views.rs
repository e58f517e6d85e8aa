//! What part of its image each panel shows, which panels are tables, and what their textures hold.

use egui::{ColorImage, TextureId};

use super::State;
use crate::layout::Pane;
use crate::raster::Raster;
use crate::view2d::View2d;

/// What each panel shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Views {
    /// The left image.
    pub left: View2d,
    /// The right image.
    pub right: View2d,
    /// The surface of scores.
    pub surface: View2d,
}

impl Default for Views {
    fn default() -> Self {
        Self { left: View2d::Fit, right: View2d::Fit, surface: View2d::Fit }
    }
}

impl State {
    /// The pixels of a texture that is shown.
    pub fn pixels_of(&self, texture: TextureId) -> Option<ColorImage> {
        let ghost = self.why.scores.lock().as_ref().map(|(_, raster)| std::sync::Arc::clone(raster));
        if let Some(ghost) = ghost.filter(|raster| raster.texture.id() == texture) {
            return Some(ghost.pixels());
        }
        self.cache.rasters().find(|raster| raster.texture.id() == texture).map(Raster::pixels)
    }

    /// Whether a panel is looked at as a table.
    pub fn is_table(&self, pane: Pane) -> bool {
        self.tables.contains(&pane)
    }

    /// Shows a panel as a table, or as it is painted again.
    pub(super) fn turn_table(&mut self, pane: Pane) {
        if !self.tables.remove(&pane) {
            self.tables.insert(pane);
        }
    }
}
