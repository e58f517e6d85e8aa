//! A target as seen at one stop: its surface, its position on it, and the line of sight to it.
//!
//! Every later stop is registered to the *first* view, so that errors do not accumulate (R189). At a hand-off the new
//! pair is registered to the last view of the old one (R205), which is the nearest and the sharpest.

use std::sync::Arc;

use nalgebra::{Matrix3, UnitQuaternion};
use serde::{Deserialize, Serialize};

use sightline_geometry::camera::Camera;
use sightline_geometry::frames::{Point3, Pose, Ray};
use sightline_vision::image::GrayImage;
use sightline_vision::registration::Mesh;

/// A target as seen at one stop.
///
/// Mesh, image and ray are not serialised: they follow from the images of that stop, its camera and the designation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct View {
    /// The step.
    pub step: usize,
    /// The estimated rover pose at that stop.
    pub site_from_rover: Pose,
    /// Position of the target, m, rover frame of that stop.
    pub position_in_rover: Point3,
    /// Its covariance, m².
    pub covariance_in_rover: Matrix3<f64>,
    /// The line of sight of the designated pixel; `None` at later stops.
    #[serde(skip)]
    pub ray: Option<Ray>,
    /// Half the width of the surface to be registered, m.
    pub half_width_m: f64,
    /// The surface around the target, m, rover frame of that stop.
    #[serde(skip)]
    pub mesh: Mesh,
    /// The left camera, rover frame.
    pub left: Camera,
    /// The left image.
    #[serde(skip)]
    pub image: Arc<GrayImage>,
}

impl View {
    /// Rotation from the rover frame of another stop to that of this view, by the pose estimates.
    pub fn turn_to(&self, site_from_rover: &Pose) -> UnitQuaternion<f64> {
        self.site_from_rover.rotation.inverse() * site_from_rover.rotation
    }

    /// Start of a registration with this view: the given rotation, and the shift that moves `position_in_rover` to
    /// the target.
    pub fn start_from(&self, rotation: UnitQuaternion<f64>, position_in_rover: &Point3) -> Pose {
        let shift = self.position_in_rover - rotation * position_in_rover;
        Pose::from_parts(shift.into(), rotation)
    }
}

/// The views to which later stops are registered.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Views {
    /// The view of the designation.
    #[serde(with = "by_value")]
    pub first: Option<Arc<View>>,
    /// The view of the last stop whose surface was measured.
    #[serde(with = "by_value")]
    pub last: Option<Arc<View>>,
}

/// Serialises a shared view by its value.
mod by_value {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use super::{Arc, View};

    pub(super) fn serialize<S: Serializer>(
        view: &Option<Arc<View>>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        view.as_deref().serialize(serializer)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Option<Arc<View>>, D::Error> {
        Ok(Option::<View>::deserialize(deserializer)?.map(Arc::new))
    }
}

impl Views {
    /// Adds a view that is newer than all of them.
    #[must_use]
    pub fn with(mut self, view: Arc<View>) -> Self {
        self.first.get_or_insert_with(|| Arc::clone(&view));
        self.last = Some(view);
        self
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Translation3;

    use super::*;

    #[test]
    fn a_registration_starts_with_the_target_where_it_is_thought_to_be_and_turned_as_the_poses_say() {
        let pose = |x: f64, yaw: f64| {
            Pose::from_parts(
                Translation3::new(x, 0.5, 0.0),
                UnitQuaternion::from_euler_angles(0.02, 0.0, yaw),
            )
        };
        let (then, now) = (pose(0.0, 0.1), pose(6.0, -0.2));
        let view = View {
            step: 0,
            site_from_rover: then,
            position_in_rover: Point3::new(9.0, 0.3, 0.1),
            covariance_in_rover: Matrix3::identity(),
            ray: None,
            half_width_m: 0.2,
            mesh: Mesh::default(),
            left: crate::testing::camera(),
            image: Arc::default(),
        };
        let thought = Point3::new(3.1, 0.2, 0.15);
        let start = view.start_from(view.turn_to(&now), &thought);
        assert!((start * thought - view.position_in_rover).norm() < 1e-12);
        assert!(start.rotation.angle_to(&(then.inverse() * now).rotation) < 1e-12);
        // With consistent poses and position, the start is the motion itself.
        let exact = view.start_from(view.turn_to(&now), &((now.inverse() * then) * view.position_in_rover));
        assert!((exact.translation.vector - (then.inverse() * now).translation.vector).norm() < 1e-12);
    }
}
