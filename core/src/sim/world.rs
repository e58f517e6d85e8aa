//! The world of a scenario: what a ray meets, exactly; what is in shadow; what can be seen from where.
//!
//! The world follows from the scenario alone and never changes: it can be shared between threads. Geometry
//! is `f64` throughout and exact: the ground's patches are met at the root of a quadratic
//! (`terrain_cast.rs`), rocks at the ends of an interval (`rocks.rs`).
//!
//! Frame: site (level, x along the drive, +z down), m. A surface point is tested for shadow and visibility
//! with rays that start 1 µm off it, so that it does not hide itself.
//! Sources: domain.md 10, 11; the definition of a target's truth as the surface point under its pixel.

use crate::frames::{Point3, Ray, Vector3};

use crate::sim::camera::render;
use crate::sim::culling::{SunGrid, Tree};
use crate::sim::ground::rock_field::{self, Approach};
use crate::sim::ground::rocks::Rock;
use crate::sim::ground::surface::Surfaces;
use crate::sim::ground::terrain::Terrain;
use crate::sim::light::openness::Openness;
use crate::sim::light::reflection::Light;
use crate::sim::rover::drive;
use crate::sim::scenario::Scenario;

/// How far off its surface a ray starts, m.
const OFF_SURFACE_M: f64 = 1e-6;

/// What a ray met.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SurfaceId {
    /// The ground.
    Ground,
    /// The rock of this number.
    Rock(u32),
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

/// The world of a scenario.
#[derive(Clone, Debug)]
pub struct World {
    pub(in crate::sim) terrain: Terrain,
    pub(in crate::sim) rocks: Vec<Rock>,
    pub(in crate::sim) surfaces: Surfaces,
    pub(in crate::sim) light: Light,
    pub(in crate::sim) openness: Openness,
    /// Fraction of full scale per unit of radiance.
    pub(in crate::sim) exposure: f64,
    tree: Tree,
    sun_grid: SunGrid,
    targets_centre: Point3,
}

impl World {
    /// Builds the world of a scenario; the scenario is taken as valid ([`Scenario::validate`]).
    pub fn new(scenario: &Scenario) -> Self {
        let approach = Approach {
            goal_m: drive::goal_m(&scenario.drive),
            wheels_reach_m: drive::wheels_reach_m(&scenario.drive),
        };
        let [x_m, y_m] = drive::ground_extent_m(&scenario.drive);
        let terrain = Terrain::new(&scenario.terrain, x_m, y_m, scenario.seed);
        let rocks = rock_field::scatter(&scenario.rocks, &approach, &terrain, scenario.seed);
        let light = Light::new(&scenario.sun, scenario.texture.soil_albedo);
        let mut world = Self {
            tree: Tree::new(&rocks),
            sun_grid: SunGrid::new(&rocks, &light.to_sun),
            openness: Openness::new(&rocks, x_m, y_m),
            surfaces: Surfaces::new(&scenario.texture, scenario.seed),
            terrain,
            rocks,
            light,
            exposure: 1.0,
            targets_centre: Point3::origin(),
        };
        let [x_m, y_m] = approach.goal_m;
        let down = Ray { origin: Point3::new(x_m, y_m, -100.0), direction: Vector3::z() };
        world.targets_centre = world.cast(&down).map_or(Point3::new(x_m, y_m, 0.0), |hit| hit.point);
        world.exposure = render::exposure(&world, scenario);
        world
    }

    /// The rocks of the world; `SurfaceId::Rock(n)` is the n-th.
    pub fn rocks(&self) -> &[Rock] {
        &self.rocks
    }

    /// The point that the rover approaches and the mast looks at, on the surface, site frame, m.
    pub fn targets_centre(&self) -> Point3 {
        self.targets_centre
    }

    /// Unit direction towards the sun, site frame.
    pub fn to_sun(&self) -> Vector3 {
        self.light.to_sun
    }

    /// Height of the bare ground at a place, m down, site frame.
    pub fn ground_z_at(&self, x_m: f64, y_m: f64) -> f64 {
        self.terrain.z_at(x_m, y_m)
    }

    /// The first surface that a ray meets; the ray's direction is unit.
    pub fn cast(&self, ray_in_site: &Ray) -> Option<Hit> {
        let ground_m = self.terrain.cast(ray_in_site, 0.0, f64::INFINITY);
        let mut nearest_m = ground_m.unwrap_or(f64::INFINITY);
        let mut met = None;
        self.tree.along(ray_in_site, nearest_m, |index| {
            if let Some(interval) = self.rocks[index].interval(ray_in_site)
                && interval.enter_m > 0.0
                && interval.enter_m < nearest_m
            {
                nearest_m = interval.enter_m;
                met = Some((index, interval.plane));
            }
            nearest_m
        });
        if nearest_m == f64::INFINITY {
            return None;
        }
        let point = ray_in_site.at(nearest_m);
        let (surface, normal) = match met {
            Some((rock, plane)) => (SurfaceId::Rock(rock as u32), self.rocks[rock].normal(plane)),
            None => (SurfaceId::Ground, self.terrain.normal_at(point.x, point.y)),
        };
        Some(Hit { point, normal, distance_m: nearest_m, surface })
    }

    /// Whether nothing stands between `from` and a point of a surface.
    pub fn is_visible(&self, from: &Point3, point: &Point3) -> bool {
        let way = point - from;
        let distance_m = way.norm();
        let ray = Ray { origin: *from, direction: way / distance_m };
        self.cast(&ray).is_none_or(|hit| hit.distance_m > distance_m - OFF_SURFACE_M)
    }

    /// Whether a point of a surface gets no sun: another surface, or its own, stands in the way.
    pub fn in_shadow(&self, point: &Point3) -> bool {
        let ray = Ray { origin: *point, direction: self.light.to_sun };
        self.is_blocked_by_rock(&ray) || self.is_blocked_by_ground(&ray)
    }

    /// Whether a rock, or the rock on which the ray starts, stands on a ray to the sun.
    #[inline(always)]
    pub(in crate::sim) fn is_blocked_by_rock(&self, to_sun: &Ray) -> bool {
        self.sun_grid.towards_sun(&to_sun.origin).iter().any(|&index| {
            let interval = self.rocks[index as usize].interval(to_sun);
            // Where the ray starts on a lit face it leaves at once.
            interval
                .is_some_and(|i| i.leave_m - i.enter_m.max(0.0) > OFF_SURFACE_M && i.leave_m > OFF_SURFACE_M)
        })
    }

    /// Whether the ground stands on a ray to the sun.
    #[inline(always)]
    pub(in crate::sim) fn is_blocked_by_ground(&self, to_sun: &Ray) -> bool {
        // Most grounds are nowhere as steep as the sun is high.
        let rise = -to_sun.direction.z / to_sun.direction.xy().norm();
        rise <= self.terrain.steepest() && self.terrain.cast(to_sun, OFF_SURFACE_M, f64::INFINITY).is_some()
    }
}
