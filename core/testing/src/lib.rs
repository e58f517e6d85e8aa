//! A test world with analytic grey values: a textured plane seen by two CAHV or CAHVOR cameras.
//!
//! The ground truth is exact and independent of the resampling and matching under test: a pixel's value is the texture
//! where the ray through its centre meets the plane. The shortest wavelength is six pixels, so no pixel aliases.

use std::sync::Arc;

use image::Luma;

use sightline_geometry::camera::{Cahv, Camera, CameraModel, CameraName, Mast, MastAngles};
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::{Pixel, Point3, Pose, Vector3};
use sightline_geometry::odometry_error::OdometryError;
use sightline_geometry::stereo_geometry::StereoGeometry;
use sightline_rover::pipeline::Stops;
use sightline_track::stages::capture::StereoPair;
use sightline_vision::image::GrayImage;
use sightline_world::target_truth::TruthSource;

/// A fault of the images at a stop.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Trouble {
    /// No fault.
    #[default]
    None,
    /// The image file is missing.
    Missing,
    /// Both cameras are covered: a constant grey.
    Covered,
}

/// A textured plane in the site frame, `x = const` unless tilted, in front of a rover that drives towards it.
pub struct PlaneWorld {
    /// The plane's normal, site frame; its texture is projected along the site's x axis.
    pub normal: Vector3,
    /// Intersection of the plane with the site's x axis, m.
    pub plane_x_m: f64,
    /// The true poses.
    pub true_poses: Vec<Pose>,
    /// The estimated poses.
    pub estimates: Vec<Pose>,
    /// The left camera in the rover frame.
    pub left: Camera,
    /// The right camera in the rover frame.
    pub right: Camera,
    /// Fault of each stop.
    pub troubles: Vec<Trouble>,
    /// Geometric relation of the two cameras.
    pub stereo: StereoGeometry,
}

impl PlaneWorld {
    /// A drive with exact pose estimates: `poses` are the true ones.
    pub fn new(poses: Vec<Pose>) -> Self {
        let eye = |y: f64| {
            let a = Vector3::x();
            let (h, v) = (Vector3::y() * 600.0 + a * 127.5, Vector3::z() * 600.0 + a * 127.5);
            let centre = Point3::new(0.3, y, -1.2);
            Camera::new(CameraModel::Cahv(Cahv::as_printed(centre, a, h, v)), 256, 256)
        };
        let troubles = vec![Trouble::None; poses.len()];
        Self {
            normal: Vector3::x(),
            plane_x_m: 8.0,
            estimates: poses.clone(),
            true_poses: poses,
            left: eye(-0.1),
            right: eye(0.1),
            troubles,
            stereo: StereoGeometry::Lateral,
        }
    }

    /// Intersection of a pixel's ray with the plane, site frame.
    pub fn plane_point(&self, step: usize, camera: &Camera, pixel: Pixel) -> Option<Point3> {
        let ray = camera.ray(pixel)?;
        let site_from_rover = &self.true_poses[step];
        let (origin, direction) = (site_from_rover * ray.origin, site_from_rover * ray.direction);
        let foot = Point3::new(self.plane_x_m, 0.0, 0.0);
        let distance_m = (foot - origin).dot(&self.normal) / direction.dot(&self.normal);
        (distance_m > 0.0).then(|| origin + direction * distance_m)
    }

    fn render(&self, step: usize, camera: &Camera) -> Arc<GrayImage> {
        let covered = self.troubles[step] == Trouble::Covered;
        Arc::new(GrayImage::from_fn(camera.width(), camera.height(), |x, y| {
            if covered {
                return Luma([0.4]);
            }
            let point = self.plane_point(step, camera, Pixel::new(f64::from(x), f64::from(y)));
            Luma([point.map_or(0.0, |point| texture(point.y, point.z)) as f32])
        }))
    }
}

/// Grey value of the plane at (y, z), m: a sum of waves of many lengths and directions, so it never repeats.
pub fn texture(y: f64, z: f64) -> f64 {
    let mut value = 0.5;
    for i in 0..16 {
        let i = f64::from(i);
        // Golden-angle directions and geometric wavelengths from 0.6 m down to 9 cm.
        let (direction, wavelength_m) = (i * 2.399_963, 0.6 * 0.88_f64.powf(i));
        let along = y * direction.cos() + z * direction.sin();
        value += 0.03 * (std::f64::consts::TAU * along / wavelength_m + i * i).sin();
    }
    value
}

impl Stops for PlaneWorld {
    fn stop_count(&self) -> usize {
        self.true_poses.len()
    }
    fn time_s(&self, step: usize) -> f64 {
        60.0 * step as f64
    }
    fn site_from_rover(&self, step: usize) -> Pose {
        self.estimates[step]
    }
    fn cameras(&self, _step: usize) -> (&Camera, &Camera) {
        (&self.left, &self.right)
    }
    fn mast(&self) -> Option<&Mast> {
        None
    }
    fn mast_angles(&self, _step: usize) -> Option<MastAngles> {
        None
    }
    fn odometry_error(&self) -> OdometryError {
        OdometryError::default()
    }
    fn pointing_error_deg(&self) -> f64 {
        0.0
    }
    fn stereo(&self) -> StereoGeometry {
        self.stereo
    }
    fn capture(&self, step: usize, _: Cancel<'_>) -> Result<StereoPair> {
        if self.troubles[step] == Trouble::Missing {
            return Err(Error::Request(format!("images/left_{step:04}.png is missing")));
        }
        Ok(StereoPair { left: self.render(step, &self.left), right: self.render(step, &self.right) })
    }
}

impl TruthSource for PlaneWorld {
    fn true_site_from_rover(&self, step: usize) -> Option<Pose> {
        self.true_poses.get(step).copied()
    }
    fn true_left_camera(&self, _step: usize, camera: Option<CameraName>) -> Option<&Camera> {
        camera.is_none().then_some(&self.left)
    }
    fn surface_point_in_site(
        &self,
        step: usize,
        _camera: Option<CameraName>,
        pixel: Pixel,
    ) -> Option<Point3> {
        self.plane_point(step, &self.left, pixel)
    }
    fn is_visible(&self, step: usize, _camera: Option<CameraName>, _point_in_site: &Point3) -> bool {
        self.troubles[step] != Trouble::Covered
    }
}
