//! The timeline: its description, its clicks, and that the number of its shapes is bounded by the width, not the steps.

use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;

use crate::breakpoints::BreakpointCommand;
use crate::command::{Command, Go};
use crate::panels::pane::Pane;
use crate::panels::timeline;
use crate::state::State;
use crate::tests::breakpoints::breakpoint;
use crate::tests::{Shown, fixture};

const SIZE: [f32; 2] = [1400.0, 160.0];

/// A drive of this many steps with five runs whose state changes every few steps, hits at every second step, and a loop.
fn long(steps: usize, every: usize) -> State {
    let mut state = fixture::at_step(&egui::Context::default(), 2);
    let stops = &mut state.traverse.as_mut().unwrap().stops;
    let stop = stops[0].clone();
    *stops = vec![stop; steps];
    for (k, stop) in stops.iter_mut().enumerate() {
        stop.ready = k % 2 == 0;
    }
    let target = &mut state.session.as_mut().unwrap().targets[0];
    let row = target.runs[0].rows[0].clone();
    let words = ["tracking", "lost", "failed"];
    let rows = |offset: usize| {
        let row = |k: usize| {
            let mut row = row.clone();
            (row.step, row.state) = (k, words[(k / every + offset) % 3].to_owned());
            row
        };
        (0..steps).map(row).collect::<Vec<_>>()
    };
    let run = target.runs[0].clone();
    target.runs = (0..5)
        .map(|number| {
            let mut run = run.clone();
            (run.number, run.rows) = (number, rows(number));
            run
        })
        .collect();
    let every_second: Vec<usize> = (0..steps).step_by(2).collect();
    state.breakpoints.list = (0..4).map(|number| breakpoint(number, "step > 0", &every_second)).collect();
    (state.breakpoints.play.loop_in, state.breakpoints.play.loop_out) = (Some(10), Some(steps / 2));
    state
}

/// Number of shapes that the timeline of a state paints.
fn shapes(state: State) -> usize {
    let mut harness = Harness::builder().with_size(SIZE).build_ui(move |ui| {
        timeline::show(ui, &state, &mut Vec::new());
    });
    harness.run_steps(2);
    harness.output().shapes.len()
}

#[test]
fn ten_thousand_steps_need_no_more_shapes_than_the_width_allows() {
    // The maximum that a column can need: its neighbours differ from it in every run.
    let busiest = |steps: usize| shapes(long(steps, steps.div_ceil(661)));
    let [short, drive, longest] = [1_000, 10_000, 40_000].map(busiest);
    println!("shapes: {short} for 1,000 steps, {drive} for 10,000, {longest} for 40,000");
    // 661 columns, five bands, at most a ground and three lines each, and some marks and numbers.
    assert!([short, drive, longest].iter().all(|count| *count < 661 * 5 * 4), "{short}, {drive}, {longest}");
    assert!(longest <= drive + drive / 5, "{longest} for 40,000 steps against {drive} for 10,000");
    let flicker = shapes(long(10_000, 1));
    assert!(flicker < drive, "columns that hold every state are all alike: {flicker}");
}

fn shown(state: impl FnOnce(&egui::Context) -> State + 'static) -> Shown<'static> {
    Shown::new(SIZE, state, timeline::show)
}

#[test]
fn the_timeline_says_where_the_cursor_is_and_how_the_run_went() {
    let shown = shown(|context| {
        let mut state = fixture::at_step(context, 3);
        state.breakpoints.list = vec![breakpoint(0, "ncc < 0.6", &[3, 4])];
        state
    });
    shown.says("timeline: step 3 of 5, lost; run A: tracking 0 to 2, lost 3 to 3, failed 4 to 4, not computed yet 5 to 5");
    shown.says("2 hits of breakpoints");
}

#[test]
fn a_click_on_the_band_goes_to_its_step_and_one_in_the_lane_breaks_there() {
    let mut shown = shown(|context| fixture::at_step(context, 2));
    let rect =
        shown.harness.get_by(|node| node.label().is_some_and(|label| label.starts_with("timeline"))).rect();
    let drive = rect.with_min_x(rect.left() + 78.0);
    let at =
        |step: f32, y: f32| egui::pos2(drive.left() + drive.width() * (step + 0.5) / 6.0, rect.top() + y);
    let mut click = |place: egui::Pos2| {
        shown.harness.state_mut().clear();
        for pressed in [true, false] {
            shown.harness.event(egui::Event::PointerMoved(place));
            let button = egui::PointerButton::Primary;
            let modifiers = egui::Modifiers::NONE;
            shown.harness.event(egui::Event::PointerButton { pos: place, button, pressed, modifiers });
            shown.harness.run_steps(1);
        }
        shown.harness.run_steps(1);
        shown.take_commands()
    };
    assert!(click(at(4.0, 25.0)).contains(&Command::Go(Go::Step(4))));
    assert_eq!(click(at(1.0, 8.0)), [Command::Breakpoints(BreakpointCommand::BreakAt(1))]);
}

#[test]
fn every_run_of_the_target_has_a_band_and_other_targets_have_one_when_they_are_asked_for() {
    let one = fixture::at_step(&egui::Context::default(), 2);
    let mut three = fixture::at_step(&egui::Context::default(), 2);
    let target = &mut three.session.as_mut().unwrap().targets[0];
    let run = target.runs[0].clone();
    target.runs.extend([run.clone(), run]);
    assert!(timeline::height(&three) > timeline::height(&one) + 15.0);
    let mut many = long(100, 1);
    let targets = &mut many.session.as_mut().unwrap().targets;
    let mut other = targets[0].clone();
    other.number = 1;
    targets.push(other);
    let before = timeline::height(&many);
    many.perform(Command::Breakpoints(BreakpointCommand::ShowOthers(true)));
    assert!(timeline::height(&many) > before);
    let target = &mut many.session.as_mut().unwrap().targets[0];
    let run = target.runs[0].clone();
    target.runs.extend((5..200).map(|number| sightline_session::view::RunView { number, ..run.clone() }));
    many.cursor.run = 150;
    assert!(timeline::height(&many) < 180.0, "no more bands than fit");
}

#[test]
fn ten_thousand_steps_cost_every_panel_hardly_more_than_a_thousand() {
    let vertices = |pane: Pane, steps: usize| {
        let shown = Shown::pane(pane, move |_| long(steps, steps.div_ceil(60)));
        let shapes = shown.harness.output().shapes.clone();
        let count = |clipped: &egui::ClippedPrimitive| match &clipped.primitive {
            egui::epaint::Primitive::Mesh(mesh) => mesh.vertices.len(),
            egui::epaint::Primitive::Callback(_) => 0,
        };
        shown.harness.ctx.tessellate(shapes, 1.0).iter().map(count).sum::<usize>()
    };
    for pane in Pane::ALL {
        let [short, longer] = [1_000, 10_000].map(|steps| vertices(pane, steps));
        println!("{pane:?}: {short} vertices for 1,000 steps, {longer} for 10,000");
        // A curve of a thousand steps is drawn completely, a longer one with four points in each of 600 columns.
        assert!(longer < 3 * short + 20_000, "{pane:?}: {longer} for 10,000 steps, {short} for 1,000");
        assert!(longer < 250_000, "{pane:?}: {longer}");
    }
}

#[test]
fn the_filmstrip_of_a_long_drive_shows_few_windows_and_that_of_a_short_one_all() {
    let count = |state: &State| timeline::film::rows(state, state.run().unwrap()).count();
    assert_eq!(count(&fixture::at_step(&egui::Context::default(), 2)), 5);
    for steps in [49, 480, 10_000] {
        assert!((20..=48).contains(&count(&long(steps, 3))), "{steps} steps");
    }
}
