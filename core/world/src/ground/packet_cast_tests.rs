//! Rays cast in lanes hit as each ray does alone.

use super::*;
use crate::ground::rocks::RockSeed;
use crate::ground::texture::mix;
use crate::scenario::{RockShape, TerrainSettings};

/// A number in [0, 1).
fn unit(seed: u64, n: u64) -> f64 {
    (mix(seed * 64 + n) >> 11) as f64 / (1u64 << 53) as f64
}

/// The rays of a square pixel of angular width `width_rad`, from 1 to 2 m above a point of the ground.
fn pixel(terrain: &Terrain, seed: u64, pitch_rad: f64, width_rad: f64) -> (RayLanes, Cone) {
    let (x, y) = (-1.0 + 4.0 * unit(seed, 0), -3.0 + 6.0 * unit(seed, 1));
    let origin = Point3::new(x, y, terrain.z_at(x, y) - 1.0 - unit(seed, 2));
    let yaw_rad = std::f64::consts::TAU * unit(seed, 3);
    let direction = |u: f64, v: f64| {
        let (yaw_rad, pitch_rad) = (yaw_rad + (u - 0.5) * width_rad, pitch_rad + (v - 0.5) * width_rad);
        let level = pitch_rad.cos();
        Vector3::new(level * yaw_rad.cos(), level * yaw_rad.sin(), pitch_rad.sin())
    };
    let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
    let corners = corners.map(|[u, v]| Ray { origin, direction: direction(u, v) });
    let mut rays = RayLanes { origin: [[0.0; LANES]; 3], direction: [[0.0; LANES]; 3] };
    for lane in 0..LANES {
        let direction = direction(unit(seed, 4 + lane as u64), unit(seed, 30 + lane as u64));
        for k in 0..3 {
            (rays.origin[k][lane], rays.direction[k][lane]) = (origin[k], direction[k]);
        }
    }
    // Half a percent of a pixel allows for lines of equal pitch not being great circles.
    (rays, Cone::around(corners.iter(), 0.005 * width_rad).unwrap())
}

#[test]
fn rays_of_a_pixel_hit_as_each_alone_and_never_before_the_clear_distance() {
    let level = TerrainSettings { rms_at_1m_m: 0.03, ..TerrainSettings::default() };
    let slope = TerrainSettings { slope_deg: 17.0, slope_azimuth_deg: 40.0, ripple_height_m: 0.04, ..level };
    let (mut together, mut hits) = (0, 0);
    for (number, settings) in [level, slope].into_iter().enumerate() {
        let terrain = Terrain::new(&settings, [-2.0, 14.0], [-6.0, 6.0], 5);
        for seed in 0..600u64 {
            let pitch_rad = [0.6, 0.25, 0.12, -0.05, 1.4][(seed % 5) as usize];
            let width_rad = [0.0008, 0.003][(seed / 5 % 2) as usize];
            let (rays, cone) = pixel(&terrain, seed + 1000 * number as u64, pitch_rad, width_rad);
            let clear_m = terrain.clear_m(&cone);
            together += u32::from(terrain.is_narrow(&cone, clear_m));
            let to_m = std::array::from_fn(|lane| if lane % 4 == 3 { 3.0 } else { f64::INFINITY });
            let lanes = terrain.cast_lanes(&rays, &cone, clear_m, &to_m);
            for lane in 0..LANES {
                let alone = terrain.cast(&rays.ray(lane), 0.0, to_m[lane]).unwrap_or(f64::INFINITY);
                let agrees = lanes[lane] == alone || (lanes[lane] - alone).abs() < 1e-9 * alone;
                assert!(agrees, "{seed} {lane}: {} {alone}", lanes[lane]);
                let is_on_grid = {
                    let point = rays.ray(lane).at(alone.min(1e6));
                    (-2.0..14.0).contains(&point.x) && (-6.0..6.0).contains(&point.y)
                };
                assert!(!is_on_grid || alone >= clear_m, "{seed} {lane}: {alone} {clear_m}");
                hits += u32::from(alone < f64::INFINITY);
            }
        }
    }
    assert!(together > 300 && hits > 8000, "{together} {hits}");
}

#[test]
fn rays_of_a_pixel_meet_a_rock_as_each_alone() {
    let (mut met, mut missed) = (0, 0);
    for seed in 0..200u64 {
        let shape = [RockShape::Angular, RockShape::Block, RockShape::Cobble, RockShape::Slab];
        let shape = shape[(seed % 4) as usize];
        let from =
            RockSeed { x_m: 3.0, y_m: -1.0, diameter_m: 0.4, height_m: 0.2, shape, face_yaw_rad: None, seed };
        let rock = Rock::grow(&from, 0.3, &-Vector3::z());
        let origin = Point3::new(2.0 * unit(seed, 0), 2.0 * unit(seed, 1) - 2.0, -1.0 + unit(seed, 2));
        let (mut directions, mut points) = ([[0.0; LANES]; 3], [[0.0; LANES]; 3]);
        for lane in 0..LANES {
            let aim = |n: u64| 2.0 * unit(seed, 3 + 3 * lane as u64 + n) - 1.0;
            let off = Vector3::new(aim(0), aim(1), aim(2)) * rock.radius_m;
            let direction = (rock.centre + off - origin).normalize();
            for k in 0..3 {
                (directions[k][lane], points[k][lane]) = (direction[k], rock.centre[k] + 1.3 * off[k]);
            }
        }
        let (enter_m, planes) = rock.enter_lanes(&origin, &directions);
        let to_sun = Vector3::new(0.5, 0.2, -0.6).normalize();
        let [from_m, until_m] = rock.passage_lanes(&points, &to_sun);
        for lane in 0..LANES {
            let [direction, point] = [&directions, &points].map(|v| [v[0][lane], v[1][lane], v[2][lane]]);
            match rock.interval(&Ray { origin, direction: direction.into() }) {
                Some(alone) => {
                    met += 1;
                    assert!((enter_m[lane] - alone.enter_m).abs() < 1e-12, "{seed} {lane}");
                    assert_eq!(planes[lane], alone.plane);
                }
                None => {
                    missed += 1;
                    assert_eq!(enter_m[lane], f64::INFINITY);
                }
            }
            match rock.interval(&Ray { origin: point.into(), direction: to_sun }) {
                Some(alone) => {
                    assert!((from_m[lane] - alone.enter_m).abs() < 1e-12);
                    assert!((until_m[lane] - alone.leave_m).abs() < 1e-12);
                }
                None => assert!(until_m[lane] < from_m[lane]),
            }
        }
    }
    assert!(met > 800 && missed > 300, "{met} {missed}");
}
