//! The stops from which a motion can be measured, with the target's position and the features there (R186).
//!
//! After an occlusion the stops in between are useless, so the last good stop is tried again at every stop. Of
//! several remembered stops, the one whose motion gives the most certain target is used, so that fewer motions are chained.

use std::sync::Arc;

use nalgebra::{Matrix3, UnitQuaternion, Vector6};
use serde::{Deserialize, Serialize};

use super::detect::StopFeatures;
use sightline_geometry::estimate::bootstrap::Bootstrap;
use sightline_geometry::estimate::carry::carry;
use sightline_geometry::estimate::motion_parameters::MotionParameters;
use sightline_geometry::frames::{Point3, Pose};

/// A stop at which the target was located.
///
/// The features are not serialised: `detect` finds the same ones again in the images of that stop.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Anchor {
    /// The step, from 0.
    pub step: usize,
    /// Index of the stop in the recording; `None` if the traverse has no store.
    pub stop: Option<usize>,
    /// The features and points of that stop.
    #[serde(skip)]
    pub features: Arc<StopFeatures>,
    /// The estimated rover pose at that stop.
    pub site_from_rover: Pose,
    /// The target's position in the rover frame of that stop.
    pub carried: Carried,
}

/// A target's position, carried by motions from the designation to a stop.
///
/// Errors shared by the features of one stop (`feature_common_px`) are shared with the next stop as well, because the
/// same stones are seen from nearly the same side. They add up linearly along a run, whereas independent errors add
/// up in quadrature.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Carried {
    /// The position, m, rover frame.
    pub position_in_rover: Point3,
    /// Covariance of the designation and of the independent errors, m².
    pub scattered: Matrix3<f64>,
    /// Displacement by 1σ of each shared error, m, one column each.
    pub shared_m: Matrix3<f64>,
    /// Rotation of the rover frame since the designation: maps directions in the first frame to the current one.
    pub now_from_first: UnitQuaternion<f64>,
}

impl Carried {
    /// Returns the position at the designation.
    pub fn designated(position_in_rover: Point3, covariance_in_rover: Matrix3<f64>) -> Self {
        Self {
            position_in_rover,
            scattered: covariance_in_rover,
            shared_m: Matrix3::zeros(),
            now_from_first: UnitQuaternion::identity(),
        }
    }

    /// Returns the position after a motion. `by_shared_error`: change of the motion parameters by 1σ of each shared error.
    ///
    /// Returns `None` if a covariance is not positive semidefinite.
    pub fn after(&self, motion: &Bootstrap, by_shared_error: Option<[Vector6<f64>; 3]>) -> Option<Self> {
        let (theta, point) = (motion.parameters, &self.position_in_rover);
        let (position_in_rover, scattered) = carry(point, &self.scattered, theta, &motion.covariance)?;
        let moved = |change: Vector6<f64>| {
            let at = |sign: f64| {
                MotionParameters::from_vector(&(theta.to_vector() + sign * change)).to_pose() * point
            };
            (at(1.0) - at(-1.0)) / 2.0
        };
        let turn = theta.to_pose().rotation;
        let turned = turn.to_rotation_matrix() * self.shared_m;
        let added =
            by_shared_error.map_or_else(Matrix3::zeros, |changes| Matrix3::from_columns(&changes.map(moved)));
        let now_from_first = turn * self.now_from_first;
        Some(Self { position_in_rover, scattered, shared_m: turned + added, now_from_first })
    }

    /// The covariance of the position, m².
    pub fn covariance_in_rover(&self) -> Matrix3<f64> {
        self.scattered + self.shared_m * self.shared_m.transpose()
    }
}

/// The remembered stops, oldest first.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Anchors {
    stops: Vec<Anchor>,
}

impl Anchors {
    /// Adds a stop and drops all but the newest `count`.
    #[must_use]
    pub fn with(mut self, anchor: Anchor, count: usize) -> Self {
        self.stops.push(anchor);
        let forgotten = self.stops.len().saturating_sub(count.max(1));
        self.stops.drain(..forgotten);
        self
    }

    /// The remembered stops, newest first.
    pub fn newest(&self) -> impl Iterator<Item = &Anchor> {
        self.stops.iter().rev()
    }
}
