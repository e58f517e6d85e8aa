//! Speed of dense stereo against what the processor can do.
//!
//! **The bound.** 1024 × 1024 pixels with 128 disparities are 134 M cells; a 512-bit vector holds 64 of bytes, 32 of sums.
//! Vector operations for 64 cells, as the code has them:
//!
//! | work | operations | bytes that come from the second cache |
//! |---|---|---|
//! | bits that differ, by a carry-save adder and four counts | 55 | 576, of which a pixel's neighbour reads all but 9 again |
//! | one path: three loads, two sums, four least, store | 11; five of them 55 | 64 read, 64 written for each of the three from above |
//! | sums, the least, its place, the second | 40 | 128 read, 128 written |
//! | the right image's winners | 16 | – |
//! | block matching beside bits and winners: a row more and less, a column more and less | 26 | 64 + 128 + 256 |
//!
//! Semi-global: 166 operations, block matching 137, for each of 2.1 M blocks. A core that does four vector operations a cycle at
//! 4.1 GHz takes 21 ms and 18 ms; the least of a vector (11 a block of pixels, not of cells) is
//! about 40 operations a pixel more, 2.5 ms. Some 600 bytes a block from the second cache, at the 28 bytes a cycle that were seen in `zncc`,
//! take 11 ms beside it.
//!
//! **Reached.** docs/stereo.md; `cargo xtask bench --peers` holds both methods against OpenCV's on the same pair.
//!
//! Run with `cargo bench -p sightline-core --profile dev --bench stereo` (the profile `dev` is optimised).

use divan::Bencher;
use divan::counter::ItemsCount;
use image::Luma;
use sightline_core::camera::{Mast, MastAngles};
use sightline_core::image::GrayImage;
use sightline_core::stereo::{StereoMethod, StereoPaths, StereoSettings, dense_stereo, disparities};

const SIDE: u32 = 1024;

fn main() {
    divan::main();
}

fn hash(x: u32, y: u32) -> f64 {
    let mut h = x.wrapping_mul(0x9E37_79B1) ^ y.wrapping_mul(0x85EB_CA77);
    h = (h ^ (h >> 15)).wrapping_mul(0x2C1B_3C6D);
    f64::from(h ^ (h >> 13)) / f64::from(u32::MAX)
}

/// Hashed values between which is interpolated, every 4, 8 … 64 pixels.
fn scene(x: u32, y: u32) -> f32 {
    let noise = |spacing: u32| {
        let (u, v) = (f64::from(x % spacing), f64::from(y % spacing));
        let (u, v) = (u / f64::from(spacing), v / f64::from(spacing));
        let at = |i: u32, j: u32| hash((x / spacing + i) * 97 + spacing, y / spacing + j) - 0.5;
        let along = |j: u32| at(0, j) * (1.0 - u) + at(1, j) * u;
        along(0) * (1.0 - v) + along(1) * v
    };
    (0.5 + (2..7).map(|octave| 0.45 * noise(1 << octave)).sum::<f64>()) as f32
}

/// A pair with 16 to 101 px of disparity.
fn pair() -> [GrayImage; 2] {
    let image = |shift: fn(u32) -> u32| GrayImage::from_fn(SIDE, SIDE, |x, y| Luma([scene(x + shift(y), y)]));
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
