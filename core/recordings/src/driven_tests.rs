//! Commanded drives in folders: resumed, restored, branched and rejected.

use sightline_world::surface_point;

use super::*;

fn scenario() -> Scenario {
    let mut scenario = Scenario { seed: 5, ..Scenario::default() };
    (scenario.camera.image_size, scenario.camera.samples_per_axis) = (128, 1);
    (scenario.rocks.area_fraction, scenario.rocks.cluster_count) = (0.02, 4);
    scenario.drive.pointing_error_deg = 0.2;
    scenario
}

fn arc(length_m: f64) -> Motion {
    Motion::Arc { length_m, curvature_per_m: 0.05 }
}

/// Drives and points the mast a little to the side.
fn go(world: &mut DrivenTraverse, length_m: f64) {
    world.drive(&arc(length_m), Cancel::default()).unwrap();
    let angles = world.state().last().unwrap().mast_angles.unwrap();
    world.point_mast(Some(MastAngles { azimuth_rad: angles.azimuth_rad + 0.01, ..angles })).unwrap();
}

#[test]
fn a_resumed_drive_continues_with_the_same_bits_and_can_be_replayed() {
    let folder = tempfile::tempdir().unwrap();
    let [one, two] = ["one", "two"].map(|name| folder.path().join(name));
    let mut whole = DrivenTraverse::begin(&scenario(), &one, Cancel::default()).unwrap();
    [0.5, 0.4, 0.3].into_iter().for_each(|length_m| go(&mut whole, length_m));
    let mut cut = DrivenTraverse::begin(&scenario(), &two, Cancel::default()).unwrap();
    go(&mut cut, 0.5);
    drop(cut);
    let mut resumed = DrivenTraverse::resume(&two).unwrap();
    [0.4, 0.3].into_iter().for_each(|length_m| go(&mut resumed, length_m));
    assert_eq!(resumed.state(), whole.state());
    assert_eq!(resumed.traverse().index(), whole.traverse().index());
    let replayed = Traverse::open(&one).unwrap();
    assert_eq!(replayed.index(), whole.traverse().index());
    assert_eq!(replayed.capture(2).unwrap(), resumed.traverse().capture(2).unwrap());
    // The mast's error is that of its stop.
    assert!(replayed.index().stops[2].truth.as_ref().unwrap().left_camera.is_some());
}

#[test]
fn a_stop_is_exposed_for_the_pixel_that_was_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let mut scenario = scenario();
    scenario.camera.exposure = sightline_world::scenario::ExposureMode::Subframe;
    scenario.camera.auto_exposure.subframe_px = 11;
    let mut world = DrivenTraverse::begin(&scenario, &folder.path().join("a"), Cancel::default()).unwrap();
    go(&mut world, 0.5);
    let mut level = |around: Pixel| {
        world.expose(Some(around)).unwrap();
        assert_eq!(world.traverse().index().stops[1].metered_px, Some(around));
        let left = world.traverse().capture(1).unwrap().left;
        let side = |centre: f64| (centre as u32 - 5)..(centre as u32 + 6);
        let pixels = side(around.y).flat_map(|y| side(around.x).map(move |x| (x, y)));
        f64::from(pixels.map(|(x, y)| left.get_pixel(x, y).0[0]).fold(0.0, f32::max)) * 4095.0
    };
    // One percent of 121 pixels may exceed the cut of 2000: the brightest one.
    for around in [Pixel::new(64.0, 20.0), Pixel::new(20.0, 100.0), Pixel::new(100.0, 70.0)] {
        let brightest_dn = level(around);
        assert!((1800.0..2400.0).contains(&brightest_dn), "{around:?}: {brightest_dn}");
    }
}

#[test]
fn wheels_leave_tracks_where_the_rover_was_driven() {
    let folder = tempfile::tempdir().unwrap();
    let drive = |tracks: bool, name: &str| {
        let mut scenario = scenario();
        (scenario.camera.blur_px, scenario.camera.read_noise_electrons) = (0.0, 0.0);
        scenario.rover.tracks = tracks;
        let path = folder.path().join(name);
        let mut world = DrivenTraverse::begin(&scenario, &path, Cancel::default()).unwrap();
        for motion in [arc(0.8), Motion::Turn { angle_rad: 1.0 }, arc(1.2)] {
            world.drive(&motion, Cancel::default()).unwrap();
        }
        // Look back along the tracks.
        let angles = MastAngles { azimuth_rad: 3.0, elevation_rad: -0.6 };
        world.point_mast(Some(angles)).unwrap();
        world
    };
    let [bare, tracked] = [drive(false, "bare"), drive(true, "tracked")];
    assert!(bare.state().iter().all(|stop| stop.wheel_places_m.is_empty()));
    let places: Vec<[f64; 2]> =
        tracked.state().iter().flat_map(|stop| stop.wheel_places_m.iter().flatten().copied()).collect();
    let images = [&bare, &tracked].map(|world| world.traverse().capture(3).unwrap().left);
    let camera = tracked.traverse().true_left_camera(3);
    let camera = camera.moved(&tracked.traverse().true_site_from_rover(3).unwrap());
    let world = tracked.traverse().world().unwrap();
    let mut changed = 0;
    for (x, y, value) in images[1].enumerate_pixels() {
        if (value.0[0] - images[0].get_pixel(x, y).0[0]).abs() < 0.02 {
            continue;
        }
        changed += 1;
        let point = surface_point(world, &camera, Pixel::new(f64::from(x), f64::from(y))).unwrap();
        let off = |place: &[f64; 2]| (place[0] - point.x).hypot(place[1] - point.y);
        let nearest_m = places.iter().map(off).fold(f64::INFINITY, f64::min);
        // Half the track's width, half a segment of it and half a pixel.
        assert!(nearest_m < 0.08 + 0.05 + 0.03, "({x}, {y}): {nearest_m} m from the wheels' way");
    }
    assert!(changed > 300, "{changed} of {} pixels", 128 * 128);
    // The folder alone renders the same tracks, and a resumed drive continues them.
    let seen = tracked.traverse().capture(2).unwrap();
    std::fs::remove_dir_all(folder.path().join("tracked/images")).unwrap();
    std::fs::remove_dir_all(folder.path().join("tracked/cache")).unwrap();
    assert_eq!(Traverse::open(&folder.path().join("tracked")).unwrap().capture(2).unwrap(), seen);
    let mut resumed = DrivenTraverse::resume(&folder.path().join("tracked")).unwrap();
    assert_eq!(resumed.state(), tracked.state());
    resumed.stay().unwrap();
    assert!(resumed.state()[4].wheel_places_m.is_empty(), "nothing is laid by waiting");
}

#[test]
fn a_restored_world_forgets_what_it_saw_later() {
    let folder = tempfile::tempdir().unwrap();
    let mut world = DrivenTraverse::begin(&scenario(), &folder.path().join("a"), Cancel::default()).unwrap();
    go(&mut world, 0.5);
    let branch = world.state().to_vec();
    go(&mut world, 0.8);
    let trunk = world.state().to_vec();
    let seen = world.traverse().capture(2).unwrap();
    world.restore(branch).unwrap();
    assert_eq!(world.traverse().stop_count(), 2);
    go(&mut world, -0.3);
    assert_ne!(world.traverse().capture(2).unwrap().left, seen.left);
    world.restore(trunk.clone()).unwrap();
    assert_eq!(world.traverse().capture(2).unwrap(), seen);
    assert_eq!(world.state(), trunk);
}

#[test]
fn a_state_with_a_pose_that_is_none_is_refused_and_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let mut world = DrivenTraverse::begin(&scenario(), &folder.path().join("a"), Cancel::default()).unwrap();
    go(&mut world, 0.5);
    let before = world.state().to_vec();
    let mut refused = |change: fn(&mut DrivenStop)| {
        let mut state = before.clone();
        change(&mut state[1]);
        let problem = world.restore(state).unwrap_err().to_string();
        assert_eq!(world.state(), before);
        problem
    };
    let turned = refused(|stop| stop.true_site_from_rover.quaternion_sxyz[0] *= 1.1);
    assert!(turned.contains("driven[1].true_site_from_rover: must have") && turned.contains("unit length"));
    assert!(
        refused(|stop| stop.site_from_rover.position_m[0] = f64::NAN).contains("driven[1].site_from_rover")
    );
    assert!(refused(|stop| stop.completed = 2.0).contains("driven[1].completed: is 2"));
}

#[test]
fn a_folder_with_something_in_it_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("note"), "mine").unwrap();
    let refused = |scenario: &Scenario, path: &Path| {
        DrivenTraverse::begin(scenario, path, Cancel::default()).err().unwrap().to_string()
    };
    assert!(refused(&scenario(), folder.path()).contains("is not empty"));
}
