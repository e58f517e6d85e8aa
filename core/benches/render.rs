//! Speed of the simulator's renderer, in samples (rays with their shadow and texture) a second.
//!
//! **The bound.** The cost of a sample of the soil, counted from the source. The 16 samples of a pixel are computed in vectors
//! (`ground/packet_cast.rs`, `camera/shading.rs`; here of 16 `f32` or twice 8 `f64`, about one instruction a cycle), the rest
//! in scalar instructions, about two a cycle:
//!
//! | part | instructions | cycles |
//! |---|---|---|
//! | rays of the samples, made unit | (3 × 14 × 2 + 80) / 16 | 10 |
//! | distance before which nothing is met: one walk a pixel | 400 / 16 / 2 | 12 |
//! | ground: about 8 cells a pixel, two of them solved with a root | (8 × 90 + 2 × 200) / 16 | 70 |
//! | rocks: one in view and one towards the sun, 15 planes each | 2 × 15 × 20 / 16 | 38 |
//! | noting the sample | 40 | 20 |
//! | texture: 8 octaves of two channels; half of them hash corners for each sample | 8 × (72 + 80 / 2) / 16 | 56 |
//! | drifts: 2 octaves in one cell; cells of grains: 3 | (2 × 72 + 3 × 36) / 16 | 16 |
//! | few grains' shapes | 60 | 30 |
//! | light, openness, normal | 150 | 75 |
//!
//! together about 330 cycles, 8.2 million samples a second on a core at 2.7 GHz; without wide vectors about a third of it.
//! With four samples a pixel or one, the rays of 4 or 16 neighbouring pixels are cast at once (`camera/sampling.rs`); the work
//! per pixel (rays through its corners, noise of the detector) is then a larger part of the time.
//!
//! A 1024 × 1024 picture with 16 samples a pixel is 16.8 million samples: 3 s on one core at most, and 17 stereo pairs one
//! minute on two. Building the world is not counted.
//!
//! Run with `cargo bench -p sightline-core --profile dev --bench render` (the profile `dev` is optimised); measured times:
//! `docs/benchmarks.md`.

use std::sync::OnceLock;
use std::sync::atomic::AtomicBool;

use divan::Bencher;
use divan::counter::ItemsCount;
use sightline_geometry::camera::Camera;
use sightline_world::scenario::CameraRig;
use sightline_world::{Eye, Region, Scenario, World, library};

/// Side of the rendered square in the middle of the picture, px.
const SIDE_PX: u32 = 256;

struct Scene {
    scenario: Scenario,
    world: World,
    first: Camera,
    last: Camera,
}

fn main() {
    divan::main();
}

fn scene() -> &'static Scene {
    static SCENE: OnceLock<Scene> = OnceLock::new();
    SCENE.get_or_init(|| {
        let scenario = Scenario::demo();
        let world = World::new(&scenario);
        let index = sightline_world::index(&scenario, &world).expect("the demonstration can be driven");
        let camera = |stop: usize| {
            sightline_world::true_camera_in_site(&index.stops[stop], Eye::Left)
                .expect("a simulated stop has a camera")
        };
        let (first, last) = (camera(0), camera(index.stops.len() - 1));
        Scene { scenario, world, first, last }
    })
}

fn bench(bencher: Bencher<'_, '_>, threads: usize, camera: &Camera) {
    let scene = scene();
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .expect("a pool of a few threads can be made");
    let first = (camera.width() - SIDE_PX) / 2;
    let region = Region { x: first, y: first, width: SIDE_PX, height: SIDE_PX };
    let never = AtomicBool::new(false);
    bencher.counter(ItemsCount::new(SIDE_PX * SIDE_PX * 16)).bench_local(|| {
        pool.install(|| {
            sightline_world::clean_radiance(&scene.world, &scene.scenario, camera, region, &never)
        })
    });
}

/// The first stop, 10 m from the targets; one thread, to hold against the bound.
#[divan::bench(sample_count = 5)]
fn far_one_thread(bencher: Bencher<'_, '_>) {
    bench(bencher, 1, &scene().first);
}

/// The last stop, 1.9 m from the targets; one thread.
#[divan::bench(sample_count = 5)]
fn near_one_thread(bencher: Bencher<'_, '_>) {
    bench(bencher, 1, &scene().last);
}

/// The last stop with the threads of this machine.
#[divan::bench(sample_count = 5)]
fn near_all_threads(bencher: Bencher<'_, '_>) {
    bench(bencher, 0, &scene().last);
}

/// The pictures of a drive among rocks as studies take them, 4 samples a pixel; one thread.
fn bench_drive(bencher: Bencher<'_, '_>, rig: CameraRig, size: u32) {
    let mut scenario = library::scenario("obstacles-10").expect("the library has the scenario");
    scenario.camera.further.clear();
    (scenario.camera.rig, scenario.camera.image_size, scenario.camera.samples_per_axis) = (rig, size, 2);
    if rig == CameraRig::MerFrontHazcam {
        // Farther away, the target is above its picture.
        (scenario.drive.start_distance_m, scenario.drive.end_distance_m) = (2.5, 2.0);
    }
    let world = World::new(&scenario);
    let index = sightline_world::index(&scenario, &world).expect("the scenario can be driven");
    let camera = sightline_world::true_camera_in_site(&index.stops[0], Eye::Left)
        .expect("a simulated stop has a camera");
    let region = Region::whole(&camera);
    let never = AtomicBool::new(false);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool of one thread");
    bencher.counter(ItemsCount::new(size * size * 4)).bench_local(|| {
        pool.install(|| sightline_world::clean_radiance(&world, &scenario, &camera, region, &never))
    });
}

/// A picture of the mast.
#[divan::bench(sample_count = 5)]
fn mast_four_samples(bencher: Bencher<'_, '_>) {
    bench_drive(bencher, CameraRig::MerNavcam, 512);
}

/// A picture of the body's cameras.
#[divan::bench(sample_count = 5)]
fn hazcam_four_samples(bencher: Bencher<'_, '_>) {
    bench_drive(bencher, CameraRig::MerFrontHazcam, 256);
}
