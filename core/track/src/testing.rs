//! A camera for unit tests.

use sightline_geometry::camera::{Cahv, Camera, CameraModel};
use sightline_geometry::frames::{Point3, Vector3};

/// A CAHV camera of 256 x 256 px and 600 px focal length that looks along the rover's +x axis from 1.2 m above ground.
pub(crate) fn camera() -> Camera {
    let axis = Vector3::x();
    let (h, v) = (Vector3::y() * 600.0 + axis * 127.5, Vector3::z() * 600.0 + axis * 127.5);
    Camera::new(CameraModel::Cahv(Cahv::as_printed(Point3::new(0.3, -0.1, -1.2), axis, h, v)), 256, 256)
}
