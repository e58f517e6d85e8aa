//! Speed of dense stereo against what the processor can do.
//!
//! **The bound.** 1024 × 1024 pixels with 128 disparities are 134 M cells in 2.1 M blocks of 64; a 512-bit vector holds 64 of
//! bytes, 32 of sums. The headers of `core/vision/src/stereo/block_matching.rs` and `semi_global.rs` count the vector operations of a block:
//!
//! | method | operations a block, and a pixel more | at four a cycle of 4.1 GHz | stores a block, at one a cycle | bytes held |
//! |---|---|---|---|---|
//! | block matching | 52, 20 | 8 ms | 9, 5 ms | 1.4 MB of costs, 0.3 MB of V |
//! | semi-global | 134, 75 | 22 ms | 10, 5 ms | 0.6 MB of L, 0.4 MB of costs and sums |
//!
//! Beside it stand, pixel by pixel and not disparity by disparity: the bits (3 and 8 planes of two images), texture, checks,
//! patches.
//!
//! Run with `cargo bench -p sightline-core --profile dev --bench stereo` (the profile `dev` is optimised); measured times:
//! `docs/benchmarks.md`.

use divan::Bencher;
use divan::counter::ItemsCount;
use image::Luma;
use image::imageops::{FilterType, resize};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use sightline_geometry::camera::{Mast, MastAngles};
use sightline_vision::image::GrayImage;
use sightline_vision::stereo::{StereoMethod, StereoPaths, StereoSettings, dense_stereo, disparities};

const SIDE: u32 = 1024;

fn main() {
    divan::main();
}

/// A pair with 16 to 101 px of disparity: random values between which is interpolated, every 4, 8 … 64 pixels.
fn pair() -> [GrayImage; 2] {
    let (width, mut random) = (SIDE + 128, Pcg64::seed_from_u64(1));
    let mut wide = GrayImage::from_pixel(width, SIDE, Luma([-0.625]));
    for octave in 2..7 {
        let random = |_, _| Luma([random.random::<f32>()]);
        let grid = GrayImage::from_fn(width >> octave, SIDE >> octave, random);
        let smooth = resize(&grid, width, SIDE, FilterType::Triangle);
        wide.iter_mut().zip(smooth.iter()).for_each(|(sum, value)| *sum += 0.45 * value);
    }
    let image =
        |shift: fn(u32) -> u32| GrayImage::from_fn(SIDE, SIDE, |x, y| *wide.get_pixel(x + shift(y), y));
    [image(|_| 0), image(|y| 16 + y / 12)]
}

fn settings(name: &str) -> StereoSettings {
    let method = if name == "block" { StereoMethod::BlockMatching } else { StereoMethod::SemiGlobal };
    let paths = if name == "eight_paths" { StereoPaths::Eight } else { StereoPaths::Five };
    StereoSettings { method, paths, disparity_count: 128, ..StereoSettings::default() }
}

/// An aligned pair on one thread; items are cells.
#[divan::bench(args = ["block", "semi_global", "eight_paths"])]
fn disparities_one_thread(bencher: Bencher<'_, '_>, name: &str) {
    let ([left, right], settings) = (pair(), settings(name));
    // The pool of one is this thread itself, so that no time goes into handing over.
    let _pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build();
    bencher
        .counter(ItemsCount::new(SIDE * SIDE * 128))
        .bench_local(|| disparities([&left, &right], &settings));
}

/// With alignment and points, by Spirit's navcams, with the threads of the machine.
#[divan::bench(args = ["block", "semi_global"])]
fn whole(bencher: Bencher<'_, '_>, name: &str) {
    let ([left, right], settings) = (pair(), settings(name));
    let ahead = MastAngles { azimuth_rad: 0.0, elevation_rad: 0.0 };
    let (left_camera, right_camera) = Mast::spirit().cameras_in_rover(ahead);
    bencher.bench(|| dense_stereo([&left, &right], [&left_camera, &right_camera], &settings));
}
