//! A simulated drive with faults at chosen stops: an image is missing, or both cameras are covered.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use sightline_geometry::camera::{Camera, CameraName, Mast, MastAngles};
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::{Pixel, Point3, Pose};
use sightline_geometry::odometry_error::OdometryError;
use sightline_geometry::stereo_geometry::StereoGeometry;
use sightline_recordings::{Traverse, create_simulated};
use sightline_rover::pipeline::Stops;
use sightline_track::stages::capture::StereoPair;
use sightline_vision::image::GrayImage;
use sightline_world::target_truth::TruthSource;
use sightline_world::{Scenario, choose_targets};

/// A simulated drive with faults.
pub struct FaultyDrive {
    /// The drive.
    pub traverse: Traverse,
    /// Stops whose left image is missing.
    pub missing: Vec<usize>,
    /// Stops at which both images are a uniform grey.
    pub covered: Vec<usize>,
    /// Targets by the scenario's rule, px of the first left image.
    pub targets: Vec<Pixel>,
}

impl FaultyDrive {
    /// Simulates the drive of a scenario in an empty folder.
    pub fn simulate(scenario: &Scenario, folder: &Path) -> Self {
        let traverse = create_simulated(scenario, folder).expect("the scenario makes a traverse");
        let world = traverse.world().expect("a simulated traverse has a world");
        let targets = choose_targets(world, scenario, traverse.index());
        Self { traverse, missing: Vec::new(), covered: Vec::new(), targets }
    }

    /// Simulates a drive of few stops and small images; rendering takes about a second per stop.
    pub fn short(folder: &Path) -> Self {
        Self::simulate(&short_scenario(), folder)
    }
}

/// The scenario of [`FaultyDrive::short`].
pub(crate) fn short_scenario() -> Scenario {
    let mut scenario = Scenario { name: "short approach".to_owned(), ..Scenario::default() };
    scenario.camera.image_size = 512;
    scenario.camera.samples_per_axis = 1;
    scenario.drive.start_distance_m = 6.0;
    scenario.drive.end_distance_m = 3.0;
    scenario.targets.count = 3;
    scenario.targets.depth_range_fraction = 0.2;
    scenario
}

impl Stops for FaultyDrive {
    fn stop_count(&self) -> usize {
        Stops::stop_count(&self.traverse)
    }
    fn time_s(&self, step: usize) -> f64 {
        Stops::time_s(&self.traverse, step)
    }
    fn site_from_rover(&self, step: usize) -> Pose {
        Stops::site_from_rover(&self.traverse, step)
    }
    fn cameras(&self, step: usize) -> (&Camera, &Camera) {
        Stops::cameras(&self.traverse, step)
    }
    fn mast(&self) -> Option<&Mast> {
        Stops::mast(&self.traverse)
    }
    fn mast_angles(&self, step: usize) -> Option<MastAngles> {
        Stops::mast_angles(&self.traverse, step)
    }
    fn odometry_error(&self) -> OdometryError {
        Stops::odometry_error(&self.traverse)
    }
    fn pointing_error_deg(&self) -> f64 {
        Stops::pointing_error_deg(&self.traverse)
    }
    fn stereo(&self) -> StereoGeometry {
        Stops::stereo(&self.traverse)
    }
    fn capture(&self, step: usize, cancel: Cancel<'_>) -> Result<StereoPair> {
        if self.missing.contains(&step) {
            let path = PathBuf::from(&self.traverse.index().stops[step].left.image);
            return Err(Error::Read { path, source: std::io::ErrorKind::NotFound.into() });
        }
        let mut pair = Stops::capture(&self.traverse, step, cancel)?;
        if self.covered.contains(&step) {
            let grey = |image: &GrayImage| {
                Arc::new(GrayImage::from_pixel(image.width(), image.height(), image::Luma([0.2])))
            };
            pair = StereoPair { left: grey(&pair.left), right: grey(&pair.right) };
        }
        Ok(pair)
    }
}

impl TruthSource for FaultyDrive {
    fn true_site_from_rover(&self, step: usize) -> Option<Pose> {
        TruthSource::true_site_from_rover(&self.traverse, step)
    }
    fn true_left_camera(&self, step: usize, camera: Option<CameraName>) -> Option<&Camera> {
        TruthSource::true_left_camera(&self.traverse, step, camera)
    }
    fn surface_point_in_site(&self, step: usize, camera: Option<CameraName>, pixel: Pixel) -> Option<Point3> {
        TruthSource::surface_point_in_site(&self.traverse, step, camera, pixel)
    }
    fn is_visible(&self, step: usize, camera: Option<CameraName>, point_in_site: &Point3) -> bool {
        TruthSource::is_visible(&self.traverse, step, camera, point_in_site)
    }
}
