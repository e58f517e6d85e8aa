//! The memory of the template tracker: the template in use and the appearances that renewals replaced (R23, R59, R70).
//!
//! Images are not serialised: each is the left image of the stop of its appearance, and resuming a drive reads it
//! again from the recording (`TrackerMemory::lacks_image_of`).

use std::sync::Arc;

use nalgebra::Matrix3x2;
use serde::{Deserialize, Serialize};

use super::relief::Relief;
use crate::stages::point_mast::declare_camera;
use sightline_geometry::camera::Camera;
use sightline_geometry::estimate::drift::Drift;
use sightline_geometry::frames::{Pixel, Point3, Pose};
use sightline_record::{Declaration, Unit};
use sightline_vision::image::GrayImage;

/// The memory of the template tracker.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TemplateMemory {
    /// The appearance of the target when the template was taken.
    pub appearance: Appearance,
    /// The error of the template's centre relative to the designated point, in the image of `appearance`, accumulated
    /// over the renewals of the template.
    pub drift: Drift,
    /// The appearances that renewals replaced, oldest first.
    pub replaced: Replaced,
}

impl TemplateMemory {
    /// Returns the memory after a renewal of the template; keeps the first replaced appearance and the newest `count`.
    #[must_use]
    pub fn renewed(self, appearance: Appearance, drift: Drift, count: usize) -> Self {
        let old = Kept { appearance: self.appearance, drift: self.drift };
        Self { appearance, drift, replaced: self.replaced.with(old, count) }
    }
}

impl TemplateMemory {
    /// Declares the memory for the stage that passes it to the next stop.
    pub(crate) fn declare(r: &mut Declaration<Self>) {
        declare_camera(r, "target.memory.appearance.camera");
        r.field("target.memory.appearance.pixel", Unit::Pixel);
        r.field("target.memory.appearance.surface_by_pixel", Unit::MetrePerPixel);
        r.quantity("target.appearance.step", Unit::One, |m| m.appearance.step)
            .describe("The stop at which the template was taken.");
        r.quantity("target.appearance.pixel", Unit::Pixel, |m| m.appearance.pixel)
            .describe("The target in the left image of the stop at which the template was taken.");
        r.quantity("target.appearance.position_in_rover", Unit::Metre, |m| m.appearance.position_in_rover)
            .describe("The target in the rover frame of the stop at which the template was taken.");
        r.quantity("target.appearance.surface_by_pixel", Unit::MetrePerPixel, |m| {
            m.appearance.surface_by_pixel
        })
        .describe("Derivative of the surface point by the pixel of that stop.");
        r.quantity("target.drift.covariance_px2", Unit::SquarePixel, |m| m.drift.covariance_px2)
            .describe("Covariance of the template's centre against the designated point.");
        r.quantity("target.drift.bias_px", Unit::Pixel, |m| m.drift.bias_px)
            .describe("The part of that error that has the same direction at every step.");
        r.quantity("target.drift.with_last_match_px", Unit::Pixel, |m| m.drift.with_last_match_px)
            .describe("Covariance of that error with the normalised error of the last match.");
    }
}

/// The appearance of the target when its template was taken (R23, R59).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Appearance {
    /// The step at which the template was taken.
    pub step: usize,
    /// Position of the target in that left image, px.
    pub pixel: Pixel,
    /// Position of the target in the rover frame *of that stop*, m: `p_old` of K-Eq 6.
    pub position_in_rover: Point3,
    /// Derivative of the surface point with respect to that pixel, m per px; `None` if stereo gave none.
    pub surface_by_pixel: Option<Matrix3x2<f64>>,
    /// The heights around the target; `None` without the height term.
    pub relief: Option<Relief>,
    /// The left camera in the rover frame of that stop.
    pub camera: Camera,
    /// The estimated pose at that stop.
    pub site_from_rover: Pose,
    /// The whole left image of that stop, so that rolled and shrunk templates have no empty corners (R59).
    #[serde(skip)]
    pub image: Arc<GrayImage>,
}

/// An appearance that was replaced, with the error of its centre.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Kept {
    /// The appearance.
    pub appearance: Appearance,
    /// The error of its centre relative to the designated point, in its own image.
    pub drift: Drift,
}

/// The appearances that renewals replaced: the designated one, and the newest ones.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Replaced(Vec<Kept>);

impl Replaced {
    /// Adds an appearance, and drops all but the first and the newest `count`.
    #[must_use]
    pub fn with(mut self, kept: Kept, count: usize) -> Self {
        self.0.push(kept);
        let newest = self.0.len().saturating_sub(count);
        self.0 =
            self.0.into_iter().enumerate().filter(|(i, _)| *i == 0 || *i >= newest).map(|(_, k)| k).collect();
        self
    }

    /// The designated appearance; `None` before the first renewal.
    pub fn first(&self) -> Option<&Kept> {
        self.0.first()
    }

    /// The replaced appearances, newest first.
    pub fn newest(&self) -> impl Iterator<Item = &Kept> {
        self.0.iter().rev()
    }
}
