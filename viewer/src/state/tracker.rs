//! The settings of the selected run, and the evidence that only one of the trackers records.

use sightline_geometry::camera::Camera;
use sightline_session::step::StepRow;
use sightline_session::view::RunView;
use sightline_track::locate::features::FeatureEvidence;
use sightline_track::locate::features::rows::{CloudPoint, Feature};
use sightline_track::locate::shape_tracker::ShapeEvidence;
use sightline_track::locate::shape_tracker::rows::{Facet, PathStep};
use sightline_track::settings::TrackerKind;
use sightline_track::trace::ArrayName;
use sightline_vision::stereo::{AlignSettings, Alignment};

use crate::cache::{Key, Slot};
use crate::command::{Stage, StageBarExtent};
use crate::state::State;
use crate::tables::Table;

impl State {
    /// Side of the template, px.
    pub(crate) fn template_side_px(&self) -> u32 {
        self.run_settings().template.template_size_px
    }

    /// The tracker of the selected run; the default without a run.
    pub fn tracker(&self) -> TrackerKind {
        self.run().map_or_else(TrackerKind::default, |run| run.settings.tracker)
    }

    /// The selected stage, mapped to one that the tracker and the drive have.
    pub fn stage(&self) -> Stage {
        let stage = self.stage.of_tracker(self.tracker());
        match (stage, self.extent()) {
            (Stage::VISUAL_ODOMETRY, StageBarExtent::Tracker) => Stage::PREDICT,
            (of_drive, StageBarExtent::Tracker | StageBarExtent::Odometry) if of_drive.is_of_drive() => {
                Stage::UPDATE
            }
            _ => stage,
        }
    }

    /// The stages that the stage bar has in addition to the tracker's.
    pub(crate) fn extent(&self) -> StageBarExtent {
        let stops = || self.traverse.iter().flat_map(|traverse| &traverse.stops);
        match self.is_on_commands() {
            true => StageBarExtent::Drive,
            false if stops().any(|stop| stop.odometry.is_some()) => StageBarExtent::Odometry,
            false => StageBarExtent::Tracker,
        }
    }

    /// The stages of the stage bar, in running order.
    pub fn stages(&self) -> impl Iterator<Item = Stage> {
        Stage::bar(self.tracker(), self.extent())
    }

    /// The feature tracker's evidence at the cursor's step.
    pub fn feature_evidence(&self) -> Option<&FeatureEvidence> {
        self.trace().and_then(|trace| trace.features())
    }

    /// The features of the cursor's step.
    pub fn features(&self) -> Slot<'_, Vec<Feature>> {
        self.table(ArrayName::FEATURES, |table| match table {
            Table::Features(rows) => Some(rows),
            _ => None,
        })
    }

    /// The bootstrap distribution of the target at the cursor's step.
    pub fn cloud(&self) -> Slot<'_, Vec<CloudPoint>> {
        self.table(ArrayName::CLOUD, |table| match table {
            Table::Cloud(rows) => Some(rows),
            _ => None,
        })
    }

    /// The iterations of the refinement at the cursor's step.
    pub fn refine_path(&self) -> Slot<'_, Vec<PathStep>> {
        self.table(ArrayName::REFINE_PATH, |table| match table {
            Table::Path(rows) => Some(rows),
            _ => None,
        })
    }

    /// The facets of a mesh of the cursor's step.
    pub fn facets(&self, name: ArrayName) -> Slot<'_, Vec<Facet>> {
        self.table(name, |table| match table {
            Table::Facets(rows) => Some(rows),
            _ => None,
        })
    }

    /// The shape tracker's evidence at the cursor's step.
    pub fn shape_evidence(&self) -> Option<&ShapeEvidence> {
        self.trace().and_then(|trace| trace.shape())
    }

    /// The aligned left camera of the cursor's step, in which dense stereo is computed.
    pub fn aligned_left(&self) -> Option<Camera> {
        let key = self.step_key(self.cursor.step)?;
        let mut cached = self.aligned.lock();
        if let Some((_, camera)) = cached.as_ref().filter(|(of, _)| *of == key) {
            return camera.clone();
        }
        let pointing = &self.trace()?.point_mast;
        let aligned = Alignment::new(&pointing.left, &pointing.right, &AlignSettings::default());
        let camera = aligned.ok().map(|aligned| aligned.left);
        *cached = Some((key, camera.clone()));
        camera
    }

    fn table<'a, T>(&'a self, name: ArrayName, of: impl FnOnce(&'a Table) -> Option<&'a T>) -> Slot<'a, T> {
        let key = self.step_key(self.cursor.step).map(|key| Key::Array(key, name));
        key.map_or(Slot::Absent, |key| self.cache.table(&key).and(of))
    }

    /// Why a panel about the template is empty, and which panel to use.
    pub(crate) fn missing_template(&self) -> String {
        match (self.tracker(), self.row()) {
            (TrackerKind::Shape, Some(_)) => {
                "This run registers the shape of the target’s surroundings and matches no template. The panel \
                 “Shape” shows what it saw."
                    .to_owned()
            }
            (TrackerKind::Features | TrackerKind::Combined, Some(_)) => {
                "This run follows the features of the whole scene and matches no template. The panel “Features” \
                 shows what it saw."
                    .to_owned()
            }
            _ => self.missing_step(),
        }
    }

    /// Why a panel about features is empty, and how to get them.
    pub(crate) fn missing_features(&self) -> String {
        match (self.tracker(), self.row()) {
            (TrackerKind::Shape, Some(_)) => {
                "This run registers the shape of the target’s surroundings and detects no features. Choose the preset “combined” in Settings and press “Run from here” at the step of the designation."
                    .to_owned()
            }
            (TrackerKind::Template, Some(_)) => {
                "This run follows the target’s own template and looks for no features. Choose the preset \
                 “features” in Settings and press “Run from here” at the pick."
                    .to_owned()
            }
            _ => self.missing_step(),
        }
    }

    /// Why a panel about the shape is empty, and how to get it.
    pub(crate) fn missing_shape(&self) -> String {
        match (self.tracker(), self.row()) {
            (TrackerKind::Template | TrackerKind::Features, Some(_)) => {
                "This run does not ask for the shape of the target’s surroundings. Choose the preset “combined” or \
                 “shape” in Settings and press “Run from here” at the pick."
                    .to_owned()
            }
            _ => self.missing_step(),
        }
    }
}

/// The feature tracker's confidence in a step; `None` at the designation, which uses point stereo.
pub(crate) fn confidence_of(run: &RunView, row: &StepRow) -> Option<f64> {
    let is_pick = run.rows.first().is_some_and(|first| first.step == row.step);
    row.confidence.filter(|_| run.settings.tracker != TrackerKind::Template && !is_pick)
}
