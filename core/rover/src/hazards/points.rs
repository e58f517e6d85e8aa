//! Range data of a stereo pair: the points of its dense stereo, computed on reduced images.
//!
//! Any pair that can be aligned is accepted: the hazcams (CAHVORE) or a wedge of the mast cameras. Two wedges give two
//! lists of points, which are added one after the other (R101).
//!
//! Frame: that of the cameras (rover), m.

use sightline_geometry::camera::Camera;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::{Pixel, Point3, Vector3};
use sightline_vision::image::GrayImage;
use sightline_vision::stereo::{Plane, dense_stereo_about};

use super::map::RangeNoise;
use super::settings::HazardSettings;
use crate::visual_odometry::reduce::Reduced;
use crate::visual_odometry::windows::Eye;

/// Error of the points of a stereo pair; `None` if the left camera has no ray at its centre.
pub(crate) fn range_noise(cameras: [&Camera; 2], settings: &HazardSettings) -> Option<RangeNoise> {
    let [left, right] = cameras;
    let centre = Pixel::new(0.5 * f64::from(left.size[0] - 1), 0.5 * f64::from(left.size[1] - 1));
    let focal_px = left.model.focal_length_px(centre)? / f64::from(reduction(left, settings));
    let baseline_m = (right.model.centre() - left.model.centre()).norm();
    let per_m = settings.disparity_sigma_px / (focal_px * baseline_m);
    Some(RangeNoise { camera_in_rover: left.model.centre(), per_m }).filter(|noise| noise.per_m.is_finite())
}

/// Factor by which the images are reduced before stereo.
fn reduction(left: &Camera, settings: &HazardSettings) -> u32 {
    left.size[0].div_ceil(settings.range_width_px).max(1)
}

/// The points of a stereo pair, rover frame, m, row by row of the left image, without those of the rover itself.
///
/// # Errors
/// As [`dense_stereo_about`].
pub fn range_points(
    images: [&GrayImage; 2],
    cameras: [&Camera; 2],
    settings: &HazardSettings,
    cancel: Cancel<'_>,
) -> Result<Vec<Point3>> {
    for (image, camera) in images.into_iter().zip(cameras) {
        if <[u32; 2]>::from(image.dimensions()) != camera.size {
            return Err(Error::Request("an image of the pair is not as large as its camera says".to_owned()));
        }
    }
    let factor = reduction(cameras[0], settings);
    let stereo = settings.stereo();
    // The ground under the rover if it were level.
    let ground = Plane { normal: Vector3::z(), distance_m: settings.ground_below_m };
    let dense = if factor == 1 {
        dense_stereo_about(images, cameras, &ground, &stereo, cancel)?
    } else {
        let [left, right] =
            [0, 1].map(|k| Reduced::new(Eye { camera: cameras[k], image: images[k] }, factor));
        dense_stereo_about(
            [&left.image, &right.image],
            [&left.camera, &right.camera],
            &ground,
            &stereo,
            cancel,
        )?
    };
    let found = dense.points_m.iter().filter(|point| point[0].is_finite());
    let is_own = |point: &Point3| {
        point.x.abs() < settings.own_half_length_m && point.y.abs() < settings.own_half_width_m
    };
    Ok(found.map(|point| Point3::from(point.map(f64::from))).filter(|point| !is_own(point)).collect())
}
