//! A drive as modified by a study: only some stops are visited, and the estimated pose may jump.
//!
//! Larger steps use the same images (R111): skipping n images at a time turns steps of 5 % into steps of 1 − 0.95^(n+1):
//! 9.75, 14.26, 18.55 and 22.62 %. The last stop is visited only if it is a multiple of the stride (E6).
//!
//! A jump rotates the rover's estimated attitude from one visited stop on, as if the estimator had diverged:
//! `site_from_rover' = site_from_rover · R_z(jump)`. Or it translates the estimated position sideways:
//! `site_from_rover · t_y(jump)`. Truth, cameras and images are unchanged.
//!
//! Steps of the staged drive are renumbered from 0; poses, cameras, images and truth are those of the drive.

use nalgebra::{Translation3, UnitQuaternion};

use crate::point::Visit;
use sightline_geometry::camera::{Camera, CameraName, Mast, MastAngles};
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::Result;
use sightline_geometry::frames::{Pixel, Point3, Pose, Vector3};
use sightline_geometry::odometry_error::OdometryError;
use sightline_geometry::stereo_geometry::StereoGeometry;
use sightline_rover::pair::{FurtherCamera, FurtherImages, StopPair};
use sightline_rover::pipeline::Stops;
use sightline_rover::visual_odometry::MeasuredMotion;
use sightline_session::track::Drive;
use sightline_track::locate::store::Shared;
use sightline_track::stages::capture::StereoPair;
use sightline_world::target_truth::TruthSource;

/// Some stops of a drive, in their order.
pub struct Staged<'a, D: Drive> {
    drive: &'a D,
    stops: Vec<usize>,
    jump: Option<(usize, Pose)>,
}

impl<'a, D: Drive> Staged<'a, D> {
    /// Visits the stops selected by `visit`.
    pub fn new(drive: &'a D, visit: Visit) -> Self {
        Self { drive, stops: visit.stops(drive.stop_count()), jump: None }
    }

    /// Adds a jump of the estimated heading by `yaw_rad` (clockwise seen from above) at a visited stop.
    #[must_use]
    pub(crate) fn with_heading_jump(self, step: usize, yaw_rad: f64) -> Self {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw_rad);
        Self { jump: Some((step, Pose::from_parts(Translation3::identity(), turn))), ..self }
    }

    /// Adds a jump of the estimated position by `across_m` to the right at the last stop but one.
    #[must_use]
    pub fn with_position_jump(self, across_m: f64) -> Self {
        let step = self.stops.len().saturating_sub(2);
        Self { jump: Some((step, Pose::translation(0.0, across_m, 0.0))), ..self }
    }
}

impl<D: Drive> Stops for Staged<'_, D> {
    fn stop_count(&self) -> usize {
        self.stops.len()
    }
    fn time_s(&self, step: usize) -> f64 {
        self.drive.time_s(self.stops[step])
    }
    fn site_from_rover(&self, step: usize) -> Pose {
        let site_from_rover = self.drive.site_from_rover(self.stops[step]);
        match self.jump {
            Some((from, jump)) if step >= from => site_from_rover * jump,
            _ => site_from_rover,
        }
    }
    fn cameras(&self, step: usize) -> (&Camera, &Camera) {
        self.drive.cameras(self.stops[step])
    }
    fn mast(&self) -> Option<&Mast> {
        self.drive.mast()
    }
    fn mast_angles(&self, step: usize) -> Option<MastAngles> {
        self.drive.mast_angles(self.stops[step])
    }
    fn odometry_error(&self) -> OdometryError {
        self.drive.odometry_error()
    }
    fn measured_motion(&self, step: usize) -> Option<&MeasuredMotion> {
        // The measured motion is from the previous stop, and does not include the jump.
        let is_next = step > 0 && self.stops[step] == self.stops[step - 1] + 1;
        let is_jump = self.jump.is_some_and(|(from, _)| from == step);
        self.drive.measured_motion(self.stops[step]).filter(|_| is_next && !is_jump)
    }
    fn is_odometry_alone(&self, step: usize) -> bool {
        self.drive.is_odometry_alone(self.stops[step])
    }
    fn pointing_error_deg(&self) -> f64 {
        self.drive.pointing_error_deg()
    }
    fn stereo(&self) -> StereoGeometry {
        self.drive.stereo()
    }
    fn shared(&self, step: usize) -> Option<Shared<'_>> {
        self.drive.shared(self.stops[step])
    }
    fn capture(&self, step: usize, cancel: Cancel<'_>) -> Result<StereoPair> {
        self.drive.capture(self.stops[step], cancel)
    }
    fn further_cameras(&self, step: usize) -> Vec<FurtherCamera<'_>> {
        self.drive.further_cameras(self.stops[step])
    }
    fn images_at_hand(&self, step: usize, name: CameraName) -> Option<FurtherImages> {
        self.drive.images_at_hand(self.stops[step], name)
    }
    fn further_pair(&self, step: usize, name: CameraName) -> Result<StopPair<'_>> {
        self.drive.further_pair(self.stops[step], name)
    }
    fn capture_further(&self, step: usize, name: CameraName, cancel: Cancel<'_>) -> Result<StereoPair> {
        self.drive.capture_further(self.stops[step], name, cancel)
    }
}

impl<D: Drive> TruthSource for Staged<'_, D> {
    fn prepare(&self, cancel: Cancel<'_>) -> Result<()> {
        self.drive.prepare(cancel)
    }
    fn true_site_from_rover(&self, step: usize) -> Option<Pose> {
        self.drive.true_site_from_rover(self.stops[step])
    }
    fn true_left_camera(&self, step: usize, camera: Option<CameraName>) -> Option<&Camera> {
        self.drive.true_left_camera(self.stops[step], camera)
    }
    fn surface_point_in_site(&self, step: usize, camera: Option<CameraName>, pixel: Pixel) -> Option<Point3> {
        self.drive.surface_point_in_site(self.stops[step], camera, pixel)
    }
    fn is_visible(&self, step: usize, camera: Option<CameraName>, point_in_site: &Point3) -> bool {
        self.drive.is_visible(self.stops[step], camera, point_in_site)
    }
    fn shadow_share(
        &self,
        step: usize,
        camera: Option<CameraName>,
        centre: Pixel,
        size_px: u32,
    ) -> Option<f64> {
        self.drive.shadow_share(self.stops[step], camera, centre, size_px)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sightline_testing::PlaneWorld;

    fn drive() -> PlaneWorld {
        PlaneWorld::new((0..7).map(|stop| Pose::translation(0.1 * f64::from(stop), 0.0, 0.0)).collect())
    }

    #[test]
    fn every_third_stop_of_seven_is_three_stops_and_the_last_is_met() {
        let drive = drive();
        let staged = Staged::new(&drive, Visit::Every(3));
        assert_eq!(staged.stop_count(), 3);
        for (step, stop) in [(0, 0), (1, 3), (2, 6)] {
            assert_eq!(staged.site_from_rover(step), drive.site_from_rover(stop));
            assert_eq!(staged.true_site_from_rover(step), drive.true_site_from_rover(stop));
        }
        // Every fourth stop omits the last one.
        assert_eq!(Staged::new(&drive, Visit::Every(4)).stop_count(), 2);
        assert_eq!(Staged::new(&drive, Visit::Every(0)).stop_count(), 7);
    }

    #[test]
    fn stops_that_are_left_out_are_stepped_over() {
        let drive = drive();
        let staged = Staged::new(&drive, Visit::LeavingOut { first: 2, count: 3 });
        assert_eq!(staged.stop_count(), 4);
        assert_eq!(staged.site_from_rover(2), drive.site_from_rover(5));
        assert_eq!(Staged::new(&drive, Visit::AllButLast).stop_count(), 6);
    }

    #[test]
    fn a_jump_turns_the_estimate_from_its_stop_on_and_leaves_the_truth() {
        let drive = drive();
        let staged = Staged::new(&drive, Visit::Every(1)).with_heading_jump(3, 0.1);
        let turned = |step: usize| staged.site_from_rover(step).rotation.angle();
        assert_eq!((turned(2), staged.true_site_from_rover(4)), (0.0, drive.true_site_from_rover(4)));
        assert!((turned(3) - 0.1).abs() < 1e-12 && (turned(6) - 0.1).abs() < 1e-12);
        assert_eq!(staged.site_from_rover(3).translation, drive.site_from_rover(3).translation);
    }

    #[test]
    fn a_jump_to_the_right_moves_the_last_two_estimates_by_it() {
        let drive = drive();
        let staged = Staged::new(&drive, Visit::Every(1)).with_position_jump(0.2);
        let moved = |step: usize| {
            staged.site_from_rover(step).translation.vector - drive.site_from_rover(step).translation.vector
        };
        assert_eq!((moved(4).norm(), staged.true_site_from_rover(5)), (0.0, drive.true_site_from_rover(5)));
        assert!((moved(5) - Vector3::new(0.0, 0.2, 0.0)).norm() < 1e-12 && (moved(6).y - 0.2).abs() < 1e-12);
    }
}
