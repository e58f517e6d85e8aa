//! Tests of the sub-pixel peak, its covariance, the second peak, and of matching scaled and rolled templates.

use image::Luma;
use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64Mcg;

use super::*;
use crate::correlate::{PixelRect, zncc_surface};
use crate::image::patch::{extract, scale_roll};
use crate::image::sample::Kernel;
use crate::image::{GrayImage, Patch};

/// A texture of waves from 8 to 20 px in all directions, around 0.5; exact at any position.
fn texture(x: f64, y: f64) -> f64 {
    let wave = |k: f64| {
        let (angle, length) = (k * 2.399_963, 8.0 + 12.0 * (k * 0.618_034).fract());
        (std::f64::consts::TAU * (x * angle.cos() + y * angle.sin()) / length + k * k).cos()
    };
    0.5 + (0..24).map(|k| wave(f64::from(k))).sum::<f64>() / 60.0
}

fn image_of(side: u32, f: impl Fn(f64, f64) -> f64) -> GrayImage {
    GrayImage::from_fn(side, side, |x, y| Luma([f(f64::from(x), f64::from(y)) as f32]))
}

fn surface_of(width: u32, height: u32, f: impl Fn(f64, f64) -> f64) -> Surface {
    let scores = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let scores = scores.map(|(x, y)| f(f64::from(x), f64::from(y)) as f32).collect();
    Surface { origin: [100, 200], width, height, scores, flat_positions: 0, template_size: 21 }
}

#[test]
fn the_peak_of_a_shifted_texture_is_found_within_two_hundredths_of_a_pixel() {
    let before = image_of(100, texture);
    let (mut worst, mut worst_integer) = (0.0_f64, 0.0_f64);
    for i in 0..25 {
        let (dx, dy) = (f64::from(i) * 0.37 % 1.0 - 0.5 + 3.0, f64::from(i) * 0.61 % 1.0 - 0.5 - 2.0);
        let after = image_of(100, |x, y| texture(x - dx, y - dy));
        let centre = Pixel::new(f64::from(30 + i), f64::from(60 - i));
        let template = extract(&before, centre, 10, Kernel::Bicubic);
        let surface = zncc_surface(&template, &after, PixelRect::centred(centre, 41)).unwrap();
        let peak = find_peak(&surface, true).unwrap();
        assert!(!peak.at_edge && peak.score > 0.99);
        worst = worst.max(peak.pixel.distance(centre.offset(dx, dy)));
        let integer = find_peak(&surface, false).unwrap();
        assert_eq!(integer.pixel, Pixel::new(f64::from(integer.integer[0]), f64::from(integer.integer[1])));
        worst_integer = worst_integer.max(integer.pixel.distance(centre.offset(dx, dy)));
    }
    assert!(worst <= 0.02, "sub-pixel error {worst}");
    assert!(worst_integer > 0.4, "without the fit the error is a rounding error: {worst_integer}");
}

#[test]
fn ncc_finds_a_template_rolled_by_ten_degrees_and_scaled_forward_and_back() {
    let centre = Pixel::new(50.0, 52.0);
    let before = image_of(105, texture);
    for (scale, roll_deg) in [(1.0, 10.0), (1.0, -10.0), (1.25, 0.0), (0.8, 0.0), (1.25, -10.0), (0.8, 10.0)]
    {
        let (sin, cos) = f64::to_radians(roll_deg).sin_cos();
        // The new image: the texture magnified and rotated clockwise about the centre, then moved by (4.3, −2.6).
        let target = centre.offset(4.3, -2.6);
        let after = image_of(105, |x, y| {
            let (u, v) = ((x - target.x) / scale, (y - target.y) / scale);
            texture(centre.x + cos * u + sin * v, centre.y + cos * v - sin * u)
        });
        let match_of = |template: &Patch| {
            let surface = zncc_surface(template, &after, PixelRect::centred(centre, 51)).unwrap();
            find_peak(&surface, true).unwrap()
        };
        let prepared = scale_roll(&before, centre, scale, f64::to_radians(roll_deg), 21, Kernel::Bicubic);
        let (with, without) = (match_of(&prepared), match_of(&extract(&before, centre, 10, Kernel::Bicubic)));
        let error = with.pixel.distance(target);
        assert!(error < 0.03 && with.score > 0.99, "{scale}, {roll_deg}: {error} px, {}", with.score);
        assert!(without.score < with.score - 0.03, "{scale}, {roll_deg}: {}", without.score);
    }
}

#[test]
fn a_quadratic_is_recovered_exactly() {
    let (px, py) = (5.3, 3.8);
    let f =
        |x: f64, y: f64| 0.9 - 0.04 * (x - px).powi(2) - 0.03 * (y - py).powi(2) + 0.02 * (x - px) * (y - py);
    let peak = find_peak(&surface_of(11, 9, f), true).unwrap();
    assert!(peak.pixel.distance(Pixel::new(105.3, 203.8)) < 1e-5);
    assert!((peak.score - 0.9).abs() < 1e-6 && peak.integer == [105, 204]);
    // Σ = (1 − 0.81)/(441 − 4) · [[0.08, −0.02], [−0.02, 0.06]]⁻¹ + 0.02².
    let expected = Matrix2::new(0.06, 0.02, 0.02, 0.08) / 0.0044 * (0.19 / 437.0);
    let found = peak.covariance_px2 - Matrix2::identity() * 0.0004;
    assert!((found - expected).norm() < 1e-4 * expected.norm(), "{found}");
}

#[test]
fn on_a_ridge_at_the_edge_or_beside_an_excluded_position_the_whole_pixel_stands() {
    // A saddle of the quadratic: the highest whole pixel of a ridge that is narrow across and level along itself.
    let ridge = surface_of(9, 9, |x, y| {
        0.8 - 0.01 * (x - y).powi(2) - 0.001 * (x - y).powi(4) - 1e-6 * (x + y - 8.0).abs()
    });
    let ridge = find_peak(&ridge, true).unwrap();
    assert_eq!((ridge.pixel, ridge.at_edge), (Pixel::new(104.0, 204.0), false));
    assert_eq!(ridge.covariance_px2, Matrix2::identity() * 0.75);
    let edge =
        find_peak(&surface_of(9, 9, |x, y| 0.8 - 0.01 * (x + 1.0).powi(2) - 0.01 * (y - 4.0).powi(2)), true);
    let edge = edge.unwrap();
    assert_eq!((edge.pixel, edge.at_edge), (Pixel::new(100.0, 204.0), true));
    let mut holed = surface_of(9, 9, |x, y| 0.8 - 0.01 * (x - 4.2).powi(2) - 0.01 * (y - 4.0).powi(2));
    holed.scores[3 * 9 + 3] = f32::NAN;
    let holed = find_peak(&holed, true).unwrap();
    assert_eq!((holed.pixel, holed.at_edge), (Pixel::new(104.0, 204.0), true));
    assert_eq!(holed.covariance_px2, Matrix2::identity() * 0.75);
    assert!(find_peak(&surface_of(4, 4, |_, _| f64::NAN), true).is_none());
    assert!(find_peak(&Surface::default(), true).is_none());
}

#[test]
fn the_covariance_is_that_of_many_noisy_matches() {
    // Independent noise in the image: the scatter of the peak must equal the predicted covariance.
    let centre = Pixel::new(30.0, 30.0);
    let clean = image_of(60, |x, y| texture(x - 0.3, y + 0.2));
    let template = extract(&image_of(60, texture), centre, 10, Kernel::Bicubic);
    let (noise, mut random) = (Normal::new(0.0, 0.02).unwrap(), Pcg64Mcg::seed_from_u64(7));
    let (mut peaks, mut predicted, runs) = (Vec::new(), Matrix2::zeros(), 600);
    for _ in 0..runs {
        let mut image = clean.clone();
        image.iter_mut().for_each(|v| *v += noise.sample(&mut random) as f32);
        let surface = zncc_surface(&template, &image, PixelRect::centred(centre, 29)).unwrap();
        let peak = find_peak(&surface, true).unwrap();
        peaks.push(Vector2::new(peak.pixel.x, peak.pixel.y));
        predicted += (peak.covariance_px2 - Matrix2::identity() * FIT_FLOOR_PX.powi(2)) / f64::from(runs);
    }
    let mean = peaks.iter().sum::<Vector2<f64>>() / f64::from(runs);
    let spread: Matrix2<f64> =
        peaks.iter().map(|p| (p - mean) * (p - mean).transpose()).sum::<Matrix2<f64>>() / f64::from(runs);
    // The contrast of the window depends on its position, which biases the peak a little towards contrast.
    assert!((mean - Vector2::new(30.3, 29.8)).norm() < 0.05, "{mean}");
    for i in 0..2 {
        let ratio = spread[(i, i)] / predicted[(i, i)];
        assert!((0.75..1.35).contains(&ratio), "axis {i}: spread over prediction {ratio}");
    }
}

#[test]
fn the_second_peak_is_the_highest_local_maximum_far_enough_away() {
    let bump = |x: f64, y: f64, cx: f64, cy: f64| (-((x - cx).powi(2) + (y - cy).powi(2)) / 8.0).exp();
    let f = |x: f64, y: f64| {
        0.9 * bump(x, y, 20.0, 20.0) + 0.8 * bump(x, y, 27.0, 20.0) + 0.7 * bump(x, y, 50.0, 30.0) - 0.1
    };
    let surface = surface_of(70, 50, f);
    let best = find_peak(&surface, true).unwrap();
    let near = second_peak(&surface, &best, 5.0).unwrap();
    assert_eq!(near.pixel, Pixel::new(127.0, 220.0));
    let far = second_peak(&surface, &best, 10.5).unwrap();
    assert_eq!(far.pixel, Pixel::new(150.0, 230.0));
    assert!((far.score - 0.6).abs() < 1e-3 && (far.ratio - far.score / best.integer_score).abs() < 1e-12);
    assert!((far.distance_px - 30.0_f64.hypot(10.0)).abs() < 0.05);
    // A slope that reaches into the allowed distance is no maximum, and a single bump has no second.
    let single = surface_of(30, 30, |x, y| -(x - 15.0).abs() - (y - 15.0).abs());
    assert!(second_peak(&single, &find_peak(&single, false).unwrap(), 5.0).is_none());
}

#[test]
fn a_plateau_counts_once_as_a_maximum() {
    let surface = surface_of(40, 9, |x, y| {
        let flat_top = if (28.0..30.0).contains(&x) && y == 4.0 { 0.5 } else { 0.0 };
        flat_top + (-((x - 8.0).powi(2) + (y - 4.0).powi(2)) / 4.0).exp()
    });
    let second = second_peak(&surface, &find_peak(&surface, true).unwrap(), 10.0).unwrap();
    assert_eq!(second.pixel, Pixel::new(128.0, 204.0));
}
