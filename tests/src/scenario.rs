//! Simulated approaches that are small enough to be rendered within a test.

use sightline_world::{Scenario, library};

/// From 5 m to 3.2 m, with images of half the size; the window of the targets is half as large, too.
pub fn short_approach() -> Scenario {
    let mut scenario = Scenario { seed: 3, ..Scenario::demo() };
    scenario.camera.image_size = 512;
    scenario.camera.samples_per_axis = 2;
    scenario.targets.window_px = 11;
    scenario.drive.start_distance_m = 5.0;
    scenario.drive.end_distance_m = 3.2;
    scenario
}

/// Starts 10 m from the target on a slope that the hazard map does not allow. Images of 256 px.
pub fn slope_beyond_the_limit() -> Scenario {
    let mut scenario = library::scenario("no-safe-path").expect("a scenario of the library");
    scenario.seed = 2;
    (scenario.camera.image_size, scenario.camera.samples_per_axis) = (256, 2);
    scenario.targets.window_px = 9;
    scenario
}

/// Starts 8 m from the target on level ground; the planned drive ends at 7.2 m, before a rock on the straight path that is
/// too high to climb. Front hazcams of 256 px; with fewer samples per pixel their stereo returns false steps.
pub fn rock_on_the_way() -> Scenario {
    let mut scenario = library::scenario("obstacles-10").expect("a scenario of the library");
    scenario.seed = 3000;
    (scenario.camera.image_size, scenario.camera.samples_per_axis) = (512, 2);
    scenario.targets.window_px = 11;
    (scenario.drive.start_distance_m, scenario.drive.end_distance_m) = (8.0, 7.2);
    (scenario.rocks.area_fraction, scenario.rocks.smallest_m) = (0.01, 0.1);
    scenario.terrain.slope_deg = 0.0;
    scenario.rocks.placed[0].x_m = -4.5;
    scenario
}

/// Starts 6 m from five targets on the rocks around the goal; the planned drive ends at 5.3 m.
pub fn several_targets() -> Scenario {
    let mut scenario = library::scenario("five-targets").expect("a scenario of the library");
    (scenario.camera.image_size, scenario.camera.samples_per_axis) = (512, 1);
    scenario.targets.window_px = 9;
    (scenario.drive.start_distance_m, scenario.drive.end_distance_m) = (6.0, 5.3);
    scenario
}
