//! Disparities of recorded and rendered pairs, compared with the truth and with OpenCV's
//! (`tests/reference/stereo_reference.py` wrote the numbers and describes the method).
//!
//! A test without its recording is skipped (see `sightline_testdata`).

use std::path::Path;

use image::Luma;
use serde::Deserialize;
use sightline_geometry::camera::Camera;
use sightline_testdata::recorded;
use sightline_vision::image::GrayImage;

use sightline_geometry::frames::{Pixel, Pose};
use sightline_recordings::import::kitti::{read_cameras, read_poses};
use sightline_vision::image::io::{read_png, write_png_u8};
use sightline_vision::stereo::*;
use sightline_world::truth::picture_truth;
use sightline_world::{Eye, NoiseSeed, Scenario, World, index, render, true_camera_in_site};

/// Error above which a disparity is bad, px.
const BAD_PX: f64 = 2.0;

#[derive(Deserialize)]
struct Reference {
    rows: Vec<ReferenceRow>,
    street: Vec<StreetRow>,
}

/// OpenCV's density on the street, and its agreement with the next frame.
#[derive(Deserialize)]
struct StreetRow {
    matcher: String,
    found: f64,
    within_1: f64,
    within_3: f64,
}

fn reference() -> Reference {
    serde_json::from_str(include_str!("../../../tests/reference/stereo_reference.json")).unwrap()
}

#[derive(Deserialize)]
struct ReferenceRow {
    pair: String,
    matcher: String,
    disparities: u32,
    bad2: f64,
    rms_px: f64,
    coverage: f64,
}

/// Accuracy of a disparity map, over the pixels with ground truth.
#[derive(Clone, Copy, Debug)]
struct Quality {
    /// Share without a disparity, or wrong by more than 2 px.
    bad2: f64,
    /// RMS error of the disparities found.
    rms_px: f64,
    /// Share with a disparity.
    coverage: f64,
}

fn quality(map: &DisparityMap, truth: &[f32]) -> Quality {
    let (mut known, mut bad, mut answered, mut squares) = (0.0, 0.0, 0.0, 0.0);
    for (found, truth) in map.disparity_px.iter().zip(truth).filter(|(_, truth)| truth.is_finite()) {
        known += 1.0;
        let off = f64::from(found - truth).abs();
        bad += f64::from(u8::from(off.is_nan() || off > BAD_PX));
        if found.is_finite() {
            answered += 1.0;
            squares += off * off;
        }
    }
    Quality { bad2: bad / known, rms_px: (squares / answered).sqrt(), coverage: answered / known }
}

/// 0.299 R + 0.587 G + 0.114 B, rounded to 8 bits, as in the reference program.
fn grey(path: &Path) -> GrayImage {
    let colour = image::open(path).unwrap().into_rgb8();
    GrayImage::from_fn(colour.width(), colour.height(), |x, y| {
        let [red, green, blue] = colour.get_pixel(x, y).0.map(f64::from);
        Luma([(0.299 * red + 0.587 * green + 0.114 * blue + 0.5).floor() as f32 / 255.0])
    })
}

/// The values of a PFM file of one channel, little endian, from the top row down.
fn portable_floatmap(path: &Path, width: usize) -> Vec<f32> {
    let bytes = std::fs::read(path).unwrap();
    let words: Vec<&[u8]> = bytes.splitn(4, |byte| *byte == b'\n').collect();
    assert_eq!((words[0], words[2][0]), (b"Pf".as_slice(), b'-'));
    let numbers = words[3].as_chunks::<4>().0.iter().map(|number| f32::from_le_bytes(*number));
    let values: Vec<f32> = numbers.collect();
    values.chunks_exact(width).rev().flatten().copied().collect()
}

/// Compares our two methods with their OpenCV counterparts; asserts that no figure is worse.
fn compare(pair: &str, [left, right]: [&GrayImage; 2], truth: &[f32]) {
    let rows: Vec<ReferenceRow> = reference().rows.into_iter().filter(|row| row.pair == pair).collect();
    assert!(!rows.is_empty(), "{pair}");
    for row in rows {
        let is_block = row.matcher.starts_with("StereoBM");
        let method = if is_block { StereoMethod::BlockMatching } else { StereoMethod::SemiGlobal };
        let settings =
            StereoSettings { method, disparity_count: row.disparities, ..StereoSettings::default() };
        let ours = quality(&disparities([left, right], &settings).unwrap(), truth);
        println!(
            "{pair}, {} disparities: bad-2.0 {:.4}, rms {:.3} px, coverage {:.4} beside {} {:.4}, {:.3} px, {:.4}",
            row.disparities,
            ours.bad2,
            ours.rms_px,
            ours.coverage,
            row.matcher,
            row.bad2,
            row.rms_px,
            row.coverage
        );
        assert!(
            ours.bad2 <= row.bad2 && ours.rms_px <= row.rms_px && ours.coverage >= row.coverage,
            "{pair}"
        );
    }
}

#[test]
fn a_motorcycle_is_matched_no_worse_than_by_opencv() {
    let Some(folder) = recorded("middlebury-motorcycle", "the comparison of disparities") else { return };
    let (left, right) =
        (grey(&folder.join("motorcycle_left.png")), grey(&folder.join("motorcycle_right.png")));
    let truth = portable_floatmap(&folder.join("motorcycle_disp.pfm"), left.width() as usize);
    compare("motorcycle", [&left, &right], &truth);
}

/// Size of the rendered pair, px.
const SIZE: [u32; 2] = [400, 300];

/// The third last stop of the demonstration, rendered for aligned cameras, with noise, 8 bits; its true disparities (sky:
/// ∞).
fn rendered() -> ([GrayImage; 2], Vec<f32>) {
    let mut scenario = Scenario::demo();
    scenario.camera.samples_per_axis = 3;
    let world = World::new(&scenario);
    let index = index(&scenario, &world).unwrap();
    let stop = &index.stops[index.stops.len() - 3];
    let [left, right] = [Eye::Left, Eye::Right].map(|eye| true_camera_in_site(stop, eye).unwrap());
    let settings = AlignSettings { size: Some(SIZE), ..AlignSettings::default() };
    let alignment = Alignment::new(&left, &right, &settings).unwrap();
    let image = |camera: &Camera, eye: Eye| {
        let mut image = render(&world, &scenario, camera, NoiseSeed { step: 1, eye });
        image.iter_mut().for_each(|value| *value = (*value * 255.0).round() / 255.0);
        image
    };
    let images = [image(&alignment.left, Eye::Left), image(&alignment.right, Eye::Right)];
    let truth = picture_truth(&world, &alignment.left);
    let disparity = |(at, range_m): (usize, &f64)| {
        let (x, y) = (at as u32 % SIZE[0], at as u32 / SIZE[0]);
        let ray = alignment.left.ray(Pixel::new(x.into(), y.into())).unwrap();
        let depth = ray.direction.dot(&alignment.left.model.axis()) * range_m;
        if depth.is_finite() { alignment.disparity_px(depth) as f32 } else { f32::INFINITY }
    };
    let truth = truth.range_m.iter().enumerate().map(disparity).collect();
    (images, truth)
}

#[test]
fn a_rendered_pair_is_matched_no_worse_than_by_opencv() {
    let ([left, right], truth) = rendered();
    if let Some(folder) = std::env::var_os("SIGHTLINE_STEREO_PAIR") {
        write_pair(Path::new(&folder), [&left, &right], &truth);
    }
    compare("rendered", [&left, &right], &truth);
}

/// Writes the rendered pair for `tests/reference/stereo_reference.py`.
fn write_pair(folder: &Path, [left, right]: [&GrayImage; 2], truth: &[f32]) {
    write_png_u8(folder.join("left.png"), left).unwrap();
    write_png_u8(folder.join("right.png"), right).unwrap();
    let bytes: Vec<u8> = truth.iter().flat_map(|value| value.to_le_bytes()).collect();
    std::fs::write(folder.join("disparity.f32"), bytes).unwrap();
}

/// Shares of points of one frame whose disparity in the next frame, predicted by the known motion, agrees within 1 px and 3
/// px.
fn reprojected(stereo: [&DenseStereo; 2], after_from_before: &Pose) -> [f64; 2] {
    let (mut compared, mut within) = (0.0, [0.0; 2]);
    let [before, after] = stereo;
    let (width, height) = (before.disparities.width, before.disparities.height);
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        let Some(point) = before.point(x, y).map(|point| after_from_before * point) else { continue };
        let Some(pixel) = after.alignment.left.project(&point).filter(|p| p.is_inside(width, height)) else {
            continue;
        };
        let Some(found) = after.disparities.at(pixel.x.round() as u32, pixel.y.round() as u32) else {
            continue;
        };
        let depth = (point - after.alignment.left.model.centre()).dot(&after.alignment.left.model.axis());
        let off = (after.alignment.disparity_px(depth) - f64::from(found)).abs();
        compared += 1.0;
        within[0] += f64::from(u8::from(off < 1.0));
        within[1] += f64::from(u8::from(off < 3.0));
    }
    within.map(|count| count / compared)
}

#[test]
fn street_stereo_is_consistent_between_eyes_and_frames() {
    let Some(folder) = recorded("kitti-seq1-frames-0-19", "the consistency of disparities") else { return };
    let frames = [0, 1].map(|frame| {
        ["image_0", "image_1"]
            .map(|eye| read_png(folder.join(eye).join(format!("{frame:06}.png")), None).unwrap())
    });
    let cameras = read_cameras(&folder.join("calib.txt"), frames[0][0].dimensions().into()).unwrap();
    let poses = read_poses(&folder.join("poses.txt")).unwrap();
    for (method, counterpart) in
        [(StereoMethod::SemiGlobal, "StereoSGBM"), (StereoMethod::BlockMatching, "StereoBM")]
    {
        let theirs = reference().street.into_iter().find(|row| row.matcher == counterpart).unwrap();
        let settings =
            StereoSettings { method, disparity_count: 96, range_max_m: 1000.0, ..StereoSettings::default() };
        let [before, after] = frames
            .each_ref()
            .map(|[left, right]| dense_stereo([left, right], [&cameras[0], &cameras[1]], &settings).unwrap());
        let map = &before.disparities;
        let share = |outcome| map.count(outcome) as f64 / map.outcome.len() as f64;
        let [within_1, within_3] = reprojected([&before, &after], &(poses[1].inverse() * poses[0]));
        println!(
            "KITTI, {method:?}: found {:.3}, eyes disagree {:.3}, not unique {:.3}, no texture {:.3}, speckle {:.3}, outside \
             {:.3}; carried to the next frame {within_1:.3} within 1 px, {within_3:.3} within 3 px; \
             {counterpart}: {:.3}, {:.3}, {:.3}",
            share(Outcome::Found),
            share(Outcome::LeftRight),
            share(Outcome::NotUnique),
            share(Outcome::NoTexture),
            share(Outcome::Speckle),
            share(Outcome::Outside),
            theirs.found,
            theirs.within_1,
            theirs.within_3,
        );
        // Half a percent is a few hundred points, about as many as a change of a setting affects.
        assert!(share(Outcome::Found) > 0.6 && within_3 > theirs.within_3 - 0.005, "{method:?}");
    }
}
