//! Maps the pixels of a prepared template to the image from which it was taken.
//!
//! To first order this is a linear map about the target's pixel (`scale_roll`). Beyond it the surface is taken as a
//! plane, and each pixel of the new window is mapped through both camera models:
//! ```text
//! pixel_new → ray → point on the plane (p, n), current rover frame → rover frame of the template → pixel_old
//! n = t_u × t_v        t: the surface's two tangents ∂p/∂pixel_old, rotated into the current frame
//! ```
//! For two linear cameras this is the plane's homography (Hartley & Zisserman 2004, 13.1); with CAHVOR(E) it includes
//! their distortion. A shift by the ray gap of the target's triangulation is added, so that the target's own pixel
//! maps to itself exactly.
//!
//! | symbol | name | unit, frame |
//! |---|---|---|
//! | p | `point_now` | m, current rover frame |
//! | n | `normal_now` | –, current rover frame |

use nalgebra::{Matrix2, Vector2};

use super::memory::Appearance;
use sightline_geometry::camera::Camera;
use sightline_geometry::frames::{Pixel, Point3, Pose, Vector3};
use sightline_vision::image::patch::{self, Patch};
use sightline_vision::image::sample::Kernel;

/// The map from the image of the template to the prepared window.
#[derive(Clone, Debug)]
pub(super) enum WindowMap<'a> {
    /// First order, px per px.
    Linear(Matrix2<f64>),
    /// Through a plane.
    Plane(Box<PlaneMap<'a>>),
}

/// An appearance and its map to the current view.
#[derive(Clone, Debug)]
pub(super) struct WindowSource<'a> {
    /// The source of the pixels.
    pub(super) appearance: &'a Appearance,
    /// The map of the pixels.
    pub(super) map: WindowMap<'a>,
    /// The interpolation of the pixels.
    pub(super) kernel: Kernel,
}

impl WindowSource<'_> {
    /// The prepared window of `size` × `size` px.
    pub(super) fn window(&self, size: u32) -> Patch {
        let (image, pixel) = (self.appearance.image.as_ref(), self.appearance.pixel);
        match &self.map {
            WindowMap::Linear(map) => patch::warp(image, pixel, map, size, self.kernel),
            WindowMap::Plane(plane) => {
                patch::warp_by(image, plane.scale, size, self.kernel, |offset| plane.source_of(offset))
            }
        }
    }
}

/// The map through the plane of the target's surface.
#[derive(Clone, Debug)]
pub(super) struct PlaneMap<'a> {
    now: &'a Camera,
    then: &'a Camera,
    then_from_now: Pose,
    point_now: Point3,
    normal_now: Vector3,
    pixel_now: Pixel,
    /// Offset from the projection of the target in the old image to its pixel there, px.
    shift: Vector2<f64>,
    /// Magnification at the target.
    scale: f64,
}

impl<'a> PlaneMap<'a> {
    /// `None` if the surface is unknown, or the target is not visible to either camera.
    pub(super) fn new(
        appearance: &'a Appearance,
        now_from_template: &Pose,
        now: &'a Camera,
        first_order: &Matrix2<f64>,
    ) -> Option<Self> {
        let tangents = appearance.surface_by_pixel?;
        let normal = Vector3::from(tangents.column(0)).cross(&Vector3::from(tangents.column(1)));
        let point_now = now_from_template * appearance.position_in_rover;
        let seen_then = appearance.camera.project(&appearance.position_in_rover)?;
        let shift = Vector2::new(appearance.pixel.x - seen_then.x, appearance.pixel.y - seen_then.y);
        Some(Self {
            now,
            then: &appearance.camera,
            then_from_now: now_from_template.inverse(),
            point_now,
            normal_now: now_from_template * normal.try_normalize(0.0)?,
            pixel_now: now.project(&point_now)?,
            shift,
            scale: first_order.determinant().abs().sqrt(),
        })
    }

    /// The pixel of the old image at an offset from the middle of the new window.
    pub(super) fn source_of(&self, offset: Vector2<f64>) -> Option<Pixel> {
        let ray = self.now.ray(self.pixel_now.offset(offset.x, offset.y))?;
        let distance_m =
            (self.point_now - ray.origin).dot(&self.normal_now) / ray.direction.dot(&self.normal_now);
        let point = Some(ray.at(distance_m)).filter(|_| distance_m > 0.0 && distance_m.is_finite())?;
        let pixel = self.then.project(&(self.then_from_now * point))?;
        Some(pixel.offset(self.shift.x, self.shift.y))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use nalgebra::Matrix3x2;

    use super::*;
    use crate::testing;
    use sightline_geometry::frames::attitude_from_roll_pitch_yaw;

    #[test]
    fn through_the_plane_pixels_go_where_the_geometry_puts_them_and_to_first_order_they_do_not() {
        let attitude = attitude_from_roll_pitch_yaw(0.1, 0.0, (-2.4_f64).atan2(8.7));
        let aside = Pose::from_parts(Vector3::new(-1.0, 2.4, 0.0).into(), attitude);
        let camera = testing::camera();
        let angle = 65_f64.to_radians();
        let normal = Vector3::new(angle.cos(), -angle.sin(), 0.0);
        let pixel = Pixel::new(118.3, 131.6);
        // The rover frame of the first stop is the site's.
        // The plane's point under a pixel, site frame; `site_from_rover` of the first stop is the identity.
        let plane_point = |site_from_rover: &Pose, pixel: Pixel| {
            let ray = camera.ray(pixel).unwrap();
            let (origin, direction) = (site_from_rover * ray.origin, site_from_rover * ray.direction);
            let distance_m = (Point3::new(8.0, 0.0, 0.0) - origin).dot(&normal) / direction.dot(&normal);
            origin + direction * distance_m
        };
        let at = |dx: f64, dy: f64| plane_point(&Pose::identity(), pixel.offset(dx, dy));
        let tangent = |dx: f64, dy: f64| (at(dx, dy) - at(-dx, -dy)) / 2e-3;
        let appearance = Appearance {
            step: 0,
            pixel,
            position_in_rover: at(0.0, 0.0),
            surface_by_pixel: Some(Matrix3x2::from_columns(&[tangent(1e-3, 0.0), tangent(0.0, 1e-3)])),
            relief: None,
            camera: camera.clone(),
            site_from_rover: Pose::identity(),
            image: Arc::default(),
        };
        let now_from_then = aside.inverse();
        let point_now = now_from_then * appearance.position_in_rover;
        let (pixel_now, jacobian) = camera.model.project_with_jacobian(&point_now).unwrap();
        let first_order = jacobian
            * now_from_then.rotation.to_rotation_matrix().matrix()
            * appearance.surface_by_pixel.unwrap();
        let plane = PlaneMap::new(&appearance, &now_from_then, &camera, &first_order).unwrap();
        let mut largest = 0.0_f64;
        for (u, v) in [(0.0, 0.0), (10.0, 0.0), (-10.0, 10.0), (30.0, -30.0), (-30.0, 0.0)] {
            let seen = plane_point(&aside, pixel_now.offset(u, v));
            let truth = camera.project(&seen).unwrap();
            let found = plane.source_of(Vector2::new(u, v)).unwrap();
            assert!(found.distance(truth) < 1e-4, "({u}, {v}): {found:?} for {truth:?}");
            let o = first_order.try_inverse().unwrap() * Vector2::new(u, v);
            largest = largest.max(pixel.offset(o.x, o.y).distance(truth));
        }
        assert!(largest > 0.5, "{largest}");
    }
}
