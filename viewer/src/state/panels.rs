//! What the panels on the screen need, which of them are tables, and what their textures hold.

use egui::{ColorImage, TextureId};

use crate::command::Layer;
use crate::drawing::raster::Raster;
use crate::panels::pane::{Need, Pane};
use crate::state::State;

impl State {
    /// The pixels of a texture that is shown.
    pub fn pixels_of(&self, texture: TextureId) -> Option<ColorImage> {
        let ghost = self.why.scores.lock().as_ref().map(|(_, raster)| std::sync::Arc::clone(raster));
        if let Some(ghost) = ghost.filter(|raster| raster.texture.id() == texture) {
            return Some(ghost.pixels());
        }
        self.cache.rasters().find(|raster| raster.texture.id() == texture).map(Raster::pixels)
    }

    /// Fetches what the panels on the screen need, and nothing that only other panels need.
    pub(crate) fn fetch_for_panels(&mut self, needs: &[Need]) {
        self.compare.wants_metrics = needs.contains(&Need::Metrics);
        self.wants_history = needs.contains(&Need::MatchedWindows);
        self.wants_odometry = needs.contains(&Need::Odometry);
        self.wants_hazards = needs.contains(&Need::Hazards) || self.shows(Layer::Ground);
        self.want_tried_scores(needs.contains(&Need::TriedScores));
        if needs.contains(&Need::Explanation) {
            self.want_question();
            self.follow_why();
        }
        if needs.contains(&Need::Studies) {
            self.want_studies();
        }
    }

    /// Whether a panel is looked at as a table.
    pub fn is_table(&self, pane: Pane) -> bool {
        self.tables.contains(&pane)
    }

    /// Shows a panel as a table, or as it is painted again.
    pub(crate) fn turn_table(&mut self, pane: Pane) {
        if !self.tables.remove(&pane) {
            self.tables.insert(pane);
        }
    }
}
