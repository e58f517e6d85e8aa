//! A drive of which only some stops are visited: larger steps over the same images (R111).
//!
//! Skipping n images at a time turns steps of 5 % into steps of 1 − 0.95^(n+1): 9.75, 14.26, 18.55 and 22.62 %.
//! The last stop is visited only where the stride meets it (E6).
//!
//! Steps of the shorter drive are numbered from 0 anew; poses, cameras, images and truth are those of the drive.

use crate::camera::{Camera, Mast, MastAngles};
use crate::error::Result;
use crate::frames::{Pixel, Point3, Pose};
use crate::pipeline::Stops;
use crate::session::track::Drive;
use crate::stages::capture::StereoPair;
use crate::study::truth::TruthSource;
use crate::traverse::{OdometryError, StereoGeometry};

/// Every n-th stop of a drive, from the first on.
pub struct Skipping<'a, D: Drive> {
    drive: &'a D,
    stride: usize,
}

impl<'a, D: Drive> Skipping<'a, D> {
    /// Visits every `stride`-th stop; 1 visits all, and 0 counts as 1.
    pub fn new(drive: &'a D, stride: usize) -> Self {
        Self { drive, stride: stride.max(1) }
    }
}

impl<D: Drive> Stops for Skipping<'_, D> {
    fn stop_count(&self) -> usize {
        self.drive.stop_count().div_ceil(self.stride)
    }
    fn time_s(&self, step: usize) -> f64 {
        self.drive.time_s(step * self.stride)
    }
    fn site_from_rover(&self, step: usize) -> Pose {
        self.drive.site_from_rover(step * self.stride)
    }
    fn cameras(&self, step: usize) -> (&Camera, &Camera) {
        self.drive.cameras(step * self.stride)
    }
    fn mast(&self) -> Option<&Mast> {
        self.drive.mast()
    }
    fn mast_angles(&self, step: usize) -> Option<MastAngles> {
        self.drive.mast_angles(step * self.stride)
    }
    fn odometry_error(&self) -> OdometryError {
        self.drive.odometry_error()
    }
    fn stereo(&self) -> StereoGeometry {
        self.drive.stereo()
    }
    fn capture(&self, step: usize) -> Result<StereoPair> {
        self.drive.capture(step * self.stride)
    }
}

impl<D: Drive> TruthSource for Skipping<'_, D> {
    fn true_site_from_rover(&self, step: usize) -> Option<Pose> {
        self.drive.true_site_from_rover(step * self.stride)
    }
    fn true_left_camera(&self, step: usize) -> &Camera {
        self.drive.true_left_camera(step * self.stride)
    }
    fn surface_point_in_site(&self, step: usize, pixel: Pixel) -> Option<Point3> {
        self.drive.surface_point_in_site(step * self.stride, pixel)
    }
    fn is_visible(&self, step: usize, point_in_site: &Point3) -> bool {
        self.drive.is_visible(step * self.stride, point_in_site)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::PlaneWorld;

    #[test]
    fn every_third_stop_of_seven_is_three_stops_and_the_last_is_met() {
        let poses = (0..7).map(|stop| Pose::translation(0.1 * f64::from(stop), 0.0, 0.0)).collect();
        let drive = PlaneWorld::new(poses);
        let skipping = Skipping::new(&drive, 3);
        assert_eq!(skipping.stop_count(), 3);
        for (step, stop) in [(0, 0), (1, 3), (2, 6)] {
            assert_eq!(skipping.site_from_rover(step), drive.site_from_rover(stop));
            assert_eq!(skipping.true_site_from_rover(step), drive.true_site_from_rover(stop));
        }
        // Every fourth stop passes the last one by.
        assert_eq!(Skipping::new(&drive, 4).stop_count(), 2);
        assert_eq!(Skipping::new(&drive, 0).stop_count(), 7);
    }
}
