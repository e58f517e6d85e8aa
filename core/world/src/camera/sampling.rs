//! Sampling: rays through the pixels of a tile, and the surface that each ray meets; `shading.rs` computes the radiance.
//!
//! A pixel is the mean over its area, sampled at n × n positions of a slightly rotated grid: sample (i, j) is at x = (i +
//! (j + ½)/n)/n, y = (j + 1 − (i + ½)/n)/n of the pixel. All n² columns and rows are distinct, and x and y are
//! uncorrelated, so the pixel is no wider along one diagonal than along the other. Rays at the corners of pixels come from
//! the true camera model, those between are interpolated (`pixel_rays.rs`).
//!
//! Texture that the samples cannot resolve is left out: with the footprint p = distance · rad per pixel, an octave shorter
//! than c = max(2p/n, 2p/(n² μ)) gets no weight (μ is the cosine of emission: on ground seen at a grazing angle the pixel
//! is long, but all n² rows of samples are spread along its length).
//!
//! Tiles list the rocks that their cone of rays can meet, the nearest first (`culling.rs`). [`LANES`] rays are cast at
//! once: those of one pixel, or of a block of neighbouring pixels with fewer samples. Every sample is a function of its
//! own pixel alone, so the image does not depend on tiles, blocks or threads.
//!
//! | symbol | name | unit, frame |
//! |---|---|---|
//! | n | `samples_per_axis` | – |
//! | p | `footprint_m` | m |
//! | μ | `emission` | – |
//!
//! Frame: site. Sources: domain.md 11.3.

use pulp::{Arch, Simd, WithSimd};

use sightline_geometry::camera::Camera;
use sightline_geometry::frames::{Ray, Vector3};

use crate::camera::pixel_rays::{Block, Corners, between};
use crate::camera::shading::Seen;
use crate::culling::{Cone, in_cone};
use crate::ground::packet_cast::{Lanes, RayLanes};
use crate::ground::rocks::Rock;
use crate::ground::texture::LANES;
use crate::world::World;

/// Side of a tile, px.
pub(crate) const TILE_PX: usize = 16;

/// The image to sample: a camera, and the positions of the samples within a pixel.
pub(crate) struct Sampler<'a> {
    world: &'a World,
    camera: &'a Camera,
    samples_per_axis: usize,
    /// Positions of the samples within a pixel, 0 to 1.
    offsets: Vec<[f64; 2]>,
    rad_per_px: f64,
    axis: Vector3,
    /// Unit normal of the mean ground, site frame.
    mean_normal: Vector3,
}

impl<'a> Sampler<'a> {
    /// Prepares to sample images of a camera in the site frame.
    pub(crate) fn new(world: &'a World, camera_in_site: &'a Camera, samples_per_axis: u32) -> Self {
        let n = samples_per_axis.max(1) as usize;
        let middle = camera_in_site.centre_pixel();
        let rays = [camera_in_site.ray(middle), camera_in_site.ray(middle.offset(1.0, 0.0))];
        let rad_per_px = match rays {
            [Some(a), Some(b)] => (a.direction - b.direction).norm(),
            _ => 1e-3,
        };
        let offsets = offsets(n);
        let axis = camera_in_site.model.axis();
        let mean_normal = world.scenery.terrain.mean_normal();
        Self { world, camera: camera_in_site, samples_per_axis: n, offsets, rad_per_px, axis, mean_normal }
    }

    /// Radiances of the tile whose first pixel is (`x0`, `y0`), `width` × `height` px, row by row.
    pub(crate) fn tile(&self, x0: i64, y0: i64, width: usize, height: usize) -> Vec<f32> {
        Arch::new().dispatch(Tile { sampler: self, first: [x0, y0], size: [width, height] })
    }

    #[inline(always)]
    fn sample_tile(&self, [x0, y0]: [i64; 2], [width, height]: [usize; 2]) -> Vec<f32> {
        let corners = Corners::new(self.camera, &self.axis, [x0, y0], [width, height]);
        let rocks = self.rocks_in_view(&corners, height);
        let count = self.offsets.len();
        let mut seen = Seen::new(width * height * count);
        match self.samples_per_axis {
            1 => self.blocks::<16>(&corners, height, &rocks, &mut seen),
            2 => self.blocks::<4>(&corners, height, &rocks, &mut seen),
            _ => self.blocks::<1>(&corners, height, &rocks, &mut seen),
        }
        let of_pixels = seen.radiances(self.world).chunks(count);
        of_pixels.map(|samples| samples.iter().sum::<f32>() / count as f32).collect()
    }

    /// The rocks that any ray of the tile can meet, the nearest first, with their smallest distance, m.
    fn rocks_in_view(&self, corners: &Corners, height: usize) -> Vec<(f64, usize)> {
        // A tile's edge can bulge beyond its corners by far less than this margin of one pixel.
        let margin_rad = self.rad_per_px * if corners.width.max(height) > 1 { 1.0 } else { 2.0 };
        let Some(cone) = Cone::around(corners.rays.iter().flatten(), margin_rad) else { return Vec::new() };
        let (scenery, mut list) = (&self.world.scenery, Vec::new());
        scenery.tree.in_cone(&cone, |index| {
            let rock = &scenery.rocks[index];
            if in_cone(&cone, &rock.centre, rock.radius_m) {
                let least_m = (rock.centre - cone.apex).norm() - rock.radius_m - cone.apex_radius_m;
                list.push((least_m, index));
            }
        });
        list.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        list
    }

    /// Records the hits of a tile's samples, in square blocks of `PIXELS` pixels.
    #[inline(always)]
    fn blocks<const PIXELS: usize>(
        &self,
        corners: &Corners,
        height: usize,
        rocks: &[(f64, usize)],
        seen: &mut Seen,
    ) {
        let side = PIXELS.isqrt();
        for y in (0..height).step_by(side) {
            for x in (0..corners.width).step_by(side) {
                let size = [side.min(corners.width - x), side.min(height - y)];
                let block = Block { first: [x, y], size };
                if self.block::<PIXELS>(corners, &block, rocks, seen) {
                    continue;
                }
                for first in block.pixels().filter(|_| PIXELS > 1) {
                    self.block::<1>(corners, &Block { first, size: [1, 1] }, rocks, seen);
                }
            }
        }
    }

    /// Records the hits of the samples of a block of at most `PIXELS` pixels. Returns false, without recording, if the
    /// camera model has no ray or if the rays of several pixels are too far apart on the ground to be cast at once.
    #[inline(always)]
    fn block<const PIXELS: usize>(
        &self,
        corners: &Corners,
        block: &Block,
        rocks: &[(f64, usize)],
        seen: &mut Seen,
    ) -> bool {
        let Some(cone) = corners.cone(block) else { return false };
        let (scenery, count) = (&*self.world.scenery, self.offsets.len());
        let clear_m = scenery.terrain.clear_m(&cone);
        if PIXELS > 1 && clear_m.is_finite() && !scenery.terrain.is_narrow(&cone, clear_m) {
            return false;
        }
        let meets = |(_, index): &&(f64, usize)| {
            in_cone(&cone, &scenery.rocks[*index].centre, scenery.rocks[*index].radius_m)
        };
        seen.rocks_in_view.clear();
        seen.rocks_in_view.extend(rocks.iter().filter(meets));
        // A block with fewer pixels repeats its first pixel.
        let mut of_pixels = [corners.of_pixel(block.first); PIXELS];
        for (rays, pixel) in of_pixels.iter_mut().zip(block.pixels()).skip(1) {
            *rays = corners.of_pixel(pixel);
        }
        let lanes = LANES / PIXELS;
        for (chunk, offsets) in self.offsets.chunks(lanes).enumerate() {
            let rays = between(&of_pixels, offsets);
            let (nearest_m, met) = self.rocks_met(&rays, &cone, &seen.rocks_in_view);
            let ground_m = scenery.terrain.cast_lanes(&rays, &cone, clear_m, &nearest_m);
            for (pixel, [x, y]) in block.pixels().enumerate() {
                let first = (y * corners.width + x) * count + chunk * lanes;
                for sample in 0..offsets.len() {
                    let lane = pixel * lanes + sample;
                    let rock = met[lane].map(|met| (nearest_m[lane], met));
                    self.note(first + sample, &rays.ray(lane), ground_m[lane], rock, seen);
                }
            }
        }
        true
    }

    /// The nearest rock and its plane on each ray, with its distance, m; infinite without a rock.
    #[inline(always)]
    fn rocks_met(
        &self,
        rays: &RayLanes,
        cone: &Cone,
        rocks: &[(f64, usize)],
    ) -> (Lanes, [Option<(usize, usize)>; LANES]) {
        let (mut nearest_m, mut met) = ([f64::INFINITY; LANES], [None; LANES]);
        for &(least_m, index) in rocks {
            if nearest_m.iter().all(|m| least_m > *m) {
                break;
            }
            let rock = &self.world.scenery.rocks[index];
            let (enter_m, planes) = if cone.apex_radius_m == 0.0 {
                rock.enter_lanes(&cone.apex, &rays.direction)
            } else {
                enter_one_by_one(rock, rays)
            };
            for lane in 0..LANES {
                if enter_m[lane] < nearest_m[lane] {
                    (nearest_m[lane], met[lane]) = (enter_m[lane], Some((index, planes[lane])));
                }
            }
        }
        (nearest_m, met)
    }

    /// Records the hit of a sample's ray: the ground at `ground_m`, m, if finite, a rock, an artificial object, or the
    /// sky.
    #[inline(always)]
    fn note(
        &self,
        sample: usize,
        ray: &Ray,
        ground_m: f64,
        rock: Option<(f64, (usize, usize))>,
        seen: &mut Seen,
    ) {
        let (world, scenery) = (self.world, &*self.world.scenery);
        let is_ground = ground_m < f64::INFINITY;
        let nearest_m = if is_ground { ground_m } else { rock.map_or(f64::INFINITY, |(rock_m, _)| rock_m) };
        if !world.solids.is_empty()
            && let Some((solid, distance_m, normal)) = world.solid_on(ray, nearest_m)
        {
            seen.solid(world, sample, ray, distance_m, (solid, &normal));
        } else if is_ground {
            let emission = -self.mean_normal.dot(&ray.direction);
            seen.ground(sample, ray, ground_m, self.cutoff_m(ground_m, emission));
        } else if let Some((rock_m, (rock, plane))) = rock {
            let emission = -scenery.rocks[rock].normal(plane).dot(&ray.direction);
            seen.rock(sample, ray, rock_m, self.cutoff_m(rock_m, emission), (rock, plane));
        } else {
            seen.sky(world, sample, ray);
        }
    }

    /// The shortest wavelength that the samples resolve at a distance, for a cosine of emission, m.
    #[inline(always)]
    fn cutoff_m(&self, distance_m: f64, emission: f64) -> f32 {
        let footprint_m = distance_m * self.rad_per_px;
        let n = self.samples_per_axis as f64;
        (2.0 * footprint_m / n * f64::max(1.0, 1.0 / (n * emission.max(0.01)))) as f32
    }
}

/// Positions of n × n samples within a pixel, 0 to 1 (header).
fn offsets(n: usize) -> Vec<[f64; 2]> {
    let place = |whole: usize, part: f64| (whole as f64 + part) / n as f64;
    let part = |k: usize| (k as f64 + 0.5) / n as f64;
    (0..n * n).map(|k| [place(k % n, part(k / n)), place(k / n, 1.0 - part(k % n))]).collect()
}

/// [`Rock::enter_lanes`] for rays whose origins differ.
fn enter_one_by_one(rock: &Rock, rays: &RayLanes) -> (Lanes, [usize; LANES]) {
    let (mut enter_m, mut planes) = ([f64::INFINITY; LANES], [0; LANES]);
    for lane in 0..LANES {
        if let Some(interval) = rock.interval(&rays.ray(lane)).filter(|interval| interval.enter_m > 0.0) {
            (enter_m[lane], planes[lane]) = (interval.enter_m, interval.plane);
        }
    }
    (enter_m, planes)
}

/// A tile of an image, sampled with the widest vectors that the processor has.
struct Tile<'a, 's> {
    sampler: &'s Sampler<'a>,
    first: [i64; 2],
    size: [usize; 2],
}

impl WithSimd for Tile<'_, '_> {
    type Output = Vec<f32>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        self.sampler.sample_tile(self.first, self.size)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_cover_the_pixel_evenly() {
        for n in 1..=8usize {
            let samples = offsets(n);
            let mean =
                |f: &dyn Fn(f64, f64) -> f64| samples.iter().map(|[x, y]| f(*x - 0.5, *y - 0.5)).sum::<f64>();
            assert!(mean(&|x, _| x).abs() < 1e-12 && mean(&|_, y| y).abs() < 1e-12);
            assert!(mean(&|x, y| x * y).abs() < 1e-12);
            // A box of side 1 has the variance 1/12; n² distinct columns fall short of it by 1/n⁴.
            let expected = (1.0 - 1.0 / (n as f64).powi(4)) / 12.0 * (n * n) as f64;
            assert!((mean(&|x, _| x * x) - expected).abs() < 1e-9);
        }
    }
}
