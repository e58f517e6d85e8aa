//! Reference image and numbers of `tests/reference/measures_reference.py`.

use image::Luma;

use crate::image::GrayImage;

/// The image of `tests/reference/measures_reference.py`: 16 waves of 7 to 48 px, sampled through `warp`.
pub(crate) fn reference_image(warp: impl Fn(f64, f64) -> (f64, f64), gain: f64, level: f64) -> GrayImage {
    GrayImage::from_fn(96, 80, |x, y| {
        let (x, y) = warp(f64::from(x), f64::from(y));
        let wave = |i: f64| {
            let (direction, wavelength) = (i * 2.399_963, 48.0 * 0.88_f64.powf(i));
            let along = x * direction.cos() + y * direction.sin();
            0.03 * (std::f64::consts::TAU * along / wavelength + i * i).sin()
        };
        let value = 0.5 + (0..16).map(|i| wave(f64::from(i))).sum::<f64>();
        Luma([(gain * value + level) as f32])
    })
}

/// The numbers written by `tests/reference/measures_reference.py`.
pub(crate) fn reference_numbers() -> serde_json::Value {
    let text = include_str!("../../../tests/reference/measures_reference.json");
    serde_json::from_str(text).unwrap()
}
