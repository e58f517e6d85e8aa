//! Speed of the simulator's renderer, in samples (rays with their shadow and texture) a second.
//!
//! **The bound.** What a sample of the soil costs, counted from the source; the noise of a pixel's 16 samples goes in
//! vectors (`camera/shading.rs`; here of 16 numbers, at about one instruction a cycle), the rest in scalar instructions at
//! about two a cycle, because ray walks are chains of dependent steps:
//!
//! | part | instructions | cycles |
//! |---|---|---|
//! | texture: 8 octaves of 4 hashed lattice points, two channels, gradient, turn | 8 × 150 / 16 | 75 |
//! | drifts: 2 octaves; the hashes of grains: 3 cells | (2 × 150 + 3 × 40) / 16 | 26 |
//! | few grains' shapes | 60 | 30 |
//! | ground: 4 levels of blocks, about two blocks each, and one quadratic | 4 × 90 + 60 | 210 |
//! | branches of the walk that cannot be foreseen | 6 × 15 cycles | 90 |
//! | ray, light, openness, sun grid | 150 | 75 |
//! | rocks in view and towards the sun: about one interval of 15 planes | 15 × 8 | 60 |
//!
//! together about 566 cycles, 4.8 million samples a second on a core at 2.7 GHz; with narrower vectors down to 2.6
//! million without any. A 1024 × 1024 picture with 16 samples a pixel is 16.8 million samples: 5 s on one core, and 17
//! stereo pairs under two minutes on two. Building the world is not
//! counted.
//!
//! Run with `cargo bench -p sightline-core --profile dev --bench render` (the profile `dev` is optimised); measured times:
//! `docs/benchmarks.md`.

use std::sync::OnceLock;
use std::sync::atomic::AtomicBool;

use divan::Bencher;
use divan::counter::ItemsCount;
use sightline_geometry::camera::Camera;
use sightline_world::{Eye, Region, Scenario, World};

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
