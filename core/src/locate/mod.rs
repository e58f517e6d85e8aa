//! Stage 4, `locate`: where the target is now. Here the trackers differ, each behind [`Locator`].
//!
//! | tracker | steps |
//! |---|---|
//! | `template` (Kim et al. 2009) | `scale_roll` → `match_template` → `point_stereo` → `triangulate` |
//! | `features` (Deans et al. 2005) | `detect` → `match_features` → `triangulate` → `fit_motion` → `bootstrap` |
//! | `shape` (Deans et al. 2005) | `surface` → `mesh` → `coarse_register` → `refine_register` → `carried_ray` |
//! | `combined` (D§4) | those of `features` on the way, those of `shape` at the end |
//!
//! `shape` holds the registration of two surfaces, `shape_tracker` the locators that make use of it.
//!
//! A locator never fails: where it finds nothing it says so in `Located::missing`, and `judge` rejects it.
//! Two contracts hold for all of them: the same input gives the same bits, and whatever was seen on the way
//! is in the evidence.

pub mod features;
pub mod shape;
pub mod shape_tracker;
pub mod store;
pub mod template;

use nalgebra::{Matrix3, Matrix3x2};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use self::store::Shared;
use crate::estimate::drift::Drift;
use crate::frames::{Pixel, Point3, Pose};
use crate::settings::{Settings, TrackerKind};
use crate::stages::capture::Capture;
use crate::stages::point_mast::Pointing;
use crate::stages::predict::Prediction;
use crate::target::Target;
use crate::traverse::StereoGeometry;

/// Where the target is now, and how that was found; by default nowhere.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Located {
    /// Position in the left image, px.
    pub left_pixel: Option<Pixel>,
    /// Position in the right image, px.
    pub right_pixel: Option<Pixel>,
    /// The error of the left position against the designated point, template drift included.
    pub left_error: Drift,
    /// Position in the rover frame, m.
    #[schema(value_type = Option<[f64; 3]>)]
    pub position_in_rover: Option<Point3>,
    /// Covariance of that position, m².
    #[schema(value_type = Option<Vec<f64>>)]
    pub covariance_in_rover: Option<Matrix3<f64>>,
    /// How the surface point moves with the left pixel, m per px.
    #[schema(value_type = Option<Vec<f64>>)]
    pub surface_by_pixel: Option<Matrix3x2<f64>>,
    /// Confidence, from 0 to 1: for `template` the score of the match, cut at 0; for `features` D-Eq 7; where the shape
    /// decides, the share of the target's pixels that both surfaces cover.
    pub confidence: f64,
    /// What could not be found and why, as one sentence.
    pub missing: Option<String>,
    /// What was seen on the way.
    pub evidence: Evidence,
}

/// What a locator saw on the way, step by step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "tracker", rename_all = "snake_case")]
pub enum Evidence {
    /// Of the template locator.
    Template(Box<template::TemplateEvidence>),
    /// Of the feature locator.
    Features(Box<features::FeatureEvidence>),
    /// Of the shape tracker and the combined one.
    Shape(Box<shape_tracker::ShapeEvidence>),
}

impl Default for Evidence {
    fn default() -> Self {
        Self::Template(Box::default())
    }
}

impl Evidence {
    /// The evidence of the template locator, to be added to: of every step, or of the designation, which all trackers
    /// leave to point stereo.
    pub fn template_mut(&mut self) -> Option<&mut template::TemplateEvidence> {
        match self {
            Self::Template(evidence) => Some(evidence),
            Self::Features(evidence) => evidence.designation.as_deref_mut(),
            Self::Shape(evidence) => match evidence.features.as_mut() {
                Some(features) => features.designation.as_deref_mut(),
                None => evidence.designation.as_deref_mut(),
            },
        }
    }

    /// The evidence of the template locator, alike.
    pub fn template(&self) -> Option<&template::TemplateEvidence> {
        match self {
            Self::Template(evidence) => Some(evidence),
            Self::Features(evidence) => evidence.designation.as_deref(),
            Self::Shape(evidence) => match evidence.features.as_ref() {
                Some(features) => features.designation.as_deref(),
                None => evidence.designation.as_deref(),
            },
        }
    }

    /// The evidence of the feature locator, where features are followed.
    pub fn features(&self) -> Option<&features::FeatureEvidence> {
        match self {
            Self::Template(_) => None,
            Self::Features(evidence) => Some(evidence),
            Self::Shape(evidence) => evidence.features.as_deref(),
        }
    }

    /// The evidence of the shape tracker.
    pub fn shape(&self) -> Option<&shape_tracker::ShapeEvidence> {
        match self {
            Self::Template(_) | Self::Features(_) => None,
            Self::Shape(evidence) => Some(evidence),
        }
    }
}

/// What a locator is given at the stop of the designation.
#[derive(Clone, Copy, Debug)]
pub struct DesignateInput<'a> {
    /// The stop.
    pub step: usize,
    /// The estimated pose there.
    pub site_from_rover: &'a Pose,
    /// The designated position in the left image, px.
    pub pixel: Pixel,
    /// The stereo pair.
    pub capture: &'a Capture,
    /// Camera models.
    pub left: &'a crate::camera::Camera,
    /// Camera models.
    pub right: &'a crate::camera::Camera,
    /// How the two images relate.
    pub stereo: StereoGeometry,
    /// What the targets of the traverse share.
    pub shared: Option<Shared<'a>>,
    /// The configuration.
    pub settings: &'a Settings,
}

/// What a locator is given at every later stop.
#[derive(Clone, Copy, Debug)]
pub struct LocateInput<'a> {
    /// The target as the last stop left it.
    pub target: &'a Target,
    /// Where it should be.
    pub prediction: &'a Prediction,
    /// Camera models and the predicted pixels.
    pub pointing: &'a Pointing,
    /// The stereo pair.
    pub capture: &'a Capture,
    /// Takes points of the rover frame at which the template was taken into the present rover frame.
    pub now_from_template: &'a Pose,
    /// The estimated pose at this stop.
    pub site_from_rover: &'a Pose,
    /// How the two images relate.
    pub stereo: StereoGeometry,
    /// What the targets of the traverse share.
    pub shared: Option<Shared<'a>>,
    /// Which stop of the drive this is.
    pub place: Place,
    /// Updates in a row that were bad so far.
    pub lost_count: u32,
    /// The configuration.
    pub settings: &'a Settings,
}

/// A stop among those of its drive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Place {
    /// The stop, from 0.
    pub step: usize,
    /// Whether its cameras are others than those of the stop before: the target is handed over (R205).
    pub is_hand_over: bool,
    /// Whether the drive ends here, or other cameras take over at the next stop.
    pub is_last_of_pair: bool,
}

/// One tracker's way of finding the target.
pub trait Locator: Send + Sync {
    /// Finds the 3-D position of a designated pixel.
    fn designate(&self, input: &DesignateInput<'_>) -> Located;
    /// Finds the target again after a move.
    fn locate(&self, input: &LocateInput<'_>) -> Located;
}

/// The locator of a configuration.
pub fn locator(kind: TrackerKind) -> &'static dyn Locator {
    match kind {
        TrackerKind::Template => &template::TemplateLocator,
        TrackerKind::Features => &features::FeatureLocator,
        TrackerKind::Shape => &shape_tracker::ShapeLocator,
        TrackerKind::Combined => &shape_tracker::CombinedLocator,
    }
}
