//! The hand-off from the mast cameras to the body cameras (R205, R209), in K9's scenarios of the library.

use sightline_geometry::camera::CameraModel;
use sightline_recordings::create_simulated;
use sightline_session::track;
use sightline_track::settings::Settings;
use sightline_track::target::Designation;
use sightline_world::library;
use sightline_world::moment::Moment;
use sightline_world::truth::{Visibility, pixel_truth, visibility};
use sightline_world::{Eye, World, choose_targets, index, true_camera_in_site};

#[test]
fn both_k9_pairs_see_the_target_at_the_last_stop() {
    // R209: three targets, 5, 7.5 and 10 m away at the start.
    for (name, distance_m) in [("k9-5", 5.0), ("k9-7.5", 7.5), ("k9-10", 10.0)] {
        let scenario = library::scenario(name).unwrap();
        let world = World::new(&scenario);
        let index = index(&scenario, &world).unwrap();
        let number = index.stops.len() - 1;
        let (before, last) = (&index.stops[number - 1], &index.stops[number]);
        assert_eq!(before.site_from_rover, last.site_from_rover, "{name}");
        assert_eq!(
            before.truth.as_ref().unwrap().site_from_rover,
            last.truth.as_ref().unwrap().site_from_rover
        );
        assert!(before.mast_angles.is_some() && last.mast_angles.is_none() && last.time_s > before.time_s);
        let centre = world.targets_centre();
        let first = true_camera_in_site(&index.stops[0], Eye::Left).unwrap();
        assert!(((centre - first.model.centre()).norm() - distance_m).abs() < 1e-6);
        for (step, stop) in [(number - 1, before), (number, last)] {
            let here = world.at(&Moment::of(step, &index.stops).unwrap(), &scenario);
            for eye in [Eye::Left, Eye::Right] {
                let camera = true_camera_in_site(stop, eye).unwrap();
                assert_eq!(matches!(camera.model, CameraModel::Cahvore(_)), step == number);
                let found = visibility(&here, &camera, &centre);
                let Visibility::Visible { pixel, .. } = found else {
                    panic!("{name}: the target is not seen at stop {step}: {found:?}");
                };
                let hit = pixel_truth(&here, &camera, pixel).unwrap();
                assert!((hit.point - centre).norm() < 1e-6, "{name}: {}", hit.point);
            }
        }
    }
}

#[test]
fn a_handed_off_target_never_fails_silently() {
    let mut scenario = library::scenario("k9-5").unwrap();
    (scenario.camera.image_size, scenario.camera.samples_per_axis) = (256, 1);
    scenario.drive.step_fraction = 0.3;
    (scenario.rocks.area_fraction, scenario.rocks.cluster_count) = (0.02, 0);
    let folder = tempfile::tempdir().unwrap();
    let traverse = create_simulated(&scenario, folder.path()).unwrap();
    let pixel = choose_targets(traverse.world().unwrap(), &scenario, traverse.index())[0];
    let steps = track::run(&traverse, Designation::new(0, pixel), &Settings::default()).unwrap();
    assert_eq!(steps.len(), traverse.stop_count());
    let sizes = |step: usize| {
        let pair = traverse.capture(step).unwrap();
        [pair.left.dimensions(), pair.right.dimensions()]
    };
    assert_eq!((sizes(0), sizes(steps.len() - 1)), ([(256, 192); 2], [(256, 256); 2]));
    // The truth does not depend on the tracker: the target is in the last image.
    assert!(steps.last().unwrap().truth.as_ref().unwrap().left_pixel.is_some());
}
