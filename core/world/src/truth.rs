//! Ground truth of an image: range, surface and normal of every pixel, and the projection of any point of the site.
//!
//! A pixel's truth is that of the ray through its centre, by the camera model itself. The range is the distance along that
//! ray from its origin (for a fisheye: the entrance pupil of that ray), so that the surface point is
//! `origin + range · direction`.
//!
//! A point is *visible* when it projects into the image and nothing occludes it from the origin of its pixel's ray.
//! Whether it is lit is reported separately, since a tracker can lose a point for either reason.
//!
//! Frames: site, m; pixels of the image. Sources: domain.md 2.3 (entrance pupil).

use rayon::prelude::*;

use crate::world::{Hit, SurfaceId, World};
use sightline_geometry::camera::Camera;
use sightline_geometry::frames::{Pixel, Point3};

/// Ground truth of every pixel of an image, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureTruth {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Distance along the pixel's ray, m; infinite for the sky.
    pub range_m: Vec<f64>,
    /// Surface seen; `None` for the sky.
    pub surface: Vec<Option<SurfaceId>>,
    /// Outward unit normal in the site frame; zero for the sky.
    pub normal: Vec<[f32; 3]>,
}

/// Where a point of the site projects in an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Visibility {
    /// Inside the image and not occluded.
    Visible {
        /// Its projection, px.
        pixel: Pixel,
        /// Whether the sun reaches it.
        is_lit: bool,
    },
    /// Inside the image, but occluded.
    Occluded {
        /// Its projection, px.
        pixel: Pixel,
        /// The occluding surface.
        by: SurfaceId,
    },
    /// Outside the image, or behind the camera.
    OutOfFrame,
}

/// Computes the ground truth of every pixel of a camera in the site frame.
pub fn picture_truth(world: &World, camera_in_site: &Camera) -> PictureTruth {
    let (width, height) = (camera_in_site.width(), camera_in_site.height());
    let of_row =
        |y: u32| (0..width).map(move |x| pixel_truth(world, camera_in_site, Pixel::new(x.into(), y.into())));
    let hits: Vec<Option<Hit>> = (0..height).into_par_iter().flat_map_iter(of_row).collect();
    let normal = |hit: &Hit| [hit.normal.x, hit.normal.y, hit.normal.z].map(|v| v as f32);
    PictureTruth {
        width,
        height,
        range_m: hits.iter().map(|hit| hit.map_or(f64::INFINITY, |hit| hit.distance_m)).collect(),
        surface: hits.iter().map(|hit| hit.map(|hit| hit.surface)).collect(),
        normal: hits.iter().map(|hit| hit.as_ref().map_or([0.0; 3], normal)).collect(),
    }
}

/// The surface seen at a pixel position, px; `None` for the sky or where the model has no ray.
pub fn pixel_truth(world: &World, camera_in_site: &Camera, pixel: Pixel) -> Option<Hit> {
    world.cast(&camera_in_site.ray(pixel)?)
}

/// Projects a surface point into a camera in the site frame and tests occlusion and shadow.
pub fn visibility(world: &World, camera_in_site: &Camera, point_in_site: &Point3) -> Visibility {
    let seen = camera_in_site
        .project(point_in_site)
        .filter(|pixel| pixel.is_inside(camera_in_site.width(), camera_in_site.height()));
    let Some((pixel, ray)) = seen.and_then(|pixel| Some((pixel, camera_in_site.ray(pixel)?))) else {
        return Visibility::OutOfFrame;
    };
    match world.in_the_way(&ray.origin, point_in_site) {
        Some(by) => Visibility::Occluded { pixel, by },
        None => Visibility::Visible { pixel, is_lit: !world.in_shadow(point_in_site) },
    }
}
