//! The stops from which a motion may be measured: where the target was there, and what features they have (R186).
//!
//! After an occlusion the stops between are of no use; the last good one is tried again at every stop. Of several
//! remembered ones the motion is taken that leaves the target most certain, so that fewer motions are chained.

use std::sync::Arc;

use nalgebra::Matrix3;

use super::detect::StopFeatures;
use crate::frames::{Point3, Pose};

/// A stop at which the target was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Anchor {
    /// The stop, from 0.
    pub step: usize,
    /// Which stop of the recording it is, where the traverse has a store.
    pub stop: Option<usize>,
    /// The features and points of that stop.
    pub features: Arc<StopFeatures>,
    /// The estimated pose there.
    pub site_from_rover: Pose,
    /// Where the target was, in the rover frame of that stop, m.
    pub position_in_rover: Point3,
    /// Its covariance, m².
    pub covariance_in_rover: Matrix3<f64>,
}

/// The remembered stops, oldest first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Anchors(Vec<Anchor>);

impl Anchors {
    /// Adds a stop and forgets all but the newest `count`.
    #[must_use]
    pub fn with(mut self, anchor: Anchor, count: usize) -> Self {
        self.0.push(anchor);
        let forgotten = self.0.len().saturating_sub(count.max(1));
        self.0.drain(..forgotten);
        self
    }

    /// The remembered stops, newest first.
    pub fn newest(&self) -> impl Iterator<Item = &Anchor> {
        self.0.iter().rev()
    }
}
