//! The scores of a trial: requested while they are visible, drawn beside those of the run, and described; the card covers
//! neither target nor search window.

use egui::accesskit::Role;
use egui_kittest::kittest::{NodeT, Queryable};
use serde_json::json;
use sightline_api::endpoints::TryStep;
use sightline_session::what_if::{Ghost, GhostArray, WhatIf};
use sightline_track::settings::Changes;
use sightline_track::trace::ArrayName;

use crate::command::{Command, Zoomable};
use crate::drawing::view2d::View2d;
use crate::panels::pane::Pane;
use crate::state::State;
use crate::tests::calls::{self, bodies};
use crate::tests::{Shown, fixture};
use crate::what_if::Scores;
use crate::why::WhyCommand;

const STEP: usize = 3;
const SIDE: u32 = 31;

fn what_if(arrays: Vec<ArrayName>) -> WhatIf {
    WhatIf { settings: Changes::from([("ncc_min".to_owned(), json!(0.4))]), arrays, ..WhatIf::default() }
}

fn requested_trials(state: &mut State) -> Vec<WhatIf> {
    bodies::<TryStep>(state)
}

fn answer(state: &mut State, arrays: Vec<ArrayName>) {
    let what_if = what_if(arrays.clone());
    let settings = Default::default();
    let mut ghost = Ghost::new(what_if, &fixture::trace(2), &fixture::trace(STEP), &settings);
    let values = (0..SIDE * SIDE).map(|k| Some(k as f32 / (SIDE * SIDE) as f32).filter(|_| k > 0)).collect();
    let array = |name| GhostArray { name, size: [SIDE, SIDE], values: Vec::clone(&values) };
    ghost.arrays = arrays.into_iter().map(array).collect();
    calls::answer::<TryStep>(state, &ghost);
}

fn trying(context: &egui::Context) -> State {
    let mut state = fixture::at_step(context, STEP);
    state.perform(Command::Why(WhyCommand::Try(what_if(Vec::new()))));
    state.show_trial_scores(true);
    state.take_requests();
    answer(&mut state, Vec::new());
    answer(&mut state, vec![ArrayName::SURFACE]);
    state
}

#[test]
fn scores_are_asked_for_only_while_they_are_seen() {
    let mut state = fixture::at_step(&egui::Context::default(), STEP);
    state.perform(Command::Why(WhyCommand::Try(what_if(Vec::new()))));
    assert_eq!(requested_trials(&mut state), [what_if(Vec::new())], "nobody sees the scores");
    answer(&mut state, Vec::new());
    state.show_trial_scores(false);
    assert!(requested_trials(&mut state).is_empty());
    state.show_trial_scores(true);
    assert_eq!(
        requested_trials(&mut state),
        [what_if(vec![ArrayName::SURFACE])],
        "the panel came to the front"
    );
    state.show_trial_scores(true);
    assert!(requested_trials(&mut state).is_empty(), "once");
    answer(&mut state, vec![ArrayName::SURFACE]);
    state.show_trial_scores(true);
    assert!(requested_trials(&mut state).is_empty(), "they are here");
    assert_eq!(state.trial().unwrap().ghost.as_ref().unwrap().what_if, what_if(Vec::new()));
    state.perform(Command::Why(WhyCommand::Scores(Scores::Recorded)));
    state.show_trial_scores(true);
    state.perform(Command::Why(WhyCommand::Change { key: "ncc_min".to_owned(), value: Some(json!(0.3)) }));
    state.show_trial_scores(true);
    assert!(
        requested_trials(&mut state).iter().all(|what_if| what_if.arrays.is_empty()),
        "those of the run are shown"
    );
}

#[test]
fn the_scores_of_what_is_tried_stand_beside_those_of_the_run_with_the_difference_in_words() {
    let mut shown = Shown::pane(Pane::Surface, trying);
    shown.says("what if: peak 0.830 at").says("+0.420 against the recorded 0.410").says("second peak");
    let name = "match scores of what if: what if: peak 0.830";
    let images: Vec<String> = shown
        .harness
        .query_all_by_role(Role::Image)
        .filter_map(|node| node.accesskit_node().label())
        .collect();
    assert!(images.iter().any(|label| label.starts_with(name)), "{images:?}");
    for (label, choice) in [
        ("scores: recorded", Scores::Recorded),
        ("scores: what if", Scores::Tried),
        ("scores: both", Scores::Both),
    ] {
        assert_eq!(shown.click(label), vec![Command::Why(WhyCommand::Scores(choice))]);
    }
    let alone = Shown::pane(Pane::Surface, |context| {
        let mut state = trying(context);
        state.perform(Command::Why(WhyCommand::Scores(Scores::Tried)));
        state
    });
    alone.says("what if, ").says("colours -1 to +1");
    assert!(
        alone.harness.query_by_label_contains("white line: threshold").is_none(),
        "the run's are not shown"
    );
}

#[test]
fn scores_that_are_missing_say_why() {
    let on_the_way = Shown::pane(Pane::Surface, |context| {
        let mut state = fixture::at_step(context, STEP);
        state.perform(Command::Why(WhyCommand::Try(what_if(Vec::new()))));
        state
    });
    on_the_way.says("What if: computing the scores");
    let none = Shown::pane(Pane::Surface, |context| {
        let mut state = trying(context);
        if let Some(ghost) = state.why.trial.as_mut().and_then(|trial| trial.ghost.as_mut()) {
            ghost.arrays.clear();
        }
        state
    });
    none.says("What if has no scores: this step did not reach the search.");
}

/// The rectangles of the left image, of the target and the search window on it, and of the panel.
fn left_image(
    size: [f32; 2],
    view: View2d,
    make: fn(&egui::Context) -> State,
) -> (Shown<'static>, egui::Rect, egui::Rect, egui::Pos2) {
    let canvas = std::rc::Rc::new(std::cell::RefCell::new(None));
    let kept = std::rc::Rc::clone(&canvas);
    let mut shown = Shown::new(
        size,
        move |context| {
            let mut state = make(context);
            state.perform(Command::View(Zoomable::Left, view));
            state
        },
        move |ui, state, out| {
            *kept.borrow_mut() = crate::layout::show_pane(ui, Pane::Left, state, out);
        },
    );
    shown.harness.run_steps(3);
    let (transform, _) = (*canvas.borrow()).unwrap();
    let matched = fixture::trace(STEP).template().unwrap().match_template.clone().unwrap();
    let window = transform.area(matched.search_window).intersect(transform.rect);
    (shown, transform.rect, window, transform.to_screen(fixture::PIXEL))
}

#[test]
fn the_card_covers_no_target_and_the_image_keeps_its_size() {
    for (size, scale, is_strip) in [
        ([900.0, 700.0], 0.5, false),
        ([900.0, 700.0], 8.0, true),
        // In such a small image no corner is large enough.
        ([420.0, 380.0], 0.2, true),
        ([420.0, 380.0], 3.0, true),
    ] {
        let view = View2d::At { centre: fixture::PIXEL, scale };
        let (_, without, ..) = left_image(size, view, |context| fixture::at_step(context, STEP));
        let (shown, image, window, target) = left_image(size, view, trying);
        assert_eq!(image, without, "{size:?} at {scale}: the image moves when something is tried");
        let buttons = ["Run from here as branch", "discard what if"];
        for button in buttons.map(|name| shown.harness.get_by_label(name).rect()) {
            assert!(image.contains_rect(button), "{size:?} at {scale}: {button:?} is cut off by {image:?}");
            assert!(
                !button.expand(10.0).contains(target),
                "{size:?} at {scale}: {button:?} covers the target"
            );
            assert!(
                is_strip || !button.intersects(window),
                "{size:?} at {scale}: {button:?} covers {window:?}"
            );
        }
    }
}
