//! The trait that every tracker implements, and its inputs.
//!
//! A tracker owns three things: its *memory*, which is all that it carries from stop to stop; its *evidence*, which is
//! everything it observed at one stop; and its *gates*. The stages around it use neither memory nor evidence.
//!
//! A tracker never fails: if it finds nothing, `Sighting::missing` gives the reason and `judge` rejects the update.
//! The same input gives the same bits.

use nalgebra::{Matrix3, Matrix3x2};
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::store::Shared;
use crate::gate::{Gate, GateKind};
use crate::limits::Limits;
use crate::settings::Settings;
use crate::stages::capture::Capture;
use crate::stages::point_mast::Pointing;
use crate::stages::prediction::Prediction;
use sightline_geometry::camera::Camera;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::estimate::drift::Drift;
use sightline_geometry::frames::{Pixel, Point3, Pose};
use sightline_geometry::stereo_geometry::StereoGeometry;

/// A method of tracking a target.
pub trait Tracker {
    /// The state carried from stop to stop. Its serialised form may omit data that can be computed again from the
    /// images of the stops that it names.
    type Memory: Clone + PartialEq + Serialize + DeserializeOwned;
    /// All observations at one stop.
    type Evidence: Clone + PartialEq + Default + Serialize + DeserializeOwned;

    /// The gates of this tracker.
    const GATES: &'static [GateKind];
    /// Its steps in running order: names of stages of the record.
    const STEPS: &'static [&'static str];

    /// Locates a designated pixel; there is no memory without a position.
    fn designate(&self, input: &DesignateInput<'_>) -> (Sighting<Self::Evidence>, Option<Self::Memory>);

    /// Locates the target at a later stop.
    fn locate(&self, input: &LocateInput<'_>, memory: &Self::Memory) -> Sighting<Self::Evidence>;

    /// Returns the gates of an update, in display order. A value that was not reached is `None`, and fails.
    fn gates(&self, evidence: &Self::Evidence, input: &GateInput<'_>) -> Vec<Gate>;

    /// Returns the memory after an accepted update; a rejected one does not change it.
    fn remember(
        &self,
        memory: Self::Memory,
        evidence: &Self::Evidence,
        update: &Accepted<'_>,
    ) -> Self::Memory;
}

/// A target located by a tracker, with its evidence; by default not located.
///
/// The fields are those of [`super::Located`], which contains the evidence of any tracker.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sighting<E> {
    /// Position in the left image, px.
    pub left_pixel: Option<Pixel>,
    /// Position in the right image, px.
    pub right_pixel: Option<Pixel>,
    /// The error of the left position relative to the designated point, template drift included.
    pub left_error: Drift,
    /// Position in the rover frame, m.
    pub position_in_rover: Option<Point3>,
    /// Covariance of that position, m².
    pub covariance_in_rover: Option<Matrix3<f64>>,
    /// Derivative of the surface point with respect to the left pixel, m per px.
    pub surface_by_pixel: Option<Matrix3x2<f64>>,
    /// Confidence, from 0 to 1.
    pub confidence: f64,
    /// Why there is no position: a failure of the tracker, as one sentence.
    pub missing: Option<String>,
    /// The evidence.
    pub evidence: E,
}

impl<E> Sighting<E> {
    /// Replaces the evidence; also returns the previous one.
    pub fn replace<F>(self, evidence: F) -> (Sighting<F>, E) {
        let sighting = Sighting {
            left_pixel: self.left_pixel,
            right_pixel: self.right_pixel,
            left_error: self.left_error,
            position_in_rover: self.position_in_rover,
            covariance_in_rover: self.covariance_in_rover,
            surface_by_pixel: self.surface_by_pixel,
            confidence: self.confidence,
            missing: self.missing,
            evidence,
        };
        (sighting, self.evidence)
    }
}

impl<E: Default> Sighting<E> {
    /// A sighting without a position, for a reason.
    pub fn nothing(missing: impl std::fmt::Display, evidence: E) -> Self {
        Self { missing: Some(missing.to_string()), evidence, ..Self::default() }
    }
}

/// The input of a tracker's gates besides its evidence.
#[derive(Clone, Debug)]
pub struct GateInput<'a> {
    /// Whether a position was found.
    pub is_located: bool,
    /// The confidence of the sighting.
    pub confidence: f64,
    /// The gates on the corrections of distance and position, which `judge` computes for every tracker.
    pub corrections: [Gate; 2],
    /// Camera models and the predicted pixels.
    pub pointing: &'a Pointing,
    /// Whether the target was lost before this update.
    pub was_lost: bool,
    /// The limits.
    pub limits: &'a Limits,
}

/// An accepted update, for the memory of a tracker.
#[derive(Clone, Copy, Debug)]
pub struct Accepted<'a> {
    /// The step, from 0.
    pub step: usize,
    /// The left camera.
    pub left: &'a Camera,
    /// The stereo pair.
    pub capture: &'a Capture,
    /// The estimated rover pose.
    pub site_from_rover: &'a Pose,
    /// Position in the left image, px.
    pub left_pixel: Option<Pixel>,
    /// The error of the left position relative to the designated point.
    pub left_error: Drift,
    /// Position in the rover frame, m.
    pub position_in_rover: Point3,
    /// Derivative of the surface point with respect to the left pixel, m per px.
    pub surface_by_pixel: Option<Matrix3x2<f64>>,
    /// The settings.
    pub settings: &'a Settings,
}

/// The input of a tracker at the stop of the designation.
#[derive(Clone, Copy, Debug)]
pub struct DesignateInput<'a> {
    /// The step, from 0.
    pub step: usize,
    /// The estimated rover pose.
    pub site_from_rover: &'a Pose,
    /// The designated position in the left image, px.
    pub pixel: Pixel,
    /// The stereo pair.
    pub capture: &'a Capture,
    /// The left camera.
    pub left: &'a Camera,
    /// The right camera.
    pub right: &'a Camera,
    /// The relation of the two views.
    pub stereo: StereoGeometry,
    /// The store shared by the targets of the traverse.
    pub shared: Option<Shared<'a>>,
    /// The settings.
    pub settings: &'a Settings,
    /// Once requested, the tracker returns early; the sighting is discarded.
    pub cancel: Cancel<'a>,
}

/// The input of a tracker at every later stop.
#[derive(Clone, Copy, Debug)]
pub struct LocateInput<'a> {
    /// The predicted target.
    pub prediction: &'a Prediction,
    /// Camera models and the predicted pixels.
    pub pointing: &'a Pointing,
    /// The stereo pair.
    pub capture: &'a Capture,
    /// The estimated rover pose at this stop.
    pub site_from_rover: &'a Pose,
    /// The relation of the two views.
    pub stereo: StereoGeometry,
    /// The store shared by the targets of the traverse.
    pub shared: Option<Shared<'a>>,
    /// The stop within its drive.
    pub place: Place,
    /// Number of consecutive bad updates so far.
    pub lost_count: u32,
    /// Whether the target was located at the previous stop.
    pub was_found: bool,
    /// The settings.
    pub settings: &'a Settings,
    /// Once requested, the tracker returns early; the sighting is discarded.
    pub cancel: Cancel<'a>,
}

/// A stop within its drive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Place {
    /// The step, from 0.
    pub step: usize,
    /// Whether its cameras differ from those of the previous stop: a hand-off (R205).
    pub is_hand_over: bool,
    /// Whether the drive ends here, or the next stop is a hand-off.
    pub is_last_of_pair: bool,
}
