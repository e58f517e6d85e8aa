//! Alignment against projection, and against reference numbers for a real pair (domain.md 15, TV6) from JPL's code. That
//! code does not normalise A, so that they agree to 5e-6 rad and 0.01 px (domain.md 3.3).

use super::*;
use sightline_geometry::camera::{Cahvor, Cahvore, Imaging, Mast, MastAngles};
use sightline_geometry::frames::Point3;

fn navcams() -> (Camera, Camera) {
    Mast::spirit().cameras_in_rover(MastAngles { azimuth_rad: 0.3, elevation_rad: -0.4 })
}

fn hazcams() -> (Camera, Camera) {
    let at = |x: f64, y: f64, z: f64| {
        let linear = Cahv::as_printed(
            Point3::new(x, y, z),
            Vector3::new(0.703447, -0.005161, 0.710729),
            Vector3::new(351.362, 452.204, 353.494),
            Vector3::new(35.8065, -1.75143, 682.705),
        );
        let optical_axis = Vector3::new(0.704402, -0.006062, 0.709775);
        let (radial, pupil) = ([3e-6, -0.012015, -0.007525], [0.001442, 0.001522, 0.000483]);
        let model = Cahvore::normalised(linear, optical_axis, radial, pupil, (Imaging::General, 0.37));
        Camera::new(CameraModel::Cahvore(model), 1024, 1024)
    };
    (at(0.609331, -0.041064, -0.233849), at(0.6098595, 0.0589344, -0.2336460))
}

/// Points in the field of view of both aligned cameras, at many ranges.
fn points(alignment: &Alignment) -> Vec<(Pixel, Point3)> {
    let mut points = Vec::new();
    for k in 0..400 {
        let k = f64::from(k);
        let pixel = Pixel::new((k * 61.803).rem_euclid(1023.0), (k * 38.197).rem_euclid(1023.0));
        let ray = alignment.left.ray(pixel).unwrap();
        let point = ray.at(0.4 * 1.012_f64.powf(k));
        if alignment.right.sees(&point) {
            points.push((pixel, point));
        }
    }
    assert!(points.len() > 200);
    points
}

#[test]
fn a_point_lies_in_the_same_row_of_both_and_its_disparity_is_its_depth() {
    for (left, right) in [navcams(), hazcams()] {
        let alignment = Alignment::new(&left, &right, &AlignSettings::default()).unwrap();
        for (pixel, point) in points(&alignment) {
            let partner = alignment.right.project(&point).unwrap();
            assert!((partner.y - pixel.y).abs() < 1e-9, "{pixel:?} {partner:?}");
            let depth = (point - alignment.left.model.centre()).dot(&alignment.left.model.axis());
            assert!((pixel.x - partner.x - alignment.disparity_px(depth)).abs() < 1e-9);
        }
    }
}

#[test]
fn the_warp_is_where_the_real_camera_sees_the_ray() {
    for ((left, right), range_m) in [(navcams(), 30.0), (hazcams(), 2.0)] {
        let alignment = Alignment::new(&left, &right, &AlignSettings::default()).unwrap();
        let mut seen = 0;
        for k in 0..2000 {
            let k = f64::from(k);
            let [x, y] = [(k * 61.803).rem_euclid(1023.0), (k * 38.197).rem_euclid(1023.0).floor()];
            for (aligned, real, row) in [
                (&alignment.left, &left, alignment.left_row(y)),
                (&alignment.right, &right, alignment.right_row(y)),
            ] {
                let ray = aligned.ray(Pixel::new(x, y)).unwrap();
                let Some(exact) = real.project(&ray.at(range_m)) else { continue };
                seen += 1;
                assert!(row.at(x).distance(exact) < 1e-4, "{:?} {exact:?}", row.at(x));
            }
        }
        assert!(seen > 3900, "{seen}");
    }
}

#[test]
fn what_the_aligned_navcams_show_both_real_ones_see() {
    let (left, right) = navcams();
    let alignment = Alignment::new(&left, &right, &AlignSettings::default()).unwrap();
    for (aligned, real) in [(&alignment.left, &left), (&alignment.right, &right)] {
        for (x, y) in [(0.0, 0.0), (1023.0, 0.0), (0.0, 1023.0), (1023.0, 1023.0), (511.0, 511.0)] {
            let pixel = real.project(&aligned.ray(Pixel::new(x, y)).unwrap().at(1e4)).unwrap();
            assert!(pixel.x > -8.0 && pixel.y > -8.0 && pixel.x < 1031.0 && pixel.y < 1031.0, "{pixel:?}");
        }
    }
}

#[test]
fn a_field_that_is_asked_for_is_not_exceeded() {
    let (left, right) = hazcams();
    for degrees in [30.0, 60.0] {
        let settings =
            AlignSettings { field_max_deg: degrees, size: Some([512, 384]), ..AlignSettings::default() };
        let alignment = Alignment::new(&left, &right, &settings).unwrap();
        let plane = alignment.left.model.image_plane();
        let tangent = f64::to_radians(degrees).tan();
        assert!((plane.hs * 2.0 * tangent / 511.0 - 1.0).abs() < 1e-9, "{plane:?}");
        assert!(plane.vs * 2.0 * tangent / 383.0 > 1.0 - 1e-9, "{plane:?}");
    }
}

#[test]
fn the_real_spirit_pair_is_aligned_as_in_the_reference() {
    let model = |c: [f64; 3], a: [f64; 3], h: [f64; 3], v: [f64; 3], o: [f64; 3], r: [f64; 3]| {
        let linear = Cahv::as_printed(Point3::from(c), a.into(), h.into(), v.into());
        Camera::new(CameraModel::Cahvor(Cahvor::as_printed(linear, o.into(), r)), 1024, 1024)
    };
    let left = model(
        [0.394318, -0.0582843, -1.23826],
        [0.276192, -0.889336, 0.364419],
        [1262.81, -60.1316, 185.71],
        [0.196974, -50.5533, 1294.91],
        [0.156295, -0.929704, 0.3335],
        [0.019876, -0.014281, 0.020876],
    );
    let right = model(
        [0.584061, 0.00602352, -1.2389],
        [0.311825, -0.875514, 0.369109],
        [1301.08, -49.1938, 190.743],
        [15.1976, -38.3493, 1318.0],
        [0.30304, -0.87994, 0.365886],
        [0.0003, -0.004874, 0.018766],
    );
    let alignment = Alignment::new(&left, &right, &AlignSettings::default()).unwrap();
    assert!((alignment.baseline_m() - 0.20034548).abs() < 1e-8);
    let linear = alignment.left.model.linear();
    let expected = [
        (linear.axis, [0.2997168485, -0.8806765689, 0.3668495491]),
        (linear.horizontal, [1315.68488605, -48.98891536, 180.90557784]),
        (linear.vertical, [14.78999073, -30.36234617, 1334.0014367]),
    ];
    for (found, expected) in expected {
        assert!((found - Vector3::from(expected)).norm() < 1e-5 * found.norm(), "{found:?} {expected:?}");
    }
    let seen = [
        ([1.9297, -4.4632, 0.5615], [512.31947952, 511.49478045], 49.27785962),
        ([0.7525, -2.6445, 0.2393], [295.60811973, 702.0422749], 84.17307394),
        ([6.7421, -9.9828, 1.0441], [805.80804981, 299.63887283], 21.46110813),
    ];
    for (point, [x, y], disparity) in seen {
        let project = |camera: &Camera| camera.project(&Point3::from(point)).unwrap();
        let (in_left, in_right) = (project(&alignment.left), project(&alignment.right));
        assert!(in_left.distance(Pixel::new(x, y)) < 0.02, "{in_left:?}");
        assert!((in_left.x - in_right.x - disparity).abs() < 1e-3);
    }
}

#[test]
fn a_pair_with_its_baseline_askew_shows_every_point_in_the_same_row() {
    let (left, _) = navcams();
    let right = left.moved(&sightline_geometry::frames::Pose::translation(0.3, -0.9, 0.2));
    let alignment = Alignment::new(&left, &right, &AlignSettings::default()).unwrap();
    assert!((alignment.baseline_m() - 0.94_f64.sqrt()).abs() < 1e-12);
    let mut seen = 0;
    for k in 0..4000 {
        let k = f64::from(k);
        let pixel = Pixel::new((k * 61.803).rem_euclid(1023.0), (k * 38.197).rem_euclid(1023.0));
        let Some(ray) = left.ray(pixel) else { continue };
        let point = ray.at(2.0 * 1.001_f64.powf(k));
        let (Some(in_left), Some(in_right)) =
            (alignment.left.project(&point), alignment.right.project(&point))
        else {
            continue;
        };
        if [in_left, in_right]
            .iter()
            .any(|pixel| !(0.0..=1023.0).contains(&pixel.x) || !(0.0..=1023.0).contains(&pixel.y))
        {
            continue;
        }
        assert!((in_left.y - in_right.y).abs() < 1e-9, "{in_left:?} {in_right:?}");
        // The positions in the real images are the projections of the point by the real cameras.
        for (aligned, real, row) in [
            (in_left, &left, alignment.left_row(in_left.y)),
            (in_right, &right, alignment.right_row(in_right.y)),
        ] {
            let (taken, seen) = (row.at(aligned.x), real.project(&point).unwrap());
            assert!(taken.distance(seen) < 1e-3, "{taken:?} {seen:?}");
        }
        seen += 1;
    }
    assert!(seen > 500, "{seen}");
}

#[test]
fn pairs_that_have_no_rows_in_common_are_refused() {
    let (left, right) = navcams();
    assert!(Alignment::new(&left, &left, &AlignSettings::default()).is_err());
    let axis = left.model.axis() * 0.3;
    let before = left.moved(&sightline_geometry::frames::Pose::translation(axis.x, axis.y, axis.z));
    assert!(Alignment::new(&left, &before, &AlignSettings::default()).is_err());
    let narrow = AlignSettings { field_max_deg: 2.0, ..AlignSettings::default() };
    assert!(Alignment::new(&left, &right, &narrow).is_err());
}

#[test]
fn about_a_plane_all_of_its_points_have_one_disparity() {
    let (left, right) = navcams();
    let normal = Vector3::new(0.1, -0.05, 1.0).normalize();
    let plane = Plane { normal, distance_m: 0.4 };
    let alignment = Alignment::about(&left, &right, Some(&plane), &AlignSettings::default()).unwrap();
    let mut seen = 0;
    for k in 0..400 {
        let k = f64::from(k);
        let pixel = Pixel::new((k * 61.803).rem_euclid(1023.0), 560.0 + (k * 38.197).rem_euclid(463.0));
        let Some(ray) = alignment.left.ray(pixel) else { continue };
        let along_m = (plane.distance_m - normal.dot(&ray.origin.coords)) / normal.dot(&ray.direction);
        if along_m < 0.1 {
            continue;
        }
        let on_plane = ray.at(along_m);
        let in_right = alignment.right.project(&on_plane).unwrap();
        assert!((in_right.y - pixel.y).abs() < 1e-9);
        assert!((pixel.x - in_right.x - alignment.plane_px).abs() < 1e-6, "{pixel:?} {in_right:?}");
        // A point above the plane has the same row in both images and a larger disparity.
        let above = alignment.left.ray(pixel).unwrap().at(0.7 * along_m);
        let in_right = alignment.right.project(&above).unwrap();
        assert!((in_right.y - pixel.y).abs() < 1e-9 && pixel.x - in_right.x > alignment.plane_px + 0.5);
        // The position in the real right image is the projection of the point by the real camera.
        if (0.0..=1023.0).contains(&in_right.x) {
            let (taken, seen) =
                (alignment.right_row(in_right.y).at(in_right.x), right.project(&above).unwrap());
            assert!(taken.distance(seen) < 1e-3, "{taken:?} {seen:?}");
        }
        seen += 1;
    }
    assert!(seen > 200, "{seen}");
    let above = Plane { normal, distance_m: -30.0 };
    let refused = Alignment::about(&left, &right, Some(&above), &AlignSettings::default());
    assert!(refused.err().unwrap().to_string().contains("plane"));
}
