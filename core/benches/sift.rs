//! Speed of features and of their matching against what the processor can do.
//!
//! **The bound of the scale space.** Doubled, 1024 × 1024 pixels become 2048 × 2048 in the first octave and 5.59 M in all.
//! The five filters of an octave have 11, 13, 17, 21 and 25 taps along and, as four rows are made at a time, three more
//! down: 87 + 102 multiply-adds a pixel; the first image takes 25 more for 4.19 M pixels.
//!
//! | work | multiply-adds | bytes |
//! |---|---|---|
//! | Gaussians of 1024 × 1024 | 1160 M | 12 MB held of the first octave, 4 MB of the image read |
//! | one descriptor, σ = 2.3 px of its octave | 225 σ² ≈ 1200 pixels × 128, of which half are left out: 0.08 M | 12 kB read |
//! | 2000 × 2000 descriptors of 128 numbers | 512 M | 1 MB as `f32`, blocks of 32 kB in the first cache |
//!
//! A core with two 512-bit multiply-add units does 32 of them a cycle: the Gaussians take 36 M cycles, 8.9 ms at 4.1 GHz,
//! the matches 16 M, 3.9 ms. Along a row each multiply-add loads its pixels anew, most of them across two cache lines,
//! which the processor does once a cycle: 15 M cycles more. Extrema are little beside it: 5 differences and, of the
//! pixels above the threshold, at least 8 comparisons. A descriptor's sums take 0.6 µs; the gradient of its pixels (a
//! root, a division, an arc tangent) and their 16 factors about as much again, at 60 operations for 16 pixels.
//!
//! Run with `cargo bench -p sightline-core --profile dev --bench sift` (the profile `dev` is optimised); measured times:
//! `docs/benchmarks.md`.

use divan::Bencher;
use divan::counter::ItemsCount;
use image::Luma;
use sightline_vision::image::GrayImage;
use sightline_vision::sift::{Descriptor, SiftSettings, detect, nearest};

const SIDE: u32 = 1024;

fn main() {
    divan::main();
}

fn hash(x: u32, y: u32) -> f64 {
    let mut h = x.wrapping_mul(0x9E37_79B1) ^ y.wrapping_mul(0x85EB_CA77);
    h = (h ^ (h >> 15)).wrapping_mul(0x2C1B_3C6D);
    f64::from(h ^ (h >> 13)) / f64::from(u32::MAX)
}

/// Hashed values between which is interpolated, every 4, 8 … 64 pixels; some 6000 features.
fn scene() -> GrayImage {
    let noise = |x: u32, y: u32, spacing: u32| {
        let (u, v) = (f64::from(x % spacing), f64::from(y % spacing));
        let (u, v) = (u / f64::from(spacing), v / f64::from(spacing));
        let at = |i: u32, j: u32| hash((x / spacing + i) * 97 + spacing, y / spacing + j) - 0.5;
        let along = |j: u32| at(0, j) * (1.0 - u) + at(1, j) * u;
        along(0) * (1.0 - v) + along(1) * v
    };
    GrayImage::from_fn(SIDE, SIDE, |x, y| {
        let sum = (2..7).map(|octave| 0.45 * noise(x, y, 1 << octave)).sum::<f64>();
        Luma([(0.5 + sum) as f32])
    })
}

/// With the threads of the machine; the argument is the least contrast in thousandths, items are pixels.
#[divan::bench(args = [30, 300])]
fn detect_all_threads(bencher: Bencher<'_, '_>, contrast: u32) {
    let (image, settings) = (scene(), settings(contrast));
    bencher.counter(ItemsCount::new(SIDE * SIDE)).bench(|| detect(&image, &settings));
}

/// On one thread.
#[divan::bench(args = [30, 300])]
fn detect_one_thread(bencher: Bencher<'_, '_>, contrast: u32) {
    let (image, settings) = (scene(), settings(contrast));
    // The pool of one is this thread itself, so that no time goes into handing over.
    let _pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build();
    bencher.counter(ItemsCount::new(SIDE * SIDE)).bench_local(|| detect(&image, &settings));
}

fn settings(contrast: u32) -> SiftSettings {
    SiftSettings { contrast_min: f64::from(contrast) / 1000.0, ..SiftSettings::default() }
}

/// Nearest descriptors of as many others, on one thread; items are multiply-adds.
#[divan::bench(args = [500, 2000])]
fn nearest_one_thread(bencher: Bencher<'_, '_>, count: usize) {
    let number = |i: usize, k: usize| (hash(i as u32, k as u32) * hash(k as u32, i as u32) * 255.0) as u8;
    let descriptors: Vec<Descriptor> =
        (0..2 * count).map(|i| std::array::from_fn(|k| number(i, k))).collect();
    let (query, train) = descriptors.split_at(count);
    let _pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build();
    bencher.counter(ItemsCount::new(count * count * 128)).bench_local(|| nearest(query, train));
}
