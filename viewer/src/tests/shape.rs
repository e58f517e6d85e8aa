//! A run with registration by shape: its panel with all parts, its marks on the left image, its gates and stages.

use egui_kittest::kittest::Queryable;
use sightline_track::settings::TrackerKind;
use sightline_track::trace::StepKind;

use crate::command::{Command, Layer, Stage};
use crate::layout::show_pane;
use crate::panels::pane::Pane;
use crate::panels::{bars, inspector};
use crate::shape_view::{ShapePart, ShapeView};
use crate::state::State;
use crate::tests::shape_run;
use crate::tests::shape_run::{HAND_OFF, REFUSED};
use crate::tests::{Shown, fixture};

/// The panel with a part of a step of the combined tracker.
fn part(part: ShapePart, step: usize) -> Shown<'static> {
    with(part, step, |_| {})
}

fn with(part: ShapePart, step: usize, change: fn(&mut State)) -> Shown<'static> {
    let state = move |context: &egui::Context| {
        let mut state = shape_run::at_step(context, TrackerKind::Combined, step);
        state.shape_view.part = part;
        change(&mut state);
        state
    };
    Shown::new([900.0, 700.0], state, |ui, state, out| {
        show_pane(ui, Pane::Shape, state, out);
    })
}

fn left_image(step: usize) -> Shown<'static> {
    let state = move |context: &egui::Context| shape_run::at_step(context, TrackerKind::Shape, step);
    Shown::new([900.0, 700.0], state, |ui, state, out| {
        show_pane(ui, Pane::Left, state, out);
    })
}

#[test]
fn the_surface_gives_both_pictures_with_units_and_what_became_of_the_pixels() {
    let shown = part(ShapePart::Surface, 2);
    shown.says("disparity, px, from 12.0 px to").says("range from the left camera, m, from");
    shown.says("80 × 60 px; one of 2 × 2 is shown").says("900 vertices, 1700 triangles").says("2.1 mm rms");
    for word in ["found", "outside", "no texture", "not unique", "left–right", "speckle", "out of range"] {
        shown.says(word);
    }
    shown.says("62.5 %").says("8.3 %");
}

#[test]
fn the_sensor_shows_the_errors_with_one_limit_and_says_what_remained() {
    let shown = part(ShapePart::Sensor, 2);
    shown.says("earlier surface, depth, from 4.00 m to 4.15 m");
    for title in ["error at the start", "after the coarse search", "at the end"] {
        shown.says(&format!("{title}, from -10.0 cm to 10.0 cm"));
    }
    shown.says("colours end at ± 10.00 cm").says("at the start, rms").says("98 % of pixels");
    shown.says("registered to step 0; mean distance 31.0 → 8.0 → 4.0 mm; moved the target by 3.2 cm");
}

#[test]
fn a_handle_of_the_histogram_sets_the_limit_of_the_colours_and_a_button_takes_it_back() {
    let mut shown = part(ShapePart::Sensor, 2);
    let grip = shown.harness.get_by_label("upper limit of the colours").rect().center();
    let to = grip - egui::vec2(100.0, 0.0);
    shown.harness.drag_at(grip);
    shown.harness.run_steps(2);
    shown.harness.hover_at(to);
    shown.harness.run_steps(2);
    shown.harness.drop_at(to);
    shown.harness.run_steps(2);
    let commands = std::mem::take(shown.harness.state_mut());
    let mut limits = commands.iter().filter_map(|command| match command {
        Command::SetShapeView(view) => view.error_limit_m,
        _ => None,
    });
    let last = limits.next_back().expect("the handle was dragged");
    // The axis of some 880 points ends at 12.5 cm on both sides.
    assert!((last - (0.1 - 100.0 * 0.125 / 440.0)).abs() < 0.002, "{last}");

    let mut set = with(ShapePart::Sensor, 2, |state| state.shape_view.error_limit_m = Some(0.02));
    set.says("colours end at ± 2.00 cm").says("at the end, from -2.00 cm to 2.00 cm");
    let back = Command::SetShapeView(ShapeView { part: ShapePart::Sensor, ..ShapeView::default() });
    assert_eq!(set.click("Automatic limit"), vec![back]);
}

#[test]
fn the_search_gives_its_range_its_best_and_the_way_of_the_refinement() {
    let shown = part(ShapePart::Search, 2);
    shown
        .says("9 × 9 shifts of 43.")
        .says("mm, to ± 17.5 cm, as far as the start can be off; half width 25.0 cm");
    shown.says("best at Δx +4.4, Δy -8.8, Δz +1.0 cm").says("basin: the rock’s half width");
    shown.says("refinement (simplex)").says("restart 1").says("evaluation 50: 1.33 mm; shift +5.00");
}

#[test]
fn both_meshes_are_drawn_and_a_drag_turns_them() {
    let mut shown = part(ShapePart::Meshes, 2);
    shown.says("step 0, 8 facets").says("this step, 8 facets").says("axes of 3σ");
    let at = shown.harness.get_by_label("meshes in space").rect().center();
    shown.harness.drag_at(at);
    shown.harness.run_steps(2);
    shown.harness.hover_at(at + egui::vec2(40.0, 0.0));
    shown.harness.run_steps(2);
    let commands = std::mem::take(shown.harness.state_mut());
    assert!(
        commands
            .iter()
            .any(|command| matches!(command, Command::SetShapeView(view) if view.orbit.yaw_rad < -0.1)),
        "{commands:?}"
    );
}

#[test]
fn the_hand_off_gives_score_correction_and_share_and_elsewhere_says_where_it_is() {
    let shown = part(ShapePart::HandOff, HAND_OFF);
    shown.says("step 3, draped").says("step 4, where it was found");
    shown.says("0.913").says("2.40 px").says("82 %").says("1σ 0.20 and 0.10 px");
    shown.says("handed over from step 3");
    part(ShapePart::HandOff, 2).says("The hand-off is at step 4, where other cameras take over.");
}

#[test]
fn no_part_is_blank_without_a_sentence_that_says_why() {
    for tracker in [TrackerKind::Shape, TrackerKind::Combined] {
        for part in ShapePart::ALL.into_iter().filter(|part| *part != ShapePart::HandOff) {
            let shown = Shown::pane(Pane::Shape, move |context| {
                let mut state = shape_run::at_step(context, tracker, 1);
                state.shape_view.part = part;
                state
            });
            shown.says(
                "at step 1: features follow the target on the way; the surface is registered at the last stop.",
            );
        }
    }
    part(ShapePart::Meshes, 0).says("later stops are registered to the surface at the designation");
    part(ShapePart::Surface, 0).says("disparity, px");
    let refused = part(ShapePart::Sensor, REFUSED);
    refused.says("Not used: the RMS residual of the surfaces is 2.6 times its predicted σ");
    part(ShapePart::Meshes, REFUSED).says("meshes in space");
    for part in ShapePart::ALL {
        let loading = with(part, HAND_OFF, |state| state.cache = crate::cache::Cache::default());
        loading.says("Loading step 4");
    }
    Shown::pane(Pane::Shape, |context| fixture::at_step(context, 2)).says("Choose the preset “combined”");
    Shown::pane(Pane::Shape, |_| fixture::without_target()).says("press T");
}

#[test]
fn the_parts_are_chosen_by_their_names() {
    let mut shown = part(ShapePart::Sensor, 2);
    let chosen = Command::SetShapeView(ShapeView { part: ShapePart::Meshes, ..ShapeView::default() });
    assert_eq!(shown.click("Meshes"), vec![chosen]);
    let mut state = fixture::nothing();
    state.perform(Command::SetShapeView(ShapeView { part: ShapePart::HandOff, ..ShapeView::default() }));
    assert_eq!(state.shape_view.part, ShapePart::HandOff);
}

#[test]
fn a_prediction_that_may_lie_outside_the_basin_is_warned_of() {
    part(ShapePart::Sensor, 2);
    let uncertain = Shown::new(
        [900.0, 700.0],
        |context| {
            let mut state = shape_run::at_step(context, TrackerKind::Shape, 2);
            let mut trace = shape_run::trace(TrackerKind::Shape, 2);
            let StepKind::Tracked { predict, .. } = &mut trace.kind else { panic!("step 2 is tracked") };
            predict.covariance_in_rover *= 100.0;
            fixture::load(&mut state, trace);
            state
        },
        |ui, state, out| {
            show_pane(ui, Pane::Shape, state, out);
        },
    );
    uncertain.says("known to 40 cm (1σ), which is more than the half width of the rock, 25 cm");
}

#[test]
fn the_left_image_has_the_registered_target_and_the_basin_about_the_prediction() {
    let mut shown = left_image(2);
    shown.click("legend");
    shown.says("registered here, 1σ 2σ 3σ").says("basin, half width 25 cm (legend)");
    assert_eq!(shown.click("basin, half width 25 cm (legend)"), vec![Command::ToggleLayer(Layer::Basin)]);
    let mut designated = left_image(0);
    designated.click("legend");
    designated.says("picked");
}

#[test]
fn the_gates_of_a_registration_have_words_values_and_limits() {
    let shown =
        Shown::pane(Pane::Gates, |context| shape_run::at_step(context, TrackerKind::Combined, REFUSED));
    for word in ["shape overlap", "shape misfit", "shape σ", "shape turn", "next minimum ×", "from the edge"]
    {
        shown.says(word);
    }
    shown.says("2.600").says("≤ 1.800").says("FAIL").says("≥ 0.250");
    for pane in [Pane::Machine, Pane::Map, Pane::Plots, Pane::Tolerances, Pane::Features, Pane::Right] {
        for tracker in [TrackerKind::Shape, TrackerKind::Combined] {
            Shown::pane(pane, move |context| shape_run::at_step(context, tracker, 2));
        }
    }
}

#[test]
fn every_stage_of_both_trackers_has_its_record() {
    let trace = shape_run::trace(TrackerKind::Combined, HAND_OFF);
    for stage in [Stage::SURFACE, Stage::COARSE_REGISTER, Stage::REFINE_REGISTER, Stage::CARRIED_RAY] {
        for tracker in [TrackerKind::Shape, TrackerKind::Combined] {
            assert!(Stage::of(tracker).any(|of| of == stage), "{}", stage.word());
        }
        assert!(inspector::is_reached(&trace, stage), "{}", stage.word());
        assert!(inspector::record(&trace, stage).is_some(), "{}", stage.word());
    }
    let combined = |context: &egui::Context| shape_run::at_step(context, TrackerKind::Combined, 2);
    let mut shown = Shown::new([1600.0, 60.0], combined, bars::stages);
    assert_eq!(shown.click("refine_register"), vec![Command::SelectStage(Stage::REFINE_REGISTER)]);
    shown.says("fit_motion");
}

#[test]
fn the_settings_of_the_shape_are_listed_where_a_tracker_asks_it() {
    let shown = Shown::new(
        [420.0, 3600.0],
        |context| shape_run::at_step(context, TrackerKind::Combined, 2),
        |ui, state, out| {
            show_pane(ui, Pane::Settings, state, out);
        },
    );
    shown.says("SHAPE").says("hand_off_picture").says("shape_misfit_max");
}
