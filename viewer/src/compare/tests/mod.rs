//! Comparing runs: choosers and keys, each view of the left image, the differences in every readout, and the table.

mod panels;
mod state;

use std::sync::Arc;

use egui::{Context, Key as Keyboard, Modifiers};
use egui_kittest::kittest::Queryable;
use sightline_api::endpoints::{CompareRuns, ShowMetrics};
use sightline_api::wire::Problem;
use sightline_geometry::frames::Pixel;
use sightline_session::compare::{Alignment, Compared, NewComparison, RunName, compare};
use sightline_session::metrics::metrics;
use sightline_session::step::RunStep;
use sightline_session::summary::summarise;
use sightline_session::view::RunView;
use sightline_track::locate::Evidence;
use sightline_track::settings::Settings;
use sightline_track::target::TrackingState;
use sightline_track::trace::{ArrayName, StepKind};
use sightline_vision::image::{GrayImage, npy};

use crate::cache::{Item, Key, StepKey};
use crate::command::{Command, Go, Layer, Mode, Stage};
use crate::compare::{CompareCommand, Sort, View};
use crate::drawing::raster::Raster;
use crate::drawing::view2d::View2d;
use crate::layout::show_pane;
use crate::panels::pane::Pane;
use crate::panels::{bars, images_left, runs};
use crate::state::State;
use crate::tests::Shown;
use crate::tests::calls::{self, bodies, calls, calls_of};
use crate::tests::fixture;
use crate::tests::fixture::STOPS;

const A: RunName = RunName { target: 0, run: 0 };
const B: RunName = RunName { target: 0, run: 1 };

/// Pixel at which run B locates the target from step 3 on.
const PIXEL_B: Pixel = Pixel::new(fixture::PIXEL.x + 8.0, fixture::PIXEL.y);

/// The records of run A.
fn traces_a() -> Vec<RunStep> {
    (0..STOPS - 1).map(fixture::trace).collect()
}

/// The records of run B, whose gates are looser from step 3 on, so that it keeps tracking, slightly off the target.
fn traces_b() -> Vec<RunStep> {
    let mut traces = traces_a();
    for trace in traces.iter_mut().skip(3) {
        trace.update.state = TrackingState::Tracking;
        if let StepKind::Tracked { judge: verdict, .. } = &mut trace.kind {
            (verdict.good, verdict.accepted, verdict.reason, verdict.state) =
                (true, true, None, TrackingState::Tracking);
            (verdict.gates[0].limit, verdict.gates[0].passed) = (0.3, true);
            verdict.gates[0].margin = verdict.gates[0].value.map(|value| value - 0.3);
        }
        if let Some(located) = trace.located_mut() {
            located.left_pixel = Some(PIXEL_B);
            if let Evidence::Template(evidence) = &mut located.evidence
                && let Some(matched) = &mut evidence.match_template
            {
                matched.pixel = PIXEL_B;
            }
        }
        if let Some(truth) = &mut trace.truth {
            (truth.err_px, truth.tracked) = (Some(1.5 + trace.trace.step as f64), Some(false));
        }
    }
    traces
}

fn settings_b() -> Settings {
    Settings::default().with(&[("ncc_min".to_owned(), serde_json::json!(0.3))].into()).unwrap()
}

/// The drive at `step` with both runs loaded there.
fn two_runs(context: &Context, step: usize) -> State {
    let mut state = fixture::at_step(context, step);
    let traces = traces_b();
    let settings = settings_b();
    let run = RunView {
        number: 1,
        fork: None,
        changes: settings.changes(),
        settings,
        without_effect: Default::default(),
        rows: traces.iter().map(RunStep::row).collect(),
        complete: false,
        stopped: None,
        waits_for: None,
        summary: summarise(&traces),
    };
    state.session.as_mut().unwrap().targets[0].runs.push(run);
    for trace in traces {
        let key = StepKey { session: "s1".to_owned(), target: 0, run: 1, step: trace.step };
        state.cache.store(Key::Trace(key), Ok(Item::Trace(Arc::new(trace))), 0.0);
    }
    let key = StepKey { session: "s1".to_owned(), target: 0, run: 1, step };
    for (name, side) in [(ArrayName::MATCHED, 21), (ArrayName::ROLLED, 31), (ArrayName::SURFACE, 31)] {
        let wave = |x: u32, y: u32| image::Luma([((x * 7 + y * 3) % 11) as f32 / 11.0]);
        let image = GrayImage::from_fn(side, side, wave);
        let raster = Raster::from_npy(context, name, &npy::encode(&image).unwrap()).unwrap();
        state.cache.store(Key::Array(key.clone(), name), Ok(Item::Raster(Arc::new(raster))), 0.0);
    }
    state
}

/// As [`two_runs`], compared, with the server's comparison.
fn compared(context: &Context, step: usize) -> State {
    let mut state = two_runs(context, step);
    state.compare.wants_metrics = true;
    state.perform(Command::Compare(CompareCommand::With { place: 0, run: Some(B) }));
    answer(&mut state);
    state
}

fn steps(name: RunName) -> Vec<Arc<RunStep>> {
    let traces = if name == A { traces_a() } else { traces_b() };
    traces.into_iter().map(Arc::new).collect()
}

/// Answers the page's requests as the server would; returns the number of comparisons requested.
fn answer(state: &mut State) -> usize {
    let mut comparisons = 0;
    for _ in 0..6 {
        for call in calls(state) {
            if call.is_to::<CompareRuns>() {
                comparisons += 1;
                let new: NewComparison = serde_json::from_slice(&call.body.unwrap()).unwrap();
                let run = |&name: &RunName| {
                    let settings = if name == A { Settings::default() } else { settings_b() };
                    Compared { name, settings: Arc::new(settings), steps: steps(name) }
                };
                let runs: Vec<Compared> = new.runs.iter().map(run).collect();
                calls::answer::<CompareRuns>(state, &compare(&runs, &new).unwrap());
            } else if call.is_to::<ShowMetrics>() {
                let name = if call.path.contains("/runs/0/") { A } else { B };
                calls::answer::<ShowMetrics>(state, &metrics(&steps(name)));
            }
        }
    }
    comparisons
}

/// A panel of the compared runs at step 3 in one view.
fn panel(pane: Pane, view: View) -> Shown<'static> {
    Shown::new(
        [760.0, 480.0],
        move |context| {
            let mut state = compared(context, 3);
            state.compare.view = view;
            state
        },
        move |ui, state, out| {
            show_pane(ui, pane, state, out);
        },
    )
}

/// Whether exactly these words were painted.
fn paints(shown: &Shown<'_>, words: &str) -> bool {
    fn has(shape: &egui::Shape, words: &str) -> bool {
        match shape {
            egui::Shape::Text(text) => text.galley.text() == words,
            egui::Shape::Vec(shapes) => shapes.iter().any(|shape| has(shape, words)),
            _ => false,
        }
    }
    shown.harness.output().shapes.iter().any(|clipped| has(&clipped.shape, words))
}

/// Answers with a comparison in which run B drove twice as far between its stops.
fn twice_as_far(state: &mut State) {
    let [new] = bodies::<CompareRuns>(state).try_into().unwrap();
    let mut faster = traces_b();
    faster.iter_mut().for_each(|trace| trace.update.target.travelled_m *= 2.0);
    let runs = [
        Compared { name: A, settings: Arc::default(), steps: steps(A) },
        Compared { name: B, settings: Arc::default(), steps: faster.into_iter().map(Arc::new).collect() },
    ];
    calls::answer::<CompareRuns>(state, &compare(&runs, &new).unwrap());
}
