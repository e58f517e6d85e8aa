//! Descents over images with known maps, compared with OpenCV (`tests/reference/measures_reference.py`).

use super::*;
use crate::testing::{reference_image, reference_numbers};

const CENTRE: Pixel = Pixel { x: 45.0, y: 38.0 };
const KLT: Descend = Descend { affine: false, photometric: false, iterations: 30, stop_px: 0.01 };

fn wide(footprint: Footprint, levels: usize) -> Patch {
    let half = footprint.wide_px(levels) / 2;
    patch::extract(&reference_image(|x, y| (x, y), 1.0, 0.0), CENTRE, half, Kernel::Bicubic)
}

fn numbers(value: &serde_json::Value) -> Vec<f64> {
    serde_json::from_value(value.clone()).unwrap()
}

#[test]
fn a_translation_is_found_as_by_opencv_and_as_it_was() {
    // The image is too small for the surroundings of three levels: windows of 21 px at two, from a near start.
    for flow in reference_numbers()["flows"].as_array().unwrap() {
        let (moved, opencv) = (numbers(&flow["moved"]), numbers(&flow["found"]));
        let image = reference_image(|x, y| (x - moved[0], y - moved[1]), 1.0, 0.0);
        let footprint = Footprint::SamePixels(21);
        let found = descend(&wide(footprint, 2), footprint, 2, &image, Placed::at(CENTRE), &KLT).unwrap();
        let truth = CENTRE.offset(moved[0], moved[1]);
        assert!(found.centre.distance(truth) < 0.02, "{moved:?}: {:?} for {truth:?}", found.centre);
        let theirs = Pixel::new(opencv[0], opencv[1]);
        // OpenCV uses 8-bit pixels and stops at the same 0.01 px.
        assert!(found.centre.distance(theirs) < 0.03, "{moved:?}: {:?}, OpenCV {theirs:?}", found.centre);
        assert_eq!(found.map, Matrix2::identity());
    }
}

fn affine_case(
    photometric: bool,
    gain: f64,
    level: f64,
) -> Result<(Placed, Pixel, Matrix2<f64>), DescentFailure> {
    let document = reference_numbers();
    let case = &document["affine"];
    let (map, moved_to) = (numbers(&case["map"]), numbers(&case["moved_to"]));
    let map = Matrix2::new(map[0], map[1], map[2], map[3]);
    let inverse = map.try_inverse().unwrap();
    let warp = |x: f64, y: f64| {
        let o = inverse * Vector2::new(x - moved_to[0], y - moved_to[1]);
        (CENTRE.x + o.x, CENTRE.y + o.y)
    };
    let image = reference_image(warp, gain, level);
    let footprint = Footprint::SameScene(21);
    let options = Descend { affine: true, photometric, iterations: 50, stop_px: 0.001 };
    let found = descend(&wide(footprint, 2), footprint, 2, &image, Placed::at(CENTRE), &options)?;
    Ok((found, Pixel::new(moved_to[0], moved_to[1]), map))
}

#[test]
fn an_affine_map_under_another_light_is_found_nearer_than_opencv_finds_it() {
    let (found, truth, map) = affine_case(true, 0.9, 0.05).unwrap();
    assert!(found.centre.distance(truth) < 0.01, "{:?} for {truth:?}", found.centre);
    assert!((found.map - map).norm() < 0.005, "{} for {map}", found.map);
    let document = reference_numbers();
    let (theirs, place) = (numbers(&document["affine"]["found_map"]), numbers(&document["affine"]["found"]));
    let (their_map, their_place) =
        (Matrix2::new(theirs[0], theirs[1], theirs[2], theirs[3]), Pixel::new(place[0], place[1]));
    // OpenCV samples the image bilinearly.
    assert!((found.map - their_map).norm() < 0.006 && found.centre.distance(their_place) < 0.015);
    assert!(found.centre.distance(truth) < their_place.distance(truth));
    assert!((found.map - map).norm() < (their_map - map).norm());
}

#[test]
fn without_gain_and_level_another_light_pulls_the_map() {
    let error = |photometric: bool| {
        affine_case(photometric, 0.7, 0.0).map_or(f64::INFINITY, |(found, _, map)| (found.map - map).norm())
    };
    assert!(error(true) < 0.005 && error(false) > 0.05, "{} {}", error(true), error(false));
}

#[test]
fn what_cannot_be_descended_on_says_why() {
    let footprint = Footprint::SamePixels(21);
    let image = reference_image(|x, y| (x, y), 1.0, 0.0);
    let flat = Patch::from(GrayImage::from_pixel(61, 61, image::Luma([0.4])));
    let start = Placed::at(CENTRE);
    let refused = |wide: &Patch, start| descend(wide, footprint, 1, &image, start, &KLT).unwrap_err();
    assert_eq!(refused(&flat, start), DescentFailure::TooLittleTexture);
    let outside = Placed::at(Pixel::new(4.0, 38.0));
    assert_eq!(refused(&wide(footprint, 1), outside), DescentFailure::LeftImage);
}
