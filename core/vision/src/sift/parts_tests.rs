//! Parts of the detector against their definitions in double precision.

use std::f64::consts::TAU;

use image::Luma;

use super::blur::{Kernel, blur};
use super::plane::Plane;
use super::scale_space::ScaleSpace;
use super::*;

fn hash(x: usize, y: usize) -> f64 {
    let h = (x as u32).wrapping_mul(0x9E37_79B1) ^ (y as u32).wrapping_mul(0x85EB_CA77);
    let h = (h ^ (h >> 15)).wrapping_mul(0x2C1B_3C6D);
    f64::from(h ^ (h >> 13)) / f64::from(u32::MAX)
}

fn plane(width: usize, height: usize) -> Plane {
    let mut plane = Plane::default();
    plane.begin([width, height], height);
    let stride = plane.stride;
    for (first, rows) in plane.make(height) {
        for (i, row) in rows.chunks_exact_mut(stride).enumerate() {
            for (x, value) in row[..width].iter_mut().enumerate() {
                *value = hash(x, first + i) as f32;
            }
        }
    }
    plane
}

#[test]
fn the_filter_is_the_gaussian_of_the_mirrored_image_however_few_rows_are_made_at_a_time() {
    for (width, height, sigma) in [(1, 1, 1.3), (7, 3, 1.0), (16, 40, 2.0), (33, 21, 3.1), (150, 47, 1.5)] {
        let source = plane(width, height);
        let radius = (4.0_f64 * sigma).round() as i64;
        let weight = |i: i64| (-0.5 * (i as f64 / sigma).powi(2)).exp();
        let sum: f64 = (-radius..=radius).map(weight).sum();
        let mirrored = |mut at: i64, side: usize| {
            let last = side as i64 - 1;
            while last > 0 && !(0..=last).contains(&at) {
                at = if at < 0 { -at } else { 2 * last - at };
            }
            if last == 0 { 0 } else { at as usize }
        };
        let expected = |x: usize, y: usize| {
            let offsets = || -radius..=radius;
            let row = |j: i64| {
                let pixel = |i: i64| hash(mirrored(x as i64 + i, width), mirrored(y as i64 + j, height));
                offsets().map(|i| weight(i) / sum * pixel(i)).sum::<f64>()
            };
            offsets().map(|j| weight(j) / sum * row(j)).sum::<f64>()
        };
        for step in [1, 5, height] {
            let mut blurred = Plane::default();
            blurred.begin([width, height], height);
            for end in (step..height + step).step_by(step) {
                blur(&source, &Kernel::gaussian(sigma), &mut blurred, end.min(height));
            }
            for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
                let found = f64::from(blurred.row(y)[x]);
                assert!((found - expected(x, y)).abs() < 1e-6, "{width} × {height}, {sigma}: ({x}, {y})");
            }
        }
    }
}

#[test]
fn of_equal_pixels_side_by_side_one_is_an_extremum() {
    let mut image = GrayImage::from_pixel(64, 64, Luma([0.3]));
    // A square of 10 × 10 pixels is symmetric about each of its four central pixels.
    for (x, y) in (26..36).flat_map(|y| (26..36).map(move |x| (x, y))) {
        image.put_pixel(x, y, Luma([0.9]));
    }
    let settings = SiftSettings { double_image: false, ..SiftSettings::default() };
    let mut space = ScaleSpace::new(&image, &settings).unwrap();
    assert!(space.next_octave());
    let (octave, rows) = space.slide().unwrap();
    let found = scan::extrema(octave, rows, 0.01);
    assert_eq!(found.len(), 1, "{found:?}");
    assert!([30, 31].contains(&found[0].x) && [30, 31].contains(&found[0].y), "{found:?}");
}

/// h by its definition, as a descriptor before rounding.
fn defined(layer: &Plane, [x, y, sigma, orientation]: [f64; 4]) -> [f64; 128] {
    let mut h = [0.0; 128];
    let pixel = |x: usize, y: usize| f64::from(layer.row(y)[x]);
    let tent = |a: f64| (1.0 - a.abs()).max(0.0);
    for (u, v) in (1..layer.height - 1).flat_map(|v| (1..layer.width - 1).map(move |u| (u, v))) {
        let (dx, dy) = (u as f64 - x, v as f64 - y);
        let (sin, cos) = orientation.sin_cos();
        let column = (dx * cos + dy * sin) / (3.0 * sigma) + 1.5;
        let row = (dy * cos - dx * sin) / (3.0 * sigma) + 1.5;
        let (gx, gy) = (pixel(u + 1, v) - pixel(u - 1, v), pixel(u, v + 1) - pixel(u, v - 1));
        let turn = (8.0 * (orientation - gy.atan2(gx)) / TAU).rem_euclid(8.0);
        let mass = gx.hypot(gy) * (-(dx * dx + dy * dy) / (72.0 * sigma * sigma)).exp();
        for (number, value) in h.iter_mut().enumerate() {
            let (i, j, k) = (number / 32, number / 8 % 4, number % 8);
            let away = (turn - k as f64).abs();
            *value += mass * tent(row - i as f64) * tent(column - j as f64) * tent(away.min(8.0 - away));
        }
    }
    let length = |h: &[f64; 128]| h.iter().map(|value| value * value).sum::<f64>().sqrt();
    let most = 0.2 * length(&h);
    let cut = h.map(|value| value.min(most));
    cut.map(|value| (512.0 * value / length(&cut)).min(255.0))
}

#[test]
fn descriptors_are_those_of_the_definition_inside_and_at_the_edges() {
    let image = GrayImage::from_fn(120, 90, |x, y| {
        let around = (0..9).map(|i| hash(x as usize + i % 3, y as usize + i / 3));
        Luma([(around.sum::<f64>() / 9.0) as f32])
    });
    let settings = SiftSettings { double_image: false, contrast_min: 0.01, ..SiftSettings::default() };
    let mut space = ScaleSpace::new(&image, &settings).unwrap();
    assert!(space.next_octave());
    // All rows are computed and kept: the image is lower than the window.
    while space.slide().is_some_and(|(_, rows)| rows.end < 85) {}
    let octave = space.octave();
    let place = (0, Candidate { layer: 0, y: 0, x: 0 });
    let mut keypoints = Vec::new();
    for i in 0..60 {
        let at = |k: usize| hash(i, k);
        keypoints.push((
            place,
            Keypoint {
                x: (5.0 + 110.0 * at(1)) as f32,
                y: (5.0 + 80.0 * at(2)) as f32,
                sigma_px: (1.6 + 2.0 * at(3)) as f32,
                orientation_rad: (TAU * (at(4) - 0.5)) as f32,
                contrast: 0.0,
                octave: 0,
                layer: 1 + (i % 3) as u8,
            },
        ));
    }
    let found = descriptor::describe(octave, &keypoints);
    for ((_, keypoint), found) in keypoints.iter().zip(found) {
        let Keypoint { x, y, sigma_px, orientation_rad, layer, .. } = *keypoint;
        let window = [x, y, sigma_px, orientation_rad].map(f64::from);
        let expected = defined(&octave.layers[usize::from(layer)], window);
        for (found, expected) in found.iter().zip(expected) {
            assert!((f64::from(*found) - expected).abs() < 0.52, "{keypoint:?}: {found}, not {expected}");
        }
    }
}
