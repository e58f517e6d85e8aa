//! Stage 4, `locate`: finds the target at the current stop. The trackers differ here, each behind [`Tracker`].
//!
//! | tracker | steps |
//! |---|---|
//! | `template` (Kim et al. 2009) | `scale_roll` → `match_template` → `point_stereo` → `triangulate` |
//! | `features` (Deans et al. 2005) | `detect` → `match_features` → `triangulate` → `fit_motion` → `bootstrap` |
//! | `shape` (Deans et al. 2005) | `surface` → `coarse_register` → `refine_register` → `carried_ray` |
//! | `combined` (D§4) | those of `features` during the drive, those of `shape` at the end |
//!
//! Only this file lists the trackers. A trait with associated types cannot be a trait object, so memory and evidence
//! have one type-erased form each, an enum: [`TrackerMemory`] and [`Evidence`]. The other stages handle only these
//! two. A new tracker needs its own folder and one variant of each.

pub mod features;
pub mod shape_tracker;
pub mod store;
pub mod template;
pub mod tracker;

pub use tracker::{Accepted, DesignateInput, GateInput, LocateInput, Place, Sighting, Tracker};

use std::sync::Arc;

use nalgebra::{Matrix3, Matrix3x2};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use self::features::{FeatureEvidence, FeatureTracker, anchor::Anchors};
use self::shape_tracker::{CombinedMemory, CombinedTracker, ShapeEvidence, ShapeTracker, view::Views};
use self::template::memory::TemplateMemory;
use self::template::{TemplateEvidence, TemplateTracker};
use crate::gate::{Gate, GateKind};
use crate::settings::TrackerKind;
use sightline_geometry::estimate::drift::Drift;
use sightline_geometry::frames::{Pixel, Point3};
use sightline_record::{Declaration, Record, Stage, Unit};
use sightline_vision::image::GrayImage;

/// The target at the current stop and the evidence for it; by default not located.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Located {
    /// Position in the left image, px.
    pub left_pixel: Option<Pixel>,
    /// Position in the right image, px.
    pub right_pixel: Option<Pixel>,
    /// The error of the left position relative to the designated point, template drift included.
    pub left_error: Drift,
    /// Position in the rover frame, m.
    #[schema(value_type = Option<[f64; 3]>)]
    pub position_in_rover: Option<Point3>,
    /// Covariance of that position, m², for cameras that point as measured; `update` adds the error of the mast angles.
    #[schema(value_type = Option<Vec<f64>>)]
    pub covariance_in_rover: Option<Matrix3<f64>>,
    /// Derivative of the surface point with respect to the left pixel, m per px.
    #[schema(value_type = Option<Vec<f64>>)]
    pub surface_by_pixel: Option<Matrix3x2<f64>>,
    /// Confidence, 0 to 1: for `template` the score of the match, at least 0; for `features` D-Eq 7; if located by
    /// shape, the share of the target's pixels that both surfaces cover.
    pub confidence: f64,
    /// The missing result and the reason, in one sentence; null if the target was located.
    pub missing: Option<String>,
    /// The tracker's measurements at this stop.
    pub evidence: Evidence,
}

impl Located {
    fn new<E>(sighting: Sighting<E>, erase: impl FnOnce(Box<E>) -> Evidence) -> Self {
        let (found, evidence) = sighting.replace(());
        Self {
            left_pixel: found.left_pixel,
            right_pixel: found.right_pixel,
            left_error: found.left_error,
            position_in_rover: found.position_in_rover,
            covariance_in_rover: found.covariance_in_rover,
            surface_by_pixel: found.surface_by_pixel,
            confidence: found.confidence,
            missing: found.missing,
            evidence: erase(Box::new(evidence)),
        }
    }
}

/// The evidence of any tracker, step by step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "tracker", rename_all = "snake_case")]
pub enum Evidence {
    /// Evidence of the template tracker.
    Template(Box<TemplateEvidence>),
    /// Evidence of the feature tracker.
    Features(Box<FeatureEvidence>),
    /// Evidence of the shape tracker.
    Shape(Box<ShapeEvidence>),
    /// Evidence of the combined tracker.
    Combined(Box<ShapeEvidence>),
}

impl Default for Evidence {
    fn default() -> Self {
        Self::Template(Box::default())
    }
}

impl Evidence {
    /// The tracker that produced the evidence.
    pub const fn tracker(&self) -> TrackerKind {
        match self {
            Self::Template(_) => TrackerKind::Template,
            Self::Features(_) => TrackerKind::Features,
            Self::Shape(_) => TrackerKind::Shape,
            Self::Combined(_) => TrackerKind::Combined,
        }
    }

    /// Mutable evidence of the template tracker; of another tracker the evidence of its designation by point stereo.
    pub fn template_mut(&mut self) -> Option<&mut TemplateEvidence> {
        match self {
            Self::Template(evidence) => Some(evidence),
            Self::Features(evidence) => evidence.designation.as_deref_mut(),
            Self::Shape(evidence) | Self::Combined(evidence) => match evidence.features.as_mut() {
                Some(features) => features.designation.as_deref_mut(),
                None => evidence.designation.as_deref_mut(),
            },
        }
    }

    /// The evidence of the template tracker; of another tracker that of its designation by point stereo.
    pub fn template(&self) -> Option<&TemplateEvidence> {
        match self {
            Self::Template(evidence) => Some(evidence),
            Self::Features(evidence) => evidence.designation.as_deref(),
            Self::Shape(evidence) | Self::Combined(evidence) => match evidence.features.as_ref() {
                Some(features) => features.designation.as_deref(),
                None => evidence.designation.as_deref(),
            },
        }
    }

    /// The evidence of the feature tracker, alone or combined.
    pub fn features(&self) -> Option<&FeatureEvidence> {
        match self {
            Self::Template(_) => None,
            Self::Features(evidence) => Some(evidence),
            Self::Shape(evidence) | Self::Combined(evidence) => evidence.features.as_deref(),
        }
    }

    /// The evidence of the shape tracker, alone or combined.
    pub fn shape(&self) -> Option<&ShapeEvidence> {
        match self {
            Self::Template(_) | Self::Features(_) => None,
            Self::Shape(evidence) | Self::Combined(evidence) => Some(evidence),
        }
    }

    /// Returns the gates of an update.
    pub fn gates(&self, input: &GateInput<'_>) -> Vec<Gate> {
        match self {
            Self::Template(evidence) => TemplateTracker.gates(evidence, input),
            Self::Features(evidence) => FeatureTracker.gates(evidence, input),
            Self::Shape(evidence) => ShapeTracker.gates(evidence, input),
            Self::Combined(evidence) => CombinedTracker.gates(evidence, input),
        }
    }
}

/// The memory of any tracker.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "tracker", rename_all = "snake_case")]
pub enum TrackerMemory {
    /// Memory of the template tracker.
    Template(Box<TemplateMemory>),
    /// Memory of the feature tracker.
    Features(Anchors),
    /// Memory of the shape tracker.
    Shape(Views),
    /// Memory of the combined tracker.
    Combined(CombinedMemory),
}

impl TrackerMemory {
    /// The tracker of this memory.
    pub const fn tracker(&self) -> TrackerKind {
        match self {
            Self::Template(_) => TrackerKind::Template,
            Self::Features(_) => TrackerKind::Features,
            Self::Shape(_) => TrackerKind::Shape,
            Self::Combined(_) => TrackerKind::Combined,
        }
    }

    /// The memory of the template tracker; `None` for another one.
    pub fn template(&self) -> Option<&TemplateMemory> {
        match self {
            Self::Template(memory) => Some(memory),
            _ => None,
        }
    }

    /// The memory of the feature tracker, alone or combined.
    pub const fn features(&self) -> Option<&Anchors> {
        match self {
            Self::Features(memory) => Some(memory),
            Self::Combined(memory) => Some(&memory.features),
            _ => None,
        }
    }

    /// The step of the current template; `None` for a tracker without one.
    pub fn template_step(&self) -> Option<usize> {
        self.template().map(|memory| memory.appearance.step)
    }

    /// The step whose left image contains the current template, if that image was released.
    pub fn lacks_image_of(&self) -> Option<usize> {
        self.template().filter(|memory| memory.appearance.image.is_empty())?;
        self.template_step()
    }

    /// Sets the image of the current template: the left image of the step [`Self::lacks_image_of`], or an empty one
    /// to release it.
    pub fn set_image(&mut self, image: Arc<GrayImage>) {
        if let Self::Template(memory) = self {
            memory.appearance.image = image;
        }
    }

    /// Returns the memory after an accepted update; evidence of another tracker does not change it.
    #[must_use]
    pub fn remember(self, evidence: &Evidence, update: &Accepted<'_>) -> Self {
        match (self, evidence) {
            (Self::Template(memory), Evidence::Template(evidence)) => {
                Self::Template(Box::new(TemplateTracker.remember(*memory, evidence, update)))
            }
            (Self::Features(memory), Evidence::Features(evidence)) => {
                Self::Features(FeatureTracker.remember(memory, evidence, update))
            }
            (Self::Shape(memory), Evidence::Shape(evidence)) => {
                Self::Shape(ShapeTracker.remember(memory, evidence, update))
            }
            (Self::Combined(memory), Evidence::Combined(evidence)) => {
                Self::Combined(CombinedTracker.remember(memory, evidence, update))
            }
            (memory, _) => memory,
        }
    }
}

/// Locates a designated pixel with the tracker of the settings.
pub fn designate(input: &DesignateInput<'_>) -> (Located, Option<TrackerMemory>) {
    match input.settings.tracker {
        TrackerKind::Template => {
            let (found, memory) = TemplateTracker.designate(input);
            let memory = memory.map(|memory| TrackerMemory::Template(Box::new(memory)));
            (Located::new(found, Evidence::Template), memory)
        }
        TrackerKind::Features => {
            let (found, memory) = FeatureTracker.designate(input);
            (Located::new(found, Evidence::Features), memory.map(TrackerMemory::Features))
        }
        TrackerKind::Shape => {
            let (found, memory) = ShapeTracker.designate(input);
            (Located::new(found, Evidence::Shape), memory.map(TrackerMemory::Shape))
        }
        TrackerKind::Combined => {
            let (found, memory) = CombinedTracker.designate(input);
            (Located::new(found, Evidence::Combined), memory.map(TrackerMemory::Combined))
        }
    }
}

/// Locates the target with the tracker of its memory.
pub fn locate(input: &LocateInput<'_>, memory: &TrackerMemory) -> Located {
    match memory {
        TrackerMemory::Template(memory) => {
            Located::new(TemplateTracker.locate(input, memory), Evidence::Template)
        }
        TrackerMemory::Features(memory) => {
            Located::new(FeatureTracker.locate(input, memory), Evidence::Features)
        }
        TrackerMemory::Shape(memory) => Located::new(ShapeTracker.locate(input, memory), Evidence::Shape),
        TrackerMemory::Combined(memory) => {
            Located::new(CombinedTracker.locate(input, memory), Evidence::Combined)
        }
    }
}

/// The steps of a tracker in running order, as names of stages of the record.
pub const fn steps(tracker: TrackerKind) -> &'static [&'static str] {
    match tracker {
        TrackerKind::Template => TemplateTracker::STEPS,
        TrackerKind::Features => FeatureTracker::STEPS,
        TrackerKind::Shape => ShapeTracker::STEPS,
        TrackerKind::Combined => CombinedTracker::STEPS,
    }
}

/// The stages of all trackers, in running order and at their paths in the serialised [`Evidence`].
pub fn stages() -> Vec<Stage<Evidence>> {
    let template = TemplateEvidence::stages().into_iter();
    let features = FeatureEvidence::stages().into_iter();
    let shape = ShapeEvidence::stages().into_iter();
    template
        .map(|stage| stage.within(Evidence::template, &["", "designation", "features.designation"]))
        .chain(features.map(|stage| stage.within(Evidence::features, &["", "features"])))
        .chain(shape.map(|stage| stage.within(Evidence::shape, &[""])))
        .collect()
}

/// The gates of all trackers, by number; a gate that several trackers share is listed once.
pub fn gate_kinds() -> Vec<GateKind> {
    let all = [TemplateTracker::GATES, FeatureTracker::GATES, ShapeTracker::GATES, CombinedTracker::GATES];
    let mut kinds = all.concat();
    kinds.sort_by_key(|kind| kind.number);
    kinds.dedup();
    kinds
}

impl Record for Located {
    fn declare(r: &mut Declaration<Self>) {
        r.quantity("left_pixel", Unit::Pixel, |l| l.left_pixel).describe("Position in the left image.");
        r.quantity("right_pixel", Unit::Pixel, |l| l.right_pixel).describe("Position in the right image.");
        r.quantity("left_error.covariance_px2", Unit::SquarePixel, |l| l.left_error.covariance_px2).describe(
            "Covariance of the left position against the designated point, template drift included.",
        );
        r.quantity("left_error.bias_px", Unit::Pixel, |l| l.left_error.bias_px)
            .describe("The part of the drift that has the same direction at every step.");
        r.quantity("position_in_rover", Unit::Metre, |l| l.position_in_rover)
            .describe("Position in the rover frame.");
        r.quantity("covariance_in_rover", Unit::SquareMetre, |l| l.covariance_in_rover)
            .describe("Covariance of that position for cameras that point as measured.");
        r.quantity("surface_by_pixel", Unit::MetrePerPixel, |l| l.surface_by_pixel)
            .describe("Derivative of the surface point by the left pixel.");
        r.quantity("confidence", Unit::One, |l| l.confidence).describe("Confidence of the tracker, 0 to 1.");
        r.reason(|l| l.missing.clone());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::Settings;

    #[test]
    fn gate_numbers_names_and_labels_are_unique_and_limits_name_settings() {
        let (kinds, table) = (gate_kinds(), Settings::table());
        for (index, kind) in kinds.iter().enumerate() {
            let others = &kinds[index + 1..];
            assert!(others.iter().all(|other| other.number != kind.number), "{}", kind.name);
            assert!(others.iter().all(|other| other.name != kind.name), "{}", kind.name);
            assert!(others.iter().all(|other| other.label != kind.label), "{}", kind.name);
            assert!(kind.setting.is_none_or(|key| table.iter().any(|info| info.key == key)), "{}", kind.name);
        }
        // The border of the coarse search follows from its step.
        let without: Vec<&str> = kinds.iter().filter(|k| k.setting.is_none()).map(|k| k.name).collect();
        assert_eq!(without, ["shape_edge_distance_m"]);
    }
}
