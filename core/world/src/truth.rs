//! The truth of a picture: ranges, surfaces and normals of every pixel, and where any point of the site appears.
//!
//! A pixel's truth is that of the ray through its centre, by the camera model itself. The range is the distance
//! along that ray from where the ray starts (for a fisheye: the entrance pupil of that ray), so that the
//! surface point is `origin + range · direction`.
//!
//! A point is *visible* when it lies in the picture and nothing stands between it and the origin of its pixel's
//! ray; whether it is lit is told beside that, since a tracker can lose a point to either.
//!
//! Frames: site, m; pixels of the picture. Sources: domain.md 2.3 (entrance pupil).

use rayon::prelude::*;

use crate::world::{Hit, SurfaceId, World};
use sightline_geometry::camera::Camera;
use sightline_geometry::frames::{Pixel, Point3};

/// The truth of every pixel of a picture, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureTruth {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Distance along the pixel's ray, m; infinite for the sky.
    pub range_m: Vec<f64>,
    /// What is seen; nothing for the sky.
    pub surface: Vec<Option<SurfaceId>>,
    /// Outward unit normal in the site frame; zero for the sky.
    pub normal: Vec<[f32; 3]>,
}

/// Where a point of the site appears in a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Visibility {
    /// It is seen.
    Visible {
        /// Where, px.
        pixel: Pixel,
        /// Whether the sun reaches it.
        is_lit: bool,
    },
    /// Something stands before it.
    Occluded {
        /// Where it would be seen, px.
        pixel: Pixel,
        /// What stands before it.
        by: SurfaceId,
    },
    /// It lies beside the picture, or behind the camera.
    OutOfFrame,
}

/// The truth of every pixel of a camera that stands in the site.
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

/// The surface that a position of a picture shows, px; nothing for the sky or where the model has no ray.
pub fn pixel_truth(world: &World, camera_in_site: &Camera, pixel: Pixel) -> Option<Hit> {
    world.cast(&camera_in_site.ray(pixel)?)
}

/// Where a point of a surface appears in a camera that stands in the site.
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
