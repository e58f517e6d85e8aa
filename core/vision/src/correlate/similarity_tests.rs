//! The other measures against OpenCV and SciPy (`tests/reference/measures_reference.py`), and the effect of gain and
//! bias.

use image::Luma;
use serde_json::Value;

use super::*;
use crate::image::patch::extract;
use crate::image::sample::Kernel;
use crate::testing::{reference_image, reference_numbers};
use sightline_geometry::frames::Pixel;

const SDOG: Similarity = Similarity::Sdog(Sdog { sigma_px: 1.5, ratio: 1.6 });

fn largest_difference(similarity: Similarity, key: &str) -> f64 {
    let document = reference_numbers();
    let expected = &document["surfaces"];
    let wide =
        extract(&reference_image(|x, y| (x, y), 1.0, 0.0), Pixel::new(40.0, 33.0), 20, Kernel::Bicubic);
    let searched = reference_image(|x, y| (x - 3.0, y + 2.0), 1.1, 0.02);
    let all = PixelRect::whole(searched.width(), searched.height());
    let surface = similarity.surface(&wide, 21, &searched, all).unwrap();
    let positions: Vec<[i32; 2]> = serde_json::from_value(expected["positions"].clone()).unwrap();
    assert!(positions.len() > 50);
    let difference = |(at, value): (&[i32; 2], &Value)| {
        let (ix, iy) = surface.index_of(at[0], at[1]).unwrap();
        (f64::from(surface.at(ix, iy).unwrap()) - value.as_f64().unwrap()).abs()
    };
    positions.iter().zip(expected[key].as_array().unwrap()).map(difference).fold(0.0, f64::max)
}

#[test]
fn sums_of_differences_equal_those_of_opencv_and_scipy() {
    assert!(largest_difference(Similarity::Sad, "sad") < 1e-7);
    // OpenCV sums squares in single precision.
    assert!(largest_difference(Similarity::Ssd, "ssd") < 1e-6);
}

#[test]
fn signs_of_the_difference_of_gaussians_agree_as_scipy_counts_them() {
    assert!(largest_difference(SDOG, "sdog") < 1e-7);
}

/// Best position of the window about (40, 33) in the image moved by (3, −2), with other gain and bias and a slope.
fn found(similarity: Similarity, gain: f64, level: f64) -> Pixel {
    let wide =
        extract(&reference_image(|x, y| (x, y), 1.0, 0.0), Pixel::new(40.0, 33.0), 20, Kernel::Bicubic);
    let mut searched = reference_image(|x, y| (x - 3.0, y + 2.0), gain, level);
    searched.enumerate_pixels_mut().for_each(|(x, _, p)| p[0] += 0.004 * (x as f32 - 40.0));
    let all = PixelRect::whole(searched.width(), searched.height());
    let surface = similarity.surface(&wide, 21, &searched, all).unwrap();
    let (ix, iy, _) = surface.maximum().unwrap();
    surface.pixel_of(ix, iy)
}

#[test]
fn correlation_and_signs_find_the_window_in_other_light_and_sums_of_differences_do_not() {
    let truth = Pixel::new(43.0, 31.0);
    for similarity in [Similarity::Ncc, SDOG] {
        assert!(found(similarity, 0.5, 0.4).distance(truth) < 1.5, "{similarity:?}");
    }
    for similarity in [Similarity::Sad, Similarity::Ssd] {
        assert!(found(similarity, 1.0, 0.0).distance(truth) < 1.5, "{similarity:?}");
        assert!(found(similarity, 0.5, 0.4).distance(truth) > 3.0, "{similarity:?}");
    }
}

#[test]
fn every_measure_leaves_out_windows_with_an_invalid_pixel() {
    let mut image = reference_image(|x, y| (x, y), 1.0, 0.0);
    let wide = extract(&image, Pixel::new(40.0, 33.0), 20, Kernel::Bicubic);
    image.put_pixel(60, 50, Luma([f32::NAN]));
    let all = PixelRect::whole(image.width(), image.height());
    for similarity in [Similarity::Ncc, Similarity::Sad, Similarity::Ssd, SDOG] {
        let surface = similarity.surface(&wide, 21, &image, all).unwrap();
        for (x, y) in [(60, 50), (50, 40), (70, 60)] {
            let (ix, iy) = surface.index_of(x, y).unwrap();
            assert_eq!(surface.at(ix, iy), None, "{similarity:?} at ({x}, {y})");
        }
        let excluded = surface.scores.len() - surface.valid_positions();
        assert_eq!(excluded, 21 * 21, "{similarity:?}");
    }
}

#[test]
fn cancelled_search_visits_no_position() {
    let image = reference_image(|x, y| (x, y), 1.0, 0.0);
    let wide = extract(&image, Pixel::new(40.0, 33.0), 20, Kernel::Bicubic);
    let all = PixelRect::whole(image.width(), image.height());
    let flag = std::sync::atomic::AtomicBool::new(true);
    for measure in [Similarity::Sad, Similarity::Ssd, SDOG] {
        let surface = measure.surface_until(&wide, 21, &image, all, (&flag).into()).unwrap();
        assert!(surface.scores.iter().all(|score| *score == 0.0), "{measure:?}");
        let whole = measure.surface(&wide, 21, &image, all).unwrap();
        assert!(whole.scores.iter().any(|score| *score != 0.0), "{measure:?}");
    }
}
