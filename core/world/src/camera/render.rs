//! Rendering: from a camera in the site frame to its image, in two stages.
//!
//! **Clean radiance** ([`clean_radiance`]) follows from world, light and camera model alone:
//!
//! 1. `sampling.rs` averages the radiance over each pixel's area, for the requested pixels and a margin.
//! 2. The optics blur it (`optics.rs`; the margin is as wide as the kernel, so a region of an image has the
//!    same bits as the whole image has there).
//!
//! **Development** ([`develop`]) turns it into an image without rendering, so that exposure, detector and noise can be
//! changed, or noise redrawn, on stored radiance:
//!
//! 3. Flat field, exposure time, smear and dark current give electrons (`exposure.rs`).
//! 4. Response, noise, converter and quantisation give the recorded numbers (`noise.rs`).
//!
//! Steps 1 to 3 give the *clean* image ([`Rates::levels`]): the expectation of the recorded one without response, in
//! fractions of full scale.
//!
//! The fixed exposure is such that the mean of the first left image is `mean_level`, measured with 64 rays along each
//! side. Rows of tiles are shared between threads; every pixel is a function of its position alone, so the bits do not
//! depend on the number of threads.
//!
//! Units: radiance as in `light/reflection.rs`; levels are fractions of full scale (4095 DN); time in s.
//! Frame: the camera is given in the site frame. Sources: domain.md 11.3.

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use sightline_geometry::camera::Camera;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::Pixel;
use sightline_vision::image::GrayImage;

use crate::camera::exposure::{Rates, fixed_s};
use crate::camera::noise;
use crate::camera::optics::{FlatField, blur, gaussian};
use crate::camera::picture::{Eye, NoiseSeed, Region};
use crate::camera::rig::Rig;
use crate::camera::sampling::{Sampler, TILE_PX};
use crate::rover::drive;
use crate::scenario::{FULL_SCALE_DN, Scenario};
use crate::world::World;

/// Renders the image of a camera under the fixed exposure, with noise and quantisation.
pub fn render(world: &World, scenario: &Scenario, camera_in_site: &Camera, seed: NoiseSeed) -> GrayImage {
    let never = AtomicBool::new(false);
    let whole = Region::whole(camera_in_site);
    let radiance = clean_radiance(world, scenario, camera_in_site, whole, &never)
        .unwrap_or_else(|_| GrayImage::default());
    develop(&radiance, scenario, camera_in_site, fixed_s(world, scenario), seed)
}

/// Develops the recorded image from a whole image of clean radiance, without rendering.
///
/// `camera` is the one that the radiance was rendered for, in any frame; `time_s` is the exposure time, s.
pub fn develop(
    radiance: &GrayImage,
    scenario: &Scenario,
    camera: &Camera,
    time_s: f64,
    seed: NoiseSeed,
) -> GrayImage {
    develop_until(radiance, scenario, camera, time_s, seed, Cancel::default()).unwrap_or_default()
}

/// [`develop`], cancellable.
///
/// # Errors
/// [`Error::Cancelled`] soon after `cancel` is requested.
pub fn develop_until(
    radiance: &GrayImage,
    scenario: &Scenario,
    camera: &Camera,
    time_s: f64,
    seed: NoiseSeed,
    cancel: Cancel<'_>,
) -> Result<GrayImage> {
    let rates = Rates::new(radiance, scenario, camera, seed.eye, [0, 0]);
    cancel.check()?;
    noise::record(&rates, scenario, time_s, seed, [0, 0], cancel)
}

/// Radiance behind the optics in a region of an image, before exposure and detector; stops soon after `cancel` is set.
///
/// # Errors
/// [`Error::Cancelled`].
pub fn clean_radiance(
    world: &World,
    scenario: &Scenario,
    camera_in_site: &Camera,
    region: Region,
    cancel: &AtomicBool,
) -> Result<GrayImage> {
    let kernel = gaussian(scenario.camera.blur_px);
    let margin = kernel.len() / 2;
    let [width, height] = [region.width, region.height].map(|side| side as usize + 2 * margin);
    let first = [region.x, region.y].map(|at| i64::from(at) - margin as i64);
    let sampler = Sampler::new(world, camera_in_site, scenario.camera.samples_per_axis);
    let mut radiance = vec![0.0f32; width * height];
    radiance.par_chunks_mut(width * TILE_PX).enumerate().try_for_each(|(row, lines)| {
        let rows = lines.len() / width;
        let y0 = first[1] + (row * TILE_PX) as i64;
        for x in (0..width).step_by(TILE_PX) {
            if cancel.load(Ordering::Relaxed) {
                return Err(Error::Cancelled);
            }
            let columns = TILE_PX.min(width - x);
            let tile = sampler.tile(first[0] + x as i64, y0, columns, rows);
            for (line, values) in lines.chunks_mut(width).zip(tile.chunks(columns)) {
                line[x..x + columns].copy_from_slice(values);
            }
        }
        Ok(())
    })?;
    let blurred = blur(&radiance, [width, height], &kernel);
    Ok(GrayImage::from_raw(region.width, region.height, blurred).unwrap_or_default())
}

/// Fraction of full scale per unit of radiance that gives the first left image its mean level.
///
/// Returns 1 soon after `cancel` is requested.
pub(crate) fn exposure(world: &World, scenario: &Scenario, cancel: Cancel<'_>) -> f64 {
    exposure_of(world, scenario, &Rig::new(&scenario.camera), cancel)
}

/// [`exposure`] for the images of any rig mounted beside the main pair.
pub(crate) fn exposure_of(world: &World, scenario: &Scenario, rig: &Rig, cancel: Cancel<'_>) -> f64 {
    /// Rays along each side of the image.
    const SIDE: u32 = 64;
    let Ok(stop) = drive::first_stop(world, scenario, cancel) else { return 1.0 };
    let camera = rig.cameras_in_rover(stop.angles).0.moved(&stop.site_from_rover);
    let sampler = Sampler::new(world, &camera, 1);
    let flat = FlatField::new(scenario, &camera, Eye::Left);
    let middle = |k: u32, side: u32| ((2 * k + 1) * side) / (2 * SIDE);
    let mut sum = 0.0;
    for row in 0..SIDE {
        for column in 0..SIDE {
            if cancel.is_requested() {
                return 1.0;
            }
            let (x, y) = (middle(column, camera.width()), middle(row, camera.height()));
            let radiance = sampler.tile(i64::from(x), i64::from(y), 1, 1);
            sum += flat.at(x, y) * radiance.iter().copied().map(f64::from).sum::<f64>();
        }
    }
    let mean = sum / f64::from(SIDE * SIDE);
    let level = scenario.camera.mean_level - scenario.camera.bias_dn / FULL_SCALE_DN;
    if mean > 0.0 { level / mean } else { 1.0 }
}

/// Projects a point in the site frame into a camera; `None` if it is outside the image or occluded.
pub fn visible_pixel(
    world: &World,
    camera_in_site: &Camera,
    point: &sightline_geometry::frames::Point3,
) -> Option<Pixel> {
    let pixel = camera_in_site.project(point)?;
    let inside = pixel.is_inside(camera_in_site.width(), camera_in_site.height());
    let from = camera_in_site.ray(pixel)?.origin;
    (inside && world.is_visible(&from, point)).then_some(pixel)
}
