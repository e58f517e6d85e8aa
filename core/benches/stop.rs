//! Speed of a whole stop of a drive without rendering, on two cores; the goal is 500 ms.
//!
//! A stop reads its images (a pair of the mast, a pair of hazcams of 256 × 256 px), tracks the target, maps the hazards, chooses a
//! path and measures the motion by visual odometry. Everything but the reading has a bound in its own benchmark:
//!
//! | part | benchmark | 512 px | 1024 px |
//! |---|---|---|---|
//! | tracking update | `update` | 0.3 ms | 0.3 ms |
//! | pair to goodness map | `hazards` | 20 ms | 20 ms |
//! | path | `hazards` | 3 ms | 3 ms |
//! | visual odometry | `visual_odometry` | 15 ms | 20 ms |
//! | decoding two PNG images, 10 ns a pixel | – | 5 ms | 20 ms |
//!
//! The drive is replayed along a recording, whose images exist. Run with
//! `cargo bench -p sightline-core --profile dev --bench stop` (the profile `dev` is optimised); measured times: `docs/benchmarks.md`.

use std::path::Path;

use divan::Bencher;
use sightline_geometry::cancel::Cancel;
use sightline_recordings::{Traverse, create_simulated};
use sightline_rover::driving::{DriveCommand, NavigatorKind};
use sightline_rover::pipeline::Stops;
use sightline_rover::visual_odometry::{OdometryInput, OdometryPreset, OdometryView, update};
use sightline_session::replayed_drive::ReplayedDrive;
use sightline_track::settings::Settings;
use sightline_track::target::Designation;
use sightline_world::scenario::{CameraRig, FurtherRig};
use sightline_world::{Scenario, choose_targets, library};

fn main() {
    divan::main();
}

/// The stop that is measured: some stops after the designation, when the map has grown.
const STOP: usize = 4;

/// A planned drive with hazcams; its images are rendered at the first call and kept in the folder.
fn recording(size: u32, folder: &Path) -> (Traverse, Scenario) {
    let mut scenario = library::scenario("approach-10").expect("a scenario of the library");
    let name = "front_hazcam".parse().expect("a name");
    (scenario.seed, scenario.targets.window_px) = (67_000, 11);
    (scenario.camera.image_size, scenario.camera.samples_per_axis) = (size, 2);
    scenario.camera.further =
        vec![FurtherRig { name, rig: CameraRig::MerFrontHazcam, look_deg: None, image_size: 256 }];
    (create_simulated(&scenario, folder).expect("a drive"), scenario)
}

/// The drive at the stop before the one that is measured.
fn drive_to_stop(path: &Path, size: u32) -> (&'static Traverse, ReplayedDrive<'static>) {
    // The drive refers to the recording; a benchmark has few samples.
    let (traverse, scenario) = recording(size, path);
    let traverse: &'static Traverse = Box::leak(Box::new(traverse));
    let world = traverse.world().expect("a world");
    let designation = Designation::new(0, choose_targets(world, &scenario, traverse.index())[0]);
    let command = DriveCommand { navigator: NavigatorKind::Gestalt, ..DriveCommand::default() };
    let (settings, cancel) = (Settings::default(), Cancel::default());
    let mut drive = ReplayedDrive::begin(traverse, designation, command, &settings, cancel).expect("a drive");
    while drive.steps.len() < STOP {
        assert!(drive.advance(&settings, cancel).expect("a stop"), "the drive ends before the stop");
    }
    (traverse, drive)
}

#[divan::bench(args = [512, 1024], sample_count = 10)]
fn stop_without_rendering(bencher: Bencher<'_, '_>, size: u32) {
    let folder = tempfile::tempdir().expect("a folder for the drive");
    let path = folder.path().join("drive");
    let (settings, odometry) = (Settings::default(), OdometryPreset::Sightline.settings());
    // Renders all images of the stops up to the one that is measured.
    drop(drive_to_stop(&path, size).1.advance(&settings, Cancel::default()));
    bencher.with_inputs(|| drive_to_stop(&path, size)).bench_local_values(|(traverse, mut drive)| {
        let went_on = drive.advance(&settings, Cancel::default()).expect("a stop");
        assert!(went_on && drive.cycles.last().is_some_and(|cycle| cycle.choice.is_some()));
        let pairs = [STOP - 1, STOP].map(|stop| traverse.capture(stop).expect("a pair"));
        let view = |index: usize| {
            let stop = STOP - 1 + index;
            let (left, right) = traverse.cameras(stop);
            OdometryView { pair: &pairs[index], left, right, mast_angles: traverse.mast_angles(stop) }
        };
        let predicted = traverse.site_from_rover(STOP).inverse() * traverse.site_from_rover(STOP - 1);
        update(&OdometryInput {
            before: view(0),
            after: view(1),
            predicted_after_from_before: &predicted,
            mast: None,
            settings: &odometry,
            cancel: Cancel::default(),
        })
    });
}
