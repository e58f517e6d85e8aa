//! Camera models from real labels, compared with projections of an independent implementation.
//!
//! The expected pixels are rounded to 1e-4 px, for points rounded to 1e-4 m. The tolerance of 0.001 px covers this rounding
//! and the normalisation of O (2e-4 px), and nothing else.

use sightline_geometry::camera::{Cahv, Cahvor, Cahvore, CameraModel, Imaging};
use sightline_geometry::frames::{Pixel, Point3, Vector3};
use sightline_recordings::import::pds3::{Product, camera_model};
use sightline_tests::data;

const TOLERANCE_PX: f64 = 0.001;

fn point(numbers: &[f64]) -> Point3 {
    Point3::new(numbers[0], numbers[1], numbers[2])
}

#[test]
fn recorded_labels_project_like_the_reference() {
    let sets = [
        "mer1-hazcam-edr",
        "mer1-navcam-sol4087-pair",
        "mer2-navcam-sol1869",
        "mer2-navcam-linearized",
        "msl-navcam-hazcam",
    ];
    for name in sets {
        let Some(folder) = data::set(name, "the comparison of its cameras") else { continue };
        let rows = data::table(&folder.join("expected_projections.csv"), 2);
        assert!(rows.len() >= 18, "{name}: only {} rows", rows.len());
        for row in rows {
            let file = &row.names[0];
            let camera = Product::read(&folder.join(file)).unwrap().camera().unwrap();
            let kind = match &camera.model {
                CameraModel::Cahv(_) => "CAHV",
                CameraModel::Cahvor(_) => "CAHVOR",
                CameraModel::Cahvore(_) => "CAHVORE",
            };
            assert_eq!(kind, row.names[1], "{file}");
            let pixel = camera.project(&point(&row.numbers)).unwrap();
            let error = pixel.distance(Pixel::new(row.numbers[3], row.numbers[4]));
            assert!(error < TOLERANCE_PX, "{file}: {:?} is {error} px off", row.numbers);
        }
    }
}

#[test]
fn detached_and_attached_labels_agree() {
    let Some(folder) = data::set("msl-navcam-hazcam", "the comparison of its two labels") else { return };
    let [attached, detached] = ["IMG", "LBL"].map(|ending| {
        Product::read(&folder.join(format!("NRB_701384494RAD_F0933408NCAM00200M1.{ending}"))).unwrap()
    });
    assert_eq!(attached.camera().unwrap(), detached.camera().unwrap());
    assert_eq!(attached.site_from_rover().unwrap(), detached.site_from_rover().unwrap());
    assert_eq!(attached.read_raster().unwrap(), detached.read_raster().unwrap());
}

#[test]
fn labels_of_other_writers_are_understood() {
    let Some(folder) = data::set("msl-labels-only", "the labels of Mastcam, MARDI and MAHLI") else { return };
    for (file, size) in [
        ("3420MD0012740000202655E01_DRCX.LBL", [1648, 1200]),
        ("3423MH0002970011201599C00_DRCX.LBL", [1632, 1200]),
        ("3423MR1016960081600825C00_DRCX.LBL", [1328, 1184]),
    ] {
        let product = Product::read(&folder.join(file)).unwrap();
        assert_eq!(product.camera().unwrap().size, size, "{file}");
        assert!((product.site_from_rover().unwrap().position_m[0] - 151.271118).abs() < 1e-9, "{file}");
    }
}

#[test]
fn the_real_stereo_pair_projects_like_the_reference() {
    let Some(folder) = data::set("mer2-navcam-stereo-labels", "the comparison of its cameras") else {
        return;
    };
    let [left, right] = ["L", "R"].map(|eye| {
        let label = folder.join(format!("2N194463440EFFAPA0P0685{eye}0M1.geometry.txt"));
        camera_model(&Product::read(&label).unwrap().label).unwrap()
    });
    assert!(((left.centre() - right.centre()).norm() - 0.200345).abs() < 1e-6);
    for row in data::table(&folder.join("expected_stereo_projections.csv"), 0) {
        for (model, at) in [(&left, 3), (&right, 5)] {
            let pixel = model.project(&point(&row.numbers)).unwrap();
            let error = pixel.distance(Pixel::new(row.numbers[at], row.numbers[at + 1]));
            assert!(error < TOLERANCE_PX, "{:?} is {error} px off", row.numbers);
        }
    }
}

/// The model of one case of the reference: its vectors as printed, linearity (L) as T and P.
fn reference_model(case: &serde_json::Value) -> CameraModel {
    let numbers =
        |key: &str| -> [f64; 3] { std::array::from_fn(|k| case[key][k].as_f64().expect("a number")) };
    let vector = |key: &str| Vector3::from(numbers(key));
    let linear = Cahv::as_printed(Point3::from(numbers("C")), vector("A"), vector("H"), vector("V"));
    match case["model"].as_str().expect("a model") {
        "CAHV" => CameraModel::Cahv(linear),
        "CAHVOR" => CameraModel::Cahvor(Cahvor::as_printed(linear, vector("O"), numbers("R"))),
        "CAHVORE" => {
            let law = match case["linearity"].as_f64().expect("a number") {
                1.0 => (Imaging::Perspective, 0.0),
                0.0 => (Imaging::Fisheye, 0.0),
                linearity => (Imaging::General, linearity),
            };
            CameraModel::Cahvore(Cahvore::as_printed(linear, vector("O"), numbers("R"), numbers("E"), law))
        }
        other => panic!("{other}"),
    }
}

#[test]
fn the_published_reference_projections_are_reproduced() {
    let Some(folder) = data::set("camera-model-reference", "the published projections") else { return };
    let text = std::fs::read_to_string(folder.join("cahv_reference_projections.json")).unwrap();
    let reference: serde_json::Value = serde_json::from_str(&text).unwrap();
    let pair = |value: &serde_json::Value| Pixel::new(value[0].as_f64().unwrap(), value[1].as_f64().unwrap());
    for case in reference["cases"].as_array().unwrap() {
        // The reference iteration stops at 1e-6 px for CAHVORE; its numbers have 8 decimal places.
        let tolerance_px = if case["model"] == "CAHVORE" { 1e-6 } else { 1e-8 };
        let model = reference_model(case);
        let pixels = case["pixels"].as_array().unwrap();
        for (place, pixel) in reference["points"].as_array().unwrap().iter().zip(pixels) {
            let numbers: Vec<f64> = place.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
            let error = model.project(&point(&numbers)).unwrap().distance(pair(pixel));
            assert!(error < tolerance_px, "{} at {numbers:?} is {error} px off", case["model"]);
        }
    }
}
