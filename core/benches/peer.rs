//! Our half of `cargo xtask bench --peers`: runs the work it is told, on the pixels it is given, and says how long it took.
//!
//! One line in, one line out, so that the two sides can be run in turn. The first argument is a file of square `f32`
//! images, little endian, one after the other: the side as a `u32`, then the pixels row by row.
//!
//! ```text
//! in:   zncc <index of the image> <side of the template> <left> <top> <repetitions>
//! out:  <seconds of each repetition, the quickest of them> <score> <score> …
//! in:   sift <index of the image> <repetitions>
//! out:  <seconds> <keypoints>
//! in:   match <file of descriptors> <queries> <repetitions>
//! out:  <seconds> <nearest> <its distance> <that of the second nearest> <nearest> …
//! in:   stereo <block or semi-global> <index of the left image, before the right one> <disparities> <repetitions>
//! out:  <seconds> <disparity> <disparity> …
//! ```
//! The scores are those of every 97th position, the neighbours those of every 97th query, the disparities the medians
//! of some squares, for the comparison with the other side's. Descriptors are 128 bytes each: first the queries, then those they are compared with. Everything runs
//! on this one thread. Without an argument (as a plain bench) there is nothing to do.

use std::hint::black_box;
use std::io::{BufRead, Write};
use std::path::Path;
use std::time::Instant;

use sightline_vision::correlate::{PixelRect, zncc_surface};
use sightline_vision::image::{GrayImage, Patch};
use sightline_vision::sift::{Descriptor, SiftSettings, detect, nearest};
use sightline_vision::stereo::{StereoMethod, StereoSettings, disparities};

fn main() {
    // Cargo passes its own options and the name of a benchmark.
    let Some(path) = std::env::args().nth(1).filter(|argument| Path::new(argument).is_file()) else { return };
    let images = read_images(&std::fs::read(path).expect("the file of pixels can be read"));
    // The pool of one is this thread itself, so that no time goes into handing over.
    let _pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build();
    for line in std::io::stdin().lock().lines().map_while(Result::ok) {
        let words: Vec<&str> = line.split_whitespace().collect();
        let numbers: Vec<u32> = words.iter().skip(1).filter_map(|word| word.parse().ok()).collect();
        let answer = match (words.as_slice(), numbers.as_slice()) {
            (["zncc", ..], [image, size, left, top, repetitions]) => {
                run(&images[*image as usize], [*size, *left, *top], *repetitions)
            }
            (["sift", ..], [image, repetitions]) => run_sift(&images[*image as usize], *repetitions),
            (["match", path, ..], [queries, repetitions]) => run_match(path, *queries, *repetitions),
            (["stereo", method, ..], [image, count, repetitions]) => {
                run_stereo(&images[*image as usize..][..2], method, *count, *repetitions)
            }
            _ => panic!("not a line of the protocol: {line}"),
        };
        let mut out = std::io::stdout().lock();
        writeln!(out, "{answer}").and_then(|()| out.flush()).expect("the answer can be written");
    }
}

fn read_images(mut bytes: &[u8]) -> Vec<GrayImage> {
    let mut images = Vec::new();
    while let Some((side, rest)) = bytes.split_first_chunk::<4>() {
        let side = u32::from_le_bytes(*side);
        let (pixels, rest) = rest.split_at(4 * side as usize * side as usize);
        let values = pixels.as_chunks::<4>().0.iter().map(|value| f32::from_le_bytes(*value)).collect();
        images.push(GrayImage::from_raw(side, side, values).expect("a square image"));
        bytes = rest;
    }
    images
}

/// Seconds of the quickest repetition, and scores of some positions.
fn run(image: &GrayImage, [size, left, top]: [u32; 3], repetitions: u32) -> String {
    let template: Patch = GrayImage::from_fn(size, size, |x, y| *image.get_pixel(left + x, top + y)).into();
    let region = PixelRect::whole(image.width(), image.height());
    let (seconds, surface) =
        quickest(repetitions, || zncc_surface(black_box(&template), black_box(image), region));
    let scores = surface.expect("the image holds the template").scores;
    let shown = scores.iter().step_by(97).map(|score| format!(" {score:.7}"));
    format!("{seconds:.9}{}", shown.collect::<String>())
}

/// Seconds of the quickest repetition and what it gave.
fn quickest<T>(repetitions: u32, mut work: impl FnMut() -> T) -> (f64, T) {
    let mut timed = || {
        let start = Instant::now();
        let result = work();
        (start.elapsed().as_secs_f64(), result)
    };
    let first = timed();
    (1..repetitions).fold(first, |best, _| {
        let next = timed();
        if next.0 < best.0 { next } else { best }
    })
}

/// Seconds of the quickest repetition, and how many keypoints.
fn run_sift(image: &GrayImage, repetitions: u32) -> String {
    let settings = SiftSettings::default();
    let (seconds, features) = quickest(repetitions, || detect(black_box(image), &settings));
    format!("{seconds:.9} {}", features.keypoints.len())
}

/// Seconds of the quickest repetition, and neighbours of some queries.
fn run_match(path: &str, queries: u32, repetitions: u32) -> String {
    let bytes = std::fs::read(path).expect("the file of descriptors can be read");
    let (descriptors, _): (&[Descriptor], _) = bytes.as_chunks();
    let (query, train) = descriptors.split_at(queries as usize);
    let (seconds, neighbours) = quickest(repetitions, || nearest(black_box(query), black_box(train)));
    let shown = neighbours.iter().step_by(97).flatten().map(|found| {
        let distance = |square: u32| f64::from(square).sqrt();
        let second = found.second_distance2.map_or(-1.0, distance);
        format!(" {} {:.4} {second:.4}", found.nearest, distance(found.distance2))
    });
    format!("{seconds:.9}{}", shown.collect::<String>())
}

/// Seconds of the quickest repetition, and the median disparities of squares.
fn run_stereo(pair: &[GrayImage], method: &str, disparity_count: u32, repetitions: u32) -> String {
    let method = if method == "block" { StereoMethod::BlockMatching } else { StereoMethod::SemiGlobal };
    let settings = StereoSettings { method, disparity_count, ..StereoSettings::default() };
    let (seconds, map) = quickest(repetitions, || disparities([black_box(&pair[0]), &pair[1]], &settings));
    let map = map.expect("a pair that can be matched");
    let median = |left: u32, top: u32| {
        let pixels = (0..31 * 31).map(|k| map.at(left + k % 31, top + k / 31).unwrap_or(-1.0));
        let mut found: Vec<f32> = pixels.collect();
        found.sort_by(f32::total_cmp);
        found[found.len() / 2]
    };
    let places = (0..16).map(|k| (200 + 190 * (k % 4), 50 + 250 * (k / 4)));
    let shown = places.map(|(left, top)| format!(" {:.4}", median(left, top)));
    format!("{seconds:.9}{}", shown.collect::<String>())
}
