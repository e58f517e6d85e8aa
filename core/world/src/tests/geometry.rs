//! Rays meet the correct surfaces, and shadows are in the correct places.

use nalgebra::Vector2;

use super::{SurfaceId, World, demo, true_stops, unit};
use sightline_geometry::frames::{Point3, Ray, Vector3};

/// The first hit by testing every rock and marching over the ground, without tree, grid or pyramid.
fn brute_force(world: &World, ray: &Ray, to_m: f64) -> Option<(f64, SurfaceId)> {
    let rocks = world.rocks().iter().enumerate().filter_map(|(index, rock)| {
        let interval = rock.interval(ray)?;
        (interval.enter_m > 0.0).then_some((interval.enter_m, SurfaceId::Rock(index as u32)))
    });
    let rock = rocks.min_by(|a, b| a.0.total_cmp(&b.0));
    let below = |t: f64| ray.at(t).z >= world.ground_z_at(ray.at(t).x, ray.at(t).y);
    let to_m = rock.map_or(to_m, |(t, _)| t);
    let step = 1e-3;
    let ground = (1..=(to_m / step) as usize).map(|k| k as f64 * step).find(|t| below(*t)).map(|mut high| {
        let mut low = high - step;
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            if below(middle) { high = middle } else { low = middle }
        }
        (high, SurfaceId::Ground)
    });
    ground.or(rock)
}

#[test]
fn cast_agrees_with_brute_force_on_rocks_and_ground() {
    let world = &demo().world;
    let (mut rocks, mut ground, mut sky) = (0, 0, 0);
    for k in 0..600 {
        let origin = Point3::new(9.0 * unit(k, 0), 4.0 * unit(k, 1) - 2.0, -0.6 - unit(k, 2));
        let aim = Point3::new(8.0 + 5.0 * unit(k, 3), 5.0 * unit(k, 4) - 2.5, 0.5 * unit(k, 5) - 0.1);
        let ray = Ray { origin, direction: (aim - origin).normalize() };
        let cast = world.cast(&ray);
        let expected = brute_force(world, &ray, 25.0);
        match (cast, expected) {
            (Some(hit), Some((distance_m, surface))) => {
                assert!((hit.distance_m - distance_m).abs() < 1e-6, "{hit:?} {distance_m} {surface:?}");
                assert_eq!(hit.surface, surface);
                assert!(hit.normal.dot(&ray.direction) < 0.0 && (hit.normal.norm() - 1.0).abs() < 1e-12);
                assert!((hit.point - ray.at(hit.distance_m)).norm() < 1e-12);
                rocks += u32::from(surface != SurfaceId::Ground);
                ground += u32::from(surface == SurfaceId::Ground);
            }
            (cast, None) => {
                assert!(cast.is_none_or(|hit| hit.distance_m > 24.9));
                sky += 1;
            }
            (None, Some(missed)) => panic!("missed {missed:?}"),
        }
    }
    assert!(rocks > 100 && ground > 100, "{rocks} {ground} {sky}");
}

#[test]
fn a_hit_is_visible_from_where_the_ray_came_and_what_lies_behind_is_not() {
    let world = &demo().world;
    for k in 0..300 {
        let origin = Point3::new(6.0 * unit(k, 0), unit(k, 1), -1.3);
        let aim = Point3::new(9.0 + 2.0 * unit(k, 2), 2.0 * unit(k, 3) - 1.0, 0.3);
        let ray = Ray { origin, direction: (aim - origin).normalize() };
        let hit = world.cast(&ray).unwrap();
        assert!(world.is_visible(&origin, &hit.point));
        assert!(!world.is_visible(&origin, &ray.at(hit.distance_m + 0.01)));
    }
}

#[test]
fn behind_a_rock_along_the_sun_is_shadow_and_before_it_is_not() {
    let world = &demo().world;
    let mut tall = 0;
    for rock in world.rocks().iter().filter(|rock| rock.diameter_m > 0.2 && rock.centre.x < 18.0) {
        // From a point inside the rock, 5 cm above the ground if it is tall enough, away from the sun.
        let top_z_m = rock.interval(&Ray { origin: rock.centre, direction: Vector3::z() }).unwrap().enter_m;
        let start = rock.centre + Vector3::z() * (0.5 * top_z_m);
        if start.z > world.ground_z_at(start.x, start.y) - 0.05 {
            continue;
        }
        tall += 1;
        let from_sun = Ray { origin: start, direction: -world.to_sun() };
        let ground_m = world.scenery.terrain.cast(&from_sun, 0.0, 10.0).unwrap();
        assert!(world.in_shadow(&from_sun.at(ground_m)), "{rock:?}");
    }
    assert!(tall > 30, "{tall}");
}

#[test]
fn shadows_agree_with_asking_every_rock() {
    let world = &demo().world;
    let (mut dark, mut lit) = (0, 0);
    for k in 0..3000 {
        let place = Vector2::new(9.0 + 3.0 * unit(k, 0), 3.0 * unit(k, 1) - 1.5);
        let down = Ray { origin: Point3::new(place.x, place.y, -3.0), direction: Vector3::z() };
        let hit = world.cast(&down).unwrap();
        let to_sun = Ray { origin: hit.point, direction: world.to_sun() };
        let by_rock =
            world.rocks().iter().filter_map(|rock| rock.interval(&to_sun)).any(|interval| {
                interval.leave_m > 1e-6 && interval.leave_m - interval.enter_m.max(0.0) > 1e-6
            });
        let by_ground =
            (1..400).map(|step| to_sun.at(f64::from(step) * 1e-3)).any(|p| p.z > world.ground_z_at(p.x, p.y));
        // The demonstration's ground is nowhere as steep as its sun's elevation.
        assert!(!by_ground || hit.surface != SurfaceId::Ground);
        assert_eq!(world.in_shadow(&hit.point), by_rock, "{hit:?}");
        if by_rock { dark += 1 } else { lit += 1 }
    }
    assert!(dark > 200 && lit > 1000, "{dark} {lit}");
}

#[test]
fn a_low_sun_makes_the_ground_shade_itself() {
    let mut scenario = demo().scenario.clone();
    (scenario.sun.elevation_deg, scenario.terrain.rms_at_1m_m, scenario.rocks.area_fraction) =
        (6.0, 0.06, 0.0);
    scenario.rocks.cluster_count = 0;
    scenario.terrain.cell_m = 0.05;
    let world = World::new(&scenario);
    assert!(world.rocks().is_empty());
    let mut dark = 0;
    for k in 0..2000 {
        let (x, y) = (2.0 + 8.0 * unit(k, 0), 6.0 * unit(k, 1) - 3.0);
        let point = Point3::new(x, y, world.ground_z_at(x, y));
        let to_sun = Ray { origin: point, direction: world.to_sun() };
        let depth_m = |t: f64| to_sun.at(t).z - world.ground_z_at(to_sun.at(t).x, to_sun.at(t).y);
        let deepest_m = (1..4000).map(|k| depth_m(f64::from(k) * 2e-3)).fold(f64::NEG_INFINITY, f64::max);
        // Rays that the march cannot clearly classify as blocked or free are left out.
        if deepest_m.abs() > 2e-4 {
            assert_eq!(world.in_shadow(&point), deepest_m > 0.0, "{point:?} {deepest_m}");
            dark += u32::from(deepest_m > 0.0);
        }
    }
    assert!(dark > 100, "{dark}");
}

#[test]
fn the_rover_drives_up_down_and_across_slopes_and_leans_as_they_do() {
    for (slope_deg, azimuth_deg) in [(18.0, 0.0), (18.0, 180.0), (10.0, 90.0), (16.0, -45.0)] {
        let mut scenario = demo().scenario.clone();
        (scenario.terrain.cell_m, scenario.terrain.rms_at_1m_m) = (0.05, 0.005);
        (scenario.terrain.slope_deg, scenario.terrain.slope_azimuth_deg) = (slope_deg, azimuth_deg);
        scenario.rocks.farthest_m = 8.0;
        let world = World::new(&scenario);
        let stops = true_stops(&world, &scenario);
        let angle = f64::to_radians(azimuth_deg);
        let uphill = Vector3::new(angle.cos(), angle.sin(), 0.0);
        for stop in &stops {
            let down = stop.site_from_rover * Vector3::z();
            // The wheels stand on a relief of 5 mm over a metre, which tilts the rover by some tenths of a degree.
            let lean_deg = down.dot(&uphill).asin().to_degrees();
            assert!((lean_deg - slope_deg).abs() < 0.8, "{slope_deg} {azimuth_deg}: {lean_deg}");
            assert!(down.cross(&uphill).norm() > 0.9);
        }
        // Beyond the grid the plane continues to the end of the slope.
        let far = Point3::new(50.0, 20.0, -80.0);
        let hit = world.cast(&Ray { origin: far, direction: Vector3::z() }).unwrap();
        let rise_m = slope_deg.to_radians().tan() * (50.0 * angle.cos() + 20.0 * angle.sin());
        assert!((hit.point.z - (0.294 - rise_m)).abs() < 1e-9, "{hit:?}");
    }
}

#[test]
fn bad_settings_of_ground_rocks_and_light_are_named() {
    let refused = |text: &str| {
        let read = crate::Scenario::from_toml(text, std::path::Path::new("s.toml"));
        read.expect_err("refused").to_string()
    };
    for (text, name) in [
        ("[terrain]\nslope_deg = 50.0\n", "terrain.slope_deg"),
        ("[terrain]\nripple_height_m = 0.05\nripple_wavelength_m = 0.1\n", "terrain.ripple_wavelength_m"),
        ("[texture]\ngrain_cover = 0.9\n", "texture.grain_cover"),
        ("[sun]\noptical_depth = 9.0\n", "sun.optical_depth"),
        ("[sun]\nhapke_lobe = 1.0\n", "sun.hapke_lobe"),
        ("[sun]\nreflectance = \"mirror\"\n", "reflectance"),
        (
            "[[rocks.placed]]\nx_m = 0.0\ny_m = 0.0\ndiameter_m = 5.0\nheight_m = 0.1\n",
            "rocks.placed.diameter_m",
        ),
        ("[[rocks.placed]]\nx_m = 0.0\ny_m = 0.0\nheight_m = 0.1\n", "diameter_m"),
    ] {
        assert!(refused(text).contains(name), "{}", refused(text));
    }
    let placed = "[sun]\noptical_depth = 0.5\nreflectance = \"hapke\"\n[[rocks.placed]]\nx_m = 0.1\ny_m = 0.0\ndiameter_m = 0.07\nheight_m = 0.05\nshape = \"cobble\"\n";
    let read = crate::Scenario::from_toml(placed, std::path::Path::new("s.toml")).unwrap();
    let again = crate::Scenario::from_toml(&read.to_toml(), std::path::Path::new("s.toml")).unwrap();
    assert_eq!(read, again);
    assert_eq!((read.rocks.placed[0].yaw_deg, read.sun.optical_depth), (180.0, Some(0.5)));
}
