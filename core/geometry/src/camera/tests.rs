//! The camera models against the reference vectors of domain.md section 15 (computed with JPL's C code
//! and with ours in another language; vectors as printed) and against themselves.

use nalgebra::{Matrix2x3, Translation3};
use serde_json::Value;

use super::*;
use crate::estimate::triangulate::midpoint;
use crate::frames::{Pose, PoseRecord, attitude_from_roll_pitch_yaw};

/// The reference vectors of domain.md section 15.
fn reference() -> Value {
    serde_json::from_str(include_str!("reference_vectors.json")).unwrap()
}

/// A camera of the reference vectors, as printed.
fn printed(reference: &Value, name: &Value) -> Camera {
    serde_json::from_value(reference["cameras"][name.as_str().unwrap()].clone()).unwrap()
}

/// One real camera of each model, O made unit.
pub(super) fn all_kinds() -> [Camera; 3] {
    ["mer2_navcam_l_lin", "mer2_navcam_l", "mer1_fhaz_l"]
        .map(|name| printed(&reference(), &Value::from(name)).normalised())
}

/// 9 × 9 pixels from edge to edge, the corners of the border pixels included.
pub(super) fn pixel_grid(camera: &Camera) -> Vec<Pixel> {
    let at = |i: u32, size: u32| f64::from(i) / 8.0 * f64::from(size) - 0.5;
    (0..81).map(|i| Pixel::new(at(i % 9, camera.width()), at(i / 9, camera.height()))).collect()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

fn three(value: &Value) -> Vector3 {
    serde_json::from_value(value.clone()).unwrap()
}

fn point(value: &Value) -> Point3 {
    three(value).into()
}

fn pixel(value: &Value) -> Pixel {
    Pixel::new(number(&value[0]), number(&value[1]))
}

fn cases<'a>(reference: &'a Value, key: &str) -> &'a [Value] {
    reference[key].as_array().unwrap()
}

#[track_caller]
fn assert_near(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance, "{found} instead of {expected}");
}

#[track_caller]
fn assert_pixel(found: Pixel, expected: Pixel, tolerance: f64) {
    assert!(found.distance(expected) <= tolerance, "{found:?} instead of {expected:?}");
}

#[track_caller]
fn assert_vector(found: Vector3, expected: Vector3, tolerance: f64) {
    assert!((found - expected).norm() <= tolerance, "{found} instead of {expected}");
}

#[test]
fn the_image_planes_agree_with_the_reference() {
    let reference = reference();
    for case in cases(&reference, "derived") {
        let plane = printed(&reference, &case["cam"]).model.image_plane();
        assert_near(plane.hs, number(&case["hs"]), 1e-8);
        assert_near(plane.hc, number(&case["hc"]), 1e-8);
        assert_near(plane.vs, number(&case["vs"]), 1e-8);
        assert_near(plane.vc, number(&case["vc"]), 1e-8);
        assert_near(plane.theta.to_degrees(), number(&case["theta_deg"]), 1e-8);
    }
}

#[test]
fn projections_agree_with_the_reference() {
    let reference = reference();
    for case in cases(&reference, "project") {
        let camera = printed(&reference, &case["cam"]);
        assert_pixel(camera.project(&point(&case["P"])).unwrap(), pixel(&case["px"]), 1e-9);
        assert!(camera.sees(&point(&case["P"])));
    }
}

#[test]
fn rays_agree_with_the_reference() {
    let reference = reference();
    for case in cases(&reference, "ray") {
        let ray = printed(&reference, &case["cam"]).ray(pixel(&case["px"])).unwrap();
        assert_vector(ray.origin.coords, three(&case["origin"]), 2e-12);
        // The reference rays of CAHVORE are as long as the printed O; ours are unit.
        assert_vector(ray.direction, three(&case["dir"]).normalize(), 2e-12);
        assert_near(ray.direction.norm(), 1.0, 1e-15);
    }
}

#[test]
fn a_moved_hazcam_agrees_with_the_reference() {
    let reference = reference();
    let case = &reference["move"];
    let q = &case["q_sxyz"];
    let site_from_rover = PoseRecord {
        position_m: three(&case["p"]).into(),
        quaternion_sxyz: [number(&q[0]), number(&q[1]), number(&q[2]), number(&q[3])],
    }
    .to_pose();
    let camera = printed(&reference, &case["cam"]).moved(&site_from_rover);
    assert_vector(camera.model.centre().coords, three(&case["C"]), 1e-9);
    assert_vector(camera.model.axis(), three(&case["A"]), 1e-9);
    assert_vector(camera.model.linear().horizontal, three(&case["H"]), 1e-7);
    assert_vector(camera.model.linear().vertical, three(&case["V"]), 1e-7);
    assert_vector(camera.model.optical_axis(), three(&case["O"]), 1e-9);
    let point_in_site = site_from_rover * point(&case["P_rover"]);
    assert_vector(point_in_site.coords, three(&case["P_site"]), 1e-9);
    assert_pixel(camera.project(&point_in_site).unwrap(), pixel(&case["px"]), 1e-9);
}

#[test]
fn the_cameras_of_the_scale_and_roll_vector_agree_with_the_reference() {
    let reference = reference();
    let case = &reference["scale_roll"];
    let old = printed(&reference, &case["cam"]);
    let rpy = three(&case["new_pose_rpy_deg"]).map(f64::to_radians);
    let old_from_new = Pose::from_parts(
        Translation3::from(three(&case["new_pose_t"])),
        attitude_from_roll_pitch_yaw(rpy.x, rpy.y, rpy.z),
    );
    let new = old.moved(&old_from_new);
    let target = point(&case["target"]);
    assert_vector(new.model.centre().coords, three(&case["new_C"]), 1e-9);
    assert_vector(old.model.horizontal_axis(), three(&case["Hx"]), 1e-9);
    assert_pixel(old.project(&target).unwrap(), pixel(&case["old_px"]), 1e-9);
    assert_pixel(new.project(&target).unwrap(), pixel(&case["new_px"]), 1e-9);
    assert_pixel(new.project(&point(&case["p_adj"])).unwrap(), pixel(&case["p_adj_px"]), 1e-6);
    assert_near((target - old.model.centre()).norm(), number(&case["D_old"]), 1e-9);
    assert_near((target - new.model.centre()).norm(), number(&case["D_new"]), 1e-9);
}

/// A mast of the reference vectors, as printed; Opportunity has no right camera, so its left one is used for both.
fn printed_mast(case: &Value) -> Mast {
    let camera = |name: &str| {
        let head = if case[name].is_null() { &case["head_left"] } else { &case[name] };
        let mut head = head.clone();
        head["model"] = Value::from("CAHVOR");
        head["size"] = serde_json::json!([1024, 1024]);
        serde_json::from_value::<Camera>(head).unwrap()
    };
    Mast {
        origin_in_rover: point(&case["mast_origin"]),
        left_in_head: camera("head_left"),
        right_in_head: camera("head_right"),
    }
}

#[test]
fn mast_pointing_agrees_with_the_reference() {
    let reference = reference();
    for case in cases(&reference, "mast") {
        let mast = printed_mast(case);
        for expected in cases(case, "points") {
            let target = point(&expected["T"]);
            let angles = mast.point_left_centre_at(&target).unwrap();
            assert_near(angles.azimuth_rad.to_degrees(), number(&expected["az_deg"]), 1e-8);
            assert_near(angles.elevation_rad.to_degrees(), number(&expected["el_deg"]), 1e-8);
            let (left, right) = mast.cameras_in_rover(angles);
            assert_pixel(left.project(&target).unwrap(), pixel(&expected["left_px"]), 1e-7);
            assert_near((target - left.model.centre()).norm(), number(&expected["range"]), 1e-8);
            if expected["right_px"].is_array() {
                assert_pixel(right.project(&target).unwrap(), pixel(&expected["right_px"]), 1e-6);
            }
            let offset = target - mast.origin_in_rover;
            let naive = MastAngles {
                azimuth_rad: offset.y.atan2(offset.x),
                elevation_rad: -offset.z.atan2(offset.x.hypot(offset.y)),
            };
            let naive_px = mast.cameras_in_rover(naive).0.project(&target).unwrap();
            assert_pixel(naive_px, pixel(&expected["left_px_if_mast_points_at_T"]), 1e-4);
        }
    }
}

#[test]
fn the_default_mast_is_the_reference_mast_with_unit_optical_axes() {
    let reference = reference();
    let spirit = Mast::spirit();
    let mast = printed_mast(&reference["mast"][0]);
    assert_eq!(spirit.origin_in_rover, mast.origin_in_rover);
    assert_eq!(spirit.left_in_head, mast.left_in_head.normalised());
    assert_eq!(spirit.right_in_head, mast.right_in_head.normalised());
}

#[test]
fn the_midpoint_of_a_real_match_agrees_with_the_reference() {
    let reference = reference();
    let case = &reference["midpoint"];
    let left = printed(&reference, &case["left"]).ray(pixel(&case["l"])).unwrap();
    let right = printed(&reference, &case["right"]).ray(pixel(&case["r"])).unwrap();
    let found = midpoint(&left, &right).unwrap();
    assert_vector(found.point.coords, three(&case["X"]), 1e-9);
    assert_near(found.range_left_m, number(&case["s"]), 1e-9);
    assert_near(found.range_right_m, number(&case["t"]), 1e-9);
    assert_near(found.gap_m, number(&case["gap"]), 1e-9);
}

#[test]
fn the_jacobian_agrees_with_the_reference() {
    let reference = reference();
    let case = &reference["jacobian"];
    let camera = printed(&reference, &case["cam"]);
    let (_, jacobian) = camera.model.project_with_jacobian(&point(&case["P"])).unwrap();
    for row in 0..2 {
        assert_vector(jacobian.row(row).transpose(), three(&case["d_px_d_P"][row]), 1e-6);
    }
}

#[test]
fn analytic_jacobians_agree_with_central_differences() {
    for camera in all_kinds() {
        for (index, pixel) in pixel_grid(&camera).into_iter().enumerate() {
            let range = [0.5, 1.0, 5.0][index % 3];
            let point = camera.ray(pixel).unwrap().at(range);
            let (found, jacobian) = camera.model.project_with_jacobian(&point).unwrap();
            assert_eq!(Some(found), camera.project(&point));
            let step = 1e-5 * range;
            let column = |axis: usize| {
                let shift = Vector3::ith(axis, step);
                let [ahead, behind] = [point + shift, point - shift].map(|p| camera.project(&p).unwrap());
                nalgebra::Vector2::new(ahead.x - behind.x, ahead.y - behind.y) / (2.0 * step)
            };
            let numeric = Matrix2x3::from_columns(&[column(0), column(1), column(2)]);
            let error = (jacobian - numeric).norm() / numeric.norm();
            assert!(error < 1e-7, "{error:e} at {pixel:?}, {range} m");
        }
    }
}

#[test]
fn the_jacobian_of_a_hazcam_goes_smoothly_through_its_axis() {
    let [_, _, mut camera] = all_kinds();
    if let CameraModel::Cahvore(model) = &mut camera.model {
        model.radial[0] = 0.02;
    }
    let on_axis = camera.model.centre() + camera.model.optical_axis() * 2.0;
    let beside = on_axis + Vector3::new(0.0, 1e-7, 0.0);
    let (_, here) = camera.model.project_with_jacobian(&on_axis).unwrap();
    let (_, there) = camera.model.project_with_jacobian(&beside).unwrap();
    assert!((here - there).norm() < 1e-6 * here.norm(), "{here}{there}");
}

#[test]
fn every_pixel_comes_back_from_near_and_far() {
    for camera in all_kinds() {
        for pixel in pixel_grid(&camera) {
            let ray = camera.ray(pixel).unwrap();
            for range in [0.3, 1.0, 3.0, 30.0] {
                assert_pixel(camera.project(&ray.at(range)).unwrap(), pixel, 1e-9);
            }
        }
    }
}

#[test]
fn the_entrance_pupil_of_a_hazcam_moves_by_millimetres() {
    let [_, _, camera] = all_kinds();
    let ray = camera.ray(Pixel::new(1023.0, 1023.0)).unwrap();
    assert_near((ray.origin - camera.model.centre()).norm(), 0.0058, 0.0001);
    for corner in [Pixel::new(0.0, 0.0), Pixel::new(1023.0, 1023.0)] {
        let from_fixed_pupil = camera.model.centre() + camera.ray(corner).unwrap().direction;
        let error = camera.project(&from_fixed_pupil).unwrap().distance(corner);
        assert!(error > 1.0, "a fixed pupil would be wrong by only {error} px at 1 m");
    }
}

#[test]
fn points_behind_a_camera_are_rejected() {
    for camera in all_kinds() {
        for pixel in pixel_grid(&camera) {
            let ray = camera.ray(pixel).unwrap();
            // Directions opposite to the corners of a hazcam are still slightly inside its field of view.
            if ray.direction.dot(&camera.model.optical_axis()) < 70_f64.to_radians().cos() {
                continue;
            }
            for range in [0.3, 3.0, 30.0] {
                let behind = ray.at(-range);
                assert_eq!(camera.project(&behind), None, "{pixel:?} {range}");
                assert!(!camera.sees(&behind) && camera.model.project_with_jacobian(&behind).is_none());
            }
        }
        assert_eq!(camera.project(&camera.model.centre()), None);
        assert_eq!(camera.project(&Point3::new(f64::NAN, 0.0, 0.0)), None);
        assert!(camera.ray(Pixel::new(f64::NAN, 0.0)).is_none());
    }
}

#[test]
fn points_beyond_the_fold_of_a_distortion_are_rejected() {
    // With R = (0, −0.1, 0) the distorted radius turns back at the tangent √(10/3), 61.3° off the axis.
    let [linear, ..] = all_kinds();
    let linear = linear.model.linear().clone();
    let (axis, across) = (linear.axis.normalize(), linear.horizontal_axis().normalize());
    let camera = CameraModel::Cahvor(Cahvor::normalised(linear, axis, [0.0, -0.1, 0.0]));
    let at = |angle_deg: f64| {
        let (sin, cos) = angle_deg.to_radians().sin_cos();
        camera.centre() + axis * cos + across * sin
    };
    assert!(camera.project(&at(61.0)).is_some());
    for beyond in [61.6, 70.0, 89.0, 91.0, 150.0] {
        assert_eq!(camera.project(&at(beyond)), None, "{beyond}°");
        assert_eq!(camera.project_with_jacobian(&at(beyond)), None, "{beyond}°");
    }
}

#[test]
fn a_hazcam_sees_beyond_ninety_degrees_of_its_axis() {
    let [_, _, camera] = all_kinds();
    let wider = Camera { model: camera.model.shifted(-30.0, -30.0), size: [1084, 1084] };
    let corner = Pixel::new(0.0, 0.0);
    let point = wider.ray(corner).unwrap().at(1.0);
    assert!((point - camera.model.centre()).dot(&camera.model.optical_axis()) < -0.01, "not beyond 90°");
    assert_pixel(wider.project(&point).unwrap(), corner, 1e-9);
    assert!(wider.sees(&point) && !camera.sees(&point));
}

#[test]
fn the_effective_focal_lengths_are_those_of_neighbouring_rays() {
    // domain.md 2.6: mean of the x and y columns.
    let reference = reference();
    let cases = [
        ("mer1_navcam_l", 1224.8, 0.1),
        ("mer2_navcam_l", 1211.3, 0.1),
        ("mer2_navcam_r", 1209.95, 0.1),
        ("mer1_fhaz_l", 454.8, 0.1),
    ];
    for (name, expected, tolerance) in cases {
        let camera = printed(&reference, &Value::from(name)).normalised();
        let found = camera.model.focal_length_px(camera.centre_pixel()).unwrap();
        assert_near(found, expected, tolerance);
    }
}

#[test]
fn files_keep_the_numbers_as_printed() {
    let reference = reference();
    for (name, values) in reference["cameras"].as_object().unwrap() {
        let camera = printed(&reference, &Value::from(name.as_str()));
        camera.model.validate().unwrap();
        let mut written = serde_json::to_value(&camera).unwrap();
        written["from"] = values["from"].clone();
        assert_eq!(&written, values);
        let toml = toml::to_string(&camera).unwrap();
        assert_eq!(toml::from_str::<Camera>(&toml).unwrap(), camera, "{toml}");
    }
    let mut unknown_type = reference["cameras"]["mer1_fhaz_l"].clone();
    unknown_type["T"] = Value::from(4);
    let problem = serde_json::from_value::<Camera>(unknown_type).unwrap_err().to_string();
    assert!(problem.contains("must be 1, 2 or 3"), "{problem}");
}

#[test]
fn impossible_cameras_are_named() {
    let [linear, _, fisheye] = all_kinds();
    let spoilt = |spoil: fn(&mut Cahv)| {
        let mut model = linear.model.clone();
        spoil(model.linear_mut());
        model.validate().unwrap_err()
    };
    assert!(spoilt(|m| m.centre.x = f64::NAN).contains("vector C"));
    assert!(spoilt(|m| m.axis *= 1.2).contains("vector A"));
    assert!(spoilt(|m| m.horizontal = m.axis).contains("hs"));
    assert!(spoilt(|m| m.vertical = m.horizontal).contains("angle between"));
    let CameraModel::Cahvore(mut model) = fisheye.model else { panic!("not a CAHVORE") };
    model.optical_axis *= 0.5;
    assert!(CameraModel::Cahvore(model).validate().unwrap_err().contains("vector O"));
}
