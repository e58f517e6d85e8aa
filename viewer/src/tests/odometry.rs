//! The panel “Odometry”, its corners on the left image, and the explanations where there is no odometry.

use std::sync::Arc;

use egui::Shape;
use nalgebra::{Matrix6, Vector3, Vector6};
use serde_json::json;
use sightline_api::wire::StopOdometry;
use sightline_geometry::frames::{Pose, PoseRecord};
use sightline_rover::visual_odometry::{
    Fate, MeasuredMotion, OdometryCorner, OdometryPreset, OdometryUpdate, Slip,
};
use sightline_session::driving::Steering;
use sightline_track::gate::Gate;
use sightline_vision::image::{GrayImage, io};

use super::{Shown, fixture};
use crate::cache::{ImageSide, Item, Key};
use crate::command::{Command, Layer, Stage};
use crate::drawing::raster::Raster;
use crate::net::request::Request;
use crate::odometry::corners;
use crate::panels::bars;
use crate::panels::pane::{Need, Pane};
use crate::state::State;
use crate::theme;

/// The cursor's stop.
const STEP: usize = 3;

/// A motion of 50 cm ahead by the wheels from `before`, with slip by vision, and a turn to the right.
pub(crate) fn measured(before: &Pose, slip: f64, turn_deg: f64, accepted: bool) -> MeasuredMotion {
    let turn = nalgebra::UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn_deg.to_radians());
    let before_from_after = Pose::from_parts(Vector3::new(0.5 * (1.0 - slip), 0.0, 0.0).into(), turn);
    let sigmas = Vector6::new(0.003, 0.001, 0.001, 0.001, 0.001, 0.0005);
    let sigma_m = if accepted { 0.003 } else { 0.021 };
    let gate = |name: &str, unit: &str, value: f64, limit: f64, at_least: bool| {
        let margin = if at_least { value - limit } else { limit - value };
        Gate {
            criterion: 40,
            name: name.to_owned(),
            unit: unit.to_owned(),
            value: Some(value),
            limit,
            at_least,
            margin: Some(margin),
            passed: margin >= 0.0,
            setting: None,
        }
    };
    let update = OdometryUpdate {
        corners: 8,
        points: 6,
        matches: 3,
        consistent: 2,
        inliers: 2,
        coarse_search: None,
        after_from_before: Some(PoseRecord::from(&before_from_after.inverse())),
        wheels_m: [0.5, 0.0, 0.0],
        covariance: Some(Matrix6::from_diagonal(&sigmas.map(|sigma| sigma * sigma))),
        chi2_per_dof: Some(0.9),
        change: Some(0.1),
        slip: Some(Slip { along: slip, aside: -0.02, along_sigma: 0.006 }),
        ambiguity: 0.1,
        repetition: 0.2,
        gates: vec![
            gate("odometry_inliers", "", 60.0, 25.0, true),
            gate("odometry_sigma_m", "m", sigma_m, 0.015, false),
        ],
        missing: None,
        accepted,
        table: Vec::new(),
    };
    let wheels = before * Pose::translation(0.5, 0.0, 0.0);
    MeasuredMotion {
        preset: OdometryPreset::Sightline,
        wheels_site_from_rover: PoseRecord::from(&wheels),
        corrects: accepted,
        camera: None,
        update,
        refused_too: None,
    }
}

/// One corner of every fate, 100 px apart in the previous image; matches are 40 px lower.
fn table() -> Vec<OdometryCorner> {
    let fates = [
        Fate::Inlier,
        Fate::Inlier,
        Fate::Outlier,
        Fate::NoMatch,
        Fate::OutOfView,
        Fate::NoStereoAfter,
        Fate::NoStereo,
        Fate::OutOfRange,
    ];
    let corner = |(k, fate): (usize, Fate)| {
        let x = 10.0 + 6.0 * k as f64;
        let is_matched = matches!(fate, Fate::Inlier | Fate::Outlier);
        OdometryCorner {
            before_px: [x, 20.0],
            after_px: is_matched.then_some([x, 40.0]),
            range_m: (fate != Fate::NoStereo).then_some(4.25),
            residual_sigmas: is_matched.then_some(1.5),
            fate,
        }
    };
    fates.into_iter().enumerate().map(corner).collect()
}

/// A commanded drive with odometry at its stops, at [`STEP`].
fn driven(context: &egui::Context, accepted: bool) -> State {
    let mut state = fixture::at_step(context, STEP);
    let steering = json!({ "target": 0, "run": 0 });
    if let Some(session) = &mut state.session {
        session.steering = Some(serde_json::from_value::<Steering>(steering.clone()).unwrap());
    }
    let stops = &mut state.traverse.as_mut().unwrap().stops;
    for step in 1..=STEP {
        let before = stops[step - 1].site_from_rover.to_pose();
        let slip = 0.1 * step as f64;
        stops[step].odometry = Some(measured(&before, slip, 2.0, accepted || step < STEP));
    }
    let cycles: Vec<_> = (0..=STEP).map(fixture::cycle).collect();
    let view = json!({ "steering": steering, "cycles": cycles, "summary": null, "is_driving": false });
    state.driving.view = Some(("s1".to_owned(), serde_json::from_value(view).unwrap()));
    state
}

/// The same with its corners and both images loaded.
fn loaded(context: &egui::Context, accepted: bool) -> State {
    let mut state = driven(context, accepted);
    let image = GrayImage::from_pixel(64, 64, image::Luma([0.4]));
    let bytes = io::encode_png_u8(&image).unwrap();
    for step in [STEP - 1, STEP] {
        let raster = Raster::from_png(context, &format!("left {step}"), &bytes).unwrap();
        let key = state.image_key(step, ImageSide::Left).unwrap();
        state.cache.store(key, Ok(Item::Raster(Arc::new(raster))), 0.0);
    }
    let measured = state.measured_motion(STEP).unwrap().clone();
    let settings = measured.preset.settings();
    let odometry = StopOdometry { settings, measured, corners: table() };
    let key = Key::Odometry { traverse: "drive".to_owned(), step: STEP };
    state.cache.store(key, Ok(Item::Odometry(Arc::new(odometry))), 0.0);
    state
}

fn panel(state: impl FnOnce(&egui::Context) -> State + 'static) -> Shown<'static> {
    Shown::new([760.0, 900.0], state, |ui, state, out| {
        super::show_pane(ui, Pane::Odometry, state, out);
    })
}

#[test]
fn the_panel_says_by_how_much_wheels_and_vision_disagree() {
    let shown = panel(|context| loaded(context, true));
    shown.says("ACCEPTED").says("The pose of step 3 is by vision.");
    shown.says(
        "The translations by wheels and by vision differ by 15.00 cm: slip 30.0 % ± 0.6 % along the motion, 2.0 % to the left.",
    );
    // Axes in centimetres and degrees: vision, wheels, difference, 1σ.
    shown.says("+35.00").says("+50.00").says("-15.00").says("0.30").says("+2.000");
    shown.says("σ of the translation").says("≤ 0.015 m").says("0.003").says("≥ 25");
    shown.says("slip over the steps: 10.0 to 30.0 % along the motion at 3 steps");
}

#[test]
fn a_refused_update_is_told_with_its_gate() {
    let shown = panel(|context| loaded(context, false));
    shown
        .says("NO UPDATE")
        .says("odometry_sigma_m is 0.021 m, more than 0.015 m; the pose of step 3 is that of wheels");
    shown.says("FAIL").says("at 2 steps");
}

#[test]
fn the_legend_counts_corners_by_fate_and_hides_them() {
    let mut shown = panel(|context| loaded(context, true));
    shown.says("inliers 2").says("outliers 1").says("out of view 1").says("no stereo before 1");
    assert_eq!(shown.click("outliers 1 (legend)"), vec![Command::ToggleLayer(Layer::Corners(Fate::Outlier))]);
    let dots = |shown: &Shown<'_>| {
        let shapes = &shown.harness.output().shapes;
        let is_dot = |shape: &Shape| matches!(shape, Shape::Circle(c) if c.fill == theme::inlier());
        shapes.iter().filter(|clipped| is_dot(&clipped.shape)).count()
    };
    let hidden = panel(|context| {
        let mut state = loaded(context, true);
        state.perform(Command::ToggleLayer(Layer::Corners(Fate::Inlier)));
        state
    });
    // Two on each image and one in the legend.
    assert_eq!(dots(&shown), 5);
    assert_eq!(dots(&hidden), 0, "the legend shows that they are hidden");
}

#[test]
fn a_corner_is_read_with_range_residual_and_fate() {
    let corners = table();
    let words = corners::words(&corners[0]);
    assert_eq!(
        words,
        "before at 10.0, 20.0\nmatched at 10.0, 40.0\nrange before 4.25 m\nresidual 1.50 σ\ninlier of the transform"
    );
    assert_eq!(
        corners::words(&corners[6]),
        "before at 46.0, 20.0\nlost: no stereo match at the previous stop"
    );
}

#[test]
fn corners_are_a_layer_of_the_left_image() {
    let left = |is_on: bool| {
        Shown::new(
            [700.0, 700.0],
            move |context| {
                let mut state = loaded(context, true);
                if is_on {
                    state.perform(Command::ToggleLayer(Layer::Odometry));
                }
                state
            },
            |ui, state, out| {
                super::show_pane(ui, Pane::Left, state, out);
            },
        )
    };
    let crosses = |shown: &Shown<'_>| {
        let shapes = &shown.harness.output().shapes;
        let is_line = |shape: &Shape| match shape {
            Shape::LineSegment { stroke, .. } => stroke.color == theme::outlier(),
            _ => false,
        };
        shapes.iter().filter(|clipped| is_line(&clipped.shape)).count()
    };
    let (mut off, mut on) = (left(false), left(true));
    off.click("legend");
    on.click("legend");
    off.says("odometry from step 2, 2 inliers (legend)");
    assert!(crosses(&on) > crosses(&off), "{} and {}", crosses(&on), crosses(&off));
}

#[test]
fn a_stop_without_odometry_says_why() {
    let without = |step: usize, mode: &'static str| {
        panel(move |context| {
            let mut state = driven(context, true);
            state.cursor.step = step;
            state.traverse.as_mut().unwrap().stops[STEP].odometry = None;
            let (_, view) = state.driving.view.as_mut().unwrap();
            view.steering.as_mut().unwrap().command.odometry = serde_json::from_value(json!(mode)).unwrap();
            state
        })
    };
    without(0, "full").says("no motion led there");
    without(STEP, "off").says("Visual odometry is off").says("Switch it on in the panel Drive");
    without(STEP, "full").says("Step 3 has no odometry");
    panel(|context| fixture::at_step(context, STEP)).says("recorded without visual odometry");
    panel(|_| fixture::nothing()).says("Asking the server");
}

#[test]
fn corners_are_read_only_where_they_are_shown() {
    let context = egui::Context::default();
    let is_wanted = |state: &mut State| {
        let key = Key::Odometry { traverse: "drive".to_owned(), step: STEP };
        state.needed_items().contains(&key)
    };
    let mut state = driven(&context, true);
    assert!(!is_wanted(&mut state));
    state.fetch_for_panels(&[Need::Odometry]);
    assert!(is_wanted(&mut state));
    let before = state.image_key(STEP - 1, ImageSide::Left).unwrap();
    assert!(state.needed_items().contains(&before));
    state.fetch_for_panels(&[]);
    state.perform(Command::ToggleLayer(Layer::Odometry));
    assert!(is_wanted(&mut state));
    let key = Key::Odometry { traverse: "t1".to_owned(), step: 4 };
    assert_eq!(crate::net::items::call(&key).path, "traverses/t1/steps/4/odometry");
    assert!(!Request::Item(key).is_invisible());
}

#[test]
fn odometry_is_the_first_stage_of_a_drive_and_its_record_is_inspected() {
    let recorded = |context: &egui::Context, accepted: bool| {
        let mut state = driven(context, accepted);
        let mut trace = fixture::trace(STEP);
        trace.odometry = state.measured_motion(STEP).cloned().map(Box::new);
        state.cache.forget(|key| matches!(key, Key::Trace(_)));
        fixture::load(&mut state, trace);
        state.perform(Command::SelectStage(Stage::VISUAL_ODOMETRY));
        state
    };
    let bar = |make: fn(&egui::Context) -> State| Shown::new([1200.0, 60.0], make, bars::stages);
    let mut shown = Shown::new([1200.0, 60.0], move |context| recorded(context, true), bars::stages);
    assert_eq!(shown.click("visual_odometry"), vec![Command::SelectStage(Stage::VISUAL_ODOMETRY)]);
    bar(|context| fixture::at_step(context, STEP)).hides("visual_odometry").says("predict");

    let inspector = |make: Box<dyn FnOnce(&egui::Context) -> State>| {
        Shown::new([500.0, 700.0], make, |ui, state, out| {
            super::show_pane(ui, Pane::Inspector, state, out);
        })
    };
    let shown = inspector(Box::new(move |context| recorded(context, true)));
    shown.says("How did the rover move since the stop before").says("wheels apart").says("slip aside");
    let without = inspector(Box::new(|context| {
        let mut state = driven(context, true);
        state.traverse.as_mut().unwrap().stops[STEP].odometry = None;
        state.perform(Command::SelectStage(Stage::VISUAL_ODOMETRY));
        state
    }));
    without.says("Step 3 has no odometry");
}
