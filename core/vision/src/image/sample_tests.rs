//! Tests of the interpolation: polynomials, borders, invalid pixels.

use super::*;

fn image_of(width: u32, height: u32, f: impl Fn(f64, f64) -> f64) -> GrayImage {
    GrayImage::from_fn(width, height, |x, y| image::Luma([f(f64::from(x), f64::from(y)) as f32]))
}

fn quadratic(x: f64, y: f64) -> f64 {
    0.3 + 0.02 * x - 0.015 * y + 0.004 * x * x + 0.003 * x * y - 0.002 * y * y
}

fn assert_reproduced(
    width: u32,
    height: u32,
    read: fn(&GrayImage, Pixel) -> Option<f32>,
    f: fn(f64, f64) -> f64,
) {
    let image = image_of(width, height, f);
    for i in 0..=40 {
        for j in 0..=40 {
            let x = f64::from(width - 1) * f64::from(i) / 40.0;
            let y = f64::from(height - 1) * f64::from(j) / 40.0;
            let value = f64::from(read(&image, Pixel::new(x, y)).unwrap());
            assert!((value - f(x, y)).abs() < 2e-6, "({x}, {y}): {value} instead of {}", f(x, y));
        }
    }
}

#[test]
fn bicubic_reproduces_a_quadratic_up_to_the_border() {
    assert_reproduced(9, 8, bicubic, quadratic);
    assert_reproduced(3, 3, bicubic, quadratic);
    assert_reproduced(4, 3, bicubic, quadratic);
}

#[test]
fn bilinear_reproduces_a_bilinear_function() {
    assert_reproduced(9, 8, bilinear, |x, y| 0.1 + 0.03 * x - 0.02 * y + 0.01 * x * y);
}

#[test]
fn bicubic_of_a_cubic_errs_by_the_third_order_and_is_exact_half_way() {
    let image = image_of(12, 12, |x, _| x * x * x / 1000.0);
    for (x, exact) in [(5.0, true), (5.5, true), (5.25, false)] {
        let error = f64::from(bicubic(&image, Pixel::new(x, 6.0)).unwrap()) - x * x * x / 1000.0;
        // Central differences overestimate the slope of x³ by 1 at both ends, which adds t(1−t)(1−2t) = 0.09375.
        let expected = if exact { 0.0 } else { 0.093_75e-3 };
        assert!((error.abs() - expected).abs() < 1e-6, "at {x}: {error}");
    }
}

#[test]
fn whole_pixels_are_returned_unchanged() {
    let image = image_of(7, 6, |x, y| (x * 12.9898 + y * 78.233).sin());
    for (x, y, pixel) in image.enumerate_pixels() {
        let at = Pixel::new(f64::from(x), f64::from(y));
        assert_eq!(bicubic(&image, at), Some(pixel[0]));
        assert_eq!(bilinear(&image, at), Some(pixel[0]));
    }
}

#[test]
fn nothing_is_read_outside_the_centres_of_the_outermost_pixels() {
    let image = image_of(7, 6, |x, _| x);
    for at in [(-1e-9, 2.0), (6.000_001, 2.0), (2.0, -0.5), (2.0, 5.1), (f64::NAN, 2.0)] {
        assert_eq!(bicubic(&image, Pixel::new(at.0, at.1)), None);
        assert_eq!(bilinear(&image, Pixel::new(at.0, at.1)), None);
    }
    assert_eq!(bilinear(&GrayImage::new(0, 0), Pixel::new(0.0, 0.0)), None);
    assert_eq!(bicubic(&image_of(1, 1, |_, _| 0.5), Pixel::new(0.0, 0.0)), Some(0.5));
}

#[test]
fn touching_an_invalid_pixel_gives_nothing() {
    let mut image = image_of(9, 9, |x, _| x);
    image.put_pixel(4, 4, image::Luma([f32::NAN]));
    assert_eq!(bilinear(&image, Pixel::new(3.5, 4.0)), None);
    assert_eq!(bilinear(&image, Pixel::new(3.0, 4.0)), Some(3.0));
    assert_eq!(bicubic(&image, Pixel::new(2.5, 4.0)), None);
    assert_eq!(bicubic(&image, Pixel::new(1.5, 4.0)), Some(1.5));
}
