//! A fixed drive of six stops with one target: tracked, then lost, then failed, and one step not computed.

mod record;

pub(crate) use record::trace;

use serde_json::json;
use sightline_api::wire::{StopView, TraverseEntry, TraverseView};
use sightline_geometry::frames::{Pixel, Pose, PoseRecord};
use sightline_geometry::stereo_geometry::StereoGeometry;
use sightline_session::Cursor;
use sightline_session::step::RunStep;
use sightline_session::summary::summarise;
use sightline_session::view::{RunView, SessionView, TargetView};
use sightline_track::locate::template::history::AgainstEarlier;
use sightline_track::settings::{Changes, Settings};
use sightline_track::target::Designation;
use sightline_track::trace::ArrayName;
use sightline_vision::image::{GrayImage, npy};
use std::sync::Arc;

use crate::cache::{ImageSide, Item, Key, StepKey};
use crate::drawing::raster::Raster;
use crate::net::events::Connection;
use crate::state::State;
use crate::tables::Table;

/// Number of stops of the drive.
pub(crate) const STOPS: usize = 6;
/// The target's pixel at every stop.
pub(crate) const PIXEL: Pixel = Pixel::new(512.3, 480.6);
const POSITION: [f64; 3] = [6.0, 0.4, 0.2];

/// A state before any reply of the server.
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
        steering: None,
    });
    state
}

/// A session with one target and its run, at `step`, with all data of that step loaded.
pub(crate) fn at_step(context: &egui::Context, step: usize) -> State {
    let mut state = without_target();
    let traces: Vec<RunStep> = (0..STOPS - 1).map(trace).collect();
    let run = RunView {
        number: 0,
        fork: None,
        changes: Changes::new(),
        settings: Settings::default(),
        without_effect: Default::default(),
        rows: traces.iter().map(RunStep::row).collect(),
        complete: false,
        stopped: None,
        waits_for: None,
        summary: summarise(&traces),
    };
    let designation = Designation::new(0, PIXEL);
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
    state.cache.store(Key::Arrays(key), Ok(Item::Arrays(arrays)), 0.0);
    for side in [ImageSide::Left, ImageSide::Right] {
        let bytes = sightline_vision::image::io::encode_png_u8(&bump(64)).unwrap();
        let raster = Raster::from_png(context, side.word(), &bytes).unwrap();
        let key = state.image_key(step, side).unwrap();
        state.cache.store(key, Ok(Item::Raster(Arc::new(raster))), 0.0);
    }
    state
}

/// As [`at_step`], with the records and windows of all steps loaded; every step has the same image at the same range.
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
        state.cache.store(Key::EarlierTemplates(key.clone()), Ok(item), 0.0);
        for name in [ArrayName::REFERENCE, ArrayName::MATCHED] {
            let raster = Raster::from_npy(context, name, &npy::encode(&bump(21)).unwrap()).unwrap();
            state.cache.store(Key::Array(key.clone(), name), Ok(Item::Raster(Arc::new(raster))), 0.0);
        }
    }
    state
}

/// The decision at a stop of a commanded drive, as sent by the server.
pub(crate) fn cycle(step: usize) -> serde_json::Value {
    let exact = [[0.0; 3]; 3];
    let place = json!({ "position_m": [0.0, 0.0], "heading_rad": 0.0, "covariance": exact });
    json!({ "step": step, "estimated": place, "by_wheels": place, "flight_minutes": 1.0,
        "flight": { "point_mast_s": 5.0, "capture_s": 7.5, "locate_s": 5.0, "drive_s": 0.0 },
        "ending": null, "report": null, "arrival_actions": 0,
        "goal": { "in_site_m": [4.0, 0.5], "in_rover_m": [3.25, 0.5], "distance_m": 3.0, "arrived": false },
        "motion": { "kind": "arc", "length_m": 0.5, "curvature_per_m": 0.0625 } })
}

/// Loads the record of a step of the first run.
pub(crate) fn load(state: &mut State, trace: RunStep) {
    let key = StepKey { session: "s1".to_owned(), target: 0, run: 0, step: trace.step };
    state.cache.store(Key::Trace(key), Ok(Item::Trace(Arc::new(trace))), 0.0);
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
        odometry: None,
        left_size: [1024, 1024],
        right_size: [1024, 1024],
        ready: step + 1 < STOPS,
        cameras: Vec::new(),
    };
    TraverseView {
        id: "drive".to_owned(),
        name: "Six stops".to_owned(),
        description: "A fixed drive.".to_owned(),
        simulated: true,
        source: "/drives/six-stops".to_owned(),
        stereo: StereoGeometry::Lateral,
        warnings: Vec::new(),
        odometry_error: sightline_geometry::odometry_error::OdometryError::default(),
        stops: (0..STOPS).map(stop).collect(),
    }
}
