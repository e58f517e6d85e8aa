//! Speed of an update of visual odometry on one thread; the goals are 25 ms at 512 × 512 px and 80 ms at 1024 × 1024 px.
//!
//! **The bound**, of 240 corners with windows of 11 × 11 px, 512 × 512 px:
//!
//! | step | work | at what the processor can do |
//! |---|---|---|
//! | corners | 262,144 px of some 60 operations, eight at a time | 0.5 ms |
//! | points | 240 windows of 121 cubic samples, 20 ns each; 240 strips of some 100 × 6 places of 121 products | 0.6 ms + 0.6 ms |
//! | coarse search | 40 points × 3 windows, 58 × 58 places of 49 products; some 800 translations × 40 projections, 50 ns each | 0.7 ms + 1.6 ms |
//! | matches | two rounds of 240 windows twice, 27 × 27 and 9 × 9 places of 121 products, stereo on some 30 × 8 and 15 × 8 | 2.4 ms + 1 ms |
//! | consistent set | 28,000 pairs of some 60 operations, twice | 1 ms |
//! | motion | some ten fits of 150 matches, 1 µs a match and iteration | 6 ms |
//!
//! Together about 15 ms; at 1024 × 1024 px corners and coarse images cost four times as much.
//! Run with `cargo bench -p sightline-core --profile dev --bench visual_odometry` (the profile `dev` is optimised); measured
//! times: `docs/benchmarks.md`.

use std::path::Path;

use divan::Bencher;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::Result;
use sightline_geometry::frames::Pose;
use sightline_recordings::DrivenTraverse;
use sightline_rover::driving::{ActiveWorld, Motion};
use sightline_rover::pipeline::Stops;
use sightline_rover::visual_odometry::look::look;
use sightline_rover::visual_odometry::{OdometryInput, OdometryPreset, OdometryView, update};
use sightline_world::{Scenario, library};

fn main() {
    divan::main();
}

/// A drive of one step in a folder of its own, each stop's mast at the ground ahead.
fn step(size: u32, folder: &Path) -> Result<DrivenTraverse> {
    let mut scenario = Scenario { seed: 1234, ..library::scenario("approach-10")? };
    (scenario.camera.image_size, scenario.camera.samples_per_axis) = (size, 2);
    let mut world = DrivenTraverse::begin(&scenario, folder, Cancel::default())?;
    let angles = world.traverse().mast().and_then(|mast| look(mast, None, &Pose::identity()));
    world.point_mast(angles)?;
    world.drive(&Motion::Arc { length_m: 0.6, curvature_per_m: 0.1 }, Cancel::default())?;
    world.point_mast(angles)?;
    Ok(world)
}

#[divan::bench(args = [(OdometryPreset::Sightline, 512), (OdometryPreset::Sightline, 1024), (OdometryPreset::Mer2007, 1024)])]
fn update_of_a_step(bencher: Bencher<'_, '_>, (preset, size): &(OdometryPreset, u32)) {
    let folder = tempfile::tempdir().expect("a folder for images");
    let world = step(*size, &folder.path().join("drive")).expect("a drive of one step");
    let traverse = world.traverse();
    let pairs = [0, 1].map(|stop| traverse.capture(stop).expect("a rendered pair"));
    let view = |stop: usize| {
        let (left, right) = traverse.cameras(stop);
        OdometryView { pair: &pairs[stop], left, right, mast_angles: traverse.mast_angles(stop) }
    };
    let predicted = traverse.site_from_rover(1).inverse() * traverse.site_from_rover(0);
    let settings = preset.settings();
    let input = OdometryInput {
        before: view(0),
        after: view(1),
        predicted_after_from_before: &predicted,
        mast: None,
        settings: &settings,
        cancel: Cancel::default(),
    };
    bencher.bench_local(|| update(&input));
}
