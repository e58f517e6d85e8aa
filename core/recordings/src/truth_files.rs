//! The truth of every image of a simulated traverse, as NumPy files beside the images.
//!
//! For each stop and side, in the folder `truth`, with the stop's number as in the images' names (H rows, W columns):
//!
//! | file | array | content |
//! |---|---|---|
//! | `left_0000_range_m.npy` | H × W, `<f4` | distance along the pixel's ray from its origin, m; infinite for the sky |
//! | `left_0000_surface.npy` | H × W, `<i4` | 0 sky, 1 ground, 2 + n the rock n of the world, negative: artificial objects |
//! | `left_0000_normal.npy` | H × W × 3, `<f4` | outward unit normal in the site frame; zeros for the sky |
//! | `left_0000_shadow.npy` | H × W, `\|u1` | 1 in shadow, 0 in sunlight and for the sky |
//!
//! Artificial objects are −1000 − n for fiducials, −2000 − n for occluders, −3000 − n for the rover, with n the index
//! in the list of those present at that stop. A rock keeps its number during the whole drive.
//!
//! A pixel's truth is that of the ray through its centre (`world/src/truth.rs`), by the true camera at the true pose.
//! Both are in the index, `stops.truth`, where `left_camera` and `right_camera` are omitted if the tracker's cameras
//! are the true ones. The surface point of a pixel is `origin + range · direction` of its ray.
//!
//! Values are cast in `f64` and rounded to `f32` once, which is 0.5 µm at 10 m. A stop of 1024 × 1024 px takes 42 MiB.
//! Existing files are kept, so that an interrupted run continues where it stopped.
//!
//! Units: m. Frames: pixels, site. Sources: domain.md 2.3 (entrance pupil); the format is ours.

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use super::files::{resolve, write_atomically};
use super::native::Traverse;
use sightline_geometry::camera::Camera;
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::Pixel;
use sightline_vision::image::npy::encode_array;
use sightline_world::solids::SolidKind;
use sightline_world::truth::pixel_truth;
use sightline_world::{Eye, SurfaceId, World, true_camera_in_site};

/// The name of the folder with the truth within the folder of a traverse.
pub(crate) const TRUTH_FOLDER: &str = "truth";

/// The number of the sky in the file of surfaces.
pub(crate) const SKY: i32 = 0;

/// The truth of a pixel as stored in the files.
#[derive(Clone, Copy, Debug)]
struct PixelTruth {
    range_m: f32,
    surface: i32,
    normal: [f32; 3],
    shadow: u8,
}

/// The truth of a pixel without a surface.
const OF_SKY: PixelTruth = PixelTruth { range_m: f32::INFINITY, surface: SKY, normal: [0.0; 3], shadow: 0 };

/// The number of a surface in the files.
pub(crate) fn surface_number(surface: SurfaceId) -> i32 {
    let number = |n: u32| i32::try_from(n).unwrap_or(i32::MAX);
    match surface {
        SurfaceId::Ground => 1,
        SurfaceId::Rock(n) => number(n).saturating_add(2),
        SurfaceId::Solid(SolidKind::Fiducial, n) => (-1000i32).saturating_sub(number(n)),
        SurfaceId::Solid(SolidKind::Occluder, n) => (-2000i32).saturating_sub(number(n)),
        SurfaceId::Solid(SolidKind::Rover, n) => (-3000i32).saturating_sub(number(n)),
    }
}

impl Traverse {
    /// Writes the missing truth files of both images of a simulated stop.
    ///
    /// # Errors
    /// No such stop, a recorded traverse, files that cannot be written, or [`Error::Cancelled`] soon after `cancel`
    /// is set.
    pub fn write_truth(&self, step: usize, cancel: &AtomicBool) -> Result<()> {
        let stop = self.index().stops.get(step);
        let stop = stop.ok_or_else(|| Error::Request(format!("there is no step {step}")))?;
        let world = self.world_at(step)?;
        for (eye, name) in [(Eye::Left, "left"), (Eye::Right, "right")] {
            let path = |what: &str| {
                let file = format!("{TRUTH_FOLDER}/{name}_{step:04}_{what}.npy");
                resolve(self.folder(), &file).map_err(|problem| Error::format(self.folder(), problem))
            };
            let paths = ["range_m", "surface", "normal", "shadow"].map(path);
            let [range, surface, normal, shadow] = paths;
            let (range, surface, normal, shadow) = (range?, surface?, normal?, shadow?);
            if [&range, &surface, &normal, &shadow].iter().all(|path| path.exists()) {
                continue;
            }
            let camera = true_camera_in_site(stop, eye);
            let camera = camera.ok_or_else(|| Error::Request(format!("stops[{step}] has no true camera")))?;
            let pixels = of_picture(&world, &camera, cancel)?;
            let (width, height) = (camera.width(), camera.height());
            let size = [height, width];
            let of_range: Vec<f32> = pixels.iter().map(|pixel| pixel.range_m).collect();
            write_atomically(&range, &encode_array(&of_range, &size)?)?;
            let of_surface: Vec<i32> = pixels.iter().map(|pixel| pixel.surface).collect();
            write_atomically(&surface, &encode_array(&of_surface, &size)?)?;
            let of_normal: Vec<f32> = pixels.iter().flat_map(|pixel| pixel.normal).collect();
            write_atomically(&normal, &encode_array(&of_normal, &[height, width, 3])?)?;
            let of_shadow: Vec<u8> = pixels.iter().map(|pixel| pixel.shadow).collect();
            write_atomically(&shadow, &encode_array(&of_shadow, &size)?)?;
        }
        Ok(())
    }
}

/// The truth of every pixel, row by row.
fn of_picture(world: &World, camera_in_site: &Camera, cancel: &AtomicBool) -> Result<Vec<PixelTruth>> {
    let width = camera_in_site.width() as usize;
    let mut pixels = vec![OF_SKY; width * camera_in_site.height() as usize];
    pixels.par_chunks_mut(width.max(1)).enumerate().try_for_each(|(y, row)| {
        if cancel.load(Ordering::Relaxed) {
            return Err(Error::Cancelled);
        }
        for (x, truth) in row.iter_mut().enumerate() {
            *truth = of_pixel(world, camera_in_site, Pixel::new(x as f64, y as f64));
        }
        Ok(())
    })?;
    Ok(pixels)
}

fn of_pixel(world: &World, camera_in_site: &Camera, pixel: Pixel) -> PixelTruth {
    pixel_truth(world, camera_in_site, pixel).map_or(OF_SKY, |hit| PixelTruth {
        range_m: hit.distance_m as f32,
        surface: surface_number(hit.surface),
        normal: [hit.normal.x, hit.normal.y, hit.normal.z].map(|v| v as f32),
        shadow: u8::from(world.in_shadow(&hit.point)),
    })
}

#[cfg(test)]
#[path = "truth_files_tests.rs"]
mod tests;
