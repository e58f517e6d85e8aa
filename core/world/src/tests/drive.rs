//! The drive keeps its distances, estimates have the stated errors, targets satisfy their rule.

use super::*;
use crate::camera::rig::Rig;
use crate::rover::approach::distances_m;
use crate::rover::odometry::estimates;
use crate::rover::scene::TrueStop;
use sightline_geometry::frames::{Pixel, Pose};

#[test]
fn seventeen_stops_follow_the_powers_of_nine_tenths() {
    let demo = demo();
    let stops = true_stops(&demo.world, &demo.scenario);
    assert_eq!((stops.len(), demo.index.stops.len()), (17, 17));
    let rig = Rig::new(&demo.scenario.camera);
    for (step, stop) in stops.iter().enumerate() {
        let wanted_m = 10.0 * 0.9f64.powi(step as i32);
        assert!((distance_m(&demo.world, &rig, stop) - wanted_m).abs() < 1e-9);
        let (left, _) = rig.cameras_in_rover(stop.angles);
        let pixel = left.moved(&stop.site_from_rover).project(&demo.world.targets_centre()).unwrap();
        assert!(pixel.distance(Pixel::new(511.5, 511.5)) < 1e-6, "{pixel:?}");
    }
    // R108: 29 steps of 5 % end at 2.259 m.
    let fives = distances_m(10.0, 2.26, 0.05);
    assert_eq!(fives.len(), 30);
    assert!((fives[29] - 2.259).abs() < 5e-4, "{}", fives[29]);
}

#[test]
fn the_rover_stands_level_on_level_ground_and_tilts_with_it() {
    let demo = demo();
    for stop in true_stops(&demo.world, &demo.scenario) {
        let pose = stop.site_from_rover;
        let wheels = [[0.7, -0.53], [0.7, 0.53], [-0.7, -0.53], [-0.7, 0.53]];
        for [x, y] in wheels {
            let contact = pose * sightline_geometry::frames::Point3::new(x, y, 0.294);
            // Six wheels on a plane: a wheel is off by the roughness of the ground over its base.
            assert!((contact.z - demo.world.ground_z_at(contact.x, contact.y)).abs() < 0.04);
        }
        let (roll, pitch, yaw) = pose.rotation.euler_angles();
        assert!(roll.abs() < 0.1 && pitch.abs() < 0.1 && yaw.abs() < 1e-3, "{roll} {pitch} {yaw}");
    }
}

#[test]
fn the_index_gives_estimate_and_truth_apart_and_equal_at_the_start() {
    let index = &demo().index;
    let truth = |stop: usize| index.stops[stop].truth.as_ref().unwrap().site_from_rover;
    assert_eq!(index.stops[0].site_from_rover, truth(0));
    assert!(index.stops[0].site_from_rover.to_pose().translation.vector.norm() < 0.1);
    assert_ne!(index.stops[16].site_from_rover, truth(16));
    assert_eq!(index.stops[3].left.image, "images/left_0003.png");
    assert_eq!(index.scenario.as_deref(), Some("scenario.toml"));
    assert!(index.stops.windows(2).all(|pair| pair[1].time_s > pair[0].time_s));
    let again = crate::index(&demo().scenario, &World::new(&demo().scenario)).unwrap();
    assert_eq!(&again, index);
}

#[test]
fn estimates_have_the_stated_errors_over_many_seeds() {
    let demo = demo();
    let poses: Vec<Pose> =
        true_stops(&demo.world, &demo.scenario).iter().map(|stop| stop.site_from_rover).collect();
    let error = demo.scenario.odometry_error;
    let (mut along, mut across, mut attitude) = (Vec::new(), Vec::new(), Vec::new());
    for seed in 0..300 {
        let estimated = estimates(&poses, &error, seed);
        for (pair, seen) in poses.windows(2).zip(estimated.windows(2)) {
            let truth = pair[0].inv_mul(&pair[1]);
            let seen = seen[0].inv_mul(&seen[1]);
            let length_m = truth.translation.vector.norm();
            let forward = truth.translation.vector / length_m;
            let off = (seen.translation.vector - truth.translation.vector) / length_m;
            along.push(off.dot(&forward));
            let side = (off - forward * off.dot(&forward)).norm_squared();
            across.push((side / 2.0).sqrt());
            let turned = truth.rotation.inverse() * seen.rotation;
            attitude.extend(turned.scaled_axis().iter().map(|angle| angle.to_degrees()));
        }
    }
    let rms = |v: &[f64]| (v.iter().map(|x| x * x).sum::<f64>() / v.len() as f64).sqrt();
    // 4800 steps determine a standard deviation to 1 %.
    assert!((rms(&along) / 0.01 - 1.0).abs() < 0.04, "{}", rms(&along));
    assert!((rms(&across) / 0.005 - 1.0).abs() < 0.04, "{}", rms(&across));
    assert!((rms(&attitude) / 0.1 - 1.0).abs() < 0.03, "{}", rms(&attitude));
    let mean = along.iter().sum::<f64>() / along.len() as f64;
    assert!(mean.abs() < 4.0 * 0.01 / (along.len() as f64).sqrt(), "{mean}");
}

#[test]
fn a_pointing_error_shows_in_the_true_cameras_only() {
    let mut scenario = demo().scenario.clone();
    scenario.drive.pointing_error_deg = 0.05;
    let index = crate::index(&scenario, &demo().world).unwrap();
    let mut offsets = Vec::new();
    for (stop, without) in index.stops.iter().zip(&demo().index.stops) {
        assert_eq!(stop.left, without.left);
        let camera = true_camera_in_site(stop, Eye::Left).unwrap();
        let pixel = camera.project(&demo().world.targets_centre()).unwrap();
        offsets.push(pixel.distance(Pixel::new(511.5, 511.5)));
    }
    // 0.05° is 1.06 px at 1211 px/rad, on each of two axes.
    let rms = (offsets.iter().map(|d| d * d).sum::<f64>() / offsets.len() as f64).sqrt();
    assert!((0.8..2.4).contains(&rms), "{rms}");
}

#[test]
fn a_miscalibrated_mast_shows_in_the_true_cameras_only() {
    let mut scenario = demo().scenario.clone();
    scenario.drive.mast_offset_deg = [0.2, -0.1];
    let index = crate::index(&scenario, &demo().world).unwrap();
    let rig = Rig::new(&scenario.camera);
    for (stop, without) in index.stops.iter().zip(&demo().index.stops) {
        assert_eq!((&stop.left, stop.mast_angles), (&without.left, without.mast_angles));
        let mut angles = stop.mast_angles.unwrap();
        angles.azimuth_rad += 0.2f64.to_radians();
        angles.elevation_rad += -0.1f64.to_radians();
        let (left, right) = rig.cameras_in_rover(Some(angles));
        let truth = stop.truth.as_ref().unwrap();
        assert_eq!((&truth.left_camera, &truth.right_camera), (&Some(left), &Some(right)));
        // The mast points to the right of the targets and below them: they appear to the left and above.
        let pixel =
            true_camera_in_site(stop, Eye::Left).unwrap().project(&demo().world.targets_centre()).unwrap();
        assert!(pixel.x < 510.0 && pixel.y < 510.0, "{pixel:?}");
    }
}

#[test]
fn targets_satisfy_the_rule_and_follow_from_the_seed() {
    let demo = demo();
    let targets = choose_targets(&demo.world, &demo.scenario, &demo.index);
    assert_eq!(targets.len(), 20);
    let (first, last) = (&demo.index.stops[0], &demo.index.stops[16]);
    let camera = true_camera_in_site(first, Eye::Left).unwrap();
    let last_camera = true_camera_in_site(last, Eye::Left).unwrap();
    for pixel in &targets {
        let point = surface_point(&demo.world, &camera, *pixel).unwrap();
        assert!((point - demo.world.targets_centre()).norm() <= demo.scenario.targets.radius_m);
        let seen = last_camera.project(&point).unwrap();
        assert!(seen.is_inside(1024, 1024));
        assert!(demo.world.is_visible(&last_camera.model.centre(), &point));
        let rock = demo.world.cast(&camera.ray(*pixel).unwrap()).unwrap().surface;
        assert!(matches!(rock, SurfaceId::Rock(_)));
        let mut distances_m = Vec::new();
        let (mut shaded, mut same, mut facing) = (0, 0, 0);
        for k in 0..441 {
            let at = pixel.offset(f64::from(k % 21) - 10.0, f64::from(k / 21) - 10.0);
            let hit = demo.world.cast(&camera.ray(at).unwrap()).unwrap();
            distances_m.push(hit.distance_m);
            shaded += u32::from(demo.world.in_shadow(&hit.point));
            same += u32::from(hit.surface == rock);
            let places = [camera.model.centre(), last_camera.model.centre()];
            facing += u32::from(places.iter().all(|place| {
                let to_place = (place - hit.point).normalize();
                hit.normal.dot(&to_place) >= 70f64.to_radians().cos() - 1e-12
            }));
        }
        assert!(f64::from(facing) >= 0.90 * 441.0);
        assert!(f64::from(same) >= 0.90 * 441.0);
        distances_m.sort_by(f64::total_cmp);
        let distance_m = (point - camera.model.centre()).norm();
        assert!(distances_m[440] - distances_m[0] <= 0.10 * distance_m + 1e-9);
        assert!(f64::from(shaded) <= 0.20 * 441.0);
    }
    assert_eq!(targets, choose_targets(&demo.world, &demo.scenario, &demo.index));
    let mut anywhere = demo.scenario.clone();
    anywhere.targets.on_rocks = false;
    anywhere.targets.incidence_deg = 90.0;
    let anywhere = choose_targets(&demo.world, &anywhere, &demo.index);
    assert!(share_on_rocks(&demo.world, &demo.index, &anywhere) < 1.0);
    let other = Scenario { seed: 77, ..demo.scenario.clone() };
    assert_ne!(targets, choose_targets(&demo.world, &other, &demo.index));
    let share = share_on_rocks(&demo.world, &demo.index, &targets);
    assert!((share - 1.0).abs() < 1e-12, "{share}");
}

/// The fraction of the targets that are on rocks, 0 to 1.
fn share_on_rocks(world: &World, index: &TraverseIndex, targets: &[Pixel]) -> f64 {
    let Some(camera) = index.stops.first().and_then(|stop| true_camera_in_site(stop, Eye::Left)) else {
        return 0.0;
    };
    let hits = targets.iter().filter_map(|pixel| world.cast(&camera.ray(*pixel)?));
    let on_rocks = hits.filter(|hit| matches!(hit.surface, SurfaceId::Rock(_))).count();
    on_rocks as f64 / targets.len().max(1) as f64
}

/// Distance from the centre of the left camera to the targets' centre, m.
fn distance_m(world: &World, rig: &Rig, stop: &TrueStop) -> f64 {
    let (left, _) = rig.cameras_in_rover(stop.angles);
    (stop.site_from_rover * left.model.centre() - world.targets_centre()).norm()
}
