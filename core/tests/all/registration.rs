//! Registrations of synthetic surfaces: correct ones, and those that must be refused with their reasons.

use nalgebra::Matrix3;
use rand::SeedableRng;
use rand_pcg::Pcg64;

use sightline_experiments::registration::views::Stereo;
use sightline_experiments::registration::{Case, Staging};
use sightline_geometry::cancel::Cancel;
use sightline_geometry::frames::{Point3, Pose, Ray, Vector3};
use sightline_vision::registration::*;
use sightline_world::ground::rocks::{Rock, RockSeed};
use sightline_world::scenario::RockShape;

const GROUND_Z_M: f64 = 0.294;

/// The direction from one point to another.
fn direction(from: &Point3, to: &Point3) -> Vector3 {
    (to - from).normalize()
}

const BOTH: [Method; 2] = [Method::SimplexL1, Method::PointToPlane];

fn with(method: Method) -> ShapeSettings {
    ShapeSettings { method, ..ShapeSettings::default() }
}

fn exact() -> Stereo {
    Stereo { sigma_px: 0.0, wrong: 0.0, ..Stereo::default() }
}

/// Intersection of a ray with level ground.
fn ground(ray: &Ray) -> Option<(Point3, Vector3, f64)> {
    let distance_m = (GROUND_Z_M - ray.origin.z) / ray.direction.z;
    (distance_m > 0.0).then(|| (ray.at(distance_m), -Vector3::z(), distance_m))
}

/// Intersection of a ray with a sphere.
fn ball(ray: &Ray, centre: &Point3, radius_m: f64) -> Option<(Point3, Vector3, f64)> {
    let from = ray.origin - centre;
    let along = from.dot(&ray.direction);
    let room = along * along - from.norm_squared() + radius_m * radius_m;
    let distance_m = -along - room.max(0.0).sqrt();
    let point = ray.at(distance_m);
    (room > 0.0 && distance_m > 0.0).then(|| (point, (point - centre) / radius_m, distance_m))
}

fn nearest(hits: &[Option<(Point3, Vector3, f64)>]) -> Option<(Point3, Vector3)> {
    let met = hits.iter().flatten().min_by(|a, b| a.2.total_cmp(&b.2));
    met.map(|&(point, normal, _)| (point, normal))
}

/// An angular rock of 0.5 m on level ground, 4 m ahead.
fn rock(seed: u64, shape: RockShape) -> Rock {
    let from =
        RockSeed { x_m: 4.0, y_m: 0.0, diameter_m: 0.5, height_m: 0.35, shape, face_yaw_rad: None, seed };
    Rock::grow(&from, GROUND_Z_M, &-Vector3::z())
}

/// The rock seen twice; the target is the intersection of the first view's line of sight with the rock.
fn rock_case(rock: &Rock, stereo: &Stereo, seed: u64) -> Case {
    let cast = |ray: &Ray| {
        let on_rock = rock.interval(ray).filter(|interval| interval.enter_m > 0.0);
        let on_rock = on_rock.map(|i| (ray.at(i.enter_m), rock.normal(i.plane), i.enter_m));
        nearest(&[on_rock, ground(ray)])
    };
    let aim = rock.centre + Vector3::new(0.0, 0.03, -0.05);
    let camera = Point3::new(1.5, 0.0, -1.2);
    let (target, _) = cast(&Ray { origin: camera, direction: direction(&camera, &aim) }).unwrap();
    Case::of_surface(&cast, &target, 0.25, 0.0, (&Staging::default(), stereo, seed))
}

fn registered(case: &Case, start: &Pose, settings: &ShapeSettings) -> Registration {
    let [fixed, moving] = case.meshes(start, settings);
    case.register([&fixed, &moving], start, settings)
}

#[test]
fn a_known_motion_is_found_from_exact_points() {
    let case = rock_case(&rock(3, RockShape::Angular), &exact(), 1);
    for method in BOTH {
        let start = case.start(0.6, &Staging::default(), 5);
        let found = registered(&case, &start, &with(method));
        let row = case.row(&found, 0.6, method);
        assert_eq!(found.failure, None, "{method:?}");
        // The start error is 15 cm and 30 mrad; facets of 1 cm cut off the rock's edges.
        assert!(row.error_m < 1.5e-3 && row.error_rad < 5e-3, "{method:?} {row:?}");
    }
}

#[test]
fn a_known_motion_is_found_as_well_as_the_noise_allows() {
    let case = rock_case(&rock(3, RockShape::Angular), &Stereo::default(), 2);
    for method in BOTH {
        let start = case.start(0.6, &Staging::default(), 6);
        let row = case.row(&registered(&case, &start, &with(method)), 0.6, method);
        assert!(row.is_success(), "{method:?} {row:?}");
        assert!(row.error_m < 8e-3 && row.nees < Some(16.3), "{method:?} {row:?}");
        assert!(row.sigma_m.is_some_and(|sigma_m| (5e-4..5e-3).contains(&sigma_m)), "{row:?}");
    }
}

#[test]
fn objective_and_depth_errors_fall_from_coarse_to_fine() {
    let case = rock_case(&rock(4, RockShape::Block), &Stereo::default(), 3);
    let start = case.start(0.5, &Staging::default(), 7);
    for method in BOTH {
        let found = registered(&case, &start, &with(method));
        let [before, coarse, fine] = found.agreement.map(|agreement| agreement.unwrap().mean_m);
        assert!(before > 2.0 * coarse && coarse > fine, "{method:?} {before} {coarse} {fine}");
        let mean = |values: &[f32]| {
            let seen: Vec<f64> = values.iter().filter(|v| !v.is_nan()).map(|v| f64::from(v.abs())).collect();
            seen.iter().sum::<f64>() / seen.len() as f64
        };
        let errors = &found.depth_errors;
        for (values, expected) in
            [(&errors.before_m, before), (&errors.coarse_m, coarse), (&errors.fine_m, fine)]
        {
            assert!((mean(values) - expected).abs() < 1e-6);
        }
        let last = found.path.last().unwrap();
        assert!(found.path.len() > 3 && last.value_m < coarse);
    }
}

#[test]
fn the_coarse_search_finds_a_unique_shift() {
    let case = rock_case(&rock(3, RockShape::Angular), &exact(), 1);
    let staging = Staging { start_turn_rad: 0.0, ..Staging::default() };
    let start = case.start(0.7, &staging, 9);
    let found = registered(&case, &start, &with(Method::PointToPlane));
    let best = found.coarse.best.unwrap();
    let sensor = found.sensor.unwrap();
    // The truth as an offset in the sensor's frame.
    let truth = sensor.sensor_from_fixed
        * case.fixed_from_moving
        * start.inverse()
        * sensor.sensor_from_fixed.inverse();
    let shift = truth.translation.vector;
    assert!(shift.xy().norm() > 0.1);
    for axis in 0..3 {
        assert!((best.shift_m[axis] - shift[axis]).abs() < 0.75 * found.coarse.step_m, "{best:?} {shift}");
    }
    let side = 2 * found.coarse.steps + 1;
    assert_eq!(found.coarse.mean_m.len(), side * side);
    assert!(!best.is_at_edge && found.coarse.other.is_none_or(|other| other.mean_m > 2.0 * best.mean_m));
}

#[test]
fn a_pinhole_sensor_finds_the_same_motion() {
    let case = rock_case(&rock(3, RockShape::Angular), &exact(), 1);
    let start = case.start(0.4, &Staging::default(), 5);
    let settings = ShapeSettings { search_half_range_m: Some(0.12), ..with(Method::PointToPlane) };
    let [fixed, moving] = case.meshes(&start, &settings);
    let sight = case.target_in_fixed - case.viewpoint_in_rover;
    let sensor = RangeSensor::pinhole(&case.viewpoint_in_rover, &sight, 0.12, [64, 64]);
    let found = register(
        &RegistrationInput {
            fixed: &fixed,
            moving: &moving,
            start_fixed_from_moving: &start,
            target_in_fixed: &case.target_in_fixed,
            half_width_m: case.half_width_m,
            prior: None,
            sensor: Some(sensor),
            cancel: Cancel::default(),
        },
        &settings,
    );
    let row = case.row(&found, 0.4, Method::PointToPlane);
    assert!(row.is_success() && row.error_m < 2e-3, "{row:?}");
}

#[test]
fn cancelled_registration_compares_no_shift_and_takes_no_step() {
    let case = rock_case(&rock(3, RockShape::Angular), &exact(), 1);
    let start = case.start(0.4, &Staging::default(), 5);
    let cancelled = std::sync::atomic::AtomicBool::new(true);
    for method in BOTH {
        let settings = with(method);
        let [fixed, moving] = case.meshes(&start, &settings);
        let input = RegistrationInput {
            fixed: &fixed,
            moving: &moving,
            start_fixed_from_moving: &start,
            target_in_fixed: &case.target_in_fixed,
            half_width_m: case.half_width_m,
            prior: None,
            sensor: None,
            cancel: Cancel::from(&cancelled),
        };
        let found = register(&input, &settings);
        assert!(found.failure.is_some() && found.path.is_empty(), "{method:?}");
        assert!(found.coarse.mean_m.iter().all(|mean_m| mean_m.is_infinite()), "{method:?}");
        let free = register(&RegistrationInput { cancel: Cancel::default(), ..input }, &settings);
        assert!(free.failure.is_none(), "{method:?}: {:?}", free.failure);
    }
}

#[test]
fn flat_ground_and_a_smooth_boulder_have_not_enough_shape() {
    let level = |ray: &Ray| nearest(&[ground(ray)]);
    let boulder_at = Point3::new(4.0, 0.0, 0.0);
    let boulder = |ray: &Ray| nearest(&[ball(ray, &boulder_at, 0.3)]);
    let on_ground = Point3::new(4.0, 0.0, GROUND_Z_M);
    let on_boulder = boulder_at + direction(&boulder_at, &Point3::new(1.5, 0.3, -1.2)) * 0.3;
    for stereo in [exact(), Stereo::default()] {
        for method in BOTH {
            for (case, name) in [
                (Case::of_surface(&level, &on_ground, 0.25, 0.0, (&Staging::default(), &stereo, 3)), "flat"),
                (
                    Case::of_surface(&boulder, &on_boulder, 0.25, 0.0, (&Staging::default(), &stereo, 4)),
                    "ball",
                ),
            ] {
                let start = case.start(0.3, &Staging::default(), 8);
                let found = registered(&case, &start, &with(method));
                assert!(
                    matches!(found.failure, Some(Failure::NotEnoughShape { .. })),
                    "{name} {method:?} {:?} {:?}",
                    found.failure,
                    found.sigma_m()
                );
            }
        }
    }
}

#[test]
fn another_rock_does_not_fit() {
    let first = rock_case(&rock(3, RockShape::Angular), &Stereo::default(), 1);
    let second = rock_case(&rock(8, RockShape::Slab), &Stereo::default(), 2);
    let mixed = Case { views: [first.views[0].clone(), second.views[1].clone()], ..first.clone() };
    for method in BOTH {
        let start = mixed.start(0.2, &Staging::default(), 3);
        let found = registered(&mixed, &start, &with(method));
        assert!(matches!(found.failure, Some(Failure::DoesNotFit { .. })), "{method:?} {:?}", found.failure);
    }
}

#[test]
fn missing_or_disjoint_surfaces_are_reported_by_name() {
    let case = rock_case(&rock(3, RockShape::Angular), &Stereo::default(), 1);
    let settings = with(Method::PointToPlane);
    let start = case.start(0.0, &Staging::default(), 3);
    let [fixed, moving] = case.meshes(&start, &settings);
    let failure = |meshes: [&Mesh; 2], start: &Pose| case.register(meshes, start, &settings).failure;
    let region = Region { centre: case.target_in_fixed, radius_m: 1.0 };
    let empty = PointGrid::empty(300, 300);
    let empty = Mesh::from_grid(&empty, &case.viewpoint_in_rover, Some(&region), &settings.mesh);
    assert_eq!(failure([&fixed, &empty], &start), Some(Failure::EmptySurface { side: Side::Moving }));
    assert_eq!(failure([&empty, &moving], &start), Some(Failure::EmptySurface { side: Side::Fixed }));
    let three = Mesh { triangles: moving.triangles[..3].to_vec(), ..moving.clone() };
    assert_eq!(
        failure([&fixed, &three], &start),
        Some(Failure::TooFewTriangles { side: Side::Moving, triangles: 3, least: 100 })
    );
    let mut apart = start;
    apart.translation.vector.y += 2.0;
    let refused = failure([&fixed, &moving], &apart);
    assert!(matches!(refused, Some(Failure::NoOverlap { share, .. }) if share < 0.1), "{refused:?}");
    let text = refused.unwrap().to_string();
    assert_eq!(text, "the surfaces share 0 % of the target's pixels, less than 40 %");
}

#[test]
fn a_row_of_equal_rocks_is_not_isolated() {
    let stones = [-0.3, 0.0, 0.3].map(|aside| {
        let mut stone = rock(3, RockShape::Angular);
        stone.centre.y += aside;
        stone
    });
    let cast = |ray: &Ray| {
        let mut hits = vec![ground(ray)];
        hits.extend(stones.iter().map(|stone| {
            let interval = stone.interval(ray).filter(|interval| interval.enter_m > 0.0)?;
            Some((ray.at(interval.enter_m), stone.normal(interval.plane), interval.enter_m))
        }));
        nearest(&hits)
    };
    let camera = Point3::new(1.5, 0.0, -1.2);
    let (target, _) =
        cast(&Ray { origin: camera, direction: direction(&camera, &stones[1].centre) }).unwrap();
    let case = Case::of_surface(&cast, &target, 0.12, 0.0, (&Staging::default(), &Stereo::default(), 4));
    let settings =
        ShapeSettings { search_half_range_m: Some(0.4), margin: 0.2, ..with(Method::PointToPlane) };
    let start = case.start(0.0, &Staging::default(), 3);
    let found = registered(&case, &start, &settings);
    assert!(
        matches!(found.failure, Some(Failure::NotIsolated { distance_m, .. }) if (distance_m - 0.3).abs() < 0.05),
        "{:?} {:?} {:?}",
        found.failure,
        found.coarse.best,
        found.coarse.other
    );
}

#[test]
fn the_bits_do_not_depend_on_the_number_of_threads() {
    let case = rock_case(&rock(4, RockShape::Block), &Stereo::default(), 3);
    let start = case.start(0.5, &Staging::default(), 7);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| registered(&case, &start, &with(Method::PointToPlane)))
    };
    let (one, three) = (run(1), run(3));
    assert_eq!(one.record(), three.record());
    assert_eq!((one.coarse, one.path), (three.coarse, three.path));
}

/// With noise, because a registration without noise cannot reveal a covariance in a wrong frame.
#[test]
fn the_covariance_matches_the_scatter_under_noise() {
    let rock = rock(3, RockShape::Angular);
    let settings = with(Method::PointToPlane);
    let mut random = Pcg64::seed_from_u64(1);
    let (mut scatter, mut told) = (Matrix3::zeros(), Matrix3::zeros());
    let draws = 24;
    let mut mean = Vector3::zeros();
    let errors: Vec<Vector3> = (0..draws)
        .map(|_| {
            let seed = rand::RngExt::random_range(&mut random, 0..1_000_000);
            // The geometry is the same for every seed except for the tilt of the rover, which is set to zero.
            let staging = Staging { tilt_rad: 0.0, ..Staging::default() };
            let cast = |ray: &Ray| {
                let on_rock = rock.interval(ray).filter(|interval| interval.enter_m > 0.0);
                let on_rock = on_rock.map(|i| (ray.at(i.enter_m), rock.normal(i.plane), i.enter_m));
                nearest(&[on_rock, ground(ray)])
            };
            let camera = Point3::new(1.5, 0.0, -1.2);
            let aim = rock.centre + Vector3::new(0.0, 0.03, -0.05);
            let (target, _) = cast(&Ray { origin: camera, direction: direction(&camera, &aim) }).unwrap();
            let case = Case::of_surface(&cast, &target, 0.25, 0.0, (&staging, &Stereo::default(), seed));
            let found = registered(&case, &case.start(0.2, &staging, seed), &settings);
            told += found.covariance_in_moving.unwrap() / f64::from(draws);
            found.target_in_moving - case.fixed_from_moving.inverse() * case.target_in_fixed
        })
        .collect();
    for error in &errors {
        mean += error / f64::from(draws);
    }
    for error in &errors {
        scatter += (error - mean) * (error - mean).transpose() / f64::from(draws - 1);
    }
    let sigmas = [scatter, told].map(|covariance| covariance.trace().sqrt());
    println!(
        "scatter {:.2} mm, told {:.2} mm, bias {:.2} mm",
        sigmas[0] * 1e3,
        sigmas[1] * 1e3,
        mean.norm() * 1e3
    );
    assert!((0.5..2.0).contains(&(sigmas[0] / sigmas[1])), "{sigmas:?}");
    assert!(mean.norm() < 4e-3, "{mean}");
}
