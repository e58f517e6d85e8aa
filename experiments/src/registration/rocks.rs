//! Rocks of simulated plains as cases: each seen from two places that no other rock hides.
//!
//! The target is where the first camera's line of sight to a drawn point of the rock's upper half meets the rock; a rock
//! whose target the second camera does not see is left out, as are rocks smaller than 25 cm or larger than 80 cm.
//!
//! Frame: site, m. Source: ours.

use nalgebra::Translation3;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use super::views::Stereo;
use super::{CAMERA_IN_ROVER, Case, ORIGIN_HEIGHT_M, Staging};
use sightline_geometry::frames::{Point3, Pose, Ray, Vector3, attitude_from_roll_pitch_yaw};
use sightline_world::{Scenario, SurfaceId, World};

/// A rover whose camera is `distance_m` from a point, seen in a direction; tilted at random.
pub(super) fn rover(
    target: &Point3,
    bearing_rad: f64,
    distance_m: f64,
    tilt_rad: f64,
    random: &mut Pcg64,
) -> Pose {
    let tilts: [f64; 2] = [(); 2].map(|()| StandardNormal.sample(random));
    let attitude = attitude_from_roll_pitch_yaw(tilts[0] * tilt_rad, tilts[1] * tilt_rad, bearing_rad);
    let ahead = Vector3::new(bearing_rad.cos(), bearing_rad.sin(), 0.0);
    let camera = attitude * Vector3::from(CAMERA_IN_ROVER);
    let drop_m = (ORIGIN_HEIGHT_M - CAMERA_IN_ROVER[2]).min(0.9 * distance_m);
    let level_m = (distance_m * distance_m - drop_m * drop_m).sqrt();
    let place = target.coords - ahead * level_m - Vector3::z() * drop_m - camera;
    Pose::from_parts(Translation3::from(place), attitude)
}

/// Rocks of simulated plains, one case each, world by world until there are `count`.
pub fn rock_cases(count: usize, staging: &Staging, stereo: &Stereo, seed: u64) -> Vec<Case> {
    let mut cases = Vec::with_capacity(count);
    let mut world_seed = seed;
    while cases.len() < count {
        let world = World::new(&Scenario { seed: world_seed, ..Scenario::demo() });
        let mut random = Pcg64::seed_from_u64(world_seed);
        for rock in 0..world.rocks().len() as u32 {
            if cases.len() == count {
                break;
            }
            if let Some(case) = rock_case(&world, rock, staging, stereo, &mut random) {
                cases.push(Case { rock: cases.len(), ..case });
            }
        }
        world_seed += 1;
    }
    cases
}

/// A rock of a world seen twice; none where it is too small, too large, far from the drive or hidden.
fn rock_case(
    world: &World,
    rock: u32,
    staging: &Staging,
    stereo: &Stereo,
    random: &mut Pcg64,
) -> Option<Case> {
    let seed = random.random();
    let body = &world.rocks()[rock as usize];
    let from_centre = (body.centre - world.targets_centre()).xy().norm();
    if !(0.25..0.8).contains(&body.diameter_m) || from_centre > 2.5 {
        return None;
    }
    let bearing_rad = random.random_range(0.0..std::f64::consts::TAU);
    let aim = body.centre
        + Vector3::new(0.0, 0.0, -0.3 * body.height_m)
        + Vector3::from_fn(|_, _| random.random_range(-0.15..0.15) * body.diameter_m);
    let cast = |ray: &Ray| world.cast(ray).map(|hit| (hit.point, hit.normal));
    let camera = |bearing_rad: f64, distance_m: f64| {
        let mut still = Pcg64::seed_from_u64(0);
        rover(&aim, bearing_rad, distance_m, 0.0, &mut still) * Point3::from(CAMERA_IN_ROVER)
    };
    let origin = camera(bearing_rad, staging.distances_m[0]);
    let hit = world.cast(&Ray { origin, direction: (aim - origin).normalize() })?;
    let again = camera(bearing_rad + staging.round_rad, staging.distances_m[1]);
    if hit.surface != SurfaceId::Rock(rock) || !world.is_visible(&again, &hit.point) {
        return None;
    }
    let half_width_m = 0.5 * body.diameter_m;
    Some(Case::of_surface(&cast, &hit.point, half_width_m, bearing_rad, (staging, stereo, seed)))
}
