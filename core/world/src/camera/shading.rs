//! Shading: the light of what the samples of one pixel met, many at once.
//!
//! The samples of a pixel lie side by side, so that the noise of their textures is the same program on other numbers:
//! up to [`LANES`] of them are gathered by what they met, and the loops over lanes in `texture.rs` and `details.rs`
//! become vectors as wide as the processor has, chosen when the program runs. Every sample keeps the bits that it has
//! alone: no sum runs across lanes, and nothing is joined to a fused product.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | c | `cutoff_m`: the shortest wavelength that the samples carry (`sampling.rs`) | m |
//!
//! Frame: site.

use pulp::{Arch, Simd, WithSimd};

use crate::ground::surface::Face;
use crate::ground::texture::LANES;
use crate::light::reflection::Appearance;
use crate::world::World;
use sightline_geometry::frames::{Point3, Ray, Vector3};

/// The cutoff of a lane that holds no sample: longer than any wave, so that none is evaluated for its sake.
const NOTHING_M: f32 = 1e9;

/// A sample that met a surface.
#[derive(Clone, Copy, Debug)]
struct Sample {
    /// Its number in the pixel.
    number: usize,
    point: Point3,
    to_camera: [f32; 3],
    cutoff_m: f32,
}

/// What up to [`LANES`] samples of a pixel met.
#[derive(Debug, Default)]
pub(super) struct Seen {
    ground: Vec<Sample>,
    /// With rock and plane.
    rocks: Vec<(Sample, usize, usize)>,
    /// By the samples' numbers; those of made things and of the sky are there at once.
    radiances: [f32; LANES],
}

impl Sample {
    #[inline(always)]
    fn new(number: usize, ray: &Ray, distance_m: f64, cutoff_m: f32) -> Self {
        let to_camera = [-ray.direction.x as f32, -ray.direction.y as f32, -ray.direction.z as f32];
        Self { number, point: ray.at(distance_m), to_camera, cutoff_m }
    }
}

impl Seen {
    /// Forgets the samples of the pixel before.
    pub(super) fn clear(&mut self) {
        self.ground.clear();
        self.rocks.clear();
    }

    /// A sample met the ground.
    #[inline(always)]
    pub(super) fn ground(&mut self, number: usize, ray: &Ray, distance_m: f64, cutoff_m: f32) {
        self.ground.push(Sample::new(number, ray, distance_m, cutoff_m));
    }

    /// A sample met a plane of a rock.
    #[inline(always)]
    pub(super) fn rock(
        &mut self,
        number: usize,
        ray: &Ray,
        distance_m: f64,
        cutoff_m: f32,
        (rock, plane): (usize, usize),
    ) {
        self.rocks.push((Sample::new(number, ray, distance_m, cutoff_m), rock, plane));
    }

    /// A sample met a made thing.
    pub(super) fn solid(
        &mut self,
        world: &World,
        number: usize,
        ray: &Ray,
        distance_m: f64,
        (solid, normal): (usize, &Vector3),
    ) {
        let sample = Sample::new(number, ray, distance_m, NOTHING_M);
        let albedo = world.solids[solid].albedo_at(&sample.point, normal);
        let look = Appearance { albedo, normal: [normal.x, normal.y, normal.z].map(|v| v as f32) };
        let in_sun = normal.dot(&world.light.to_sun) > 0.0 && !world.in_shadow(&sample.point);
        self.radiances[number] = world.light.reflected(&look, sample.to_camera, in_sun, 1.0);
    }

    /// A sample met nothing.
    pub(super) fn sky(&mut self, world: &World, number: usize, ray: &Ray) {
        let direction = [ray.direction.x, ray.direction.y, ray.direction.z].map(|v| v as f32);
        self.radiances[number] = world.light.sky(direction);
    }

    /// The radiance of every sample, by its number.
    pub(super) fn radiances(&mut self, world: &World) -> &[f32; LANES] {
        if !self.ground.is_empty() {
            self.shade_ground(world);
        }
        if !self.rocks.is_empty() {
            self.shade_rocks(world);
        }
        &self.radiances
    }

    fn shade_ground(&mut self, world: &World) {
        let looks = Arch::new().dispatch(Soil { world, samples: &self.ground });
        for (sample, mut look) in self.ground.iter().zip(looks) {
            let point = &sample.point;
            if let Some(imprint) = &world.imprint {
                look = imprint.on_soil(look, point.x, point.y, sample.cutoff_m);
            }
            let in_sun = !world.in_shadow(point);
            let open = world.scenery.openness.at(point.x, point.y);
            self.radiances[sample.number] = world.light.reflected(&look, sample.to_camera, in_sun, open);
        }
    }

    fn shade_rocks(&mut self, world: &World) {
        let looks = Arch::new().dispatch(Stone { world, samples: &self.rocks });
        for ((sample, rock, plane), look) in self.rocks.iter().zip(looks) {
            let normal = world.scenery.rocks[*rock].normal(*plane);
            let in_sun = normal.dot(&world.light.to_sun) > 0.0 && !world.in_shadow(&sample.point);
            self.radiances[sample.number] = world.light.reflected(&look, sample.to_camera, in_sun, 1.0);
        }
    }
}

/// The look of soil at samples.
struct Soil<'a> {
    world: &'a World,
    samples: &'a [Sample],
}

impl WithSimd for Soil<'_> {
    type Output = [Appearance; LANES];

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        let (mut p_m, mut cutoff_m) = ([[0.0; LANES]; 2], [NOTHING_M; LANES]);
        for (lane, sample) in self.samples.iter().enumerate() {
            (p_m[0][lane], p_m[1][lane]) = (sample.point.x, sample.point.y);
            cutoff_m[lane] = sample.cutoff_m;
        }
        let scenery = &*self.world.scenery;
        scenery.surfaces.soil(&scenery.terrain, &p_m, &cutoff_m, self.samples.len())
    }
}

/// The look of rocks at samples.
struct Stone<'a> {
    world: &'a World,
    samples: &'a [(Sample, usize, usize)],
}

impl WithSimd for Stone<'_> {
    type Output = [Appearance; LANES];

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        let scenery = &*self.world.scenery;
        let mut faces = [None; LANES];
        let mut cutoff_m = [NOTHING_M; LANES];
        for (lane, (sample, rock, plane)) in self.samples.iter().enumerate() {
            let rock = &scenery.rocks[*rock];
            faces[lane] = Some(Face { rock, point: sample.point, normal: rock.normal(*plane) });
            cutoff_m[lane] = sample.cutoff_m;
        }
        scenery.surfaces.rock(&faces, &cutoff_m)
    }
}
