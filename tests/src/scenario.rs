//! A simulated approach small enough to be rendered within a test.

use sightline_world::Scenario;

/// From 5 m to 3.2 m with images of half the size; the targets' window is halved with them.
pub fn short_approach() -> Scenario {
    let mut scenario = Scenario { seed: 3, ..Scenario::demo() };
    scenario.camera.image_size = 512;
    scenario.camera.samples_per_axis = 2;
    scenario.targets.window_px = 11;
    scenario.drive.start_distance_m = 5.0;
    scenario.drive.end_distance_m = 3.2;
    scenario
}
