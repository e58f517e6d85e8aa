//! Data needed by the visible panels, panels shown as tables, and the pixels of textures.

use egui::{ColorImage, TextureId};

use crate::command::Layer;
use crate::drawing::raster::Raster;
use crate::panels::pane::{Need, Pane};
use crate::state::State;

impl State {
    /// The pixels of a texture.
    pub fn pixels_of(&self, texture: TextureId) -> Option<ColorImage> {
        let ghost = self.why.scores.lock().as_ref().map(|(_, raster)| std::sync::Arc::clone(raster));
        if let Some(ghost) = ghost.filter(|raster| raster.texture.id() == texture) {
            return Some(ghost.pixels());
        }
        self.cache.rasters().find(|raster| raster.texture.id() == texture).map(Raster::pixels)
    }

    /// Requests the data that the visible panels need, and none that only hidden panels need.
    pub(crate) fn fetch_for_panels(&mut self, needs: &[Need]) {
        self.compare.wants_metrics = needs.contains(&Need::Metrics);
        self.wants_history = needs.contains(&Need::MatchedWindows);
        self.wants_odometry = needs.contains(&Need::Odometry);
        self.wants_hazards = needs.contains(&Need::Hazards) || self.shows(Layer::Ground);
        self.show_trial_scores(needs.contains(&Need::TriedScores));
        if needs.contains(&Need::Explanation) {
            self.read_question_once();
            self.follow_why();
        }
        if needs.contains(&Need::Studies) {
            self.read_studies_once();
        }
    }

    /// Whether a panel is shown as a table.
    pub fn is_table(&self, pane: Pane) -> bool {
        self.tables.contains(&pane)
    }

    /// Toggles between a panel's table and its graphical form.
    pub(crate) fn turn_table(&mut self, pane: Pane) {
        if !self.tables.remove(&pane) {
            self.tables.insert(pane);
        }
    }
}
