//! The entities of the shape tracker, from synthetic arrays for the short drive.

use std::sync::Arc;

use sightline_geometry::frames::{Pixel, Point3};
use sightline_session::step::RunStep;
use sightline_track::locate::features::evidence::Table;
use sightline_track::locate::shape_tracker::ShapeEvidence;
use sightline_track::locate::shape_tracker::drape::Draped;
use sightline_track::locate::shape_tracker::evidence::{MESH_COLUMNS, Registered};
use sightline_track::locate::shape_tracker::surface::SurfaceSeen;
use sightline_track::locate::{Evidence, gate_kinds};
use sightline_vision::registration::Method;

use super::{FIXTURE, MISSING, exported_as_promised};

/// A square of values that increase by one from pixel to pixel; the first value is missing.
fn picture(columns: u32, first: f32) -> Table {
    let values = (0..columns * columns).map(|i| if i == 0 { f32::NAN } else { first + i as f32 });
    Table { columns, values: values.collect() }
}

/// The values of a registration, independent of the surfaces.
fn registered() -> Registered {
    let check = |name: &str, value: f64, limit: f64| {
        gate_kinds().into_iter().find(|kind| kind.name == name).unwrap().judge(Some(value), limit)
    };
    Registered {
        to_step: 0,
        is_hand_off: true,
        method: Method::PointToPlane,
        half_width_m: 0.3,
        sensor_side_m: Some(0.4),
        start_in_rover: [4.0, 0.1, 0.2],
        correction_m: Some(0.02),
        coarse_shift_m: Some([0.1, -0.1, 0.0]),
        search_m: 0.1,
        mean_m: [Some(0.03), Some(0.02), Some(0.01)],
        evaluations: 5,
        turn_deg: 0.5,
        sigmas_m: Some([0.003, 0.002, 0.001]),
        ray: None,
        draped: Some(Draped {
            pixel: Pixel::new(10.0, 10.0),
            score: 0.875,
            correction_px: 1.0,
            covariance_px2: Default::default(),
            on_mesh: 1.0,
            picture: picture(3, 0.0).into(),
            matched: picture(3, 0.0).into(),
        }),
        draped_missing: None,
        checks: vec![check("shape_overlap", 0.5, 0.25), check("shape_misfit", 1.25, 1.8)],
        failure: None,
        reason: None,
    }
}

/// A surface of two by two pixels, registered with a sensor of four by four and matched at a hand-off.
fn by_shape(trace: &RunStep) -> RunStep {
    let mut trace = trace.clone();
    let (is_pick, Some(located)) = (trace.prediction().is_none(), trace.located_mut()) else { return trace };
    let mut evidence = ShapeEvidence { why: "made up".to_owned(), ..ShapeEvidence::default() };
    evidence.surface = Some(SurfaceSeen {
        size: [2, 2],
        pixels: [3, 1, 0, 0, 0, 0, 0],
        vertices: 3,
        triangles: 1,
        stride: 1,
        detail_rms_m: 0.0,
        shown_every: 1,
    });
    let arrays = evidence.arrays.get_or_default();
    (arrays.disparities, arrays.ranges) = (picture(2, 10.0), picture(2, 3.0));
    if !is_pick {
        evidence.registration = Some(registered());
        (arrays.sensor, arrays.coarse) = (picture(4, 2.0), picture(3, 0.01));
        arrays.error_before = picture(4, -8.0);
        (arrays.error_coarse, arrays.error_fine) = (picture(4, -4.0), picture(4, -2.0));
        let facet = vec![4.0, 0.0, 0.0, 4.0, 0.1, 0.0, 4.0, 0.0, 0.1];
        arrays.mesh_fixed = Table { columns: MESH_COLUMNS as u32, values: facet.clone() };
        arrays.mesh_moving = Table { columns: MESH_COLUMNS as u32, values: facet };
    }
    located.evidence = Evidence::Shape(Box::new(evidence));
    trace
}

#[test]
fn a_shape_run_logs_depth_errors_search_and_meshes() {
    let steps: Vec<_> = FIXTURE.runs[0].iter().map(|trace| Arc::new(by_shape(trace))).collect();
    let recording = exported_as_promised(&steps);
    let step = 1;
    let numbers = |entity: &str, component: &str| {
        let entity = &recording.entities[&format!("/target_1/locate/{entity}")];
        entity.numbers[&(component.to_owned(), step)].clone()
    };
    // A step of the search is a pixel of the sensor: 10 cm. The centre of its three pixels is zero shift.
    assert_eq!(numbers("coarse_register/coarse_search/best", "Points2D:positions"), [2.5, 0.5]);
    assert_eq!(numbers("refine_register/mesh_fixed", "Mesh3D:vertex_positions").len(), 3 * 3);
    assert_eq!(numbers("refine_register/misfit", "Scalars:scalars"), [1.25]);
    assert_eq!(numbers("refine_register/overlap/limit", "Scalars:scalars"), [0.25]);
    assert_eq!(numbers("hand_off/score", "Scalars:scalars"), [0.875]);
    let corner = FIXTURE.drive.traverse.site_from_rover(1) * Point3::new(4.0, 0.1, 0.0);
    let second = &numbers("refine_register/mesh_moving", "Mesh3D:vertex_positions")[3..6];
    assert!(second.iter().zip(corner.iter()).all(|(a, b)| (a - b).abs() < 1e-5), "{second:?} {corner}");
    // The first step has its surface and no registration; a step without images has neither.
    let surface = &recording.entities["/target_1/locate/surface/ranges"];
    assert!(surface.data.contains(&0) && surface.cleared.contains(&(MISSING as i64)));
    assert!(recording.entities["/target_1/locate/refine_register/mesh_fixed"].cleared.contains(&0));
}
