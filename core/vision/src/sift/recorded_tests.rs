//! Features of recorded images compared with OpenCV's; `tests/reference/sift_reference.py` wrote and describes the
//! numbers.
//!
//! A test is skipped if its images are missing (see `sightline_testdata`).

use std::path::Path;

use image::Luma;
use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;
use sightline_testdata::recorded;

use super::*;

#[derive(Deserialize)]
struct Reference {
    contrast_min: f64,
    near_px: f64,
    ratio_max: f64,
    images: Vec<ReferenceImage>,
    pairs: Vec<ReferencePair>,
}

#[derive(Deserialize)]
struct ReferenceImage {
    image: String,
    keypoints: usize,
    /// (x, y, σ, direction).
    samples: Vec<[f64; 4]>,
}

#[derive(Deserialize)]
struct ReferencePair {
    image: String,
    second: String,
    repeatability: f64,
    matching_score: f64,
}

fn reference() -> Reference {
    serde_json::from_str(include_str!("../../../../tests/reference/sift_reference.json")).unwrap()
}

/// Grey in 8 bits, converted as by the reference: 0.299 R + 0.587 G + 0.114 B, rounded.
fn grey(path: &Path) -> image::GrayImage {
    if path.extension().is_some_and(|extension| extension == "pgm") {
        return portable_graymap(&std::fs::read(path).unwrap());
    }
    match image::open(path).unwrap() {
        image::DynamicImage::ImageLuma8(grey) => grey,
        colour => {
            let colour = colour.into_rgb8();
            image::GrayImage::from_fn(colour.width(), colour.height(), |x, y| {
                let [red, green, blue] = colour.get_pixel(x, y).0.map(f64::from);
                Luma([(0.299 * red + 0.587 * green + 0.114 * blue + 0.5).floor() as u8])
            })
        }
    }
}

/// Decodes a binary PGM file of 8 bits: four words, with comments between, then the pixels.
fn portable_graymap(bytes: &[u8]) -> image::GrayImage {
    let mut words = Vec::new();
    let mut at = 0;
    while words.len() < 4 {
        let end = |stop: fn(&u8) -> bool| at + bytes[at..].iter().position(stop).unwrap();
        if bytes[at] == b'#' {
            at = end(|&byte| byte == b'\n');
        } else if !bytes[at].is_ascii_whitespace() {
            let end = end(u8::is_ascii_whitespace);
            words.push(std::str::from_utf8(&bytes[at..end]).unwrap());
            at = end;
        }
        at += 1;
    }
    assert_eq!((words[0], words[3]), ("P5", "255"));
    image::GrayImage::from_raw(words[1].parse().unwrap(), words[2].parse().unwrap(), bytes[at..].to_vec())
        .unwrap()
}

fn fractions(grey: &image::GrayImage) -> GrayImage {
    GrayImage::from_fn(grey.width(), grey.height(), |x, y| Luma([f32::from(grey.get_pixel(x, y)[0]) / 255.0]))
}

fn features(grey: &image::GrayImage) -> Features {
    let settings = SiftSettings { contrast_min: reference().contrast_min, ..SiftSettings::default() };
    detect(&fractions(grey), &settings)
}

/// The second image of a pair, and the homography to it.
fn second(path: &Path, image: &image::GrayImage, how: &str) -> (image::GrayImage, Matrix3<f64>) {
    let (width, height) = image.dimensions();
    match how {
        "homography" => {
            let folder = path.parent().unwrap();
            let text = std::fs::read_to_string(folder.join("H1to3p.xml")).unwrap();
            let (_, data) = text.split_once("<data>").unwrap();
            let numbers = data.split_once("</data>").unwrap().0.split_whitespace();
            let numbers: Vec<f64> = numbers.map(|number| number.parse().unwrap()).collect();
            (grey(&folder.join("graf3.png")), Matrix3::from_row_slice(&numbers))
        }
        "turned" => {
            let turn = Matrix3::new(0., -1., f64::from(height) - 1., 1., 0., 0., 0., 0., 1.);
            (image::imageops::rotate90(image), turn)
        }
        _ => {
            let pixel = |x, y| u32::from(image.get_pixel(x, y)[0]);
            let mean = |x: u32, y: u32| {
                pixel(2 * x, 2 * y)
                    + pixel(2 * x + 1, 2 * y)
                    + pixel(2 * x, 2 * y + 1)
                    + pixel(2 * x + 1, 2 * y + 1)
                    + 2
            };
            let halved =
                image::GrayImage::from_fn(width / 2, height / 2, |x, y| Luma([(mean(x, y) / 4) as u8]));
            (halved, Matrix3::new(0.5, 0., -0.25, 0., 0.5, -0.25, 0., 0., 1.))
        }
    }
}

fn mapped(homography: &Matrix3<f64>, keypoint: &Keypoint) -> [f64; 2] {
    let there = homography * Vector3::new(f64::from(keypoint.x), f64::from(keypoint.y), 1.0);
    [there.x / there.z, there.y / there.z]
}

/// Repeatability and matching score.
fn compare(first: &image::GrayImage, other: &image::GrayImage, homography: &Matrix3<f64>) -> [f64; 2] {
    let Reference { near_px, ratio_max, .. } = reference();
    let (a, b) = (features(first), features(other));
    let is_inside = |[x, y]: [f64; 2], image: &image::GrayImage| {
        let (width, height) = (f64::from(image.width()), f64::from(image.height()));
        (0.0..=width - 1.0).contains(&x) && (0.0..=height - 1.0).contains(&y)
    };
    let back = homography.try_inverse().unwrap();
    let common: Vec<usize> =
        (0..a.keypoints.len()).filter(|&i| is_inside(mapped(homography, &a.keypoints[i]), other)).collect();
    let there: Vec<[f64; 2]> = common.iter().map(|&i| mapped(homography, &a.keypoints[i])).collect();
    let common_b: Vec<&Keypoint> =
        b.keypoints.iter().filter(|keypoint| is_inside(mapped(&back, keypoint), first)).collect();
    let is_near = |[x, y]: [f64; 2], b: &Keypoint| (f64::from(b.x) - x).hypot(f64::from(b.y) - y) <= near_px;
    let repeated = there.iter().filter(|&&place| b.keypoints.iter().any(|b| is_near(place, b))).count();
    let everywhere: Vec<[f64; 2]> = a.keypoints.iter().map(|keypoint| mapped(homography, keypoint)).collect();
    let repeated_b = common_b.iter().filter(|b| everywhere.iter().any(|&place| is_near(place, b))).count();

    let descriptors: Vec<Descriptor> = common.iter().map(|&i| a.descriptors[i]).collect();
    let settings = MatchSettings { ratio_max: Some(ratio_max), mutual: false };
    let found = matches(&descriptors, &b.descriptors, &settings);
    let is_correct =
        |found: &&Match| is_near(there[found.query as usize], &b.keypoints[found.train as usize]);
    let correct = found.iter().filter(is_correct).count();
    let count = common.len().min(common_b.len()) as f64;
    [repeated.min(repeated_b) as f64 / count, correct as f64 / count]
}

#[test]
fn as_many_keypoints_as_opencv_at_the_same_places_with_the_same_scales_and_directions() {
    for ReferenceImage { image, keypoints, samples } in reference().images {
        let Some(path) = recorded(&image, "the comparison of keypoints") else { continue };
        let found = features(&grey(&path)).keypoints;
        let share = found.len() as f64 / keypoints as f64;
        assert!((share - 1.0).abs() < 0.05, "{image}: {} beside {keypoints}", found.len());

        let mut distances = Vec::new();
        for [x, y, sigma, direction] in &samples {
            let off = |keypoint: &Keypoint| (f64::from(keypoint.x) - x).hypot(f64::from(keypoint.y) - y);
            let is_along =
                |keypoint: &Keypoint| (f64::from(keypoint.orientation_rad) - direction).cos() > 0.995;
            let same = found
                .iter()
                .filter(|keypoint| (f64::from(keypoint.sigma_px) / sigma).ln().abs() < 0.05)
                .filter(|keypoint| is_along(keypoint))
                .map(off)
                .fold(f64::INFINITY, f64::min);
            distances.extend(Some(same).filter(|&off| off < 0.5 * sigma));
        }
        distances.sort_by(f64::total_cmp);
        println!(
            "{image}: {} beside {keypoints}, {} of {} samples, median {:.5} px",
            found.len(),
            distances.len(),
            samples.len(),
            distances[distances.len() / 2]
        );
        assert!(distances.len() * 10 >= samples.len() * 9, "{image}: {}", distances.len());
        assert!(distances[distances.len() / 2] < 0.01, "{image}");
    }
}

#[test]
fn features_are_found_again_and_matched_at_least_as_well_as_opencvs() {
    let (mut ours, mut theirs) = ([0.0; 2], [0.0; 2]);
    for ReferencePair { image, second: how, repeatability, matching_score } in reference().pairs {
        let Some(path) = recorded(&image, "the comparison of matches") else { return };
        let first = grey(&path);
        let (other, homography) = second(&path, &first, &how);
        let [repeated, matched] = compare(&first, &other, &homography);
        println!(
            "{image} {how}: repeatability {repeated:.4} beside {repeatability:.4}, \
             matching score {matched:.4} beside {matching_score:.4}"
        );
        assert!(repeated > repeatability - 0.03 && matched > matching_score - 0.03, "{image} {how}");
        ours = [ours[0] + repeated, ours[1] + matched];
        theirs = [theirs[0] + repeatability, theirs[1] + matching_score];
    }
    println!("sums: ours {ours:?}, OpenCV's {theirs:?}");
    assert!(ours[0] >= theirs[0] && ours[1] >= theirs[1], "{ours:?} beside {theirs:?}");
}
