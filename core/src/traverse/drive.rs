//! An opened traverse as the stages and the truth see it.
//!
//! The surface of a simulated world is met by an exact cast of the true camera's ray; a recorded traverse knows
//! at most its true poses.

use super::{OdometryError, StereoGeometry, StereoPair, Traverse};
use crate::camera::{Camera, Mast, MastAngles};
use crate::error::Result;
use crate::frames::{Pixel, Point3, Pose, Ray};
use crate::pipeline::Stops;
use crate::study::truth::TruthSource;

impl Stops for Traverse {
    fn stop_count(&self) -> usize {
        Self::stop_count(self)
    }

    fn time_s(&self, step: usize) -> f64 {
        self.index().stops[step].time_s
    }

    fn site_from_rover(&self, step: usize) -> Pose {
        Self::site_from_rover(self, step)
    }

    fn cameras(&self, step: usize) -> (&Camera, &Camera) {
        (self.left_camera(step), self.right_camera(step))
    }

    fn mast(&self) -> Option<&Mast> {
        self.index().mast.as_ref()
    }

    fn mast_angles(&self, step: usize) -> Option<MastAngles> {
        self.index().stops[step].mast_angles
    }

    fn odometry_error(&self) -> OdometryError {
        self.index().odometry_error
    }

    fn stereo(&self) -> StereoGeometry {
        self.index().stereo
    }

    fn capture(&self, step: usize) -> Result<StereoPair> {
        Self::capture(self, step)
    }
}

impl TruthSource for Traverse {
    fn true_site_from_rover(&self, step: usize) -> Option<Pose> {
        Self::true_site_from_rover(self, step)
    }

    fn true_left_camera(&self, step: usize) -> &Camera {
        Self::true_left_camera(self, step).unwrap_or_else(|| self.left_camera(step))
    }

    fn surface_point_in_site(&self, step: usize, pixel: Pixel) -> Option<Point3> {
        let site_from_rover = Self::true_site_from_rover(self, step)?;
        let ray = TruthSource::true_left_camera(self, step).ray(pixel)?;
        let ray_in_site = Ray { origin: site_from_rover * ray.origin, direction: site_from_rover * ray.direction };
        self.world()?.cast(&ray_in_site).map(|hit| hit.point)
    }

    fn is_visible(&self, step: usize, point_in_site: &Point3) -> bool {
        let (Some(world), Some(site_from_rover)) = (self.world(), Self::true_site_from_rover(self, step)) else {
            return true;
        };
        let centre = TruthSource::true_left_camera(self, step).model.centre();
        world.is_visible(&(site_from_rover * centre), point_in_site)
    }
}
