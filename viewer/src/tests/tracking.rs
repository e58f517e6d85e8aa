//! The panels of configurations, tolerances and the state machine.

use egui_kittest::kittest::Queryable;
use serde_json::json;
use sightline_track::stages::judge::Gate;

use crate::command::{Command, Go};
use crate::panels::pane::Pane;
use crate::state::State;
use crate::tests::{Shown, fixture};

/// The fixed drive at step 3, where gate 3 fails in addition to gate 1.
fn fires_at_three(context: &egui::Context) -> State {
    let mut state = fixture::at_step(context, 3);
    let session = state.session.as_mut().unwrap();
    let row = &mut session.targets[0].runs[0].rows[3];
    row.distance_correction_m = Some(0.25);
    let verdict = fixture::trace(3).verdict().cloned().unwrap();
    let recorded = verdict.gates.into_iter().find(|gate| gate.criterion == 3).unwrap();
    row.failed_gates.push(Gate { value: Some(0.25), margin: Some(0.12 - 0.25), passed: false, ..recorded });
    state
}

#[test]
fn a_run_is_named_by_its_preset_and_a_draft_shows_the_preset_that_it_leads_to() {
    Shown::pane(Pane::Targets, |context| fixture::at_step(context, 2)).says("sightline");
    let shown = Shown::pane(Pane::Settings, |context| fixture::at_step(context, 2));
    shown.says("The defaults: scale, roll");
    let chosen = Shown::pane(Pane::Settings, |context| {
        let mut state = fixture::at_step(context, 2);
        state.perform(Command::UsePreset("ncc-scale"));
        state
    });
    chosen.says("Correlation of the scaled window");
}

#[test]
fn a_preset_becomes_the_changes_that_lead_from_the_run_to_it() {
    let mut state = fixture::at_step(&egui::Context::default(), 2);
    state.perform(Command::UsePreset("half-pixel"));
    assert_eq!(state.draft, [("noise_model".to_owned(), json!("half_pixel"))].into());
    // From another run, the change back to the defaults is the opposite one.
    let settings = state.pending().unwrap();
    state.session.as_mut().unwrap().targets[0].runs[0].settings = settings;
    state.perform(Command::UsePreset("sightline"));
    assert_eq!(state.draft, [("noise_model".to_owned(), json!("measured"))].into());
}

#[test]
fn the_list_of_presets_has_a_sentence_for_each_and_a_choice_drafts_it() {
    let mut shown = Shown::new(
        [420.0, 900.0],
        |context| fixture::at_step(context, 2),
        |ui, state, out| {
            crate::layout::show_pane(ui, Pane::Settings, state, out);
        },
    );
    shown.click("configuration preset");
    for preset in sightline_track::presets::PRESETS {
        shown.says(preset.name).says(preset.description);
    }
    assert_eq!(shown.click("ncc-roll"), vec![Command::UsePreset("ncc-roll")]);
}

#[test]
fn the_tolerances_say_value_tolerance_and_where_they_fired() {
    let calm = Shown::pane(Pane::Tolerances, |context| fixture::at_step(context, 2));
    calm.says("3 range change, cm: 3.0 of 12.0 at step 2; never fired")
        .says("5.0 of 20.0 at step 2; never fired");
    let fired = Shown::pane(Pane::Tolerances, fires_at_three);
    fired.says("25.0 of 12.0 at step 3; fired at 3");
}

#[test]
fn steps_that_fire_in_a_row_have_no_words_over_each_other() {
    let shown = Shown::pane(Pane::Tolerances, |context| {
        let mut state = fires_at_three(context);
        let rows = &mut state.session.as_mut().unwrap().targets[0].runs[0].rows;
        (rows[4].distance_correction_m, rows[4].distance_tolerance_m) = (Some(0.26), Some(0.12));
        state
    });
    shown.says("fired at 3, 4");
    let painted = shown.harness.output().shapes.iter().flat_map(|clipped| texts(&clipped.shape));
    let words: Vec<String> = painted.filter(|words| words == "fired").collect();
    assert_eq!(words.len(), 1, "the legend alone names the mark");
}

/// The texts of a shape.
fn texts(shape: &egui::Shape) -> Vec<String> {
    match shape {
        egui::Shape::Text(text) => vec![text.galley.text().to_owned()],
        egui::Shape::Vec(shapes) => shapes.iter().flat_map(texts).collect(),
        _ => Vec::new(),
    }
}

#[test]
fn in_a_narrow_panel_the_names_of_gates_are_beside_their_values() {
    for width in [150.0, 190.0, 230.0, 520.0] {
        let shown = Shown::new(
            [width, 420.0],
            |context| fixture::at_step(context, 3),
            |ui, state, out| {
                crate::layout::show_pane(ui, Pane::Gates, state, out);
            },
        );
        let name = shown.harness.get_by_label("match score").rect();
        let value = shown.harness.get_by_label("0.410").rect();
        assert!(!name.intersects(value), "{width}: {name:?} is under {value:?}");
    }
}

#[test]
fn the_state_machine_shows_state_counter_and_what_fired() {
    let tracking = Shown::pane(Pane::Machine, |context| fixture::at_step(context, 2));
    tracking.says("state tracking").says("2 retries left").says("designated here").says("all gates passed");
    let mut lost = Shown::pane(Pane::Machine, fires_at_three);
    lost.says("Lost (2 retries left)").says("gate 1: match score 0.410 < 0.700");
    lost.says("gate 3: range change 25.0 > 12.0 cm");
    assert_eq!(lost.click("step   2"), vec![Command::Go(Go::Step(2))]);
    Shown::pane(Pane::Machine, |context| fixture::at_step(context, 4)).says("no retry left");
}

#[test]
fn the_state_machine_counts_rejected_updates_as_recorded() {
    let shown = Shown::pane(Pane::Machine, |context| {
        let mut state = fixture::at_step(context, 3);
        let mut trace = fixture::trace(3);
        trace.update.state = sightline_track::target::TrackingState::Lost { count: 2 };
        state.session.as_mut().unwrap().targets[0].runs[0].rows[3] = trace.row();
        fixture::load(&mut state, trace);
        state
    });
    shown.says("Lost (1 retry left)");
}

#[test]
fn no_gate_is_shown_at_the_designation() {
    let designation = fixture::trace(0).row();
    assert!(designation.failed_gates.is_empty(), "nothing is judged there");
    let lost = fixture::trace(3).row();
    assert_eq!(lost.failed_gates.iter().map(|gate| gate.criterion).collect::<Vec<_>>(), [1]);
    assert_eq!(lost.lost_count, Some(1));
}

#[test]
fn the_warnings_about_a_pick_stand_under_its_target() {
    use sightline_track::locate::Evidence;
    use sightline_track::locate::template::warnings::{Warning, WarningKind};
    let shown = Shown::pane(Pane::Targets, |context| {
        let mut state = fixture::at_step(context, 2);
        let mut trace = fixture::trace(0);
        if let Some(Evidence::Template(evidence)) = trace.located_mut().map(|l| &mut l.evidence) {
            let sentence = "The window ranges over 14 % of its distance.".to_owned();
            evidence.warnings =
                vec![Warning { kind: WarningKind::DepthRange, value: 0.14, limit: 0.1, sentence }];
        }
        fixture::load(&mut state, trace);
        state
    });
    shown.says("! The window ranges over 14 % of its distance.");
}
