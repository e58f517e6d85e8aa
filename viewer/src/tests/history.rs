//! The panels that look back along the run: the template's history and the converging map.

use sightline_api::wire::Problem;

use crate::cache::Key;
use crate::command::{Command, Go};
use crate::panels::pane::Pane;
use crate::tests::session::problem;
use crate::tests::{Shown, fixture};

#[test]
fn the_history_lists_every_window_and_says_what_is_loading() {
    let mut shown = Shown::new(
        [1000.0, 160.0],
        |context| fixture::at_step(context, 2),
        |ui, state, out| {
            crate::layout::show_pane(ui, Pane::History, state, out);
        },
    );
    shown.says("window of step 1: ×1.13 +1.1°, ncc 0.83");
    shown.says("comparing step 2 with the earlier templates …");
    assert_eq!(shown.click("window of step 3: ×1.13 +1.1°, ncc 0.41"), vec![Command::Go(Go::Step(3))]);
    let first = |context: &egui::Context| fixture::with_history(context, 0);
    Shown::pane(Pane::History, first).says("step 0 has no earlier template to compare with");
}

#[test]
fn a_comparison_that_is_refused_says_why() {
    let shown = Shown::pane(Pane::History, |context| {
        let mut state = fixture::at_step(context, 2);
        let key = Key::EarlierTemplates(state.step_key(2).unwrap());
        let problem = Problem { detail: "The image of step 0 is missing.".to_owned(), ..problem(422) };
        state.cache.store(key, Err(problem), 0.0);
        state
    });
    shown.says("step 2 cannot be compared with earlier templates: The image of step 0 is missing.");
}

#[test]
fn a_loaded_history_says_score_and_shift_against_the_first_template() {
    let shown = Shown::pane(Pane::History, |context| fixture::with_history(context, 3));
    shown.says("step 3 against the template of step 0: score 0.96, shift 0.50 px");
}

#[test]
fn earlier_templates_are_fetched_only_while_they_are_looked_at() {
    let mut state = fixture::at_step(&egui::Context::default(), 1);
    let earlier = |key: &Key| matches!(key, Key::EarlierTemplates(step) if step.step == 1);
    assert!(!state.needed_items().iter().any(earlier));
    state.wants_history = true;
    assert!(state.needed_items().iter().any(earlier));
}

#[test]
fn the_map_says_how_the_ellipses_shrink() {
    let shown = Shown::pane(Pane::Map, |context| {
        let mut state = fixture::at_step(context, 2);
        for row in &mut state.session.as_mut().unwrap().targets[0].runs[0].rows {
            row.covariance_in_rover /= 4.0_f64.powi(row.step as i32);
        }
        state
    });
    shown.says("3σ (cm): at pick 6.0 · now 1.5 · at end 0.4");
}
