//! Where the time of a hand-off goes: K9's drive from 5 m, whose last stop is taken by the mast's pair (1024 × 768 px) and
//! by the hazcams (1024 × 1024 px). The goal is two seconds for the whole on two cores.
//!
//! **The bound.** Semi-global matching with five paths does about 40 operations on bytes for a pixel and a disparity:
//!
//! | what | work | at what two cores can do |
//! |---|---|---|
//! | surface at the designation | 0.8 M pixels × 342 disparities × 40, 64 bytes an instruction, 2 an instruction cycle | 35 ms |
//! | surface of the last mast stop | the same with 512 disparities | 50 ms |
//! | surface of the hazcams | 1.05 M pixels × 64 to 128 disparities | 15 ms |
//! | registration, point to plane, twice | `registration.rs` | 2 × 20 ms |
//! | draped picture | 1,000 pixels × a sensor of 160 × 160, 900 positions × 1,000 products | 2 ms |
//!
//! **Memory**: a surface holds 17 bytes a pixel (disparity, outcome, point), 13 MB and 18 MB; the three last are kept. A view
//! that is kept for later stops holds its mesh, 0.1 to 1 MB, and its left image, 3 or 4 MB. What was measured is in
//! docs/shape.md.
//!
//! Run with `cargo bench -p sightline-core --profile dev --bench hand_off` (the profile `dev` is optimised).

use std::sync::OnceLock;

use divan::Bencher;
use sightline_geometry::cancel::Cancel;
use sightline_recordings::{Traverse, create_simulated};
use sightline_rover::pipeline::Stops;
use sightline_session::step::RunStep;
use sightline_session::track;
use sightline_track::locate::shape_tracker::surface::StopSurface;
use sightline_track::presets::preset;
use sightline_track::settings::Settings;
use sightline_track::target::Designation;
use sightline_world::{choose_targets, library};

fn main() {
    divan::main();
}

/// The drive, and its run by the combined tracker.
struct Scene {
    _folder: tempfile::TempDir,
    traverse: Traverse,
    settings: Settings,
    steps: Vec<RunStep>,
}

fn scene() -> &'static Scene {
    static SCENE: OnceLock<Scene> = OnceLock::new();
    SCENE.get_or_init(|| {
        let mut scenario = library::scenario("k9-5").expect("a scenario of the library");
        scenario.camera.samples_per_axis = 2;
        scenario.drive.step_fraction = 0.3;
        let folder = tempfile::tempdir().expect("a folder for the drive");
        let traverse = create_simulated(&scenario, folder.path()).expect("a drive");
        let world = traverse.world().expect("a simulated drive has a world");
        let pixel = choose_targets(world, &scenario, traverse.index())[0];
        let settings =
            preset("combined").and_then(sightline_track::presets::Preset::settings).expect("a preset");
        let steps = track::run(&traverse, Designation::new(0, pixel), &settings).expect("a run");
        Scene { _folder: folder, traverse, settings, steps }
    })
}

fn surface(bencher: Bencher<'_, '_>, step: usize) {
    let scene = scene();
    let (pair, (left, right)) = (scene.traverse.capture(step).expect("images"), scene.traverse.cameras(step));
    let target = &scene.steps[step].update.target.position_in_rover;
    let stereo = scene.settings.shape.stereo((target - left.model.centre()).norm());
    bencher.bench_local(|| StopSurface::measure(&pair, [left, right], &stereo, Cancel::default()));
}

/// Dense stereo at the designation.
#[divan::bench(sample_count = 10)]
fn surface_of_the_first_view(bencher: Bencher<'_, '_>) {
    surface(bencher, 0);
}

/// Dense stereo at the last stop of the mast's pair.
#[divan::bench(sample_count = 10)]
fn surface_of_the_last_mast_stop(bencher: Bencher<'_, '_>) {
    surface(bencher, scene().steps.len() - 2);
}

/// Dense stereo of the hazcams.
#[divan::bench(sample_count = 10)]
fn surface_of_the_hazcams(bencher: Bencher<'_, '_>) {
    surface(bencher, scene().steps.len() - 1);
}

/// Mesh, registration and draped picture at the hand-off, its surface being there.
#[divan::bench(sample_count = 20)]
fn hand_off_without_stereo(bencher: Bencher<'_, '_>) {
    let scene = scene();
    let [.., mast, _] = scene.steps.as_slice() else { return };
    bencher.bench_local(|| track::advance(&scene.traverse, &scene.steps[0], mast, &scene.settings));
}
