//! Fiducials in rendered images are where the camera models project them: boards by all their edges, balls by the centre
//! of their outline; near and far, in the middle of the image and in its corner, for all three models.

use nalgebra::Vector2;

use super::*;
use crate::solids::{Look, Shape, Solid, SolidKind};
use sightline_geometry::camera::Camera;
use sightline_geometry::frames::{Pixel, Point3, Pose, Ray, Vector3};
use sightline_vision::image::GrayImage;

/// Largest accepted distance of a fiducial from its projection, px.
const TOLERANCE_PX: f64 = 0.02;
/// Squares of a board along each side.
const SQUARES: i32 = 6;

/// A bare, dark plain in uniform light: only the fiducials have edges, and a ball is as bright at its limb as at its
/// centre.
fn empty_world() -> (Scenario, World) {
    let mut scenario = Scenario::default();
    (scenario.rocks.area_fraction, scenario.rocks.cluster_count) = (0.0, 0);
    scenario.terrain.rms_at_1m_m = 0.0;
    (scenario.texture.albedo_std, scenario.texture.soil_slope_std) = (0.0, 0.0);
    (scenario.texture.soil_albedo, scenario.sun.diffuse_fraction) = (0.02, 1.0);
    (scenario.camera.samples_per_axis, scenario.camera.blur_px) = (4, 0.0);
    let mut world = World::new(&scenario);
    world.light = crate::light::reflection::Light::new(&scenario.sun, 1.0);
    world.exposure = 0.8;
    (scenario, world)
}

/// The camera moved 100 m up and rotated until its optical axis points straight down.
fn looking_down(camera: &Camera) -> Camera {
    let down =
        nalgebra::UnitQuaternion::rotation_between(&camera.model.optical_axis(), &Vector3::z()).unwrap();
    camera.moved(&Pose::from_parts(Vector3::new(0.0, 0.0, -100.0).into(), down))
}

/// The three models above the plain: a rectified navcam, a navcam and a front hazcam of real labels.
fn cameras() -> Vec<(&'static str, Camera)> {
    let reference: serde_json::Value =
        serde_json::from_str(include_str!("../../../geometry/src/camera/reference_vectors.json")).unwrap();
    let camera = |name: &str| {
        let printed: Camera = serde_json::from_value(reference["cameras"][name].clone()).unwrap();
        looking_down(&printed.normalised())
    };
    [("CAHV", "mer2_navcam_l_lin"), ("CAHVOR", "mer2_navcam_l"), ("CAHVORE", "mer1_fhaz_l")]
        .map(|(model, name)| (model, camera(name)))
        .into()
}

/// The rendered image around a pixel.
fn picture(scenario: &Scenario, world: &World, camera: &Camera, pixel: Pixel) -> (Region, GrayImage) {
    let first = |v: f64| (v.round() as u32).saturating_sub(56);
    let region = Region { x: first(pixel.x), y: first(pixel.y), width: 112, height: 112 };
    (
        region,
        clean_radiance(world, scenario, camera, region, &std::sync::atomic::AtomicBool::new(false)).unwrap(),
    )
}

/// The image's value between pixels, bilinear; px of the region.
fn value(image: &GrayImage, x: f64, y: f64) -> f64 {
    let (ix, iy) = (x.floor(), y.floor());
    let (u, v) = (x - ix, y - iy);
    let at = |dx: u32, dy: u32| f64::from(image.get_pixel(ix as u32 + dx, iy as u32 + dy).0[0]);
    (1.0 - v) * ((1.0 - u) * at(0, 0) + u * at(1, 0)) + v * ((1.0 - u) * at(0, 1) + u * at(1, 1))
}

/// The bright fraction of a pixel, from 7 × 7 rays of the camera model intersected with the board's plane in closed form.
fn bright_part(camera: &Camera, board: &Solid, x: f64, y: f64) -> f64 {
    let Shape::Box([out, left, up]) = board.shape else { panic!("a board is a box") };
    let face = board.middle + out;
    let bright = (0..49).filter(|k| {
        let (u, v) = (f64::from(k % 7) / 7.0 - 3.0 / 7.0, f64::from(k / 7) / 7.0 - 3.0 / 7.0);
        let ray = camera.ray(Pixel::new(x + u, y + v)).unwrap();
        let at = ray.at((face - ray.origin).dot(&out) / ray.direction.dot(&out)) - face;
        let half_m = left.norm();
        let square = |axis: &Vector3| {
            let along_m = at.dot(axis) / half_m;
            (along_m.abs() < half_m).then(|| ((along_m + half_m) / half_m * 0.5 * f64::from(SQUARES)) as i32)
        };
        square(&-left).zip(square(&up)).is_some_and(|(column, row)| (column + row) % 2 == 1)
    });
    bright.count() as f64 / 49.0
}

/// Offset of the board in an image from its projection by the camera model, px: least squares of
/// `level = a + b part + c ∂part/∂x + d ∂part/∂y`, since a shift of s px gives c = −b s.
fn shift(image: &GrayImage, region: &Region, camera: &Camera, board: &Solid) -> Vector2<f64> {
    let (width, height) = (region.width as usize, region.height as usize);
    let parts: Vec<f64> = (0..width * height)
        .map(|k| {
            let (x, y) = (region.x as usize + k % width, region.y as usize + k / width);
            bright_part(camera, board, x as f64, y as f64)
        })
        .collect();
    let (mut matrix, mut side) = (nalgebra::Matrix4::zeros(), nalgebra::Vector4::zeros());
    for y in 1..height - 1 {
        for x in 1..width - 1 {
            let at = |x: usize, y: usize| parts[y * width + x];
            let slope = [0.5 * (at(x + 1, y) - at(x - 1, y)), 0.5 * (at(x, y + 1) - at(x, y - 1))];
            let row = nalgebra::Vector4::new(1.0, at(x, y), slope[0], slope[1]);
            matrix += row * row.transpose();
            side += row * f64::from(image.get_pixel(x as u32, y as u32).0[0]);
        }
    }
    let fit = matrix.try_inverse().unwrap() * side;
    assert!(fit[1] > 0.3, "the board is not where it should be: {fit:?}");
    Vector2::new(-fit[2] / fit[1], -fit[3] / fit[1])
}

/// A board that faces the camera on a pixel's ray, with squares 12 px wide there, the first one dark.
fn board(camera: &Camera, ray: &Ray, range_m: f64) -> Solid {
    let pixel = camera.project(&ray.at(range_m)).unwrap();
    let beside = camera.ray(pixel.offset(1.0, 0.0)).unwrap();
    let square_m = 12.0 * range_m * (beside.direction - ray.direction).norm();
    let half_m = 0.5 * f64::from(SQUARES) * square_m;
    // Rotated a little in its plane, so that no edge is parallel to the pixel rows.
    let right = (beside.direction - ray.direction).normalize();
    let turn = nalgebra::Rotation3::from_axis_angle(&nalgebra::Unit::new_normalize(ray.direction), 0.2);
    let right = turn * (right - ray.direction * right.dot(&ray.direction)).normalize();
    let up = right.cross(&ray.direction);
    Solid {
        kind: SolidKind::Fiducial,
        middle: ray.at(range_m),
        shape: Shape::Box([-1e-5 * ray.direction, -half_m * right, half_m * up]),
        look: Look::Checkerboard { square_m, first: 0.02, second: 0.8 },
        is_seen: true,
    }
}

#[test]
fn checkerboards_are_found_where_the_models_project_them() {
    let (scenario, empty) = empty_world();
    for (name, camera) in cameras() {
        for start in [Pixel::new(511.0, 480.0), Pixel::new(90.0, 930.0)] {
            for range_m in [0.7, 12.0] {
                let board = board(&camera, &camera.ray(start).unwrap(), range_m);
                let world = World { solids: vec![board], ..empty.clone() };
                let (region, image) = picture(&scenario, &world, &camera, start);
                let off_px = shift(&image, &region, &camera, &board).norm();
                println!("{name} {start:?} {range_m} m: off by {off_px:.4} px");
                assert!(off_px < TOLERANCE_PX, "{name} {start:?} {range_m} m: {off_px}");
            }
        }
    }
}

/// Position along `direction`, px, at which an image passes the mean of the values 4 px inside and 4 px outside an edge.
fn edge(image: &GrayImage, at: Vector2<f64>, direction: Vector2<f64>) -> f64 {
    let along = |s: f64| value(image, at.x + s * direction.x, at.y + s * direction.y);
    let half = 0.5 * (along(-4.0) + along(4.0));
    let (mut low, mut high) = (-4.0, 4.0);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if (along(middle) > half) == (along(-4.0) > half) { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

#[test]
fn balls_are_found_where_the_cone_of_their_outline_meets_the_image() {
    let (scenario, empty) = empty_world();
    for (name, camera) in cameras() {
        for start in [Pixel::new(520.0, 500.0), Pixel::new(100.0, 925.0)] {
            for range_m in [1.0, 12.0] {
                let ray = camera.ray(start).unwrap();
                let beside = camera.ray(start.offset(1.0, 0.0)).unwrap();
                let radius_m = 24.0 * range_m * (beside.direction - ray.direction).norm();
                let middle = ray.at(range_m);
                let ball = Solid {
                    kind: SolidKind::Fiducial,
                    middle,
                    shape: Shape::Sphere(radius_m),
                    look: Look::Plain(0.8),
                    is_seen: true,
                };
                let world = World { solids: vec![ball], ..empty.clone() };
                let (region, image) = picture(&scenario, &world, &camera, start);
                let first = Vector2::new(f64::from(region.x), f64::from(region.y));
                let outline = outline(&camera, &middle, radius_m);
                let centre = outline.iter().sum::<Vector2<f64>>() / outline.len() as f64;
                let offsets: Vec<Vector2<f64>> = outline
                    .iter()
                    .map(|point| {
                        let out = (point - centre).normalize();
                        edge(&image, point - first, out) * out
                    })
                    .collect();
                let shift = offsets.iter().sum::<Vector2<f64>>() / offsets.len() as f64;
                println!("{name} {start:?} {range_m} m: off by {:.4} px", shift.norm());
                assert!(shift.norm() < TOLERANCE_PX, "{name} {start:?} {range_m} m: {shift:?}");
                let worst = offsets.iter().map(Vector2::norm).fold(0.0, f64::max);
                assert!(worst < 0.25, "{name} {start:?} {range_m} m: an edge is off by {worst} px");
            }
        }
    }
}

/// The outline of a ball in the image: the projections of its tangent rays, px.
fn outline(camera: &Camera, middle: &Point3, radius_m: f64) -> Vec<Vector2<f64>> {
    let pixel = camera.project(middle).unwrap();
    let origin = camera.ray(pixel).unwrap().origin;
    let to_middle = middle - origin;
    let distance_m = to_middle.norm();
    let axis = to_middle / distance_m;
    let aside = axis.cross(&Vector3::z()).normalize();
    let other = axis.cross(&aside);
    // Tangent points: at distance d cos²α from the camera along the axis, r cos α beside it, with sin α = r/d.
    let sine = radius_m / distance_m;
    let cosine = (1.0 - sine * sine).sqrt();
    (0..72)
        .map(|k| {
            let (s, c) = (f64::from(k) * std::f64::consts::TAU / 72.0).sin_cos();
            let point = origin
                + axis * (distance_m * cosine * cosine)
                + (aside * c + other * s) * (radius_m * cosine);
            let pixel = camera.project(&point).unwrap();
            Vector2::new(pixel.x, pixel.y)
        })
        .collect()
}

#[test]
fn left_and_right_agree_through_triangulation() {
    let (scenario, empty) = empty_world();
    let mast = sightline_geometry::camera::Mast::spirit();
    let angles = sightline_geometry::camera::MastAngles {
        azimuth_rad: 0.0,
        elevation_rad: -0.5 * std::f64::consts::PI,
    };
    let pose = nalgebra::Isometry3::translation(0.0, 0.0, -100.0) * mast.rover_from_head(angles);
    let (left, right) = (mast.left_in_head.moved(&pose), mast.right_in_head.moved(&pose));
    for range_m in [2.0, 8.0] {
        let ray = left.ray(Pixel::new(560.0, 505.0)).unwrap();
        let board = board(&left, &ray, range_m);
        let world = World { solids: vec![board], ..empty.clone() };
        let rays = [&left, &right].map(|camera| {
            let expected = camera.project(&board.middle).unwrap();
            let (region, image) = picture(&scenario, &world, camera, expected);
            let off = shift(&image, &region, camera, &board);
            camera.ray(expected.offset(off.x, off.y)).unwrap()
        });
        let met = sightline_geometry::estimate::triangulate::midpoint(&rays[0], &rays[1]).unwrap();
        // Effect of 0.02 px in each image on the range: Z²/(f B) per px of disparity (domain.md 3.4).
        let tolerance_m = 2.0 * TOLERANCE_PX * range_m * range_m / (1210.0 * 0.2003);
        let off_m = (met.point - board.middle).norm();
        assert!(off_m < tolerance_m, "{range_m} m: {off_m} m, allowed {tolerance_m} m");
    }
}
