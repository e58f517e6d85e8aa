//! A traverse as the input of the pipeline and of the comparison with the truth.
//!
//! The pipeline receives only estimates: poses, cameras and images. The truth is in a separate trait, so that no
//! stage can use it. A recorded traverse has at most true poses: it has no surface, and all its points count as visible.

use std::sync::atomic::AtomicBool;

use sightline_geometry::camera::{Camera, CameraName, Mast, MastAngles};
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::Result;
use sightline_geometry::frames::{Pixel, Point3, Pose};
use sightline_rover::pair::{self, FurtherCamera, FurtherImages, StopPair};
use sightline_rover::pipeline::Stops;
use sightline_rover::visual_odometry::MeasuredMotion;
use sightline_track::locate::store::Shared;
use sightline_track::stages::capture::StereoPair;
use sightline_track::target::Designation;
use sightline_world::scenario::FaultKind;
use sightline_world::target_truth::TruthSource;
use sightline_world::{Scenario, surface_point};

use super::Traverse;
use super::check::FurtherCameras;
use sightline_geometry::odometry_error::OdometryError;
use sightline_geometry::stereo_geometry::StereoGeometry;

/// Number of rays along each side of a window for measuring its shadow.
const SHADOW_SAMPLES: u32 = 9;

impl Stops for Traverse {
    fn stop_count(&self) -> usize {
        self.stop_count()
    }
    fn time_s(&self, step: usize) -> f64 {
        self.index().stops[step].time_s
    }
    fn site_from_rover(&self, step: usize) -> Pose {
        self.site_from_rover(step)
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
    fn measured_motion(&self, step: usize) -> Option<&MeasuredMotion> {
        self.index().stops[step].odometry.as_ref()
    }
    fn is_odometry_alone(&self, step: usize) -> bool {
        self.index().stops[step].odometry_alone
    }
    fn has_dropped_out(&self, step: usize) -> bool {
        let is_fault = |scenario: &Scenario| scenario.events.has_fault(FaultKind::CameraDropOut, step as u32);
        self.simulated.as_ref().is_some_and(|simulated| is_fault(&simulated.scenario))
    }
    fn mast_target(&self, step: usize) -> Option<Designation> {
        self.index().stops[step].mast_target
    }
    fn pointing_error_deg(&self) -> f64 {
        self.index().pointing_error_deg
    }
    fn stereo(&self) -> StereoGeometry {
        self.index().stereo
    }
    fn shared(&self, step: usize) -> Option<Shared<'_>> {
        self.stores.of(None).map(|store| Shared { store, stop: step })
    }
    fn capture(&self, step: usize, cancel: Cancel<'_>) -> Result<StereoPair> {
        match cancel.flag() {
            Some(flag) => self.capture_until(step, flag),
            None => self.capture(step),
        }
    }
    fn further_cameras(&self, step: usize) -> Vec<FurtherCamera<'_>> {
        self.further_cameras(step).collect()
    }
    fn images_at_hand(&self, step: usize, name: CameraName) -> Option<FurtherImages> {
        if !self.is_rendered(step, Some(name)) {
            return None;
        }
        let left = self.capture_one(step, Some(name), true).ok()?;
        Some((left, self.capture_one(step, Some(name), false).ok()))
    }
    fn further_pair(&self, step: usize, name: CameraName) -> Result<StopPair<'_>> {
        let mut cameras = self.further_cameras(step);
        let camera = cameras.find(|camera| camera.name == name).ok_or_else(|| pair::missing(step, name))?;
        Ok(StopPair {
            left: camera.left,
            right: camera.right.ok_or_else(|| pair::single(step, name))?,
            mast_angles: camera.mast_angles,
            shared: self.stores.of(Some(name)).map(|store| Shared { store, stop: step }),
        })
    }
    fn capture_further(&self, step: usize, name: CameraName, cancel: Cancel<'_>) -> Result<StereoPair> {
        let never = AtomicBool::new(false);
        self.capture_pair(step, Some(name), cancel.flag().unwrap_or(&never))
    }
}

impl Traverse {
    /// The true camera of a left image, at the true pose.
    fn true_left_in_site(&self, step: usize, camera: Option<CameraName>) -> Option<Camera> {
        let site_from_rover = self.true_site_from_rover(step)?;
        Some(TruthSource::true_left_camera(self, step, camera)?.moved(&site_from_rover))
    }
}

impl TruthSource for Traverse {
    fn prepare(&self, cancel: Cancel<'_>) -> Result<()> {
        self.simulated.as_ref().map_or(Ok(()), |simulated| simulated.world_until(cancel).map(drop))
    }
    fn true_site_from_rover(&self, step: usize) -> Option<Pose> {
        self.true_site_from_rover(step)
    }
    fn true_left_camera(&self, step: usize, camera: Option<CameraName>) -> Option<&Camera> {
        match camera {
            None => Some(self.true_left_camera(step)),
            Some(name) => self.cameras[step].named(name).map(FurtherCameras::true_left),
        }
    }
    fn surface_point_in_site(&self, step: usize, camera: Option<CameraName>, pixel: Pixel) -> Option<Point3> {
        surface_point(self.world()?, &self.true_left_in_site(step, camera)?, pixel)
    }
    fn is_visible(&self, step: usize, camera: Option<CameraName>, point_in_site: &Point3) -> bool {
        // The occluders of an event are present at some stops only.
        let at_stop = if self.has_occluders() { self.world_at(step).ok() } else { None };
        let (Some(world), Some(camera_in_site)) =
            (at_stop.as_ref().or_else(|| self.world()), self.true_left_in_site(step, camera))
        else {
            return true;
        };
        // The ray of the point's pixel starts at the entrance pupil, which is not C in a fisheye lens.
        let ray = camera_in_site.project(point_in_site).and_then(|pixel| camera_in_site.ray(pixel));
        ray.is_some_and(|ray| world.is_visible(&ray.origin, point_in_site))
    }
    fn shadow_share(
        &self,
        step: usize,
        camera: Option<CameraName>,
        centre: Pixel,
        size_px: u32,
    ) -> Option<f64> {
        let world = self.world_at(step).ok()?;
        let camera_in_site = self.true_left_in_site(step, camera)?;
        let half_px = f64::from(size_px / 2);
        let offset = |k: u32| half_px * (2.0 * f64::from(k) / f64::from(SHADOW_SAMPLES - 1) - 1.0);
        let places = (0..SHADOW_SAMPLES * SHADOW_SAMPLES)
            .map(|k| centre.offset(offset(k % SHADOW_SAMPLES), offset(k / SHADOW_SAMPLES)));
        let points: Vec<Point3> =
            places.filter_map(|pixel| surface_point(&world, &camera_in_site, pixel)).collect();
        let dark = points.iter().filter(|point| world.in_shadow(point)).count();
        (!points.is_empty()).then(|| dark as f64 / points.len() as f64)
    }
}
