//! Tests of the correlation: the definition in `f64`, affine change of intensity, flat, invalid, borders.

use image::Luma;
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::*;
use crate::image::patch::FLAT_STD;

/// An image of independent values: `level` plus or minus `contrast`.
fn noise(width: u32, height: u32, level: f32, contrast: f32, seed: u64) -> GrayImage {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    GrayImage::from_fn(width, height, |_, _| Luma([level + contrast * (random.random::<f32>() * 2.0 - 1.0)]))
}

/// K-Eq 11 as printed; `None` for a window with an invalid pixel, 0 for one without contrast.
fn naive(template: &[f32], window: &[f32]) -> Option<f64> {
    if window.iter().any(|v| !v.is_finite()) {
        return None;
    }
    let n = template.len() as f64;
    let mean = |v: &[f32]| v.iter().map(|v| f64::from(*v)).sum::<f64>() / n;
    let (mean_i, mean_j) = (mean(template), mean(window));
    let (mut ij, mut ii, mut jj) = (0.0, 0.0, 0.0);
    for (i, j) in template.iter().zip(window) {
        let (i, j) = (f64::from(*i) - mean_i, f64::from(*j) - mean_j);
        (ij, ii, jj) = (ij + i * j, ii + i * i, jj + j * j);
    }
    let flat = n * FLAT_STD * FLAT_STD;
    Some(if ii < flat || jj < flat { 0.0 } else { ij / (ii * jj).sqrt() })
}

fn window(image: &GrayImage, x: u32, y: u32, size: u32) -> Vec<f32> {
    (y..y + size).flat_map(|v| (x..x + size).map(move |u| image.get_pixel(u, v)[0])).collect()
}

fn patch_at(image: &GrayImage, x: u32, y: u32, size: u32) -> Patch {
    GrayImage::from_raw(size, size, window(image, x, y, size)).unwrap().into()
}

/// Compares every position with the definition; returns the largest difference.
fn assert_exact(template: &Patch, image: &GrayImage, region: PixelRect, tolerance: f64) -> f64 {
    let surface = zncc_surface(template, image, region).unwrap();
    let (size, mut worst) = (template.width(), 0.0_f64);
    for (iy, ix) in (0..surface.height).flat_map(|iy| (0..surface.width).map(move |ix| (iy, ix))) {
        let centre = surface.pixel_of(ix, iy);
        let (x, y) = (centre.x as u32 - size / 2, centre.y as u32 - size / 2);
        let expected = naive(template.as_raw(), &window(image, x, y, size));
        let found = surface.at(ix, iy).map(f64::from);
        assert_eq!(found.is_some(), expected.is_some(), "at ({x}, {y})");
        if let (Some(found), Some(expected)) = (found, expected) {
            worst = worst.max((found - expected).abs());
        }
    }
    assert!(worst <= tolerance, "differs from the definition by {worst:e}");
    worst
}

#[test]
fn scores_equal_the_definition_for_odd_sizes_from_5_to_41() {
    let image = noise(150, 110, 0.5, 0.4, 1);
    for size in (5..=41).step_by(2) {
        let template = patch_at(&noise(150, 110, 0.3, 0.2, 2), 20, 30, size);
        assert_exact(&template, &image, PixelRect::new(7, 3, 139, 101), 1e-6);
    }
}

#[test]
fn scores_equal_the_definition_over_several_bands_and_tiles_and_for_large_templates() {
    let (image, other) = (noise(340, 330, 0.5, 0.4, 5), noise(160, 160, 0.3, 0.2, 6));
    // 11: one remaining row; 21: three bands, the last of two groups; 101: less than a group.
    for (size, region) in [
        (3, PixelRect::new(3, 1, 150, 140)),
        (11, PixelRect::new(1, 2, 300, 155)),
        (21, PixelRect::whole(340, 330)),
        (65, PixelRect::new(10, 20, 230, 240)),
        (101, PixelRect::new(40, 5, 170, 160)),
        (101, PixelRect::new(40, 5, 101, 101)),
    ] {
        assert_exact(&patch_at(&other, 20, 30, size), &image, region, 1e-6);
    }
}

#[test]
fn low_contrast_beside_a_bright_edge_keeps_its_digits() {
    // Quantised sky of one or two levels beside bright ground: the hardest case for sums in f32.
    for (contrast, quantum) in [(2e-3_f32, 255.0_f32), (1e-4, 4095.0), (3e-5, 65_535.0)] {
        let texture = noise(160, 120, 0.0, contrast, 3);
        let image = GrayImage::from_fn(160, 120, |x, y| {
            let level = if x + y / 2 > 100 { 0.95 } else { 0.05 };
            Luma([((level + texture.get_pixel(x, y)[0]) * quantum).round() / quantum])
        });
        for size in [11, 21, 41] {
            let template = patch_at(&noise(60, 60, 0.4, 0.3, 4), 5, 5, size);
            assert_exact(&template, &image, PixelRect::whole(160, 120), 1e-5);
        }
    }
}

#[test]
fn a_quiet_patch_among_loud_ones_keeps_its_digits_up_to_where_it_is_scored_by_itself() {
    // Errors of a tile scale with its brightest pixels: windows of up to 24 times less contrast are scored with the
    // tile.
    let loud = noise(200, 110, 0.5, 0.45, 21);
    for quieter in [6.0, 12.0, 18.0, 23.0, 40.0] {
        let image = GrayImage::from_fn(200, 110, |x, y| {
            let v = loud.get_pixel(x, y)[0];
            let is_quiet = (40..90).contains(&x) && (20..75).contains(&y);
            Luma([if is_quiet { 0.5 + (v - 0.5) / quieter } else { v }])
        });
        for size in [11, 21, 31] {
            let template = patch_at(&noise(60, 60, 0.4, 0.3, 22), 5, 5, size);
            assert_exact(&template, &image, PixelRect::whole(200, 110), 1e-5);
        }
    }
}

#[test]
fn the_template_itself_scores_one_at_its_place() {
    let image = noise(90, 70, 0.5, 0.3, 5);
    let surface = zncc_surface(&patch_at(&image, 31, 22, 21), &image, PixelRect::whole(90, 70)).unwrap();
    let (ix, iy, score) = surface.maximum().unwrap();
    assert_eq!((surface.pixel_of(ix, iy).x, surface.pixel_of(ix, iy).y), (41.0, 32.0));
    assert!((score - 1.0).abs() < 1e-6);
    assert_eq!(surface.index_of(41, 32), Some((ix, iy)));
}

#[test]
fn windows_without_contrast_score_zero_and_are_counted() {
    let mut image = noise(80, 60, 0.5, 0.3, 6);
    for (y, x) in (10..35).flat_map(|y| (20..50).map(move |x| (y, x))) {
        image.put_pixel(x, y, Luma([0.7]));
    }
    let template = patch_at(&noise(80, 60, 0.5, 0.3, 7), 0, 0, 11);
    let surface = zncc_surface(&template, &image, PixelRect::whole(80, 60)).unwrap();
    assert_eq!(surface.flat_positions, 20 * 15);
    assert_eq!(surface.at(20, 10), Some(0.0));
    assert_exact(&template, &image, PixelRect::whole(80, 60), 1e-6);
    let flat: Patch = GrayImage::from_pixel(11, 11, Luma([0.25])).into();
    let surface = zncc_surface(&flat, &image, PixelRect::whole(80, 60)).unwrap();
    assert_eq!(surface.flat_positions, 70 * 50);
    assert!(surface.scores.iter().all(|s| *s == 0.0));
    assert_eq!(zncc(&flat, &template), Some(0.0));
    assert_eq!(zncc(&template, &flat), Some(0.0));
}

#[test]
fn windows_that_touch_an_invalid_pixel_are_excluded_and_no_other() {
    let mut image = noise(100, 60, 0.5, 0.3, 8);
    let template = patch_at(&image, 60, 20, 9);
    image.put_pixel(30, 25, Luma([f32::NAN]));
    image.put_pixel(99, 59, Luma([f32::INFINITY]));
    assert_exact(&template, &image, PixelRect::whole(100, 60), 1e-6);
    let surface = zncc_surface(&template, &image, PixelRect::whole(100, 60)).unwrap();
    assert_eq!(surface.scores.iter().filter(|s| s.is_nan()).count(), 81 + 1);
    let all = GrayImage::from_pixel(20, 20, Luma([f32::NAN]));
    let none = zncc_surface(&template, &all, PixelRect::whole(20, 20)).unwrap();
    assert!(none.maximum().is_none() && none.valid_positions() == 0);
}

#[test]
fn the_papers_window_has_19_881_positions() {
    // R226: 141² of a template of 21 in a window of 161.
    let image = noise(161, 161, 0.5, 0.3, 12);
    let surface = zncc_surface(&patch_at(&image, 70, 70, 21), &image, PixelRect::whole(161, 161)).unwrap();
    assert_eq!((surface.width, surface.height, surface.scores.len()), (141, 141, 19_881));
}

#[test]
fn the_whole_window_lies_in_the_region_and_in_the_image() {
    let image = noise(40, 30, 0.5, 0.3, 9);
    let template = patch_at(&image, 3, 4, 7);
    let surface = zncc_surface(&template, &image, PixelRect::new(-10, 5, 30, 100)).unwrap();
    assert_eq!((surface.origin, surface.width, surface.height), ([3, 8], 14, 19));
    assert!(zncc_surface(&template, &image, PixelRect::new(34, 0, 7, 7)).is_none());
    assert!(zncc_surface(&template, &image, PixelRect::new(33, 0, 7, 7)).is_some());
    assert!(zncc_surface(&template, &image, PixelRect::new(50, 0, 7, 7)).is_none());
    assert!(zncc_surface(&template, &GrayImage::new(0, 0), PixelRect::whole(40, 30)).is_none());
}

#[test]
fn templates_that_are_even_oblong_or_incomplete_are_refused() {
    let image = noise(40, 30, 0.5, 0.3, 10);
    let region = PixelRect::whole(40, 30);
    let mut holed = patch_at(&image, 3, 4, 7);
    holed.put_pixel(0, 0, Luma([f32::NAN]));
    assert!(zncc_surface(&holed, &image, region).is_none());
    assert!(zncc_surface(&patch_at(&image, 3, 4, 8), &image, region).is_none());
    assert!(zncc_surface(&noise(5, 7, 0.5, 0.3, 1).into(), &image, region).is_none());
    assert!(zncc_surface(&Patch::default(), &image, region).is_none());
    assert!(zncc(&holed, &patch_at(&image, 3, 4, 7)).is_none());
    assert!(zncc(&patch_at(&image, 3, 4, 7), &holed).is_none());
    assert!(zncc(&patch_at(&image, 3, 4, 7), &patch_at(&image, 3, 4, 5)).is_none());
    assert!(zncc(&Patch::default(), &Patch::default()).is_none());
}

#[test]
fn the_number_of_threads_does_not_change_a_bit() {
    let image = noise(300, 200, 0.5, 0.3, 11);
    let template = patch_at(&image, 100, 80, 21);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| zncc_surface(&template, &image, PixelRect::whole(300, 200)).unwrap())
    };
    assert_eq!(with(1), with(2));
    assert_eq!(with(1), with(5));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    #[test]
    fn scores_equal_the_definition_on_any_image(
        seed in any::<u64>(), half in 1_u32..8, level in -1.0_f32..1.0, contrast in 1e-4_f32..1.0,
        x in -5_i32..20, y in -5_i32..20, width in 16_u32..90, height in 16_u32..50,
    ) {
        let image = noise(97, 61, level, contrast, seed);
        let template = patch_at(&noise(40, 40, level, contrast, seed ^ 1), 3, 5, 2 * half + 1);
        let region = PixelRect::new(x, y, width, height).intersect(&PixelRect::whole(97, 61));
        if let Some(region) = region.filter(|r| r.width > 2 * half && r.height > 2 * half) {
            assert_exact(&template, &image, region, 1e-5);
        }
    }

    #[test]
    fn affine_change_of_intensity_leaves_the_scores(
        seed in any::<u64>(), gain in 0.05_f32..20.0, level in -2.0_f32..2.0,
    ) {
        // R69: ncc(a·I + b, J) = ncc(I, J) for a > 0, of the template and of the image.
        let (image, other) = (noise(50, 40, 0.5, 0.3, seed), noise(20, 20, 0.5, 0.3, seed ^ 2));
        let region = PixelRect::whole(50, 40);
        let changed = |image: &GrayImage| {
            GrayImage::from_fn(image.width(), image.height(), |x, y| Luma([gain * image.get_pixel(x, y)[0] + level]))
        };
        let template = patch_at(&other, 2, 2, 11);
        let before = zncc_surface(&template, &image, region).unwrap();
        for after in [
            zncc_surface(&changed(&template).into(), &image, region).unwrap(),
            zncc_surface(&template, &changed(&image), region).unwrap(),
        ] {
            for (a, b) in before.scores.iter().zip(&after.scores) {
                prop_assert!((a - b).abs() < 2e-5, "{} became {}", a, b);
            }
        }
    }

    #[test]
    fn one_score_equals_the_definition(seed in any::<u64>(), width in 1_u32..30, height in 1_u32..30) {
        let (a, b) = (noise(width, height, 0.4, 0.2, seed), noise(width, height, 0.8, 1e-3, seed ^ 3));
        let expected = naive(a.as_raw(), b.as_raw()).unwrap();
        let found = f64::from(zncc(&a.into(), &b.into()).unwrap());
        prop_assert!((found - expected).abs() < 1e-7);
    }
}
