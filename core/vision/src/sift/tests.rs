//! Features of images with known ground truth.

use std::f64::consts::{PI, TAU};

use image::Luma;

use super::*;

/// A Gaussian blob on grey: (x, y), standard deviation and height.
#[derive(Clone, Copy)]
struct Blob {
    x: f64,
    y: f64,
    sigma: f64,
    height: f64,
}

impl Blob {
    fn at(&self, x: u32, y: u32) -> f64 {
        let square = (f64::from(x) - self.x).powi(2) + (f64::from(y) - self.y).powi(2);
        self.height * (-0.5 * square / self.sigma.powi(2)).exp()
    }
}

fn image_of(side: u32, blobs: &[Blob]) -> GrayImage {
    GrayImage::from_fn(side, side, |x, y| {
        Luma([(0.5 + blobs.iter().map(|blob| blob.at(x, y)).sum::<f64>()) as f32])
    })
}

/// Smooth hashed noise of about 3 px, without symmetry.
fn texture(side: u32) -> GrayImage {
    let hash = |x: u32, y: u32| {
        let h = x.wrapping_mul(0x9E37_79B1) ^ y.wrapping_mul(0x85EB_CA77);
        let h = (h ^ (h >> 15)).wrapping_mul(0x2C1B_3C6D);
        f64::from(h ^ (h >> 13)) / f64::from(u32::MAX)
    };
    GrayImage::from_fn(side, side, |x, y| {
        let around = (0..25).map(|i| hash(x + i % 5, y + i / 5) * [1., 2., 3., 2., 1.][(i % 5) as usize]);
        Luma([(around.sum::<f64>() / 45.0 * 2.0 - 0.5) as f32])
    })
}

fn angle_between(a: f32, b: f32) -> f64 {
    let turn = (f64::from(a) - f64::from(b)).rem_euclid(TAU);
    turn.min(TAU - turn)
}

fn descriptor_distance(a: &Descriptor, b: &Descriptor) -> f64 {
    a.iter().zip(b).map(|(&a, &b)| f64::from(a.abs_diff(b)).powi(2)).sum::<f64>().sqrt()
}

#[test]
fn a_gaussian_blob_gives_a_keypoint_at_its_place_and_of_its_scale() {
    for (x, y, sigma, height) in
        [(40.0, 41.0, 3.0, 0.4), (40.3, 38.6, 2.0, -0.4), (39.5, 40.5, 5.2, 0.4), (41.27, 39.81, 7.0, -0.3)]
    {
        let blob = Blob { x, y, sigma, height };
        let features = detect(&image_of(81, &[blob]), &SiftSettings::default());
        assert!(!features.keypoints.is_empty(), "σ = {sigma}");
        // The response to a blob of σ_b is largest at k s² = σ_b² + b², with b the blur assumed in the image: there the
        // difference of scales s and k s is greatest.
        let k = 2_f64.powf(1.0 / 3.0);
        let expected = ((sigma * sigma - 0.25) / k).sqrt();
        let strongest =
            features.keypoints.iter().max_by(|a, b| a.contrast.abs().total_cmp(&b.contrast.abs())).unwrap();
        assert_eq!(strongest.contrast > 0.0, height < 0.0);
        let (dx, dy) = (f64::from(strongest.x) - x, f64::from(strongest.y) - y);
        // The error of the parabola through three pixels is a fraction of the octave's pixel.
        let pixel = 2_f64.powi(i32::from(strongest.octave)).max(1.0);
        assert!(dx.hypot(dy) < 0.05 * pixel, "σ = {sigma}: off by ({dx}, {dy})");
        let ratio = f64::from(strongest.sigma_px) / expected;
        assert!((ratio - 1.0).abs() < 0.05, "σ = {sigma}: scale {expected} · {ratio}");
    }
}

#[test]
fn turning_the_image_by_a_quarter_turns_the_keypoints_and_keeps_the_descriptors() {
    let side = 161;
    let image = texture(side);
    // (x, y) of the image maps to (side − 1 − y, x): +x becomes +y.
    let turned = image::imageops::rotate90(&image);
    // Odd sides, and no doubled image, whose samples are not symmetric: the two then differ by rounding only.
    let settings = SiftSettings { double_image: false, ..SiftSettings::default() };
    let (before, after) = (detect(&image, &settings), detect(&turned, &settings));
    assert!(before.keypoints.len() > 60, "{}", before.keypoints.len());
    let mut found = 0;
    for (keypoint, descriptor) in before.keypoints.iter().zip(&before.descriptors) {
        let expected =
            (side as f32 - 1.0 - keypoint.y, keypoint.x, keypoint.orientation_rad + (PI / 2.0) as f32);
        let same = after.keypoints.iter().zip(&after.descriptors).find(|(other, _)| {
            (other.x - expected.0).hypot(other.y - expected.1) < 0.01
                && angle_between(other.orientation_rad, expected.2) < 0.01
                && (other.sigma_px / keypoint.sigma_px - 1.0).abs() < 0.001
        });
        let Some((_, other)) = same else { continue };
        assert!(descriptor_distance(descriptor, other) < 12.0, "{keypoint:?}");
        found += 1;
    }
    // Octaves with even sides lose a row at one end only.
    assert!(100 * found > 80 * before.keypoints.len(), "{found} of {}", before.keypoints.len());
}

#[test]
fn a_flat_image_and_images_too_small_have_no_features() {
    for side in [0, 1, 2, 3, 5, 10, 16, 64] {
        let flat = GrayImage::from_pixel(side, side, Luma([0.4]));
        assert_eq!(detect(&flat, &SiftSettings::default()), Features::default(), "{side}");
    }
    for (width, height) in [(1, 1), (1, 40), (40, 1), (3, 3), (5, 200)] {
        let noisy = image::imageops::crop_imm(&texture(200), 0, 0, width, height).to_image();
        assert_eq!(detect(&noisy, &SiftSettings::default()), Features::default(), "{width} × {height}");
    }
    let blob = Blob { x: 7.6, y: 8.2, sigma: 2.0, height: 0.5 };
    assert!(!detect(&image_of(16, &[blob]), &SiftSettings::default()).keypoints.is_empty());
}

#[test]
fn no_feature_depends_on_an_invalid_pixel() {
    let mut image = texture(200);
    let whole = detect(&image, &SiftSettings::default());
    for (x, y) in (0..200).flat_map(|y| (0..30).map(move |x| (x, y))).chain([(150, 60), (151, 60)]) {
        image.put_pixel(x, y, Luma([f32::NAN]));
    }
    let holed = detect(&image, &SiftSettings::default());
    assert!(holed.keypoints.len() > 50 && holed.keypoints.len() < whole.keypoints.len());
    for (keypoint, descriptor) in holed.keypoints.iter().zip(&holed.descriptors) {
        let reach = 10.6 * keypoint.sigma_px;
        assert!(keypoint.x - 29.0 > reach && (keypoint.x - 150.0).hypot(keypoint.y - 60.0) > reach);
        // Equal to the feature without the hole, except for contributions beyond 3σ of the blur.
        let closest = whole
            .keypoints
            .iter()
            .zip(&whole.descriptors)
            .filter(|(other, _)| (other.x - keypoint.x).hypot(other.y - keypoint.y) < 0.02)
            .map(|(_, other)| descriptor_distance(descriptor, other))
            .fold(f64::INFINITY, f64::min);
        assert!(closest < 10.0, "{keypoint:?}: {closest}");
    }
    let nothing = GrayImage::from_pixel(64, 64, Luma([f32::NAN]));
    assert_eq!(detect(&nothing, &SiftSettings::default()), Features::default());
}

#[test]
fn the_strongest_features_are_kept_in_their_order() {
    let image = texture(160);
    let all = detect(&image, &SiftSettings::default());
    let some = detect(&image, &SiftSettings { features_max: 40, ..SiftSettings::default() });
    assert!(all.keypoints.len() > 80 && some.keypoints.len() == 40 && some.descriptors.len() == 40);
    let mut strengths: Vec<f32> = all.keypoints.iter().map(|keypoint| keypoint.contrast.abs()).collect();
    strengths.sort_by(|a, b| b.total_cmp(a));
    let mut rest = all.keypoints.iter().zip(&all.descriptors);
    for (keypoint, descriptor) in some.keypoints.iter().zip(&some.descriptors) {
        assert!(keypoint.contrast.abs() >= strengths[39]);
        assert!(rest.any(|other| other == (keypoint, descriptor)));
    }
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let image = texture(300);
    let with_threads = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| detect(&image, &SiftSettings::default()))
    };
    let one = with_threads(1);
    assert!(one.keypoints.len() > 200);
    assert_eq!(one, with_threads(2));
    assert_eq!(one, with_threads(5));
}

#[test]
fn settings_that_describe_no_scale_space_give_nothing() {
    let image = texture(64);
    let usual = SiftSettings::default();
    assert!(!detect(&image, &usual).keypoints.is_empty());
    for settings in [
        SiftSettings { scales_per_octave: 0, ..usual.clone() },
        SiftSettings { sigma: 0.0, ..usual.clone() },
        SiftSettings { sigma: f64::NAN, ..usual },
    ] {
        assert_eq!(detect(&image, &settings), Features::default());
    }
}

#[test]
fn cancelled_detection_returns_no_features() {
    let cancelled = std::sync::atomic::AtomicBool::new(true);
    let found = detect_until(&texture(64), &SiftSettings::default(), Cancel::from(&cancelled));
    assert!(matches!(found, Err(sightline_geometry::error::Error::Cancelled)), "{found:?}");
    let free = detect_until(&texture(64), &SiftSettings::default(), Cancel::default()).unwrap();
    assert_eq!(free, detect(&texture(64), &SiftSettings::default()));
    assert!(!free.keypoints.is_empty());
}
