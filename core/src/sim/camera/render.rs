//! Rendering: from a camera in the site to the picture that it takes.
//!
//! 1. `sampling.rs` averages the radiance over each pixel's area, for the pixels asked for and a margin.
//! 2. The optics blur it by a Gaussian of σ = `blur_px` (kernel cut at 4σ, sum 1; the margin is as wide, so
//!    a region of a picture has the same bits as the whole picture has there).
//! 3. The exposure scales radiance to the detector: `level = bias/4095 + exposure · radiance`, at most 1.
//!    This is the *clean* picture: the expectation of the recorded one, in fractions of full scale.
//! 4. `noise.rs` draws the noise and quantises.
//!
//! The exposure is fixed for a world: such that the mean of the first left picture is `mean_level`, taken
//! on 64 × 64 rays. Rows of tiles are shared between threads; every pixel is a function of its place alone,
//! so the bits do not depend on the number of threads.
//!
//! Units: pixel values are fractions of full scale (4095 DN). Frame: the camera is given in the site frame.
//! Sources: domain.md 11.3.

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use crate::camera::Camera;
use crate::error::{Error, Result};
use crate::frames::Pixel;
use crate::image::GrayImage;

use crate::sim::camera::noise;
use crate::sim::camera::sampling::{Sampler, TILE_PX};
use crate::sim::rover::drive;
use crate::sim::scenario::Scenario;
use crate::sim::world::World;

/// Which camera of the pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Eye {
    /// The left camera.
    Left,
    /// The right camera.
    Right,
}

/// Whose noise it is: two pictures with the same seed have the same noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct NoiseSeed {
    /// The stop, or any other number that tells one exposure from the next.
    pub step: u32,
    /// The camera, which has its own pixel response.
    pub eye: Eye,
}

/// A rectangle of a picture, px.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    /// First column.
    pub x: u32,
    /// First row.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl Region {
    /// The whole picture of a camera.
    pub fn whole(camera: &Camera) -> Self {
        Self { x: 0, y: 0, width: camera.width(), height: camera.height() }
    }
}

/// The picture that a camera takes, with noise and quantisation.
pub fn render(world: &World, scenario: &Scenario, camera_in_site: &Camera, seed: NoiseSeed) -> GrayImage {
    let clean = render_clean(world, scenario, camera_in_site);
    noise::expose(&clean, scenario, seed, [0, 0])
}

/// The noise-free picture: the expectation of the recorded one.
pub fn render_clean(world: &World, scenario: &Scenario, camera_in_site: &Camera) -> GrayImage {
    let never = AtomicBool::new(false);
    render_region(world, scenario, camera_in_site, Region::whole(camera_in_site), &never).unwrap_or_default()
}

/// A part of the noise-free picture; stops soon after `cancel` is set.
pub fn render_region(
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
    let bias = (scenario.camera.bias_dn / noise::FULL_SCALE_DN) as f32;
    let exposure = world.exposure as f32;
    let levels = blurred.into_iter().map(|radiance| (bias + exposure * radiance).min(1.0)).collect();
    Ok(GrayImage::from_raw(region.width, region.height, levels).unwrap_or_default())
}

/// A Gaussian of σ `sigma_px`, cut at 4σ, with the sum 1.
fn gaussian(sigma_px: f64) -> Vec<f32> {
    let reach = (4.0 * sigma_px).ceil() as i32;
    let value = |k: i32| if sigma_px > 0.0 { (-0.5 * (f64::from(k) / sigma_px).powi(2)).exp() } else { 1.0 };
    let values: Vec<f64> = (-reach..=reach).map(value).collect();
    let sum: f64 = values.iter().sum();
    values.into_iter().map(|v| (v / sum) as f32).collect()
}

/// Convolves rows, then columns, keeping only where the whole kernel fits.
fn blur(values: &[f32], [width, height]: [usize; 2], kernel: &[f32]) -> Vec<f32> {
    let lost = kernel.len() - 1;
    let (inner_width, inner_height) = (width - lost, height - lost);
    let mut along_rows = vec![0.0f32; inner_width * height];
    for (line, out) in values.chunks(width).zip(along_rows.chunks_mut(inner_width)) {
        for (k, weight) in kernel.iter().enumerate() {
            out.iter_mut().zip(&line[k..]).for_each(|(sum, value)| *sum += weight * value);
        }
    }
    let mut blurred = vec![0.0f32; inner_width * inner_height];
    for (y, out) in blurred.chunks_mut(inner_width).enumerate() {
        for (k, weight) in kernel.iter().enumerate() {
            let line = &along_rows[(y + k) * inner_width..(y + k + 1) * inner_width];
            out.iter_mut().zip(line).for_each(|(sum, value)| *sum += weight * value);
        }
    }
    blurred
}

/// Fraction of full scale per unit of radiance that gives the first left picture its mean level.
pub(in crate::sim) fn exposure(world: &World, scenario: &Scenario) -> f64 {
    /// Rays along each side of the picture.
    const SIDE: u32 = 64;
    let mast = drive::mast(scenario);
    let Ok(stop) = drive::first_stop(world, scenario) else { return 1.0 };
    let camera = mast.cameras_in_rover(stop.angles).0.moved(&stop.site_from_rover);
    let sampler = Sampler::new(world, &camera, 1);
    let stride = (camera.width() / SIDE).max(1);
    let mut sum = 0.0;
    for row in 0..SIDE {
        for column in 0..SIDE {
            let [x, y] = [column, row].map(|k| i64::from(k * stride + stride / 2));
            sum += sampler.tile(x, y, 1, 1).iter().copied().map(f64::from).sum::<f64>();
        }
    }
    let mean = sum / f64::from(SIDE * SIDE);
    let level = scenario.camera.mean_level - scenario.camera.bias_dn / noise::FULL_SCALE_DN;
    if mean > 0.0 { level / mean } else { 1.0 }
}

/// Where a point of the site appears in a camera, if it is in the picture and nothing hides it.
pub fn visible_pixel(world: &World, camera_in_site: &Camera, point: &crate::frames::Point3) -> Option<Pixel> {
    let pixel = camera_in_site.project(point)?;
    let inside = pixel.is_inside(camera_in_site.width(), camera_in_site.height());
    let from = camera_in_site.ray(pixel)?.origin;
    (inside && world.is_visible(&from, point)).then_some(pixel)
}
