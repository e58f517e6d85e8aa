//! A fixed drive of six stops with one target: tracked, then lost, then failed, and one step not computed.

use std::sync::Arc;

use nalgebra::{Matrix2, Matrix3, Vector2};
use sightline_api::wire::{StopView, TraverseEntry, TraverseView};
use sightline_geometry::camera::{Camera, Mast};
use sightline_geometry::estimate::drift::Drift;
use sightline_geometry::frames::{Pixel, Point3, Pose, PoseRecord};
use sightline_geometry::stereo_geometry::StereoGeometry;
use sightline_session::Cursor;
use sightline_session::step::RunStep;
use sightline_session::summary::summarise;
use sightline_session::view::{RunView, SessionView, TargetView};
use sightline_track::locate::template::TemplateEvidence;
use sightline_track::locate::template::history::AgainstEarlier;
use sightline_track::locate::template::match_template::TemplateMatch;
use sightline_track::locate::template::memory::{Appearance, TemplateMemory};
use sightline_track::locate::template::point_stereo::{CurvePoint, PointStereo};
use sightline_track::locate::template::scale_roll::ScaleRoll;
use sightline_track::locate::template::settings::Measure;
use sightline_track::locate::template::triangulate::Triangulation;
use sightline_track::locate::{Evidence, Located, TrackerMemory, gate_kinds};
use sightline_track::settings::{Changes, Settings};
use sightline_track::stages::capture::Capture;
use sightline_track::stages::judge::Verdict;
use sightline_track::stages::point_mast::Pointing;
use sightline_track::stages::predict::Prediction;
use sightline_track::stages::update::Updated;
use sightline_track::target::{Designation, Target, TrackingState};
use sightline_track::trace::{ArrayName, StepKind, StepTrace};
use sightline_vision::correlate::peak::{Peak, SecondPeak};
use sightline_vision::image::{GrayImage, PixelRect, npy};
use sightline_world::target_truth::{StepTruth, TruthKind};

use crate::cache::{Eye, Item, Key, StepKey};
use crate::drawing::raster::Raster;
use crate::net::events::Connection;
use crate::state::State;
use crate::tables::Table;

/// How many stops the drive has.
pub(crate) const STOPS: usize = 6;
/// Where the target is seen at every stop, px.
pub(crate) const PIXEL: Pixel = Pixel::new(512.3, 480.6);
const POSITION: [f64; 3] = [6.0, 0.4, 0.2];

/// A server that said nothing yet.
pub(crate) fn nothing() -> State {
    State::new("http://localhost".to_owned(), None)
}

/// The drive in the server's list.
pub(crate) fn entry() -> TraverseEntry {
    TraverseEntry {
        id: "drive".to_owned(),
        name: "Six stops".to_owned(),
        description: "A fixed drive.".to_owned(),
        simulated: true,
        stop_count: STOPS,
        removable: false,
    }
}

/// An open traverse and session without targets.
pub(crate) fn without_target() -> State {
    let mut state = nothing();
    state.connection = Connection::Live;
    state.traverses = Some(vec![entry()]);
    state.traverse = Some(traverse());
    state.settings = Settings::table();
    state.session = Some(SessionView {
        id: "s1".to_owned(),
        traverse: "drive".to_owned(),
        stop_count: STOPS,
        cursor: Cursor::default(),
        targets: Vec::new(),
        breakpoints: Vec::new(),
    });
    state
}

/// A session with one target and its run, at `step`, with everything of that step loaded.
pub(crate) fn at_step(context: &egui::Context, step: usize) -> State {
    let mut state = without_target();
    let traces: Vec<RunStep> = (0..STOPS - 1).map(trace).collect();
    let run = RunView {
        number: 0,
        fork: None,
        changes: Changes::new(),
        settings: Settings::default(),
        rows: traces.iter().map(RunStep::row).collect(),
        complete: false,
        stopped: None,
        waits_for: None,
        summary: summarise(&traces),
    };
    let designation = Designation { step: 0, pixel: PIXEL };
    let target = TargetView { number: 0, label: "ridge".to_owned(), designation, runs: vec![run] };
    if let Some(session) = &mut state.session {
        session.targets.push(target);
    }
    state.cursor = Cursor { target: Some(0), run: 0, step };
    let key = StepKey { session: "s1".to_owned(), target: 0, run: 0, step };
    traces.get(step).cloned().into_iter().for_each(|trace| load(&mut state, trace));
    let array = |name: ArrayName| {
        let side = if name == ArrayName::SURFACE { 31 } else { 21 };
        let raster = Raster::from_npy(context, name, &npy::encode(&bump(side)).unwrap()).unwrap();
        (name, Item::Raster(Arc::new(raster)))
    };
    let arrays = ArrayName::all().filter(|name| !Table::is_table(*name)).map(array).collect();
    state.cache.arrived(Key::Arrays(key), Ok(Item::Arrays(arrays)), 0.0);
    for eye in [Eye::Left, Eye::Right] {
        let bytes = sightline_vision::image::io::encode_png_u8(&bump(64)).unwrap();
        let raster = Raster::from_png(context, eye.word(), &bytes).unwrap();
        let key = state.image_key(step, eye).unwrap();
        state.cache.arrived(key, Ok(Item::Raster(Arc::new(raster))), 0.0);
    }
    state
}

/// As [`at_step`], with the records and windows of all steps loaded; every step saw the same from the same distance.
pub(crate) fn with_history(context: &egui::Context, step: usize) -> State {
    let mut state = at_step(context, step);
    for other in 0..STOPS - 1 {
        let key = StepKey { session: "s1".to_owned(), target: 0, run: 0, step: other };
        load(&mut state, trace(other));
        let earlier = (0..other).map(|template_step| AgainstEarlier {
            template_step,
            scale: 1.1,
            roll_rad: 0.0,
            score: 0.96,
            offset_px: [0.3, 0.4],
        });
        let item = Item::EarlierTemplates(earlier.collect());
        state.cache.arrived(Key::EarlierTemplates(key.clone()), Ok(item), 0.0);
        for name in [ArrayName::REFERENCE, ArrayName::MATCHED] {
            let raster = Raster::from_npy(context, name, &npy::encode(&bump(21)).unwrap()).unwrap();
            state.cache.arrived(Key::Array(key.clone(), name), Ok(Item::Raster(Arc::new(raster))), 0.0);
        }
    }
    state
}

/// Loads the record of a step of the first run.
pub(crate) fn load(state: &mut State, trace: RunStep) {
    let key = StepKey { session: "s1".to_owned(), target: 0, run: 0, step: trace.step };
    state.cache.arrived(Key::Trace(key), Ok(Item::Trace(Arc::new(trace))), 0.0);
}

/// A smooth hill with a hole.
fn bump(side: u32) -> GrayImage {
    GrayImage::from_fn(side, side, |x, y| {
        let d = (f64::from(x) - f64::from(side) / 2.0).hypot(f64::from(y) - f64::from(side) / 2.0);
        image::Luma([if x + y == 0 { f32::NAN } else { (1.0 - d / f64::from(side)) as f32 }])
    })
}

fn pose(step: usize) -> Pose {
    Pose::translation(step as f64, 0.1 * step as f64, 0.0)
}

fn traverse() -> TraverseView {
    let stop = |step: usize| StopView {
        time_s: 60.0 * step as f64,
        site_from_rover: PoseRecord::from(&pose(step)),
        true_site_from_rover: Some(PoseRecord::from(&pose(step))),
        left_size: [1024, 1024],
        right_size: [1024, 1024],
        ready: step + 1 < STOPS,
    };
    TraverseView {
        id: "drive".to_owned(),
        name: "Six stops".to_owned(),
        description: "A fixed drive.".to_owned(),
        simulated: true,
        source: "/drives/six-stops".to_owned(),
        stereo: StereoGeometry::Lateral,
        warnings: Vec::new(),
        stops: (0..STOPS).map(stop).collect(),
    }
}

/// The record of a step: the designation, two good ones, one lost, one failed.
pub(crate) fn trace(step: usize) -> RunStep {
    let state = match step {
        0..3 => TrackingState::Tracking,
        3 => TrackingState::Lost { count: 1 },
        _ => TrackingState::Failed,
    };
    let is_good = state == TrackingState::Tracking;
    let is_designation = step == 0;
    let mast = Mast::spirit();
    let (left, right) = (mast.left_in_head, mast.right_in_head);
    let covariance = Matrix3::from_diagonal(&nalgebra::Vector3::new(4e-4, 1e-4, 1e-4));
    let prediction = Prediction {
        position_in_rover: Point3::from(POSITION),
        position_in_site: pose(step) * Point3::from(POSITION),
        covariance_in_rover: covariance * 4.0,
        step_length_m: 1.0,
        travelled_since_update_m: 1.0,
        travelled_m: step as f64,
    };
    let capture = Capture {
        left_size: [1024, 1024],
        right_size: [1024, 1024],
        subframe: Some(PixelRect::centred(PIXEL, 161)),
        subframe_mean: Some(0.4),
        subframe_saturated: Some(0.0),
        pair: Default::default(),
    };
    let locate = located(is_designation, is_good, covariance);
    let kind = match is_designation {
        true => StepKind::Designation { capture, locate },
        false => {
            let judge = verdict(is_good, state);
            StepKind::Tracked { predict: prediction, capture, locate, judge }
        }
    };
    let trace = StepTrace {
        step,
        time_s: 60.0 * step as f64,
        point_mast: Pointing {
            wanted: None,
            used: None,
            left: left.clone(),
            right,
            predicted_left: Some(PIXEL.offset(3.0, -2.0)),
            predicted_right: Some(PIXEL.offset(-60.0, -2.0)),
            predicted_covariance_px2: Some(Matrix2::new(60.0, 10.0, 10.0, 30.0)),
        },
        kind,
        update: updated(step, state, is_good, covariance, left),
    };
    let truth = StepTruth {
        kind: TruthKind::Surface,
        position_in_rover: Point3::from(POSITION),
        left_pixel: Some(PIXEL.offset(0.4, 0.3)),
        err_m: 0.02,
        err_px: Some(if is_good { 0.5 } else { 40.0 }),
        nees: Some(2.1),
        magnification: 1.0 + 0.1 * step as f64,
        tolerance_px: 5.0,
        tracked: Some(is_good),
    };
    RunStep { trace, truth: Some(truth) }
}

fn located(is_designation: bool, is_good: bool, covariance: Matrix3<f64>) -> Located {
    let score = if is_good { 0.83 } else { 0.41 };
    let mut evidence = TemplateEvidence { point_stereo: Some(point_stereo()), ..TemplateEvidence::default() };
    evidence.triangulate = Some(Triangulation {
        position_in_rover: Point3::from(POSITION),
        covariance_in_rover: covariance,
        surface_by_pixel: None,
        range_m: 6.0,
        gap_m: 0.001,
        gap_px: 0.2,
    });
    if !is_designation {
        evidence.scale_roll = Some(ScaleRoll {
            scale: 1.13,
            roll_rad: 0.02,
            applied_scale: 1.13,
            applied_roll_rad: 0.02,
            old_distance_m: 6.8,
            new_distance_m: 6.0,
            template_step: 1,
            warped: false,
            image_from_template: Matrix2::identity() * 1.13,
            reference: Default::default(),
            scaled: Default::default(),
            rolled: Default::default(),
        });
        evidence.match_template = Some(template_match(score));
    }
    Located {
        left_pixel: Some(PIXEL),
        right_pixel: Some(PIXEL.offset(-58.0, 0.5)),
        left_error: Drift {
            covariance_px2: Matrix2::new(0.2, 0.05, 0.05, 0.1),
            bias_px: Vector2::new(0.05, 0.0),
            with_last_match_px: Matrix2::zeros(),
        },
        surface_by_pixel: None,
        position_in_rover: Some(Point3::from(POSITION)),
        covariance_in_rover: Some(covariance),
        confidence: score,
        missing: None,
        evidence: Evidence::Template(Box::new(evidence)),
    }
}

fn template_match(score: f64) -> TemplateMatch {
    TemplateMatch {
        search_window: PixelRect::centred(PIXEL, 51),
        positions: 961,
        comparisons: 961,
        flat_positions: 0,
        measure: Measure::Ncc,
        peak: Peak {
            pixel: PIXEL,
            score,
            integer: [512, 481],
            integer_score: score - 0.01,
            covariance_px2: Matrix2::identity() * 0.02,
            at_edge: false,
        },
        pixel: PIXEL,
        score,
        focused_score: Some(score),
        second_peak: Some(SecondPeak {
            pixel: PIXEL.offset(12.0, 9.0),
            score: 0.4,
            ratio: 0.48,
            distance_px: 15.0,
        }),
        coarse: None,
        descent: None,
        affine: None,
        tried: Vec::new(),
        weighed: Vec::new(),
        covariance_px2: Matrix2::identity() * 0.04,
        bias_px: Vector2::zeros(),
        edge_distance_px: Some(15.0),
        surface: Default::default(),
        matched: Default::default(),
        difference: Default::default(),
    }
}

fn point_stereo() -> PointStereo {
    let point = |i: i32| CurvePoint {
        pixel: PIXEL.offset(-20.0 - f64::from(i), 0.5),
        range_m: 20.0 / f64::from(i + 1),
        score: Some(0.5),
    };
    PointStereo {
        curve: (0..80).map(point).collect(),
        right_pixel: PIXEL.offset(-58.0, 0.5),
        score: 0.91,
        range_m: 6.0,
        disparity_px: Some(61.0),
        left_right_px: Some(0.1),
        across_px: 0.1,
        at_end: false,
        covariance_px2: Matrix2::identity() * 0.05,
        right_from_left: Matrix2::identity(),
        right_window: Default::default(),
    }
}

fn verdict(is_good: bool, state: TrackingState) -> Verdict {
    let gate = |name: &str, value: f64, limit: f64| {
        let kind = gate_kinds().into_iter().find(|kind| kind.name == name).unwrap();
        kind.judge(Some(value), limit)
    };
    let ncc = if is_good { 0.83 } else { 0.41 };
    Verdict {
        gates: vec![
            gate("ncc", ncc, 0.7),
            gate("stereo_ncc", 0.91, 0.7),
            gate("distance_correction_m", 0.03, 0.12),
            gate("position_correction_m", 0.05, 0.2),
        ],
        good: is_good,
        accepted: is_good,
        reason: (!is_good).then(|| "ncc 0.410 is below its limit 0.700".to_owned()),
        state_before: TrackingState::Tracking,
        state,
    }
}

fn updated(
    step: usize,
    state: TrackingState,
    renewed: bool,
    covariance: Matrix3<f64>,
    camera: Camera,
) -> Updated {
    Updated {
        target: Target {
            designation: Designation { step: 0, pixel: PIXEL },
            step,
            position_in_rover: Point3::from(POSITION),
            covariance_in_rover: covariance,
            initial_position_in_site: Point3::from(POSITION),
            initial_distance_m: 6.0,
            travelled_m: step as f64,
            last_distance_m: 6.0,
            travelled_since_update_m: 0.0,
            memory: TrackerMemory::Template(Box::new(TemplateMemory {
                appearance: Appearance {
                    step,
                    pixel: PIXEL,
                    position_in_rover: Point3::from(POSITION),
                    camera,
                    surface_by_pixel: None,
                    relief: None,
                    site_from_rover: Default::default(),
                    image: Arc::default(),
                },
                drift: Drift::default(),
                replaced: Default::default(),
            })),
        },
        state,
        template_renewed: renewed,
        correction_m: Some(0.03),
        correction_px: Some(3.6),
    }
}
