//! The fixed drive with the target located by its shape: registered at step 2, refused at step 3, handed off at step 4.

use std::sync::Arc;

use nalgebra::{Matrix2, Matrix3, Vector3};
use sightline_session::step::RunStep;
use sightline_session::summary::summarise;
use sightline_track::gate::{Gate, GateKind};
use sightline_track::locate::features::FeatureEvidence;
use sightline_track::locate::features::evidence::Table;
use sightline_track::locate::shape_tracker::ShapeEvidence;
use sightline_track::locate::shape_tracker::carried_ray::RayMeeting;
use sightline_track::locate::shape_tracker::drape::Draped;
use sightline_track::locate::shape_tracker::evidence::{Registered, ShapeArrays};
use sightline_track::locate::shape_tracker::surface::SurfaceSeen;
use sightline_track::locate::{Evidence, gate_kinds};
use sightline_track::settings::{Settings, TrackerKind};
use sightline_track::trace::{ArrayName, StepKind};
use sightline_vision::image::{GrayImage, npy};
use sightline_vision::registration::{Failure, Method};

use crate::cache::{Item, Key, StepKey};
use crate::drawing::raster::Raster;
use crate::state::State;
use crate::tables;
use crate::tests::{feature_run, fixture};

/// Side of the virtual sensor, px.
const SENSOR: u32 = 16;
/// Rows and columns of the coarse search.
const SHIFTS: u32 = 9;
/// Facets of each mesh.
pub(crate) const FACETS: usize = 8;
/// The step at which the registration is refused.
pub(crate) const REFUSED: usize = 3;
/// The step of the camera hand-off.
pub(crate) const HAND_OFF: usize = 4;

/// A session with one target and its run by a tracker that uses shape, at `step`, with all data loaded.
pub(crate) fn at_step(context: &egui::Context, tracker: TrackerKind, step: usize) -> State {
    let mut state = fixture::at_step(context, step);
    let traces: Vec<RunStep> = (0..fixture::STOPS - 1).map(|step| trace(tracker, step)).collect();
    if let Some(session) = &mut state.session {
        let run = &mut session.targets[0].runs[0];
        run.settings = Settings { tracker, ..Settings::default() };
        run.rows = traces.iter().map(RunStep::row).collect();
        run.summary = summarise(&traces);
    }
    if let Some(traverse) = &mut state.traverse {
        // The images of the hand-off cameras have another size.
        traverse.stops.iter_mut().skip(HAND_OFF).for_each(|stop| stop.left_size = [640, 480]);
    }
    let Some(trace) = traces.into_iter().nth(step) else { return state };
    let key = StepKey { session: "s1".to_owned(), target: 0, run: 0, step };
    for name in ArrayName::all() {
        let Some(view) = trace.array(name) else { continue };
        let [width, height] = view.size();
        let array = GrayImage::from_raw(width, height, view.values().to_vec()).unwrap();
        let bytes = npy::encode(&array).unwrap();
        let item = if tables::Table::is_table(name) {
            Item::Table(Arc::new(tables::Table::from_npy(name, &bytes).unwrap()))
        } else {
            Item::Raster(Arc::new(Raster::from_npy(context, name, &bytes).unwrap()))
        };
        state.cache.store(Key::Array(key.clone(), name), Ok(item), 0.0);
    }
    fixture::load(&mut state, trace);
    state
}

/// The record of a step.
pub(crate) fn trace(tracker: TrackerKind, step: usize) -> RunStep {
    let mut trace = match tracker {
        TrackerKind::Combined => feature_run::trace(step),
        _ => fixture::trace(step),
    };
    let Some(located) = trace.located_mut() else { return trace };
    let mut evidence = ShapeEvidence { why: why(step), ..ShapeEvidence::default() };
    match std::mem::take(&mut located.evidence) {
        Evidence::Features(features) => evidence.features = Some(features),
        Evidence::Template(designation) if step == 0 => evidence.designation = Some(designation),
        _ if tracker == TrackerKind::Combined => evidence.features = Some(Box::<FeatureEvidence>::default()),
        _ => {}
    }
    if step != 1 {
        evidence.surface = Some(surface());
        let arrays = evidence.arrays.get_or_default();
        arrays.disparities = picture(40, 30, |x, y| if y < 4.0 { f32::NAN } else { 4.0 + x + y });
        arrays.ranges = picture(40, 30, |x, y| if y < 4.0 { f32::NAN } else { 9.0 - 0.1 * (x + y) });
    }
    if step >= 2 {
        located.covariance_in_rover = Some(Matrix3::from_diagonal(&Vector3::new(1.6e-5, 4e-6, 1e-6)));
        evidence.registration = Some(registered(step));
        evidence.is_judged_by_shape = true;
        registration_arrays(evidence.arrays.get_or_default());
    }
    if step == REFUSED {
        (located.position_in_rover, located.left_pixel, located.covariance_in_rover) = (None, None, None);
    }
    let checks = evidence.registration.as_ref().map(|found| found.checks.clone());
    located.evidence = match tracker {
        TrackerKind::Combined => Evidence::Combined(Box::new(evidence)),
        _ => Evidence::Shape(Box::new(evidence)),
    };
    if let (StepKind::Tracked { judge, .. }, Some(checks)) = (&mut trace.kind, checks) {
        judge.gates = checks;
    }
    trace
}

fn why(step: usize) -> String {
    let why = match step {
        0 => "later stops are registered to the surface at the designation",
        1 => "features follow the target on the way; the surface is registered at the last stop",
        HAND_OFF => "hand-off to other cameras at this stop",
        _ => "last stop with these cameras",
    };
    why.to_owned()
}

fn gate(name: &str, value: f64, limit: f64) -> Gate {
    let kind: GateKind = gate_kinds().into_iter().find(|kind| kind.name == name).unwrap();
    kind.judge(Some(value), limit)
}

fn surface() -> SurfaceSeen {
    SurfaceSeen {
        size: [80, 60],
        pixels: [3000, 400, 300, 200, 500, 100, 300],
        vertices: 900,
        triangles: 1700,
        stride: 2,
        detail_rms_m: 0.0021,
        shown_every: 2,
    }
}

fn registered(step: usize) -> Registered {
    let is_hand_off = step == HAND_OFF;
    let failure = (step == REFUSED).then_some(Failure::DoesNotFit { misfit: 2.6, limit: 1.8 });
    Registered {
        to_step: if is_hand_off { step - 1 } else { 0 },
        is_hand_off,
        method: Method::SimplexL1,
        half_width_m: 0.25,
        sensor_side_m: Some(0.7),
        start_in_rover: [6.0, 0.4, 0.2],
        correction_m: failure.is_none().then_some(0.032),
        coarse_shift_m: Some([0.04375, -0.0875, 0.01]),
        search_m: 0.175,
        mean_m: [Some(0.031), Some(0.008), Some(0.004)],
        evaluations: 60,
        turn_deg: 1.2,
        sigmas_m: Some([0.004, 0.002, 0.001]),
        ray: Some(RayMeeting { moved_m: 0.01, incidence_deg: 30.0 }),
        draped: is_hand_off.then(draped),
        draped_missing: None,
        checks: vec![
            gate("shape_overlap", 0.63, 0.25),
            gate("shape_misfit", if failure.is_some() { 2.6 } else { 1.1 }, 1.8),
            gate("shape_sigma_m", 0.004, 0.02),
            gate("shape_turn_deg", 1.2, 8.6),
            gate("shape_other_minimum", 1.9, 1.15),
            gate("shape_edge_distance_m", 0.09, 0.005),
        ],
        failure,
        reason: failure.map(|failure| failure.to_string()),
    }
}

fn draped() -> Draped {
    Draped {
        pixel: fixture::PIXEL,
        score: 0.913,
        correction_px: 2.4,
        covariance_px2: Matrix2::new(0.04, 0.0, 0.0, 0.01),
        on_mesh: 0.82,
        picture: picture(31, 31, |x, y| 0.5 + 0.01 * (x - y)).into(),
        matched: picture(31, 31, |x, y| 0.4 + 0.01 * (x - y)).into(),
    }
}

fn registration_arrays(arrays: &mut ShapeArrays) {
    let hole = |x: f32, y: f32| x + y < 3.0;
    let error = |scale: f32| {
        picture(SENSOR, SENSOR, move |x, y| if hole(x, y) { f32::NAN } else { scale * (x - 7.5) / 7.5 })
    };
    arrays.sensor = picture(SENSOR, SENSOR, |x, y| if hole(x, y) { f32::NAN } else { 4.0 + 0.01 * x });
    (arrays.error_before, arrays.error_coarse, arrays.error_fine) = (error(0.1), error(0.03), error(0.01));
    arrays.coarse = picture(SHIFTS, SHIFTS, |x, y| 0.008 + 0.001 * (x - 5.0).abs() + 0.001 * (y - 2.0).abs());
    let row = |i: u16| {
        let i = f32::from(i);
        [10.0 * i, (i / 3.0).floor(), 0.008 / (i + 1.0), 0.01 * i, 0.0, 0.0, 0.001 * i, 0.0, 0.0]
    };
    arrays.path = Table { columns: 9, values: (0..6).flat_map(row).collect() };
    (arrays.mesh_fixed, arrays.mesh_moving) = (mesh(0.01), mesh(0.0));
}

fn picture(width: u32, height: u32, value: impl Fn(f32, f32) -> f32) -> Table {
    let places = (0..width * height).map(|i| ((i % width) as f32, (i / width) as f32));
    Table { columns: width, values: places.map(|(x, y)| value(x, y)).collect() }
}

/// A strip of facets about the target, `above` m higher.
fn mesh(above: f32) -> Table {
    let values = (0..FACETS).flat_map(|i| {
        let y = 0.2 + 0.05 * i as f32;
        [6.0, y, 0.2 - above, 6.0, y + 0.05, 0.2 - above, 6.1, y, 0.1 - above]
    });
    Table { columns: 9, values: values.collect() }
}
