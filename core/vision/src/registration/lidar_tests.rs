//! Registers two lidar scans of a street with a known motion and compares the errors with those of another program;
//! `tests/reference/lidar_registration.py` wrote and describes its numbers.
//!
//! The test is skipped if its data are missing (see `sightline_testdata`).

use std::path::Path;

use nalgebra::{Matrix3, Matrix4, Translation3, UnitQuaternion};
use serde::Deserialize;
use sightline_testdata::recorded;

use super::*;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::frames::Vector3;

/// Errors of the other program.
#[derive(Deserialize)]
struct Reference {
    /// Centre of the sector of azimuth, deg; `None`: all around.
    centre_deg: Option<f64>,
    error_mm: f64,
    error_mrad: f64,
}

/// The points of a binary PLY file of four floats a vertex: x, y, z and an intensity.
fn cloud(path: &Path) -> Vec<Point3> {
    let bytes = std::fs::read(path).unwrap();
    let mark = b"end_header\n";
    let start = bytes.windows(mark.len()).position(|window| window == mark).unwrap() + mark.len();
    let number = |vertex: &[u8], k: usize| {
        f64::from(f32::from_le_bytes([vertex[k], vertex[k + 1], vertex[k + 2], vertex[k + 3]]))
    };
    bytes[start..]
        .chunks_exact(16)
        .map(|vertex| Point3::new(number(vertex, 0), number(vertex, 4), number(vertex, 8)))
        .collect()
}

fn motion_of(path: &Path) -> Pose {
    let text = std::fs::read_to_string(path).unwrap();
    let numbers: Vec<f64> = text.split_whitespace().map(|number| number.parse().unwrap()).collect();
    let matrix = Matrix4::from_row_slice(&numbers);
    let turn: Matrix3<f64> = matrix.fixed_view::<3, 3>(0, 0).into();
    let shift = Translation3::new(matrix[(0, 3)], matrix[(1, 3)], matrix[(2, 3)]);
    Pose::from_parts(shift, UnitQuaternion::from_matrix(&turn))
}

/// 32 rings, 4/3° apart, at half of their columns; rings on the ground are far apart, hence the large ratio of ranges.
fn mesh(cloud: &[Point3]) -> Mesh {
    let pi = std::f64::consts::PI;
    let scan = Scan {
        columns: 1085,
        rows: 32,
        azimuth_rad: [pi, -pi],
        elevation_rad: [11.0 + 1.0 / 3.0, -31.0 - 1.0 / 3.0].map(f64::to_radians),
    };
    let grid = PointGrid::from_cloud(cloud, &Point3::origin(), &scan);
    let settings = MeshSettings { spacing_m: 0.0, depth_ratio_max: 1.3, grazing_max_deg: 88.0 };
    Mesh::from_grid(&grid, &Point3::origin(), None, &settings)
}

#[test]
fn a_street_is_registered_about_as_well_as_by_another_program() {
    let files = ["source.ply", "target.ply", "T_target_source.txt"].map(|name| {
        recorded(&format!("lidar-pair-registration/{name}"), "the registration of the lidar pair")
    });
    let [Some(source), Some(target), Some(truth)] = files else { return };
    let (moving, fixed, truth) = (mesh(&cloud(&source)), mesh(&cloud(&target)), motion_of(&truth));
    let reference: Vec<Reference> =
        serde_json::from_str(include_str!("../../../../tests/reference/lidar_registration.json")).unwrap();
    for part in reference {
        let Some(centre_deg) = part.centre_deg else { continue };
        let direction = Vector3::new(centre_deg.to_radians().cos(), centre_deg.to_radians().sin(), -0.12);
        let about = Point3::from(direction * 8.0);
        let input = RegistrationInput {
            fixed: &fixed,
            moving: &moving,
            start_fixed_from_moving: &Pose::identity(),
            target_in_fixed: &about,
            half_width_m: 5.0,
            prior: None,
            sensor: Some(RangeSensor::pinhole(&Point3::origin(), &direction, 0.9, [160, 64])),
            cancel: Cancel::default(),
        };
        for method in [Method::SimplexL1, Method::PointToPlane] {
            let mut settings =
                ShapeSettings { method, search_half_range_m: Some(1.0), ..ShapeSettings::default() };
            settings.simplex.edge_m = 0.1;
            let found = register(&input, &settings);
            let error = truth.inverse() * found.fixed_from_moving;
            let error_mm =
                (found.fixed_from_moving.translation.vector - truth.translation.vector).norm() * 1e3;
            let error_mrad = error.rotation.angle() * 1e3;
            println!(
                "{centre_deg}° {method:?}: {error_mm:.1} mm, {error_mrad:.1} mrad (the other program {} and {}), {:?}",
                part.error_mm, part.error_mrad, found.failure
            );
            // The scans are 504 mm and 12.5 mrad apart; the car moved during each scan.
            assert!(error_mm < part.error_mm.max(20.0) * 1.7, "{centre_deg}° {method:?} {error_mm}");
            assert!(error_mrad < part.error_mrad + 5.0, "{centre_deg}° {method:?} {error_mrad}");
        }
    }
}
