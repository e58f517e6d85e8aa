//! Comparing runs: choosers and keys, each way of the left image, the differences in every readout, and the table.

use std::collections::BTreeMap;
use std::sync::Arc;

use egui::{Context, Key as Keyboard, Modifiers};
use egui_kittest::kittest::Queryable;
use sightline_core::frames::Pixel;
use sightline_core::image::{GrayImage, npy};
use sightline_core::locate::Evidence;
use sightline_core::session::compare::{Alignment, Compared, NewComparison, RunName, compare};
use sightline_core::session::metrics::metrics;
use sightline_core::session::view::RunView;
use sightline_core::session::wire::Problem;
use sightline_core::settings::Settings;
use sightline_core::target::TrackingState;
use sightline_core::trace::{ArrayName, StepTrace, summarise};

use super::Shown;
use super::fixture::{self, STOPS};
use crate::cache::{Item, Key, StepKey};
use crate::command::{Command, Go, Layer, Mode, Stage};
use crate::compare::{Ask, Sort, View};
use crate::layout::{Pane, show_pane};
use crate::net::{Arrived, Reply, Request};
use crate::panels::{bars, images_left, runs};
use crate::raster::Raster;
use crate::state::State;
use crate::view2d::View2d;

const A: RunName = RunName { target: 0, run: 0 };
const B: RunName = RunName { target: 0, run: 1 };

/// Where run B sees the target from step 3 on, px.
const PIXEL_B: Pixel = Pixel::new(fixture::PIXEL.x + 8.0, fixture::PIXEL.y);

/// The records of run A.
fn traces_a() -> Vec<StepTrace> {
    (0..STOPS - 1).map(fixture::trace).collect()
}

/// The records of run B, which asks for less from step 3 on and goes on tracking, a little beside.
fn traces_b() -> Vec<StepTrace> {
    let mut traces = traces_a();
    for trace in traces.iter_mut().skip(3) {
        trace.update.state = TrackingState::Tracking;
        if let Some(verdict) = &mut trace.judge {
            (verdict.good, verdict.accepted, verdict.reason, verdict.state) =
                (true, true, None, TrackingState::Tracking);
            (verdict.gates[0].limit, verdict.gates[0].passed) = (0.3, true);
            verdict.gates[0].margin = verdict.gates[0].value.map(|value| value - 0.3);
        }
        if let Some(located) = &mut trace.locate {
            located.left_pixel = Some(PIXEL_B);
            if let Evidence::Template(evidence) = &mut located.evidence
                && let Some(matched) = &mut evidence.match_template
            {
                matched.pixel = PIXEL_B;
            }
        }
        if let Some(truth) = &mut trace.truth {
            (truth.err_px, truth.tracked) = (Some(1.5 + trace.step as f64), Some(false));
        }
    }
    traces
}

fn settings_b() -> Settings {
    Settings::default().with(&[("ncc_min".to_owned(), serde_json::json!(0.3))].into()).unwrap()
}

/// The drive with both runs, at `step`, both loaded there.
fn two_runs(context: &Context, step: usize) -> State {
    let mut state = fixture::at_step(context, step);
    let traces = traces_b();
    let settings = settings_b();
    let run = RunView {
        number: 1,
        fork: None,
        changes: settings.changes(),
        settings,
        rows: traces.iter().map(StepTrace::row).collect(),
        complete: false,
        stopped: None,
        summary: summarise(&traces),
    };
    state.session.as_mut().unwrap().targets[0].runs.push(run);
    for trace in traces {
        let key = StepKey { session: "s1".to_owned(), target: 0, run: 1, step: trace.step };
        state.cache.arrived(Key::Trace(key), Ok(Item::Trace(Arc::new(trace))), 0.0);
    }
    let key = StepKey { session: "s1".to_owned(), target: 0, run: 1, step };
    for (name, side) in [(ArrayName::Matched, 21), (ArrayName::Rolled, 31), (ArrayName::Surface, 31)] {
        let wave = |x: u32, y: u32| image::Luma([((x * 7 + y * 3) % 11) as f32 / 11.0]);
        let image = GrayImage::from_fn(side, side, wave);
        let raster = Raster::from_npy(context, name, &npy::encode(&image).unwrap()).unwrap();
        state.cache.arrived(Key::Array(key.clone(), name), Ok(Item::Raster(Arc::new(raster))), 0.0);
    }
    state
}

/// As [`two_runs`], compared, with what the server says of them.
fn compared(context: &Context, step: usize) -> State {
    let mut state = two_runs(context, step);
    state.compare.wants_metrics = true;
    state.apply(Command::Compare(Ask::With { place: 0, run: Some(B) }));
    answer(&mut state);
    state
}

fn steps(name: RunName) -> Vec<Arc<StepTrace>> {
    let traces = if name == A { traces_a() } else { traces_b() };
    traces.into_iter().map(Arc::new).collect()
}

/// Answers what the page asks as the server would; returns how many comparisons it asked for.
fn answer(state: &mut State) -> usize {
    let mut comparisons = 0;
    for _ in 0..6 {
        for request in state.take_requests() {
            let reply = match &request {
                Request::Compare { new, .. } => {
                    comparisons += 1;
                    let run = |&name: &RunName| {
                        let settings = if name == A { Settings::default() } else { settings_b() };
                        Compared { name, settings: Arc::new(settings), steps: steps(name) }
                    };
                    let runs: Vec<Compared> = new.runs.iter().map(run).collect();
                    Reply::Compared(Box::new(compare(&runs, new).unwrap()))
                }
                Request::Metrics { run, .. } => Reply::Metrics(Box::new(metrics(&steps(*run)))),
                _ => continue,
            };
            state.arrived(Arrived { request, outcome: Ok(reply) }, 0.0);
        }
    }
    comparisons
}

/// A panel of the compared runs at step 3, shown in one way.
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

/// Whether the words were painted without being a control.
fn paints(shown: &Shown<'_>, words: &str) -> bool {
    fn has(shape: &egui::Shape, words: &str) -> bool {
        match shape {
            egui::Shape::Text(text) => text.galley.text().contains(words),
            egui::Shape::Vec(shapes) => shapes.iter().any(|shape| has(shape, words)),
            _ => false,
        }
    }
    shown.harness.output().shapes.iter().any(|clipped| has(&clipped.shape, words))
}

#[test]
fn the_top_bar_chooses_the_run_to_compare_with_and_takes_it_out() {
    let mut shown = Shown::new([1500.0, 300.0], |context| two_runs(context, 3), bars::top);
    shown.click("compared with: none");
    assert_eq!(shown.click("run B"), vec![Command::Compare(Ask::With { place: 0, run: Some(B) })]);
    let mut shown = Shown::new([1500.0, 300.0], |context| compared(context, 3), bars::top);
    shown.says("run looked at: run A").says("compared with: run B").says("third run compared: +");
    assert_eq!(
        shown.click("take compared with out"),
        vec![Command::Compare(Ask::With { place: 0, run: None })]
    );
    let alone = Shown::new([1500.0, 300.0], |context| fixture::at_step(context, 3), bars::top);
    alone.says("compared with none");
}

#[test]
fn the_status_line_has_the_differences_and_the_other_runs_state() {
    let shown = Shown::new([1700.0, 60.0], |context| compared(context, 3), bars::top);
    // 40 px less 4.5 px.
    shown.says("Δ+35.50").says("LOST 1").says("TRACKING").says("Δ±0");
}

#[test]
fn a_comparison_is_asked_for_once_and_again_when_a_run_went_on() {
    let mut state = two_runs(&Context::default(), 2);
    assert_eq!(answer(&mut state), 0, "nothing is compared yet");
    state.apply(Command::Compare(Ask::With { place: 0, run: Some(B) }));
    assert_eq!(answer(&mut state), 1);
    assert!(state.comparison().is_some());
    assert_eq!(answer(&mut state), 0);
    state.session.as_mut().unwrap().targets[0].runs[1].rows.pop();
    assert_eq!(answer(&mut state), 1);
    state.apply(Command::Compare(Ask::Align(Alignment::Distance)));
    assert!(state.comparison().is_none(), "what is known is aligned by step");
    assert_eq!(answer(&mut state), 1);
}

#[test]
fn the_first_divergence_goes_to_step_and_stage_and_says_the_sentence() {
    let mut state = compared(&Context::default(), 1);
    let keys = crate::keys::command(Keyboard::D, Modifiers::NONE, &state);
    assert_eq!(keys, Some(Command::Compare(Ask::FirstDivergence)));
    state.apply(keys.unwrap());
    assert_eq!((state.cursor.step, state.stage()), (3, Stage::MatchTemplate));
    let said = &state.messages.newest().unwrap().text;
    assert!(said.contains("run A and run B first differ at step 3 in match_template"), "{said}");
    // Asked before the answer is there, it goes as soon as it comes.
    let mut early = two_runs(&Context::default(), 0);
    early.apply(Command::Compare(Ask::With { place: 0, run: Some(B) }));
    early.apply(Command::Compare(Ask::FirstDivergence));
    assert_eq!(early.cursor.step, 0);
    answer(&mut early);
    assert_eq!(early.cursor.step, 3);
}

#[test]
fn a_refused_comparison_says_why() {
    let mut state = two_runs(&Context::default(), 1);
    state.apply(Command::Compare(Ask::With { place: 0, run: Some(B) }));
    let request = state.take_requests().into_iter().find(|r| matches!(r, Request::Compare { .. })).unwrap();
    let problem = Problem {
        code: "request".to_owned(),
        title: String::new(),
        status: 422,
        detail: "target 0 has no run 1".to_owned(),
        hint: None,
        nearest_pixel: None,
    };
    state.arrived(Arrived { request, outcome: Err(problem) }, 0.0);
    assert_eq!(state.comparison_problem(), Some("target 0 has no run 1"));
    state.apply(Command::Compare(Ask::FirstDivergence));
    assert_eq!(state.messages.newest().unwrap().text, "target 0 has no run 1");
}

#[test]
fn without_a_run_to_compare_with_the_keys_say_how_to_get_one() {
    for ask in [Ask::FirstDivergence, Ask::NextView] {
        let mut state = fixture::at_step(&Context::default(), 2);
        state.apply(Command::Compare(ask));
        let message = state.messages.newest().unwrap();
        assert!(message.text.contains("no run to compare with"), "{}", message.text);
    }
}

#[test]
fn looking_at_the_other_run_exchanges_the_two() {
    let mut state = compared(&Context::default(), 3);
    state.apply(Command::Look { target: 0, run: 1 });
    assert_eq!((state.own_name(), state.compare.others.as_slice()), (Some(B), &[A][..]));
    state.apply(Command::Compare(Ask::Toggle(A)));
    assert!(state.compare.others.is_empty() && !state.is_comparing());
}

#[test]
fn four_runs_have_four_marks_and_a_fifth_is_refused() {
    let mut state = compared(&Context::default(), 3);
    for number in [2, 4, 5] {
        let mut run = state.run().unwrap().clone();
        run.number = number;
        state.session.as_mut().unwrap().targets[0].runs.push(run);
        state.apply(Command::Compare(Ask::Toggle(RunName { target: 0, run: number })));
    }
    assert!(state.messages.newest().unwrap().text.contains("At most 4 runs"));
    let others = state.others();
    assert_eq!(others.len(), 3);
    // Run 4 has the number of the first mark, which is taken: it gets the one that is free.
    let marks: Vec<_> = others.iter().map(|other| other.look.mark).collect();
    use crate::overlay::Mark;
    assert_eq!(marks, [Mark::Square, Mark::Triangle, Mark::Diamond]);
    assert_eq!(state.own_look().mark, Mark::Ring);
}

#[test]
fn the_row_above_the_image_says_the_sentence_and_chooses_how_to_compare() {
    let mut shown = panel(Pane::Left, View::Marks);
    shown
        .says("vs run B: first differ at step 3 in match_template")
        .says("aligned by: step")
        .says("counts: every bit");
    assert_eq!(shown.click("First divergence (D)"), vec![Command::Compare(Ask::FirstDivergence)]);
    assert_eq!(shown.click("hold target"), vec![Command::Compare(Ask::Stabilise)]);
    assert_eq!(shown.click("step before"), vec![Command::Compare(Ask::OnionSkin)]);
    shown.click("compare by: marks");
    assert_eq!(shown.click("difference"), vec![Command::Compare(Ask::View(View::Difference))]);
}

#[test]
fn all_runs_are_marked_on_one_image_with_their_names() {
    let mut shown = panel(Pane::Left, View::Marks);
    assert_eq!(shown.click("compared: run B (legend)"), vec![Command::ToggleLayer(Layer::Compared)]);
    assert!(paints(&shown, "run B"));
    let hidden = Shown::pane(Pane::Left, |context| {
        let mut state = compared(context, 3);
        state.apply(Command::ToggleLayer(Layer::Compared));
        state
    });
    assert!(!paints(&hidden, "run B"));
}

#[test]
fn side_by_side_shows_each_run_about_its_own_target() {
    let shown = panel(Pane::Left, View::SideBySide);
    shown.says("left image, run A: lost, ncc 0.41").says("left image, run B: tracking, ncc 0.41");
    let rects = ["left image, run A: lost, ncc 0.41", "left image, run B: tracking, ncc 0.41"]
        .map(|label| shown.harness.get_by_label(label).rect());
    assert!(rects[0].right() <= rects[1].left() && (rects[0].width() - rects[1].width()).abs() < 1.0);
    // While a target is picked, the whole image is there.
    let picking = Shown::pane(Pane::Left, |context| {
        let mut state = compared(context, 3);
        (state.compare.view, state.mode) = (View::SideBySide, Mode::Pick);
        state
    });
    assert!(picking.harness.query_by_label("left image, run A: lost, ncc 0.41").is_none());
}

#[test]
fn the_divider_of_the_wipe_moves_by_drag_and_by_keyboard_and_its_keys_do_not_step() {
    let label = "wipe divider, per cent of the image's width";
    let mut shown = Shown::new(
        [760.0, 480.0],
        |context| {
            let mut state = compared(context, 3);
            state.compare.view = View::Wipe;
            state
        },
        |ui, state, out| {
            out.extend(crate::keys::commands(ui.ctx(), state));
            show_pane(ui, Pane::Left, state, out);
        },
    );
    shown.harness.get_by_label(label).focus();
    shown.harness.run_steps(2);
    shown.harness.state_mut().clear();
    shown.harness.key_press(Keyboard::ArrowRight);
    shown.harness.run_steps(1);
    let commands = std::mem::take(shown.harness.state_mut());
    assert_eq!(commands, vec![Command::Compare(Ask::Wipe(0.55))]);
    shown.harness.key_press(Keyboard::Home);
    shown.harness.run_steps(1);
    assert_eq!(std::mem::take(shown.harness.state_mut()), vec![Command::Compare(Ask::Wipe(0.0))]);
    let middle = shown.harness.get_by_label(label).rect().center();
    shown.harness.drag_at(middle);
    shown.harness.hover_at(middle + egui::vec2(60.0, 0.0));
    shown.harness.run_steps(1);
    let commands = std::mem::take(shown.harness.state_mut());
    let is_right = |command: &Command| matches!(command, Command::Compare(Ask::Wipe(at)) if *at > 0.5);
    assert!(commands.iter().any(is_right), "{commands:?}");
    assert!(paints(&shown, "run A") && paints(&shown, "run B"));
}

#[test]
fn the_other_run_shows_while_x_is_held_and_nothing_flashes_by_itself() {
    let mut shown = Shown::new(
        [760.0, 480.0],
        |context| compared(context, 3),
        |ui, state, out| {
            out.extend(crate::keys::commands(ui.ctx(), state));
            show_pane(ui, Pane::Left, state, out);
        },
    );
    shown.harness.state_mut().clear();
    shown.harness.key_down(Keyboard::X);
    shown.harness.run_steps(1);
    assert_eq!(std::mem::take(shown.harness.state_mut()), vec![Command::Compare(Ask::Blink(true))]);
    shown.harness.key_up(Keyboard::X);
    shown.harness.run_steps(1);
    assert!(shown.harness.state_mut().is_empty(), "this state does not blink: nothing has to end");
    let still = panel(Pane::Left, View::Blink);
    assert!(paints(&still, "hold X to see run B"));
    let held = Shown::pane(Pane::Left, |context| {
        let mut state = compared(context, 3);
        (state.compare.view, state.compare.is_blinking) = (View::Blink, true);
        state
    });
    assert!(paints(&held, "run B") && !paints(&held, "hold X"));
}

#[test]
fn letting_the_key_go_ends_the_blinking() {
    let mut state = compared(&Context::default(), 3);
    let context = Context::default();
    assert_eq!(crate::compare::held(&context, &state), None);
    state.apply(Command::Compare(Ask::Blink(true)));
    assert_eq!(crate::compare::held(&context, &state), Some(Command::Compare(Ask::Blink(false))));
}

#[test]
fn the_difference_has_a_row_for_template_and_match_with_its_correlation() {
    let shown = panel(Pane::Left, View::Difference);
    shown.says("run A less run B").says("matched patch: ncc of run A and run B");
    shown.says("warped template: ncc of run A and run B").says("cut to what both have");
    let missing = Shown::pane(Pane::Left, |context| {
        let mut state = compared(context, 0);
        state.compare.view = View::Difference;
        state.cursor.step = 0;
        state
    });
    missing.says("less run B");
}

#[test]
fn a_held_target_stays_in_the_middle_of_the_image() {
    let middle = std::rc::Rc::new(std::cell::Cell::new(None));
    for (view, scale) in [(View2d::Fit, 4.0), (View2d::At { centre: Pixel::new(3.0, 9.0), scale: 7.0 }, 7.0)]
    {
        let seen = middle.clone();
        Shown::new(
            [520.0, 420.0],
            move |context| {
                let mut state = fixture::at_step(context, 2);
                state.views.left = view;
                state.apply(Command::Compare(Ask::Stabilise));
                state
            },
            move |ui, state, out| {
                let shown = images_left::show(ui, state, out);
                seen.set(shown.map(|(transform, _)| transform));
            },
        );
        let transform = middle.get().unwrap();
        assert!(transform.to_screen(fixture::PIXEL).distance(transform.rect.center()) < 0.01);
        assert_eq!(transform.scale, scale);
    }
}

#[test]
fn the_step_before_shines_through_and_says_so() {
    let shown = Shown::pane(Pane::Left, |context| {
        let mut state = fixture::at_step(context, 2);
        let raster =
            state.cache.raster(&state.image_key(2, crate::cache::Eye::Left).unwrap()).ready().unwrap();
        let values = raster.values.clone();
        let bytes = sightline_core::image::io::encode_png_u8(&values).unwrap();
        let raster = Raster::from_png(context, "left", &bytes).unwrap();
        let key = state.image_key(1, crate::cache::Eye::Left).unwrap();
        state.cache.arrived(key, Ok(Item::Raster(Arc::new(raster))), 0.0);
        state.apply(Command::Compare(Ask::OnionSkin));
        state
    });
    assert!(paints(&shown, "step 1 shines through"));
}

#[test]
fn gates_and_inspector_say_what_differs_from_the_other_run() {
    let gates = panel(Pane::Gates, View::Marks);
    gates.says("Δ vs run B: ±0, limit Δ +0.400; it passes there");
    let inspector = Shown::pane(Pane::Inspector, |context| {
        let mut state = compared(context, 3);
        state.stage = Stage::MatchTemplate;
        state
    });
    inspector.says("Δ vs run B: 1 value differs").says("pixel x (px)").says("−8");
    let alike = Shown::pane(Pane::Inspector, |context| {
        let mut state = compared(context, 2);
        state.stage = Stage::MatchTemplate;
        state
    });
    alike.says("Δ vs run B: alike (every bit)");
}

#[test]
fn score_surfaces_stand_side_by_side() {
    let shown = panel(Pane::Surface, View::Marks);
    shown.says("match scores of run A: peak 0.410").says("match scores of run B: peak 0.410");
}

#[test]
fn plots_and_map_name_all_compared_runs() {
    panel(Pane::Plots, View::Marks).says("run B");
    panel(Pane::Map, View::Marks).says("target, run B");
}

#[test]
fn the_table_links_every_metric_to_its_worst_step() {
    let mut shown = Shown::new(
        [1500.0, 900.0],
        |context| compared(context, 3),
        |ui, state, out| {
            show_pane(ui, Pane::Runs, state, out);
        },
    );
    shown.says("ridge · run A").says("ridge · run B").says("states: tracking 0 to 2, lost 3, failed 4");
    shown.says("ncc_min=0.3").says("protocol: sightline").says("left out of all metrics: step 0");
    let label = "max_px 5.500 of ridge · run B, worst at step 4";
    assert_eq!(shown.click(label), vec![Command::Compare(Ask::Visit { run: B, step: 4 })]);
    let star = shown.click("baseline: ridge · run A");
    assert_eq!(star, vec![Command::Compare(Ask::Baseline(A))]);
    assert_eq!(shown.click("compare ridge · run B"), vec![Command::Compare(Ask::Toggle(B))]);
    let sort = Sort { metric: Some("max_px".to_owned()), is_descending: false };
    assert_eq!(shown.click("sort by max_px"), vec![Command::Compare(Ask::Sort(sort))]);
}

#[test]
fn a_visit_goes_to_the_run_and_the_step() {
    let mut state = compared(&Context::default(), 1);
    state.apply(Command::Compare(Ask::Visit { run: B, step: 4 }));
    assert_eq!((state.cursor.run, state.cursor.step), (1, 4));
    assert_eq!(state.compare.others, [A], "what was looked at is what is compared with");
}

#[test]
fn the_table_is_sorted_and_filtered_and_the_baseline_decides_which_settings_show() {
    let mut state = compared(&Context::default(), 3);
    assert_eq!(runs::table::order(&state), [A, B]);
    // Run A has the smaller largest error (0.5 px against 5.5 px), run B survives longer.
    for (metric, is_descending, expected) in
        [("max_px", true, [B, A]), ("max_px", false, [A, B]), ("survival_steps", true, [B, A])]
    {
        let sort = Sort { metric: Some(metric.to_owned()), is_descending };
        state.apply(Command::Compare(Ask::Sort(sort)));
        assert_eq!(runs::table::order(&state), expected, "{metric}");
    }
    state.apply(Command::Compare(Ask::Filter("ncc_MIN".to_owned())));
    assert_eq!(runs::table::order(&state), [B]);
    let shown = Shown::new(
        [1500.0, 900.0],
        |context| {
            let mut state = compared(context, 3);
            state.apply(Command::Compare(Ask::Baseline(B)));
            state
        },
        |ui, state, out| {
            show_pane(ui, Pane::Runs, state, out);
        },
    );
    shown.says("settings unlike run B").says("ncc_min=0.7").says("Δ−5");
    let none = Shown::pane(Pane::Runs, |context| {
        let mut state = compared(context, 3);
        state.apply(Command::Compare(Ask::Filter("nonsense".to_owned())));
        state
    });
    none.says("No run has these words").says("0 of 2 runs");
}

#[test]
fn the_uncertainty_has_a_sentence_for_each_run_and_words_for_each_plot() {
    let shown = panel(Pane::Uncertainty, View::Marks);
    shown.says("run A: covariance about right: mean NEES 2.1, band").says("run B: covariance about right");
    shown.says("NEES, squared Mahalanobis distance of the error, over the steps; run A: mean 2.10");
    shown.says("NIS, squared Mahalanobis").says("coverage: 100 % of the steps within 3 σ, 97 % expected");
    let asked = Shown::pane(Pane::Uncertainty, |context| fixture::at_step(context, 2));
    asked.says("are being computed");
    let without = Shown::pane(Pane::Uncertainty, |context| {
        let mut state = fixture::at_step(context, 2);
        state.compare.wants_metrics = true;
        let mut traces = traces_a();
        traces.iter_mut().for_each(|trace| trace.truth = None);
        let steps: Vec<_> = traces.into_iter().map(Arc::new).collect();
        for request in state.take_requests() {
            if let Request::Metrics { .. } = &request {
                let reply = Reply::Metrics(Box::new(metrics(&steps)));
                state.arrived(Arrived { request, outcome: Ok(reply) }, 0.0);
            }
        }
        state
    });
    without.says("NEES needs the truth");
}

#[test]
fn metrics_are_asked_for_only_while_they_are_looked_at() {
    let mut state = two_runs(&Context::default(), 2);
    let asked = |state: &mut State| {
        let requests = state.take_requests();
        requests.into_iter().filter(|request| matches!(request, Request::Metrics { .. })).count()
    };
    assert_eq!(asked(&mut state), 0);
    state.compare.wants_metrics = true;
    assert_eq!(asked(&mut state), 2);
    assert_eq!(asked(&mut state), 0, "each is asked for once");
}

#[test]
fn what_the_compared_runs_need_is_fetched_and_no_more() {
    let state = compared(&Context::default(), 2);
    let wanted = state.wanted();
    let of_b = |key: &&Key| matches!(key, Key::Trace(step) | Key::Array(step, _) if step.run == 1);
    let steps: Vec<usize> = wanted
        .iter()
        .filter(of_b)
        .filter_map(|key| if let Key::Trace(step) = key { Some(step.step) } else { None })
        .collect();
    assert_eq!(steps, [2, 3, 1]);
    let arrays = wanted.iter().filter(of_b).filter(|key| matches!(key, Key::Array(..))).count();
    assert_eq!(arrays, 4, "of the step that is looked at alone");
    let mut alone = state;
    alone.apply(Command::Compare(Ask::Toggle(B)));
    assert!(!alone.wanted().iter().any(|key| of_b(&key)));
}

#[test]
fn aligned_by_distance_the_other_run_is_read_at_the_stop_that_stands_beside() {
    let mut state = two_runs(&Context::default(), 2);
    state.apply(Command::Compare(Ask::With { place: 0, run: Some(B) }));
    state.apply(Command::Compare(Ask::Align(Alignment::Distance)));
    // Run B drove twice as far between its stops.
    let request = state.take_requests().into_iter().find(|r| matches!(r, Request::Compare { .. })).unwrap();
    let mut faster = traces_b();
    faster.iter_mut().for_each(|trace| trace.update.target.travelled_m *= 2.0);
    let runs = [
        Compared { name: A, settings: Arc::default(), steps: steps(A) },
        Compared { name: B, settings: Arc::default(), steps: faster.into_iter().map(Arc::new).collect() },
    ];
    let new = NewComparison {
        runs: vec![A, B],
        align: Alignment::Distance,
        tolerance: BTreeMap::new(),
        columns: Some(Vec::new()),
    };
    let found = compare(&runs, &new).unwrap();
    state.arrived(Arrived { request, outcome: Ok(Reply::Compared(Box::new(found))) }, 0.0);
    assert_eq!([0, 1, 2, 4].map(|step| state.beside(B, step)), [Some(0), None, Some(1), Some(2)]);
    assert_eq!(state.own_beside(B, 2), Some(4));
    assert_eq!(state.other_trace(B).ready().unwrap().step, 1);
    state.apply(Command::Go(Go::Step(1)));
    assert!(state.other_trace(B).ready().is_none());
}
