//! Speed of the simulator's renderer, in samples (rays with their shadow and texture) a second.
//!
//! **The bound.** What a sample of the soil costs, counted in scalar instructions from the source and run at
//! about two a cycle, because noise and ray walks are chains of dependent steps:
//!
//! | part | instructions | cycles |
//! |---|---|---|
//! | texture: 8 octaves of 4 hashed lattice points, two channels, gradient, turn | 8 × 110 | 440 |
//! | drifts: 2 octaves; grains: 3 cells, few of them with a grain | 2 × 110 + 3 × 40 | 170 |
//! | ground: 4 levels of blocks, about two blocks each, and one quadratic | 4 × 90 + 60 | 210 |
//! | branches of the walk that cannot be foreseen | 6 × 15 cycles | 90 |
//! | ray, light, openness, sun grid | 150 | 75 |
//! | rocks in view and towards the sun: about one interval of 15 planes | 15 × 8 | 60 |
//!
//! together about 1045 cycles, 2.6 million samples a second on a core at 2.7 GHz near the rocks; at 10 m half
//! of the octaves are too fine for the picture and the bound is 3.6 million. A 1024 × 1024 picture with
//! 16 samples a pixel is 16.8 million samples: 7 s on one core, and 17 stereo pairs about four minutes.
//! The goal is 2 million on one thread; measured on a busy two-core machine (AMD EPYC): 2.3 million at the first stop and
//! at the last one, 4.1 million on both cores. Between 3900 and 15 400 rocks (k from 0.05 to 0.30) the time of a
//! picture does not grow. Building the world (0.8 million vertices, 5900 rocks) takes one to two seconds and is not
//! counted.
//!
//! Run with `cargo bench -p sightline-core --profile dev --bench render` (the profile `dev` is optimised).

use std::sync::OnceLock;
use std::sync::atomic::AtomicBool;

use divan::Bencher;
use divan::counter::ItemsCount;
use sightline_core::camera::Camera;
use sightline_core::sim::{self, Eye, Region, Scenario, World};

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
        let index = sim::index(&scenario, &world).expect("the demonstration can be driven");
        let camera = |stop: usize| {
            sim::true_camera_in_site(&index.stops[stop], Eye::Left).expect("a simulated stop has a camera")
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
        pool.install(|| sim::clean_radiance(&scene.world, &scene.scenario, camera, region, &never))
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
