//! A small slice of the approach study: one world, reduced in size, tracked to the end.

use sightline_core::settings::Settings;
use sightline_core::sim::{self, Scenario};
use sightline_core::study::approach;
use sightline_core::traverse::create_simulated;

/// The demonstration's world at half resolution and with fewer, larger rocks of texture per pixel.
fn small_scenario() -> Scenario {
    let mut scenario = Scenario { seed: 3, ..Scenario::demo() };
    scenario.camera.image_size = 512;
    scenario.camera.samples_per_axis = 2;
    scenario.targets.window_px = 11;
    scenario.drive.start_distance_m = 5.0;
    scenario.drive.end_distance_m = 3.2;
    scenario.targets.count = 6;
    scenario
}

#[test]
fn targets_on_rocks_are_tracked_through_a_short_simulated_approach() {
    let folder = tempfile::tempdir().unwrap();
    let scenario = small_scenario();
    let traverse = create_simulated(&scenario, &folder.path().join("world")).unwrap();
    let targets = sim::choose_targets(traverse.world().unwrap(), &scenario, traverse.index());
    let runs = approach::track_world(&traverse, scenario.seed, &targets, &Settings::default());
    let summary = approach::summarise_runs(&runs);
    println!("{summary:#?}");
    assert_eq!(summary.targets, 6);
    assert!(summary.tracked_share >= 0.8, "{summary:?}");
    assert!(summary.median_err_m.unwrap() < 0.03, "{summary:?}");
}
