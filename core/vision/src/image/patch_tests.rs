//! Tests of cropping and resampling with an analytic texture, whose rotated and magnified forms are known.

use super::*;

/// A texture of waves from 5 to 20 px in all directions, around 0.5; exact at any position.
fn texture(x: f64, y: f64) -> f64 {
    let wave = |k: f64| {
        let (angle, length) = (k * 2.399_963, 5.0 + 15.0 * (k * 0.618_034).fract());
        (std::f64::consts::TAU * (x * angle.cos() + y * angle.sin()) / length + k * k).cos()
    };
    0.5 + (0..24).map(|k| wave(f64::from(k))).sum::<f64>() / 60.0
}

fn image_of(side: u32, f: impl Fn(f64, f64) -> f64) -> GrayImage {
    GrayImage::from_fn(side, side, |x, y| Luma([f(f64::from(x), f64::from(y)) as f32]))
}

/// Largest difference between a patch and `f` of the offset from its centre.
fn worst(patch: &Patch, f: impl Fn(f64, f64) -> f64) -> f64 {
    let half = f64::from(patch.width() / 2);
    let difference = |(x, y, p): (u32, u32, &Luma<f32>)| {
        (f64::from(p[0]) - f(f64::from(x) - half, f64::from(y) - half)).abs()
    };
    patch.enumerate_pixels().map(difference).fold(0.0, f64::max)
}

#[test]
fn a_window_at_a_sub_pixel_centre_shows_the_texture_there() {
    let image = image_of(80, texture);
    let (cx, cy) = (40.3, 37.8);
    let exact = |u: f64, v: f64| texture(cx + u, cy + v);
    let cubic = extract(&image, Pixel::new(cx, cy), 10, Kernel::Bicubic);
    let linear = extract(&image, Pixel::new(cx, cy), 10, Kernel::Bilinear);
    assert_eq!(cubic.dimensions(), (21, 21));
    assert!(worst(&cubic, exact) < 0.015, "{}", worst(&cubic, exact));
    assert!(worst(&linear, exact) > 2.0 * worst(&cubic, exact));
    assert!(linear.is_complete() && cubic.valid_share() == 1.0);
}

#[test]
fn a_whole_pixel_window_is_a_copy_and_what_lies_outside_is_invalid() {
    let image = image_of(30, texture);
    let patch = extract(&image, Pixel::new(3.0, 20.0), 5, Kernel::Bicubic);
    for (x, y, p) in patch.enumerate_pixels() {
        match (x + 3).checked_sub(5) {
            Some(column) => assert_eq!(p, image.get_pixel(column, y + 15)),
            None => assert!(p[0].is_nan()),
        }
    }
    assert!((patch.valid_share() - 9.0 / 11.0).abs() < 1e-12 && !patch.is_complete());
    let outside = extract(&image, Pixel::new(-90.0, 20.0), 5, Kernel::Bilinear);
    assert_eq!((outside.valid_share(), outside.mean(), outside.std()), (0.0, None, None));
}

#[test]
fn scale_roll_shows_a_texture_rolled_and_magnified_forward_and_back() {
    // The source resampled by scale s and roll ρ: offset o in the output is the texture at (1/s) R(−ρ) o.
    let centre = Pixel::new(60.4, 58.7);
    let image = image_of(120, texture);
    for (scale, roll_deg) in [(1.0, 10.0), (1.0, -10.0), (1.0, 90.0), (1.25, 0.0), (1.25, 7.0), (2.0, -30.0)]
    {
        let roll = f64::to_radians(roll_deg);
        let patch = scale_roll(&image, centre, scale, roll, 21, Kernel::Bicubic);
        let (sin, cos) = roll.sin_cos();
        let exact = |u: f64, v: f64| {
            texture(centre.x + (cos * u + sin * v) / scale, centre.y + (cos * v - sin * u) / scale)
        };
        assert!(worst(&patch, exact) < 0.015, "{scale}, {roll_deg}: {}", worst(&patch, exact));
        let wrong_way = scale_roll(&image, centre, 1.0 / scale, -roll, 21, Kernel::Bicubic);
        assert!(worst(&wrong_way, exact) > 0.1);
    }
}

#[test]
fn positive_roll_turns_content_clockwise_on_screen() {
    // A bright spot to the right of the centre moves down (y is down) if the content rotates clockwise.
    let image = image_of(61, |x, y| (-((x - 40.0).powi(2) + (y - 30.0).powi(2)) / 8.0).exp());
    let quarter = std::f64::consts::FRAC_PI_2;
    let patch = scale_roll(&image, Pixel::new(30.0, 30.0), 1.0, quarter, 31, Kernel::Bicubic);
    assert!(patch.get_pixel(15, 25)[0] > 0.99 && patch.get_pixel(15, 5)[0] < 0.01);
    let magnified = scale_roll(&image, Pixel::new(30.0, 30.0), 1.4, 0.0, 31, Kernel::Bicubic);
    assert!(magnified.get_pixel(15 + 14, 15)[0] > 0.99);
}

#[test]
fn shrinking_smooths_first_so_that_fine_detail_does_not_fold() {
    // Waves of 2.2 px become 1.1 px at half the scale: without a low-pass they alias to 11 px waves.
    let wave = |length: f64| move |x: f64, _: f64| 0.5 + 0.4 * (std::f64::consts::TAU * x / length).cos();
    let centre = Pixel::new(60.0, 60.0);
    let shrunk =
        |length: f64| scale_roll(&image_of(121, wave(length)), centre, 0.5, 0.0, 21, Kernel::Bicubic);
    let every_second = extract(&image_of(121, wave(2.2)), centre, 10, Kernel::Bicubic);
    assert!(shrunk(2.2).std().unwrap() < 0.2 * every_second.std().unwrap());
    assert!(shrunk(20.0).std().unwrap() > 0.9 * 0.4 / 2.0_f64.sqrt());
    // A gentle shrink leaves the mean unchanged everywhere.
    let flat = scale_roll(&image_of(121, |_, _| 0.3), centre, 0.8, 0.2, 21, Kernel::Bicubic);
    assert!(worst(&flat, |_, _| 0.3) < 1e-6 && flat.is_flat());
}

#[test]
fn invalid_source_pixels_stay_invalid_and_do_not_spread_through_the_prefilter() {
    let mut image = image_of(61, texture);
    image.put_pixel(30, 30, Luma([f32::NAN]));
    let patch = scale_roll(&image, Pixel::new(30.0, 30.0), 0.5, 0.0, 11, Kernel::Bicubic);
    assert_eq!(patch.iter().filter(|v| v.is_nan()).count(), 1);
    assert!(patch.get_pixel(5, 5)[0].is_nan());
    let corner = scale_roll(&image, Pixel::new(0.0, 0.0), 0.5, 0.0, 11, Kernel::Bicubic);
    assert_eq!(corner.iter().filter(|v| v.is_finite()).count(), 36);
    for scale in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert_eq!(
            scale_roll(&image, Pixel::new(30.0, 30.0), scale, 0.0, 11, Kernel::Bicubic).valid_share(),
            0.0
        );
    }
}

#[test]
fn a_shrunk_texture_shows_the_same_content_smaller() {
    // s = 0.8: the texture's waves become 4 to 16 px; the prefilter may only lower their contrast.
    let centre = Pixel::new(60.4, 58.7);
    let patch = scale_roll(&image_of(120, texture), centre, 0.8, 0.1, 21, Kernel::Bicubic);
    let (sin, cos) = 0.1_f64.sin_cos();
    let exact: Patch = GrayImage::from_fn(21, 21, |x, y| {
        let (u, v) = ((f64::from(x) - 10.0) / 0.8, (f64::from(y) - 10.0) / 0.8);
        Luma([texture(centre.x + cos * u + sin * v, centre.y + cos * v - sin * u) as f32])
    })
    .into();
    let score = crate::correlate::zncc(&patch, &exact).unwrap();
    assert!(score > 0.995, "{score}");
}

#[test]
fn normalised_patches_have_zero_mean_and_unit_deviation() {
    let patch = extract(&image_of(40, texture), Pixel::new(20.0, 20.0), 7, Kernel::Bicubic);
    let unit = normalise(&patch).unwrap();
    assert!(unit.mean().unwrap().abs() < 1e-6 && (unit.std().unwrap() - 1.0).abs() < 1e-6);
    let brighter: Patch =
        GrayImage::from_fn(15, 15, |x, y| Luma([3.0 * patch.get_pixel(x, y)[0] + 0.2])).into();
    assert!(normalised_difference(&patch, &brighter).iter().all(|d| d.abs() < 1e-5));
    let flat: Patch = GrayImage::from_pixel(15, 15, Luma([0.4])).into();
    assert!(normalise(&flat).is_none());
    assert_eq!(normalised_difference(&patch, &flat), unit);
}

/// The blur by its definition: for each pixel, the weighted mean of the valid pixels within 3σ along rows, then columns.
fn blurred_by_definition(image: &GrayImage, sigma_px: f64) -> GrayImage {
    let radius = (3.0 * sigma_px).ceil() as i64;
    let (width, height) = (i64::from(image.width()), i64::from(image.height()));
    let start = image.iter().map(|v| if v.is_finite() { (f64::from(*v), 1.0) } else { (0.0, 0.0) });
    let pass = |from: Vec<(f64, f64)>, dx: i64, dy: i64| -> Vec<(f64, f64)> {
        let sum = |x: i64, y: i64| {
            let inside = (-radius..=radius).map(|i| (i, x + i * dx, y + i * dy));
            let inside = inside.filter(|(_, u, v)| (0..width).contains(u) && (0..height).contains(v));
            inside.fold((0.0, 0.0), |sum, (i, u, v)| {
                let weight = (-0.5 * (i as f64 / sigma_px).powi(2)).exp();
                let (value, valid) = from[(v * width + u) as usize];
                (sum.0 + weight * value, sum.1 + weight * valid)
            })
        };
        (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| sum(x, y)).collect()
    };
    let mut out = image.clone();
    let sums = pass(pass(start.collect(), 1, 0), 0, 1);
    for (pixel, (value, weight)) in out.iter_mut().zip(sums).filter(|(pixel, _)| pixel.is_finite()) {
        *pixel = (value / weight) as f32;
    }
    out
}

#[test]
fn blur_has_the_bits_of_its_definition() {
    let mut image = GrayImage::from_fn(37, 23, |x, y| Luma([texture(f64::from(x), f64::from(y)) as f32]));
    image.put_pixel(5, 11, Luma([f32::NAN]));
    let bits = |image: &GrayImage| image.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
    for sigma_px in [0.3, 1.7, 6.0, 40.0] {
        let found = blurred(&image, sigma_px);
        assert_eq!(bits(&found), bits(&blurred_by_definition(&image, sigma_px)), "{sigma_px}");
    }
}

#[test]
fn blur_kernel_is_no_longer_than_the_image() {
    // A kernel of 3σ would not fit into memory.
    let image = image_of(16, texture);
    let mean = Patch::from(image.clone()).mean().unwrap();
    for sigma_px in [1e12, 1e300, f64::INFINITY] {
        assert!(blurred(&image, sigma_px).iter().all(|v| (f64::from(*v) - mean).abs() < 1e-6), "{sigma_px}");
    }
    let shrunk = scale_roll(&image, Pixel::new(8.0, 8.0), 1e-12, 0.1, 21, Kernel::Bicubic);
    assert!(shrunk.valid_share() < 0.01);
}
