//! Moments of a drive on scenes with closed-form ground truth: ranges, normals, shadows and occlusion.

use super::*;
use crate::moment::Moment;
use crate::scenario::{Cloud, Occluder};
use crate::solids::{Look, Shape, Solid, SolidKind};
use crate::truth::{Visibility, picture_truth, pixel_truth, visibility};
use sightline_geometry::camera::Camera;
use sightline_geometry::frames::{Pixel, Point3, Pose, Ray, Vector3};

/// A level plain without rocks.
fn plain() -> Scenario {
    let mut scenario = Scenario::default();
    (scenario.rocks.area_fraction, scenario.rocks.cluster_count) = (0.0, 0);
    scenario.terrain.rms_at_1m_m = 0.0;
    scenario.camera.image_size = 128;
    scenario
}

fn ball(middle: Point3, radius_m: f64) -> Solid {
    let (shape, look) = (Shape::Sphere(radius_m), Look::Plain(0.5));
    Solid { kind: SolidKind::Fiducial, middle, shape, look, is_seen: true }
}

/// The plain with a ball, its index, and the left camera of the first stop in the site.
fn scene(ball: Solid) -> (Scenario, World, TraverseIndex, Camera) {
    let scenario = plain();
    let mut world = World::new(&scenario);
    world.solids.push(ball);
    let index = index(&scenario, &world).unwrap();
    let camera = true_camera_in_site(&index.stops[0], Eye::Left).unwrap();
    (scenario, world, index, camera)
}

fn moment(index: &TraverseIndex, stop: usize) -> Moment {
    Moment::of(stop, &index.stops).unwrap()
}

#[test]
fn ranges_of_a_plane_and_a_sphere_are_those_of_their_closed_forms() {
    let middle = Point3::new(8.0, 0.3, -0.4);
    let (_, world, _, camera) = scene(ball(middle, 0.5));
    let truth = picture_truth(&world, &camera);
    let (mut on_ball, mut on_ground, mut in_sky) = (0, 0, 0);
    for (k, &range_m) in truth.range_m.iter().enumerate() {
        let pixel = Pixel::new(f64::from(k as u32 % 128), f64::from(k as u32 / 128));
        let ray = camera.ray(pixel).unwrap();
        let (o, d) = (ray.origin - middle, ray.direction);
        let root = o.dot(&d).powi(2) - o.norm_squared() + 0.25;
        // `MEAN_GROUND_Z_M` is stored as f32 in the height field.
        let to_plane_m = (f64::from(0.294f32) - ray.origin.z) / d.z;
        match truth.surface[k] {
            Some(SurfaceId::Solid(SolidKind::Fiducial, 0)) => {
                on_ball += 1;
                assert!((range_m - (-o.dot(&d) - root.sqrt())).abs() < 1e-6);
                let normal = (ray.at(range_m) - middle) / 0.5;
                let stored = Vector3::from(truth.normal[k].map(f64::from));
                assert!((stored - normal).norm() < 1e-6);
            }
            Some(SurfaceId::Ground) => {
                on_ground += 1;
                assert!((range_m - to_plane_m).abs() < 1e-6 * to_plane_m.max(1.0), "{range_m} {to_plane_m}");
            }
            None => {
                in_sky += 1;
                assert!(range_m.is_infinite() && d.z <= 0.0 && root <= 0.0);
            }
            other => panic!("there is no {other:?}"),
        }
    }
    assert!(on_ball > 50 && on_ground > 5000 && in_sky > 500, "{on_ball} {on_ground} {in_sky}");
}

#[test]
fn a_ball_shades_the_ellipse_that_the_sun_s_cylinder_cuts_from_the_ground() {
    let middle = Point3::new(8.0, 0.3, -1.0);
    let (_, world, _, _) = scene(ball(middle, 0.4));
    let to_sun = world.to_sun();
    let (mut shaded, mut lit) = (0, 0);
    for k in 0..10_000u32 {
        let (x, y) = (6.0 + f64::from(k % 100) * 0.04, -2.0 + f64::from(k / 100) * 0.04);
        let point = Point3::new(x, y, world.ground_z_at(x, y));
        let off = point - middle;
        let aside_m = (off - off.dot(&to_sun) * to_sun).norm();
        if (aside_m - 0.4).abs() < 1e-4 {
            continue;
        }
        assert_eq!(world.in_shadow(&point), aside_m < 0.4, "{point}");
        if aside_m < 0.4 { shaded += 1 } else { lit += 1 }
    }
    assert!(shaded > 200 && lit > 2000, "{shaded} {lit}");
    // The half of the ball that faces away from the sun is dark, the other is lit.
    for direction in [to_sun, -to_sun] {
        let point = middle + direction * 0.4;
        assert_eq!(world.in_shadow(&point), direction == -to_sun);
    }
}

#[test]
fn a_point_behind_the_ball_is_occluded_by_it_and_one_beside_the_picture_is_out_of_frame() {
    let middle = Point3::new(8.0, 0.3, -0.4);
    let (_, world, _, camera) = scene(ball(middle, 0.5));
    let eye = camera.model.centre();
    let behind = eye + (middle - eye) * 1.2;
    let Visibility::Occluded { pixel, by } = visibility(&world, &camera, &behind) else {
        panic!("the ball stands before the point")
    };
    assert_eq!(by, SurfaceId::Solid(SolidKind::Fiducial, 0));
    assert!(pixel.distance(camera.project(&behind).unwrap()) < 1e-12);
    let front = pixel_truth(&world, &camera, pixel).unwrap().point;
    let is_lit = (front - middle).dot(&world.to_sun()) > 0.0;
    let Visibility::Visible { pixel: seen, is_lit: lit } = visibility(&world, &camera, &front) else {
        panic!("nothing stands before the ball")
    };
    assert!(seen.distance(pixel) < 1e-9 && lit == is_lit);
    let left = Point3::new(0.5, -9.0, 0.2);
    assert_eq!(visibility(&world, &camera, &left), Visibility::OutOfFrame);
}

#[test]
fn an_occluder_hides_the_centre_at_its_stops_and_its_edges_are_where_they_should_be() {
    let mut scenario = plain();
    let block = Occluder { from_stop: 2, to_stop: 3, at: 0.5, width_m: 0.6, height_m: 0.4, aside_m: 0.0 };
    scenario.events.occluders.push(block);
    let world = World::new(&scenario);
    let index = index(&scenario, &world).unwrap();
    let centre = world.targets_centre();
    for stop in 0..5 {
        let camera = true_camera_in_site(&index.stops[stop], Eye::Left).unwrap();
        let now = world.at(&moment(&index, stop), &scenario);
        let hidden = matches!(visibility(&now, &camera, &centre), Visibility::Occluded { .. });
        assert_eq!(hidden, (2..=3).contains(&stop), "stop {stop}");
        if !hidden {
            continue;
        }
        let (eye, ahead) = (camera.model.centre(), centre - camera.model.centre());
        let right = Vector3::z().cross(&Vector3::new(ahead.x, ahead.y, 0.0).normalize());
        for (aside_m, is_block) in [(0.299, true), (0.301, false), (-0.299, true), (-0.301, false)] {
            // The front face is 5 mm in front of the centre; the ray passes it near there.
            let target = eye + 0.5 * ahead + aside_m * right;
            let ray = Ray { origin: eye, direction: (target - eye).normalize() };
            let met = now.cast(&ray).unwrap().surface;
            let block = matches!(met, SurfaceId::Solid(SolidKind::Occluder, _));
            assert_eq!(block, is_block, "stop {stop}, {aside_m} m aside");
        }
    }
}

#[test]
fn the_sun_moves_at_its_rate_and_a_cloud_takes_the_direct_light_alone() {
    let mut scenario = plain();
    scenario.events.sun_azimuth_deg_per_h = 14.6;
    scenario.events.sun_elevation_deg_per_h = -6.0;
    scenario.events.clouds.push(Cloud { from_stop: 1, to_stop: 1, direct: 0.05 });
    let world = World::new(&scenario);
    let at = |stop: u32, time_s: f64| {
        let moment = Moment {
            stop,
            time_s,
            site_from_rover: Pose::identity(),
            left_camera: Point3::new(0.5, 0.0, -1.2),
            wheel_places_m: None,
        };
        world.at(&moment, &scenario)
    };
    let [azimuth, elevation] = [115.0 + 14.6f64, 42.0 - 6.0].map(f64::to_radians);
    let expected =
        Vector3::new(elevation.cos() * azimuth.cos(), elevation.cos() * azimuth.sin(), -elevation.sin());
    assert!((at(0, 3600.0).to_sun() - expected).norm() < 1e-12);
    let radiance = |world: &World, in_sun: bool| {
        let look = crate::light::reflection::Appearance { albedo: 0.2, normal: [0.0, 0.0, -1.0] };
        f64::from(world.light.reflected(&look, [-0.6, 0.0, -0.8], in_sun, 1.0))
    };
    let (clear, clouded) = (at(0, 0.0), at(1, 0.0));
    assert!((radiance(&clear, false) - radiance(&clouded, false)).abs() < 1e-9);
    let direct = |world: &World| radiance(world, true) - radiance(world, false);
    assert!((direct(&clouded) / direct(&clear) - 0.05).abs() < 1e-5);
}
