//! The three ways to designate a target give the same target.

use sightline_geometry::camera::MastAngles;
use sightline_geometry::frames::Pixel;
use sightline_geometry::frames::Pose;
use sightline_rover::designate::*;
use sightline_rover::pipeline::Stops;
use sightline_session::track;
use sightline_testing::PlaneWorld;
use sightline_track::settings::Settings;

/// A drive whose second stop is 1 m ahead and 0.2 m to the right.
fn world() -> PlaneWorld {
    PlaneWorld::new(vec![Pose::identity(), Pose::translation(1.0, 0.2, 0.0)])
}

fn refusal(place: Place, step: usize) -> String {
    place.name(&world(), step).unwrap_err().to_string()
}

#[test]
fn the_three_ways_name_one_pixel_and_lead_to_one_point() {
    let world = world();
    let pixel = Pixel::new(150.25, 131.5);
    let in_site = world.plane_point(1, &world.left, pixel).unwrap();
    let in_rover = world.site_from_rover(1).inverse() * in_site;
    let ways = [
        Place::of_pixel(pixel),
        Place { point_in_rover: Some(in_rover.coords.into()), ..Place::default() },
        Place { point_in_site: Some(in_site.coords.into()), ..Place::default() },
    ];
    for place in ways {
        let named = place.name(&world, 1).unwrap();
        let found = named.designation.pixel;
        assert!((found.x - pixel.x).hypot(found.y - pixel.y) < 1e-9, "{place:?}: {found:?}");
        let first = track::designate(&world, named.designation, &Settings::default()).unwrap();
        assert!((first.update.target.position_in_rover - in_rover).norm() < 0.02);
        assert_eq!(named.gap_m(&first).is_none(), place.pixel.is_some());
    }
}

#[test]
fn a_point_off_the_surface_is_reported_with_its_distance() {
    let world = world();
    // Half a metre before the plane, on the optical axis of the left camera.
    let point = Place { point_in_rover: Some([7.5, -0.1, -1.2]), ..Place::default() };
    let named = point.name(&world, 0).unwrap();
    let first = track::designate(&world, named.designation, &Settings::default()).unwrap();
    assert!((named.gap_m(&first).unwrap() - 0.5).abs() < 0.02, "{:?}", named.gap_m(&first));
}

#[test]
fn invalid_points_are_rejected_in_one_sentence() {
    let pixel = Some(Pixel::new(10.0, 10.0));
    let angles = Some(MastAngles { azimuth_rad: 0.3, elevation_rad: 0.0 });
    let both = Place { pixel, point_in_site: Some([8.0, 0.0, 0.0]), ..Place::default() };
    assert!(refusal(both, 0).contains("exactly one"));
    assert!(refusal(Place::default(), 0).contains("exactly one"));
    assert!(refusal(Place::of_pixel(Pixel::new(1.0, 1.0)), 2).contains("2 stops"));
    assert!(refusal(Place { mast: angles, ..Place::of_pixel(Pixel::new(1.0, 1.0)) }, 0).contains("mast"));
    let behind = Place { point_in_rover: Some([-3.0, 0.0, 0.0]), ..Place::default() };
    assert!(refusal(behind, 0).contains("not in the left image of step 0"));
    let nan = Place { point_in_rover: Some([f64::NAN, 0.0, 0.0]), ..Place::default() };
    assert!(refusal(nan, 0).contains("must be numbers"));
}
