//! The world of a scenario: exact ray casting, shadows and visibility.
//!
//! A [`World`] is the shared, constant scenery at one moment of the drive: position of the sun, occluders, pose of
//! the rover ([`World::at`], `moment.rs`). It follows from the scenario alone and can be shared between threads.
//! Geometry is `f64` throughout and exact: rays meet the ground's patches at the root of a quadratic
//! (`terrain_cast.rs`), rocks and artificial objects at the ends of an interval (`rocks.rs`, `solids.rs`).
//!
//! Frame: site (level, x along the drive, +z down), m. Shadow and visibility tests ignore hits within 1 µm of the
//! surface point, so that a point does not hide itself.
//! Sources: domain.md 10, 11; the definition of a target's truth as the surface point under its pixel.

use std::sync::{Arc, OnceLock};

use crate::culling::{SunGrid, Tree};
use crate::ground::footing::Footing;
use crate::ground::imprint::{Imprint, Laid};
use crate::ground::packet_cast::Lanes;
use crate::ground::rocks::Rock;
use crate::ground::surface::Surfaces;
use crate::ground::terrain::Terrain;
use crate::ground::texture::LANES;
use crate::light::openness::Openness;
use crate::light::reflection::Light;
use crate::solids::{Solid, SolidKind};
use sightline_geometry::frames::{Point3, Ray, Vector3};

/// Hits nearer to the surface point than this do not count, m.
const OFF_SURFACE_M: f64 = 1e-6;

/// The surface that a ray met.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SurfaceId {
    /// The ground.
    Ground,
    /// A rock, by its index.
    Rock(u32),
    /// An artificial object: its kind, and its index in [`World::solids`].
    Solid(SolidKind, u32),
}

/// First intersection of a ray with a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// The point, site frame, m.
    pub point: Point3,
    /// Outward unit normal of the geometry (without micro-relief), site frame.
    pub normal: Vector3,
    /// Distance from the ray's origin, m.
    pub distance_m: f64,
    /// The surface met.
    pub surface: SurfaceId,
}

/// The constant part of the world: ground, rocks, and their appearance.
#[derive(Clone, Debug)]
pub(crate) struct Scenery {
    pub(crate) terrain: Terrain,
    pub(crate) rocks: Vec<Rock>,
    pub(crate) surfaces: Surfaces,
    pub(crate) openness: Openness,
    pub(crate) footing: Footing,
    pub(crate) tree: Tree,
    pub(crate) targets_centre: Point3,
    /// The wheel tracks of the whole drive, computed on first use; `None` if the drive is impossible.
    pub(crate) laid: OnceLock<Option<Arc<Laid>>>,
}

/// The scenery of a scenario at one moment of the drive.
#[derive(Clone, Debug)]
pub struct World {
    pub(crate) scenery: Arc<Scenery>,
    pub(crate) light: Light,
    pub(crate) sun_grid: Arc<SunGrid>,
    pub(crate) solids: Vec<Solid>,
    /// Wheel tracks; `None` if there are none.
    pub(crate) imprint: Option<Imprint>,
    /// Fraction of full scale per unit of radiance.
    pub(crate) exposure: f64,
}

impl World {
    /// The rocks of the world; `SurfaceId::Rock(n)` is the n-th.
    pub fn rocks(&self) -> &[Rock] {
        &self.scenery.rocks
    }

    /// The artificial objects at this moment; `SurfaceId::Solid(_, n)` is the n-th.
    pub fn solids(&self) -> &[Solid] {
        &self.solids
    }

    /// The surface point that the rover approaches and the mast is pointed at, site frame, m.
    pub fn targets_centre(&self) -> Point3 {
        self.scenery.targets_centre
    }

    /// Unit direction towards the sun, site frame.
    pub fn to_sun(&self) -> Vector3 {
        self.light.to_sun
    }

    /// The rectangle of ground with relief and rocks, site frame, m: lower and upper limit along x, then along y.
    pub fn ground_extent_m(&self) -> [[f64; 2]; 2] {
        let Terrain { origin_m, cell_m, cells, .. } = self.scenery.terrain;
        [0, 1].map(|axis| [origin_m[axis], origin_m[axis] + cell_m * cells[axis] as f64])
    }

    /// z of the bare ground at (x, y), site frame, m, positive down.
    pub fn ground_z_at(&self, x_m: f64, y_m: f64) -> f64 {
        self.scenery.terrain.z_at(x_m, y_m)
    }

    /// z of the ground or rock that supports a wheel at (x, y), site frame, m, positive down.
    pub(crate) fn footing_z_at(&self, x_m: f64, y_m: f64) -> f64 {
        self.scenery.footing.z_at(&self.scenery.terrain, x_m, y_m)
    }

    /// Height of the rock at (x, y) that is too high for a wheel to climb, m; `None` if there is none.
    pub(crate) fn blocked_by_m(&self, x_m: f64, y_m: f64) -> Option<f64> {
        self.scenery.footing.blocked_by_m(&self.scenery.rocks, x_m, y_m)
    }

    /// Returns the first intersection of a ray, whose direction must be a unit vector.
    pub fn cast(&self, ray_in_site: &Ray) -> Option<Hit> {
        let scenery = &*self.scenery;
        let ground_m = scenery.terrain.cast(ray_in_site, 0.0, f64::INFINITY);
        let mut nearest_m = ground_m.unwrap_or(f64::INFINITY);
        let mut met = None;
        scenery.tree.along(ray_in_site, nearest_m, |index| {
            if let Some(interval) = scenery.rocks[index].interval(ray_in_site)
                && interval.enter_m > 0.0
                && interval.enter_m < nearest_m
            {
                nearest_m = interval.enter_m;
                met = Some((index, interval.plane));
            }
            nearest_m
        });
        if let Some((index, distance_m, normal)) = self.solid_on(ray_in_site, nearest_m) {
            let surface = SurfaceId::Solid(self.solids[index].kind, index as u32);
            return Some(Hit { point: ray_in_site.at(distance_m), normal, distance_m, surface });
        }
        if nearest_m == f64::INFINITY {
            return None;
        }
        let point = ray_in_site.at(nearest_m);
        let (surface, normal) = match met {
            Some((rock, plane)) => (SurfaceId::Rock(rock as u32), scenery.rocks[rock].normal(plane)),
            None => (SurfaceId::Ground, scenery.terrain.normal_at(point.x, point.y)),
        };
        Some(Hit { point, normal, distance_m: nearest_m, surface })
    }

    /// The first visible artificial object on a ray nearer than `to_m`: its index, distance (m) and normal.
    pub(crate) fn solid_on(&self, ray_in_site: &Ray, to_m: f64) -> Option<(usize, f64, Vector3)> {
        let seen = self.solids.iter().enumerate().filter(|(_, solid)| solid.is_seen);
        let met = seen.filter_map(|(index, solid)| {
            let passage = solid.passage(ray_in_site)?;
            (passage.enter_m > 0.0 && passage.enter_m < to_m).then_some((
                index,
                passage.enter_m,
                passage.normal,
            ))
        });
        met.min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// The surface that occludes a surface point from `from`; `None` if the point is visible.
    pub(crate) fn in_the_way(&self, from: &Point3, point: &Point3) -> Option<SurfaceId> {
        let way = point - from;
        let distance_m = way.norm();
        let ray = Ray { origin: *from, direction: way / distance_m };
        self.cast(&ray).filter(|hit| hit.distance_m <= distance_m - OFF_SURFACE_M).map(|hit| hit.surface)
    }

    /// Whether a surface point is visible from `from`.
    pub fn is_visible(&self, from: &Point3, point: &Point3) -> bool {
        self.in_the_way(from, point).is_none()
    }

    /// Whether a surface point is in shadow, its own surface's (self-shadow) included.
    pub fn in_shadow(&self, point: &Point3) -> bool {
        self.is_blocked(&Ray { origin: *point, direction: self.light.to_sun })
    }

    /// [`World::in_shadow`] of many points, given the rocks that can shade them.
    #[inline(always)]
    pub(crate) fn in_shadow_lanes(&self, points: &[Lanes; 3], count: usize, rocks: &[u32]) -> [bool; LANES] {
        let direction = self.light.to_sun;
        let mut is_dark = [false; LANES];
        for &index in rocks {
            let [enter_m, leave_m] = self.scenery.rocks[index as usize].passage_lanes(points, &direction);
            for lane in 0..LANES {
                is_dark[lane] |= leaves_behind(enter_m[lane], leave_m[lane]);
            }
        }
        for (lane, is_dark) in is_dark.iter_mut().enumerate().take(count) {
            let origin = Point3::new(points[0][lane], points[1][lane], points[2][lane]);
            let to_sun = Ray { origin, direction };
            *is_dark = *is_dark || self.is_blocked_by_solid(&to_sun) || self.is_blocked_by_ground(&to_sun);
        }
        is_dark
    }

    /// Whether anything blocks a ray to the sun.
    #[inline(always)]
    pub(crate) fn is_blocked(&self, to_sun: &Ray) -> bool {
        self.is_blocked_by_rock(to_sun)
            || self.is_blocked_by_solid(to_sun)
            || self.is_blocked_by_ground(to_sun)
    }

    /// Whether a rock (that on which the ray starts included) blocks a ray to the sun.
    #[inline(always)]
    fn is_blocked_by_rock(&self, to_sun: &Ray) -> bool {
        self.sun_grid.towards_sun(&to_sun.origin).iter().any(|&index| {
            let interval = self.scenery.rocks[index as usize].interval(to_sun);
            // A ray that starts on a lit face leaves the rock at once.
            interval.is_some_and(|i| leaves_behind(i.enter_m, i.leave_m))
        })
    }

    /// Whether an artificial object (that on which the ray starts included) blocks a ray to the sun.
    #[inline(always)]
    fn is_blocked_by_solid(&self, to_sun: &Ray) -> bool {
        self.solids
            .iter()
            .any(|solid| solid.passage(to_sun).is_some_and(|p| leaves_behind(p.enter_m, p.leave_m)))
    }

    /// Whether the ground blocks a ray to the sun.
    #[inline(always)]
    fn is_blocked_by_ground(&self, to_sun: &Ray) -> bool {
        let terrain = &self.scenery.terrain;
        // Most grounds are nowhere as steep as the sun's elevation.
        let rise = -to_sun.direction.z / to_sun.direction.xy().norm();
        rise <= terrain.steepest() && terrain.cast(to_sun, OFF_SURFACE_M, f64::INFINITY).is_some()
    }
}

/// Whether a ray that is inside an object over [enter, leave] passes through it after its start.
#[inline(always)]
fn leaves_behind(enter_m: f64, leave_m: f64) -> bool {
    leave_m - enter_m.max(0.0) > OFF_SURFACE_M && leave_m > OFF_SURFACE_M
}
