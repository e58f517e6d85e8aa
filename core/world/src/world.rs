//! The world of a scenario: what a ray meets, exactly; what is in shadow; what can be seen from where.
//!
//! A [`World`] is the scenery, which never changes and is shared, at one moment of the drive: where the sun
//! stands, what stands in the way, where the rover is ([`World::at`], `moment.rs`). It follows from the scenario
//! alone and can be shared between threads. Geometry is `f64` throughout and exact: the ground's patches are met
//! at the root of a quadratic (`terrain_cast.rs`), rocks at the ends of an interval (`rocks.rs`), made things
//! alike (`solids.rs`).
//!
//! Frame: site (level, x along the drive, +z down), m. A surface point is tested for shadow and visibility
//! with rays that start 1 µm off it, so that it does not hide itself.
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

/// How far off its surface a ray starts, m.
const OFF_SURFACE_M: f64 = 1e-6;

/// What a ray met.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SurfaceId {
    /// The ground.
    Ground,
    /// The rock of this number.
    Rock(u32),
    /// A made thing, by its kind and its number among those present.
    Solid(SolidKind, u32),
}

/// Where a ray met a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// The point, site frame, m.
    pub point: Point3,
    /// Outward unit normal of the surface itself, site frame.
    pub normal: Vector3,
    /// Distance from the ray's origin, m.
    pub distance_m: f64,
    /// What was met.
    pub surface: SurfaceId,
}

/// What never changes: ground, rocks, and their look.
#[derive(Clone, Debug)]
pub(crate) struct Scenery {
    pub(crate) terrain: Terrain,
    pub(crate) rocks: Vec<Rock>,
    pub(crate) surfaces: Surfaces,
    pub(crate) openness: Openness,
    pub(crate) footing: Footing,
    pub(crate) tree: Tree,
    pub(crate) targets_centre: Point3,
    /// The wheel tracks of the whole drive, driven when they are first asked for; nothing where it fails.
    pub(crate) laid: OnceLock<Option<Arc<Laid>>>,
}

/// The scenery of a scenario at one moment of the drive.
#[derive(Clone, Debug)]
pub struct World {
    pub(crate) scenery: Arc<Scenery>,
    pub(crate) light: Light,
    pub(crate) sun_grid: Arc<SunGrid>,
    pub(crate) solids: Vec<Solid>,
    /// Wheel tracks; nothing where the wheels leave none.
    pub(crate) imprint: Option<Imprint>,
    /// Fraction of full scale per unit of radiance.
    pub(crate) exposure: f64,
}

impl World {
    /// The rocks of the world; `SurfaceId::Rock(n)` is the n-th.
    pub fn rocks(&self) -> &[Rock] {
        &self.scenery.rocks
    }

    /// The made things that are there now; `SurfaceId::Solid(_, n)` is the n-th.
    pub fn solids(&self) -> &[Solid] {
        &self.solids
    }

    /// The point that the rover approaches and the mast looks at, on the surface, site frame, m.
    pub fn targets_centre(&self) -> Point3 {
        self.scenery.targets_centre
    }

    /// Unit direction towards the sun, site frame.
    pub fn to_sun(&self) -> Vector3 {
        self.light.to_sun
    }

    /// The rectangle of ground that has relief and rocks: from and to along x, and along y, site frame, m.
    pub fn ground_extent_m(&self) -> [[f64; 2]; 2] {
        let Terrain { origin_m, cell_m, cells, .. } = self.scenery.terrain;
        [0, 1].map(|axis| [origin_m[axis], origin_m[axis] + cell_m * cells[axis] as f64])
    }

    /// Height of the bare ground at a place, m down, site frame.
    pub fn ground_z_at(&self, x_m: f64, y_m: f64) -> f64 {
        self.scenery.terrain.z_at(x_m, y_m)
    }

    /// Height of what a wheel stands on at a place, ground or rock, m down, site frame.
    pub(crate) fn footing_z_at(&self, x_m: f64, y_m: f64) -> f64 {
        self.scenery.footing.z_at(&self.scenery.terrain, x_m, y_m)
    }

    /// The height of the rock, m, that stands at a place and is too high for a wheel to climb, if one does.
    pub(crate) fn blocked_by_m(&self, x_m: f64, y_m: f64) -> Option<f64> {
        self.scenery.footing.blocked_by_m(&self.scenery.rocks, x_m, y_m)
    }

    /// The first surface that a ray meets; the ray's direction is unit.
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

    /// The first made thing that a camera's ray meets nearer than `to_m`: its number, distance (m) and normal.
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

    /// What stands between `from` and a point of a surface, if anything does.
    pub(crate) fn in_the_way(&self, from: &Point3, point: &Point3) -> Option<SurfaceId> {
        let way = point - from;
        let distance_m = way.norm();
        let ray = Ray { origin: *from, direction: way / distance_m };
        self.cast(&ray).filter(|hit| hit.distance_m <= distance_m - OFF_SURFACE_M).map(|hit| hit.surface)
    }

    /// Whether nothing stands between `from` and a point of a surface.
    pub fn is_visible(&self, from: &Point3, point: &Point3) -> bool {
        self.in_the_way(from, point).is_none()
    }

    /// Whether a point of a surface gets no sun: another surface, or its own, stands in the way.
    pub fn in_shadow(&self, point: &Point3) -> bool {
        self.is_blocked(&Ray { origin: *point, direction: self.light.to_sun })
    }

    /// [`World::in_shadow`] of many points where the rocks that can shade them are known.
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

    /// Whether anything stands on a ray to the sun.
    #[inline(always)]
    pub(crate) fn is_blocked(&self, to_sun: &Ray) -> bool {
        self.is_blocked_by_rock(to_sun)
            || self.is_blocked_by_solid(to_sun)
            || self.is_blocked_by_ground(to_sun)
    }

    /// Whether a rock, or the rock on which the ray starts, stands on a ray to the sun.
    #[inline(always)]
    fn is_blocked_by_rock(&self, to_sun: &Ray) -> bool {
        self.sun_grid.towards_sun(&to_sun.origin).iter().any(|&index| {
            let interval = self.scenery.rocks[index as usize].interval(to_sun);
            // Where the ray starts on a lit face it leaves at once.
            interval.is_some_and(|i| leaves_behind(i.enter_m, i.leave_m))
        })
    }

    /// Whether a made thing, or the one on which the ray starts, stands on a ray to the sun.
    #[inline(always)]
    fn is_blocked_by_solid(&self, to_sun: &Ray) -> bool {
        self.solids
            .iter()
            .any(|solid| solid.passage(to_sun).is_some_and(|p| leaves_behind(p.enter_m, p.leave_m)))
    }

    /// Whether the ground stands on a ray to the sun.
    #[inline(always)]
    fn is_blocked_by_ground(&self, to_sun: &Ray) -> bool {
        let terrain = &self.scenery.terrain;
        // Most grounds are nowhere as steep as the sun is high.
        let rise = -to_sun.direction.z / to_sun.direction.xy().norm();
        rise <= terrain.steepest() && terrain.cast(to_sun, OFF_SURFACE_M, f64::INFINITY).is_some()
    }
}

/// Whether a ray that is inside something over [enter, leave] goes through it after its start.
#[inline(always)]
fn leaves_behind(enter_m: f64, leave_m: f64) -> bool {
    leave_m - enter_m.max(0.0) > OFF_SURFACE_M && leave_m > OFF_SURFACE_M
}
