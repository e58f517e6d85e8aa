//! A small slice of the approach study: one world, reduced in size, tracked to the end.

use sightline_core::settings::Settings;
use sightline_core::sim;
use sightline_core::study::approach;
use sightline_core::traverse::create_simulated;
use sightline_tests::scenario::short_approach;

#[test]
fn targets_on_rocks_are_tracked_through_a_short_simulated_approach() {
    let folder = tempfile::tempdir().unwrap();
    let mut scenario = short_approach();
    scenario.targets.count = 6;
    let traverse = create_simulated(&scenario, &folder.path().join("world")).unwrap();
    let targets = sim::choose_targets(traverse.world().unwrap(), &scenario, traverse.index());
    let runs = approach::track_world(&traverse, scenario.seed, &targets, &Settings::default());
    let summary = approach::summarise_runs(&runs);
    println!("{summary:#?}");
    assert_eq!(summary.targets, 6);
    assert!(summary.tracked_share >= 0.8, "{summary:?}");
    assert!(summary.median_err_m.unwrap() < 0.03, "{summary:?}");
}
