//! Shading: the radiance of a tile's samples, in vector lanes.
//!
//! The samples of a tile are grouped by surface, the ground or one rock, and shaded [`LANES`] at a time. The noise of
//! their textures is the same computation on other numbers, and the loops over lanes in `texture.rs` and `details.rs` use
//! vectors as wide as the processor has, chosen at run time (`sampling.rs`).
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | c | `cutoff_m`: the shortest wavelength that the samples resolve (`sampling.rs`) | m |
//!
//! Frame: site.

use crate::ground::packet_cast::Lanes;
use crate::ground::surface::Face;
use crate::ground::texture::{LANES, least};
use crate::light::reflection::Appearance;
use crate::world::World;
use sightline_geometry::frames::{Point3, Ray, Vector3};

/// Cutoff of a lane without a sample: longer than any wavelength, so that no octave is evaluated for it.
const NOTHING_M: f32 = 1e9;

/// A sample whose ray met a surface.
#[derive(Clone, Copy, Debug)]
struct Sample {
    /// Index of the sample in the tile.
    number: usize,
    point: Point3,
    to_camera: [f32; 3],
    cutoff_m: f32,
}

/// The hits of a tile's samples.
#[derive(Debug, Default)]
pub(super) struct Seen {
    ground: Vec<Sample>,
    /// With rock and plane.
    rocks: Vec<(Sample, usize, usize)>,
    /// By sample index; artificial objects and the sky are filled in at once.
    radiances: Vec<f32>,
    /// Rocks that a ray of the pixel can meet, the nearest first, with their smallest distance, m.
    pub(super) rocks_in_view: Vec<(f64, usize)>,
    /// Rocks that can shade the ground of the pixel.
    shading: Vec<u32>,
}

impl Sample {
    #[inline(always)]
    fn new(number: usize, ray: &Ray, distance_m: f64, cutoff_m: f32) -> Self {
        let to_camera = [-ray.direction.x as f32, -ray.direction.y as f32, -ray.direction.z as f32];
        Self { number, point: ray.at(distance_m), to_camera, cutoff_m }
    }
}

impl Seen {
    /// Allocates for this many samples.
    pub(super) fn new(count: usize) -> Self {
        Self { radiances: vec![0.0; count], ground: Vec::with_capacity(count), ..Self::default() }
    }

    /// Records a sample that met the ground.
    #[inline(always)]
    pub(super) fn ground(&mut self, number: usize, ray: &Ray, distance_m: f64, cutoff_m: f32) {
        self.ground.push(Sample::new(number, ray, distance_m, cutoff_m));
    }

    /// Records a sample that met a plane of a rock.
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

    /// Records a sample that met an artificial object.
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

    /// Records a sample that met nothing.
    pub(super) fn sky(&mut self, world: &World, number: usize, ray: &Ray) {
        let direction = [ray.direction.x, ray.direction.y, ray.direction.z].map(|v| v as f32);
        self.radiances[number] = world.light.sky(direction);
    }

    /// The radiance of every sample, by its index.
    #[inline(always)]
    pub(super) fn radiances(&mut self, world: &World) -> &[f32] {
        self.shade_ground(world);
        self.shade_rocks(world);
        &self.radiances
    }

    #[inline(always)]
    fn shade_ground(&mut self, world: &World) {
        for samples in self.ground.chunks(LANES) {
            let looks = soil(world, samples);
            let is_dark = in_shadow(world, &points_of(samples.iter()), samples.len(), &mut self.shading);
            for ((sample, mut look), is_dark) in samples.iter().zip(looks).zip(is_dark) {
                let point = &sample.point;
                if let Some(imprint) = &world.imprint {
                    look = imprint.on_soil(look, point.x, point.y, sample.cutoff_m);
                }
                let open = world.scenery.openness.at(point.x, point.y);
                self.radiances[sample.number] =
                    world.light.reflected(&look, sample.to_camera, !is_dark, open);
            }
        }
    }

    #[inline(always)]
    fn shade_rocks(&mut self, world: &World) {
        // Points of one rock are close together in the noise, those of different rocks are not.
        self.rocks.sort_by_key(|(_, rock, _)| *rock);
        for samples in self.rocks.chunk_by(|(_, a, _), (_, b, _)| a == b).flat_map(|one| one.chunks(LANES)) {
            let looks = stone(world, samples);
            let points = points_of(samples.iter().map(|(sample, ..)| sample));
            let is_dark = in_shadow(world, &points, samples.len(), &mut self.shading);
            for (((sample, rock, plane), look), is_dark) in samples.iter().zip(looks).zip(is_dark) {
                let normal = world.scenery.rocks[*rock].normal(*plane);
                let in_sun = normal.dot(&world.light.to_sun) > 0.0 && !is_dark;
                self.radiances[sample.number] = world.light.reflected(&look, sample.to_camera, in_sun, 1.0);
            }
        }
    }
}

/// The points of samples by component and lane; lanes without a sample repeat the first.
#[inline(always)]
fn points_of<'a>(samples: impl Iterator<Item = &'a Sample> + Clone) -> [Lanes; 3] {
    let first = samples.clone().next().map_or(Point3::origin(), |sample| sample.point);
    let mut points = [[first.x; LANES], [first.y; LANES], [first.z; LANES]];
    for (lane, sample) in samples.enumerate().take(LANES) {
        points[0][lane] = sample.point.x;
        points[1][lane] = sample.point.y;
        points[2][lane] = sample.point.z;
    }
    points
}

/// Whether each of the first `count` points is in shadow. `shading` is scratch space for the rocks that can shade them.
#[inline(always)]
fn in_shadow(world: &World, points: &[Lanes; 3], count: usize, shading: &mut Vec<u32>) -> [bool; LANES] {
    let middle = Point3::new(points[0][0], points[1][0], points[2][0]);
    let mut nearness = [0.0; LANES];
    for lane in 0..LANES {
        let (x, y, z) = (points[0][lane] - middle.x, points[1][lane] - middle.y, points[2][lane] - middle.z);
        nearness[lane] = -(x * x + y * y + z * z);
    }
    // Margin for rounding, as in the rocks' own bounding spheres.
    let radius_m = (-least(&nearness)).sqrt() * (1.0 + 1e-9);
    if world.sun_grid.near(&middle, radius_m, world.rocks(), shading) {
        return world.in_shadow_lanes(points, count, shading);
    }
    let mut is_dark = [false; LANES];
    for (lane, is_dark) in is_dark.iter_mut().enumerate().take(count) {
        *is_dark = world.in_shadow(&Point3::new(points[0][lane], points[1][lane], points[2][lane]));
    }
    is_dark
}

/// Appearance of the soil at samples.
#[inline(always)]
fn soil(world: &World, samples: &[Sample]) -> [Appearance; LANES] {
    // Lanes without a sample repeat the first point.
    let first = samples.first().map_or(Point3::origin(), |sample| sample.point);
    let (mut p_m, mut cutoff_m) = ([[first.x; LANES], [first.y; LANES]], [NOTHING_M; LANES]);
    for (lane, sample) in samples.iter().enumerate() {
        (p_m[0][lane], p_m[1][lane]) = (sample.point.x, sample.point.y);
        cutoff_m[lane] = sample.cutoff_m;
    }
    let scenery = &*world.scenery;
    scenery.surfaces.soil(&scenery.terrain, &p_m, &cutoff_m, samples.len())
}

/// Appearance of one rock at samples.
#[inline(always)]
fn stone(world: &World, samples: &[(Sample, usize, usize)]) -> [Appearance; LANES] {
    let scenery = &*world.scenery;
    let mut faces = [None; LANES];
    let mut cutoff_m = [NOTHING_M; LANES];
    for (lane, (sample, rock, plane)) in samples.iter().enumerate() {
        let rock = &scenery.rocks[*rock];
        faces[lane] = Some(Face { rock, point: sample.point, normal: rock.normal(*plane) });
        cutoff_m[lane] = sample.cutoff_m;
    }
    scenery.surfaces.rock(&faces, &cutoff_m)
}
