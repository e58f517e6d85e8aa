//! Speed of the dense correlation surface against what the processor can do.
//!
//! **The bound.** A template of n × n over P positions needs n² P multiply-adds. Memory is no limit: the
//! smallest case reads 161 × 161 × 4 = 104 kB of pixels and writes 80 kB of scores, microseconds of cache traffic.
//!
//! | case | positions | multiply-adds |
//! |---|---|---|
//! | 21 × 21 in 143 × 143 | 123² = 15 129 | 6.67 M |
//! | 21 × 21 in 161 × 161 | 141² = 19 881 | 8.77 M |
//! | 21 × 21 in 600 × 600 | 580² = 336 400 | 148.4 M |
//!
//! A core with two 512-bit multiply-add units does 32 of them a cycle: 8.77 M take 274 000 cycles, 67 µs at
//! 4.1 GHz (131 billion a second); with 256-bit units twice as long. `correlate::toom_cook` needs 5/18 of the
//! multiplications, 19 µs. The rest goes into work that grows with the positions and not with the template: copying
//! pixels, values at points, sums and squares of windows, roots. It touches some 1.2 MB in the second cache for 161 × 161,
//! which alone take 10 µs at the 28 bytes a cycle that were seen.
//! `dense_one_thread` is the number to hold against the bound; `dense` is what the tracker sees with its threads.
//!
//! Run with `cargo bench -p sightline-core --profile dev --bench zncc` (the profile `dev` is optimised); measured times:
//! `docs/benchmarks.md`.

use divan::Bencher;
use divan::counter::ItemsCount;
use image::Luma;
use sightline_vision::correlate::{PixelRect, zncc_surface};
use sightline_vision::image::{GrayImage, Patch};

const TEMPLATE: u32 = 21;

fn main() {
    divan::main();
}

/// A textured image without repetition: hashed values, smoothed by a 3 × 3 mean.
fn texture(side: u32) -> GrayImage {
    let hash = |x: u32, y: u32| {
        let mut h = x.wrapping_mul(0x9E37_79B1) ^ y.wrapping_mul(0x85EB_CA77);
        h = (h ^ (h >> 15)).wrapping_mul(0x2C1B_3C6D);
        f64::from(h ^ (h >> 13)) / f64::from(u32::MAX)
    };
    GrayImage::from_fn(side, side, |x, y| {
        let sum: f64 =
            (0..3).flat_map(|v| (0..3).map(move |u| (u, v))).map(|(u, v)| hash(x + u, y + v)).sum();
        Luma([(sum / 9.0) as f32])
    })
}

fn case(side: u32) -> (Patch, GrayImage, u64) {
    let image = texture(side);
    let template =
        GrayImage::from_fn(TEMPLATE, TEMPLATE, |x, y| *image.get_pixel(x + side / 3, y + side / 4));
    let positions = u64::from(side - TEMPLATE + 1).pow(2);
    (template.into(), image, positions * u64::from(TEMPLATE).pow(2))
}

/// With the threads of the machine; items are multiply-adds.
#[divan::bench(args = [143, 161, 600])]
fn dense(bencher: Bencher<'_, '_>, side: u32) {
    let (template, image, work) = case(side);
    bencher
        .counter(ItemsCount::new(work))
        .bench(|| zncc_surface(&template, &image, PixelRect::whole(side, side)));
}

/// On one thread; items are multiply-adds.
#[divan::bench(args = [143, 161, 600])]
fn dense_one_thread(bencher: Bencher<'_, '_>, side: u32) {
    let (template, image, work) = case(side);
    // The pool of one is this thread itself, so that no time goes into handing over.
    let _pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build();
    bencher
        .counter(ItemsCount::new(work))
        .bench_local(|| zncc_surface(&template, &image, PixelRect::whole(side, side)));
}
