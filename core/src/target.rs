//! The target: one surface point that is to be found again, and how it looked when last seen.
//!
//! A target is designated by a sub-pixel position in the left image of a stop (R16); its 3-D position comes
//! from point stereo there. From then on every accepted update renews position, covariance and appearance;
//! the initial position is kept unchanged for the checks of `judge` (R19, R84).

use std::sync::Arc;

use nalgebra::{Matrix3, Matrix3x2};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::camera::Camera;
use crate::estimate::drift::Drift;
use crate::frames::{Pixel, Point3, Pose};
use crate::image::GrayImage;
use crate::locate::features::anchor::Anchors;
use crate::locate::shape_tracker::view::Views;
use crate::locate::template::height::Relief;

/// How a person names a target: a position in the left image of a stop.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Designation {
    /// The stop whose left image was clicked, from 0.
    pub step: usize,
    /// The position, px.
    pub pixel: Pixel,
}

/// How the target looked when its template was taken (R23, R59).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Appearance {
    /// The stop at which the template was taken.
    pub step: usize,
    /// Where the target was in that left image, px.
    pub pixel: Pixel,
    /// Where the target was in the rover frame *of that stop*, m: `p_old` of K-Eq 6.
    #[schema(value_type = [f64; 3])]
    pub position_in_rover: Point3,
    /// How the surface point moves with that pixel, m per px, where stereo told.
    #[schema(value_type = Option<Vec<f64>>)]
    pub surface_by_pixel: Option<Matrix3x2<f64>>,
    /// The heights around it, where they are weighed.
    #[serde(skip)]
    #[schema(ignore)]
    pub relief: Option<Relief>,
    /// The left camera in the rover frame of that stop.
    pub camera: Camera,
    /// The estimated pose at that stop.
    #[serde(skip)]
    #[schema(ignore)]
    pub site_from_rover: Pose,
    /// The whole left image of that stop, so that rolled and shrunk templates have no empty corners (R59).
    #[serde(skip)]
    #[schema(ignore)]
    pub image: Arc<GrayImage>,
}

/// The target as one stop leaves it to the next.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Target {
    /// How it was designated.
    pub designation: Designation,
    /// The stop in whose rover frame the position is given.
    pub step: usize,
    /// Position in the rover frame, m.
    #[schema(value_type = [f64; 3])]
    pub position_in_rover: Point3,
    /// Covariance of that position, m².
    #[schema(value_type = Vec<f64>)]
    pub covariance_in_rover: Matrix3<f64>,
    /// Position at designation in the site frame, m; never changed (R84).
    #[schema(value_type = [f64; 3])]
    pub initial_position_in_site: Point3,
    /// Distance from the left camera at designation, m.
    pub initial_distance_m: f64,
    /// Distance driven since the designation, m.
    pub travelled_m: f64,
    /// Distance from the left camera at the last accepted update, m: `D_old` of R87.
    pub last_distance_m: f64,
    /// Distance driven since the last accepted update, m: `L_step` of R87.
    pub travelled_since_update_m: f64,
    /// The error of the template's centre against the designated point, in the image from which the template
    /// was taken: what the renewals of the template have added so far.
    pub drift: Drift,
    /// How it looked when the template was taken.
    pub appearance: Appearance,
    /// The appearances that renewals replaced, oldest first.
    #[serde(skip)]
    #[schema(ignore)]
    pub memory: Memory,
    /// The last good stops with their features, for the tracker that follows those.
    #[serde(skip)]
    #[schema(ignore)]
    pub anchors: Anchors,
    /// The surfaces that later stops are registered to.
    #[serde(skip)]
    #[schema(ignore)]
    pub views: Views,
}

/// An appearance that was replaced, with the error of its centre.
#[derive(Clone, Debug, PartialEq)]
pub struct Kept {
    /// How the target looked.
    pub appearance: Appearance,
    /// The error of its centre against the designated point, in its own image.
    pub drift: Drift,
}

/// The appearances that renewals replaced: the designated one, and the newest ones.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Memory(Vec<Kept>);

impl Memory {
    /// Adds an appearance, and forgets all but the first and the newest `count`.
    #[must_use]
    pub fn with(mut self, kept: Kept, count: usize) -> Self {
        self.0.push(kept);
        let newest = self.0.len().saturating_sub(count);
        self.0 =
            self.0.into_iter().enumerate().filter(|(i, _)| *i == 0 || *i >= newest).map(|(_, k)| k).collect();
        self
    }

    /// The designated appearance, once it was replaced.
    pub fn first(&self) -> Option<&Kept> {
        self.0.first()
    }

    /// The replaced appearances, newest first.
    pub fn newest(&self) -> impl Iterator<Item = &Kept> {
        self.0.iter().rev()
    }
}

/// Where tracking stands (R89): the words of the house, of which `tracking` is the papers' "normal".
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "state", rename_all = "snake_case")]
pub enum TrackingState {
    /// No target.
    #[default]
    Cleared,
    /// The last update was good.
    Tracking,
    /// This many updates were bad, and a retry is allowed.
    Lost {
        /// Bad updates in a row, the detecting one included.
        count: u32,
    },
    /// Too many bad updates; stays until the target is cleared.
    Failed,
}

impl TrackingState {
    /// The state's word.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Cleared => "cleared",
            Self::Tracking => "tracking",
            Self::Lost { .. } => "lost",
            Self::Failed => "failed",
        }
    }

    /// Whether the target counts as lost.
    pub const fn is_lost(self) -> bool {
        matches!(self, Self::Lost { .. } | Self::Failed)
    }
}
