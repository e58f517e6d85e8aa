//! The goodness map and the paths of a stop: requested with the panel, described on the map, listed in the inspector.

use std::sync::Arc;

use serde_json::json;
use sightline_rover::hazards::{CellBasis, HazardTerm};
use sightline_session::driving::{DriveView, Steering};
use sightline_session::hazard_view::{HazardView, UNKNOWN};

use super::Shown;
use super::fixture;
use crate::cache::{Item, Key};
use crate::command::{Command, Layer, Stage};
use crate::driving::ground;
use crate::driving::hazards::{HazardRaster, texels, words_at};
use crate::panels::pane::{Need, Pane};
use crate::state::State;

const STEP: usize = 2;

/// Four cells of half a metre north-east of (0, 0): bad, unknown, good, exempt.
fn view() -> HazardView {
    HazardView {
        step: STEP,
        range_points: Some(900),
        missing: None,
        cell_m: 0.5,
        side: 2,
        corner_m: [0.0, 0.0],
        goodness_percent: vec![0, UNKNOWN, 100, 100],
        limited_by: vec![Some(HazardTerm::Step), Some(HazardTerm::Unknown), None, None],
        value: vec![0.21, 0.1, 0.0, 0.0],
        basis: vec![CellBasis::Measured, CellBasis::Unknown, CellBasis::Measured, CellBasis::Exempt],
        height_m: vec![Some(0.3), None, Some(0.3), None],
    }
}

/// A drive whose navigator chose the second of two paths, with the goodness map of the stop.
fn driving(context: &egui::Context) -> State {
    let mut state = fixture::at_step(context, STEP);
    let terms = json!({ "hazard": 0.8, "goal": 0.9, "steer": 1.0 });
    let path = |curvature_per_m: f64, veto| {
        json!({ "motion": { "kind": "arc", "length_m": 0.5, "curvature_per_m": curvature_per_m }, "evaluated_m": 1.2,
            "terms": terms, "vote": 0.85, "unknown_share": 0.1, "veto": veto })
    };
    let veto =
        json!({ "in_site_m": [0.2, 0.2], "along_m": 0.4, "term": "step", "value": 0.21, "limit": 0.18 });
    let choice = json!({ "candidates": [path(0.0, veto), path(0.0625, json!(null))], "chosen": 1,
        "route_m": [[2.0, 0.2], [4.0, 0.5]],
        "blocked_goal": { "ground": { "term": "step", "value": 0.4, "limit": 0.182 }, "nearest_m": [4.0, 0.5], "nearest_from_goal_m": 1.2 } });
    let cycles: Vec<_> = (0..=STEP)
        .map(|step| {
            let mut cycle = fixture::cycle(step);
            (cycle["choice"], cycle["range_points"]) = (choice.clone(), json!(900));
            cycle
        })
        .collect();
    let steering = json!({ "target": 0, "run": 0, "command": { "navigator": "gestalt" } });
    let drive: DriveView = serde_json::from_value(
        json!({ "steering": steering, "cycles": cycles, "summary": null, "is_driving": false }),
    )
    .unwrap();
    if let Some(session) = &mut state.session {
        session.steering = Some(serde_json::from_value::<Steering>(steering).unwrap());
    }
    state.on_drive_reply("s1".to_owned(), drive);
    state
}

/// The key of the requested goodness map.
fn key(state: &mut State) -> Key {
    state.fetch_for_panels(&[Need::Hazards]);
    let is_hazards = |key: &Key| matches!(key, Key::Hazards { step: STEP, .. });
    state.needed_items().into_iter().find(is_hazards).expect("a goodness map")
}

fn with_map(context: &egui::Context) -> State {
    let mut state = driving(context);
    let raster = HazardRaster::new(context, view());
    let key = key(&mut state);
    state.cache.store(key, Ok(Item::Hazards(Arc::new(raster))), 0.0);
    state
}

#[test]
fn the_goodness_map_is_fetched_while_a_panel_shows_it() {
    let mut state = driving(&egui::Context::default());
    let is_hazards = |key: &Key| matches!(key, Key::Hazards { step: STEP, .. });
    assert!(!state.needed_items().iter().any(is_hazards));
    let first = key(&mut state);
    // Another exemption radius results in another map.
    if let Some((_, view)) = &mut state.driving.view
        && let Some(steering) = &mut view.steering
    {
        steering.command.exemption_radius_m = 1.0;
    }
    assert_ne!(key(&mut state), first);
}

#[test]
fn the_northernmost_row_is_the_first_line_of_the_picture() {
    let context = egui::Context::default();
    let raster = HazardRaster::new(&context, view());
    let texture = raster.texture.as_ref().unwrap();
    assert_eq!((texture.middle_m, texture.size_m), ([0.5, 0.5], [1.0, 1.0]));
    assert_eq!(texels(&raster.view), [100, 100, 0, UNKNOWN]);
}

#[test]
fn the_map_names_good_and_bad_ground_once_it_is_known() {
    Shown::pane(Pane::Map, driving).hides("good ground").says("planned");
    Shown::pane(Pane::Map, with_map).says("good ground").says("bad ground").says("vetoed path");
}

#[test]
fn the_ground_under_the_pointer_is_told_in_words() {
    let view = view();
    let at = |east: f64, north: f64| words_at(Some(&view), [east, north]);
    assert_eq!(at(0.1, 0.1), "  goodness 0.00: step 21.0 cm");
    assert_eq!(at(0.9, 0.1), "  ground unknown");
    assert_eq!(at(0.1, 0.9), "  goodness 1.00");
    assert_eq!(at(0.9, 0.9), "  exempt near the target");
    assert_eq!([at(3.0, 0.1), words_at(None, [0.1, 0.1])], ["", ""]);
}

#[test]
fn the_inspector_lists_every_path_with_its_vote_or_its_first_failing_cell() {
    let make = |context: &egui::Context| {
        let mut state = driving(context);
        state.perform(Command::SelectStage(Stage::SELECT_PATH));
        state
    };
    let shown = Shown::new([700.0, 500.0], make, |ui, state, out| {
        super::show_pane(ui, Pane::Inspector, state, out);
    });
    shown.says("1 of 2 paths are not vetoed").says("radius 16 m right (chosen)");
    shown.says("step 21.0 cm at 0.40 m, limit 18.0 cm").says("0.85");
    shown.says("the rover cannot stand at its goal, where the step is 0.400 m, limit 0.182 m; the nearest place that it can reach is 1.20 m");
}

#[test]
fn the_ground_lies_over_the_left_image_where_the_camera_sees_it() {
    let camera = sightline_geometry::camera::Mast::spirit().left_in_head;
    // A map of 20 × 20 cells of 10 cm, from 4 m ahead of the camera, 1 m below it.
    let side = 20;
    let view = HazardView {
        cell_m: 0.1,
        side,
        corner_m: [4.0, -1.0],
        goodness_percent: (0..side * side).map(|index| if index == 5 { UNKNOWN } else { 80 }).collect(),
        limited_by: vec![None; side * side],
        value: vec![0.0; side * side],
        basis: vec![CellBasis::Measured; side * side],
        height_m: (0..side * side).map(|index| (index != 7).then_some(1.0)).collect(),
        ..view()
    };
    let ahead = sightline_geometry::frames::Pose::identity();
    let cells = ground::cells(&view, &camera, &ahead);
    let in_picture = |index: &usize| {
        let at = |number: usize, first_m: f64| first_m + (number as f64 + 0.5) * 0.1;
        camera.sees(&sightline_geometry::frames::Point3::new(
            at(index / side, 4.0),
            at(index % side, -1.0),
            1.0,
        ))
    };
    let seen = (0..side * side).filter(in_picture).count();
    assert!(seen > 100, "{seen}");
    assert_eq!(
        cells.len(),
        (0..side * side).filter(|index| *index != 5 && *index != 7).filter(in_picture).count()
    );
    for (corners, percent) in &cells {
        assert_eq!(*percent, 80);
        // Farther rows are higher in the image, and the rover's right is on the right.
        assert!(corners[3].y < corners[0].y && corners[1].x > corners[0].x, "{corners:?}");
    }
    let behind = sightline_geometry::frames::Pose::translation(20.0, 0.0, 0.0);
    assert!(ground::cells(&view, &camera, &behind).is_empty());
}

#[test]
fn the_layer_of_the_ground_is_listed_where_there_is_a_goodness_map_and_fetches_it() {
    let context = egui::Context::default();
    let mut state = driving(&context);
    assert!(ground::entry(&state).is_some());
    state.fetch_for_panels(&[]);
    let wants = |state: &State| state.needed_items().iter().any(|key| matches!(key, Key::Hazards { .. }));
    assert!(!wants(&state), "it is hidden at first");
    state.perform(Command::ToggleLayer(Layer::Ground));
    state.fetch_for_panels(&[]);
    assert!(wants(&state));
    assert!(ground::entry(&fixture::at_step(&context, STEP)).is_none());
}
