//! Correlation scores on real images, compared with OpenCV and with K-Eq 11 in double precision (R62, R63, R66).
//!
//! `tests/reference/zncc_reference.py` wrote the numbers and describes the method. The images are not part of the project:
//! cases whose data set is missing are listed and skipped (`sightline_tests::data`).

#![allow(clippy::unwrap_used, reason = "in a test a panic is the report")]

use std::path::{Path, PathBuf};

use serde_json::Value;
use sightline_geometry::frames::Pixel;
use sightline_tests::data;
use sightline_vision::correlate::{PixelRect, zncc, zncc_surface};
use sightline_vision::image::patch::extract;
use sightline_vision::image::sample::Kernel;
use sightline_vision::image::{GrayImage, io};

/// OpenCV sums in single precision.
const OPENCV_TOLERANCE: f64 = 1e-4;

/// The accuracy that `zncc_surface` documents.
const EXACT_TOLERANCE: f64 = 1e-5;

fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The image that a case names as `key`, unless its data set is missing.
fn image_of(case: &Value, key: &str) -> Option<GrayImage> {
    let (set, file) = case[key].as_str().unwrap().split_once('/').unwrap();
    let folder = data::set(set, case["name"].as_str().unwrap())?;
    Some(read_image(&folder.join(file)))
}

/// A grey PNG, or the 16-bit samples of a PDS3 image whose `^IMAGE` is a record number.
fn read_image(path: &Path) -> GrayImage {
    if path.extension().is_some_and(|e| e == "png") {
        return io::read_png(path, None).unwrap();
    }
    let bytes = std::fs::read(path).unwrap();
    let label = String::from_utf8_lossy(&bytes[..65_536]).into_owned();
    let image_object = label.split("END_OBJECT").find(|part| {
        part.lines().any(|line| {
            line.split_once('=').is_some_and(|(k, v)| k.trim() == "OBJECT" && v.trim() == "IMAGE")
        })
    });
    let number = |text: &str, key: &str| -> usize {
        let values = text.lines().rev().filter_map(|line| line.split_once('='));
        values.filter(|(k, _)| k.trim() == key).find_map(|(_, v)| v.trim().parse().ok()).unwrap()
    };
    let image_object = image_object.unwrap();
    let (width, height) = (number(image_object, "LINE_SAMPLES"), number(image_object, "LINES"));
    let start = (number(&label, "^IMAGE") - 1) * number(&label, "RECORD_BYTES");
    let samples = bytes[start..start + 2 * width * height].chunks_exact(2);
    let values = samples.map(|s| f32::from(u16::from_be_bytes([s[0], s[1]])) / 4095.0).collect();
    GrayImage::from_raw(width as u32, height as u32, values).unwrap()
}

fn integers<const N: usize>(value: &Value) -> [i32; N] {
    std::array::from_fn(|i| value[i].as_i64().unwrap() as i32)
}

/// Compares one case; returns the largest differences from OpenCV and from double precision.
fn compare(case: &Value, template_source: &GrayImage, image: &GrayImage) -> (f64, f64) {
    let name = case["name"].as_str().unwrap();
    let [x, y] = integers(&case["template_centre"]).map(f64::from);
    let half = case["template_size"].as_u64().unwrap() as u32 / 2;
    let template = extract(template_source, Pixel::new(x, y), half, Kernel::Bicubic);
    let [x, y, width, height] = integers(&case["search_region"]);
    let region = PixelRect::new(x, y, width as u32, height as u32);
    let surface = zncc_surface(&template, image, region).unwrap();
    assert_eq!(u64::from(surface.flat_positions), case["flat_positions"].as_u64().unwrap(), "{name}");
    let (ix, iy, maximum) = surface.maximum().unwrap();
    let [x, y] = integers(&case["maximum"]["pixel"]).map(f64::from);
    assert_eq!(surface.pixel_of(ix, iy), Pixel::new(x, y), "{name}");
    assert!(
        (f64::from(maximum) - case["maximum"]["score"].as_f64().unwrap()).abs() < EXACT_TOLERANCE,
        "{name}"
    );
    let mut worst = (0.0_f64, 0.0_f64);
    for position in case["positions"].as_array().unwrap() {
        let [x, y] = integers(position);
        let (ix, iy) = surface.index_of(x, y).unwrap();
        let score = f64::from(surface.at(ix, iy).unwrap());
        if let Some(opencv) = position[2].as_f64() {
            worst.0 = worst.0.max((score - opencv).abs());
        }
        worst.1 = worst.1.max((score - position[3].as_f64().unwrap()).abs());
        let window = extract(image, Pixel::new(f64::from(x), f64::from(y)), half, Kernel::Bicubic);
        let single = f64::from(zncc(&template, &window).unwrap());
        worst.1 = worst.1.max((single - position[3].as_f64().unwrap()).abs());
    }
    worst
}

#[test]
fn scores_on_real_images_equal_opencv_and_the_formula() {
    let text = std::fs::read_to_string(workspace().join("tests/reference/zncc_reference.json")).unwrap();
    let document: Value = serde_json::from_str(&text).unwrap();
    for case in document["cases"].as_array().unwrap() {
        let name = case["name"].as_str().unwrap();
        let Some(template_source) = image_of(case, "template_source") else { continue };
        let Some(searched) = image_of(case, "searched_source") else { continue };
        let (opencv, exact) = compare(case, &template_source, &searched);
        println!(
            "{name}: differs from OpenCV by {opencv:.1e}, from K-Eq 11 in double precision by {exact:.1e}"
        );
        assert!(opencv < OPENCV_TOLERANCE, "{name}: differs from OpenCV by {opencv:e}");
        assert!(exact < EXACT_TOLERANCE, "{name}: differs from the formula by {exact:e}");
    }
}
