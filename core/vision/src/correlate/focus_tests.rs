//! Tests of the refinement through a Gaussian window.

use image::Luma;

use super::*;
use crate::correlate::zncc::zncc;
use crate::image::patch::extract;
use crate::image::sample::Kernel;
use sightline_geometry::frames::Pixel;

const SIZE: u32 = 21;

/// Waves of 7 to 19 px, so that a maximum is within climbing distance.
fn texture(x: f64, y: f64) -> f32 {
    let waves = [(7.0, 0.3), (9.0, 1.9), (13.0, 3.1), (19.0, 4.6)];
    let wave = |(length, angle): (f64, f64)| {
        (std::f64::consts::TAU * (x * angle.cos() + y * angle.sin()) / length + length).sin()
    };
    (0.5 + 0.08 * waves.map(wave).iter().sum::<f64>()) as f32
}

/// An image of the texture moved by (dx, dy) px; farther than `radius_px` from its centre by one pixel more in x.
fn image(dx: f64, dy: f64, radius_px: f64) -> GrayImage {
    GrayImage::from_fn(61, 61, |x, y| {
        let (x, y) = (f64::from(x) - 30.0, f64::from(y) - 30.0);
        let extra = if (x - dx).hypot(y - dy) > radius_px { 1.0 } else { 0.0 };
        Luma([texture(x - dx - extra, y - dy)])
    })
}

fn window(image: &GrayImage, x: i32, y: i32) -> Option<Patch> {
    let centre = Pixel::new(30.0 + f64::from(x), 30.0 + f64::from(y));
    Some(extract(image, centre, SIZE / 2, Kernel::Bilinear))
}

fn climbed(sigma_px: f64, moved: &GrayImage) -> Option<FocusedPeak> {
    let template = window(&image(0.0, 0.0, 99.0), 0, 0)?;
    Focus::new(SIZE, sigma_px).climb(&template, true, |x, y| window(moved, x, y))
}

#[test]
fn without_a_focus_the_score_is_that_of_the_definition() {
    let (a, b) =
        (window(&image(0.0, 0.0, 99.0), 0, 0).unwrap(), window(&image(0.4, 0.2, 99.0), 0, 0).unwrap());
    let even = Focus::new(SIZE, 0.0);
    let score = even.score(&even.normalise(&a).unwrap(), &b).unwrap();
    assert!((score - f64::from(zncc(&a, &b).unwrap())).abs() < 1e-6);
    assert!(even.is_even() && (even.weights().iter().sum::<f64>() - 1.0).abs() < 1e-12);
}

#[test]
fn a_climb_ends_at_the_shift_below_the_pixel() {
    for (dx, dy) in [(0.3, -0.4), (2.4, 1.7), (-2.8, 0.6)] {
        let found = climbed(4.0, &image(dx, dy, 99.0)).unwrap();
        assert!((found.offset_px - Vector2::new(dx, dy)).norm() < 0.03, "{} for {dx} {dy}", found.offset_px);
        assert!(found.score > 0.99);
    }
}

#[test]
fn what_moves_far_from_the_centre_pulls_an_even_match_and_hardly_a_focused_one() {
    let moved = image(0.2, 0.0, 6.0);
    let error = |sigma_px| (climbed(sigma_px, &moved).unwrap().offset_px - Vector2::new(0.2, 0.0)).norm();
    assert!(error(0.0) > 0.1, "{}", error(0.0));
    assert!(error(3.0) < error(0.0) / 3.0, "{} {}", error(3.0), error(0.0));
}

#[test]
fn a_straight_edge_a_far_maximum_and_a_flat_window_have_no_peak_in_focus() {
    let edge = GrayImage::from_fn(61, 61, |x, _| Luma([if x < 30 { 0.2 } else { 0.6 }]));
    let template = window(&edge, 0, 0).unwrap();
    let focus = Focus::new(SIZE, 4.0);
    assert_eq!(focus.climb(&template, true, |x, y| window(&edge, x, y)), None);
    let slow = |dx: f64| {
        GrayImage::from_fn(61, 61, |x, y| {
            let (x, y) = ((f64::from(x) - 30.0 - dx) / 40.0, (f64::from(y) - 30.0) / 40.0);
            Luma([(0.5 - 0.3 * (x * x + y * y)) as f32])
        })
    };
    let template = window(&slow(0.0), 0, 0).unwrap();
    assert!(focus.climb(&template, true, |x, y| window(&slow(3.0), x, y)).is_some());
    assert_eq!(focus.climb(&template, true, |x, y| window(&slow(9.0), x, y)), None);
    let flat = GrayImage::from_pixel(61, 61, Luma([0.4]));
    assert_eq!(focus.climb(&template, true, |x, y| window(&flat, x, y)), None);
}
