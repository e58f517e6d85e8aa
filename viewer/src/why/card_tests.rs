//! The card of Why and related parts: the headline, the pose change, the tree in view, and the end of a trial.

use std::cell::{Cell, RefCell};
use std::rc::Rc;

use egui_kittest::kittest::{NodeT, Queryable};
use serde_json::json;
use sightline_api::endpoints::{ForkRun, ShowWhy, TryStep};
use sightline_geometry::frames::{Pose, PoseRecord};
use sightline_session::Fork;
use sightline_session::view::RunView;
use sightline_session::why::{Explanation, Sources};
use sightline_track::trace::StepKind;

use super::why::{LOST, changing, ghost, lost};
use crate::command::{Command, Stage, Zoomable};
use crate::drawing::view2d::View2d;
use crate::panels::pane::Pane;
use crate::tests::calls::answer;
use crate::tests::{Shown, fixture};
use crate::why::WhyCommand;

#[test]
fn after_a_branch_nothing_is_tried_any_more() {
    let mut state = lost();
    let what_if = changing("ncc_min", json!(0.4));
    state.perform(Command::Why(WhyCommand::Try(what_if.clone())));
    answer::<TryStep>(&mut state, &ghost(what_if.clone()));
    state.perform(Command::Why(WhyCommand::Branch));
    let run = RunView { number: 1, fork: Some(Fork::new(0, LOST)), ..state.run().unwrap().clone() };
    answer::<ForkRun>(&mut state, &run);
    assert_eq!(state.cursor.run, 1);
    state.perform(Command::SelectRun { target: 0, run: 0 });
    assert!(state.trial().is_none(), "the card is gone from the run that was left");
    // Undoing and redoing the branch does not restore the card either.
    state.perform(Command::Why(WhyCommand::Undo));
    state.perform(Command::Why(WhyCommand::Redo));
    assert!(state.why.trial.is_none());
}

#[test]
fn a_tree_that_is_asked_for_is_scrolled_into_view_and_the_key_of_the_panel_brings_the_card_back() {
    let explanation = Explanation {
        step: LOST,
        sentence: String::new(),
        gates: Vec::new(),
        values: Vec::new(),
        tree: None,
    };
    let asked = Rc::new(RefCell::new(None));
    let is_asked = Rc::new(Cell::new(false));
    let (made, read) = (Rc::clone(&asked), Rc::clone(&asked));
    let shows_asked = Rc::clone(&is_asked);
    let mut shown = Shown::new(
        [420.0, 150.0],
        move |context| {
            let mut state = fixture::at_step(context, LOST);
            state.perform(Command::Why(WhyCommand::Value { step: LOST, value: "state".to_owned() }));
            answer::<ShowWhy>(&mut state, &explanation);
            *made.borrow_mut() = Some(state);
            fixture::at_step(context, LOST)
        },
        move |ui, state, out| {
            let asked = read.borrow();
            let state = asked.as_ref().filter(|_| shows_asked.get()).unwrap_or(state);
            crate::layout::show_pane(ui, Pane::Why, state, out);
        },
    );
    let headline = |shown: &Shown<'_>| shown.harness.get_by_label("Why this state?").rect().top();
    shown.harness.run_steps(5);
    let before = headline(&shown);
    is_asked.set(true);
    shown.harness.run_steps(60);
    let title = shown.harness.get_by_label_contains("WHY STATE, RUN A").rect();
    assert!(title.top() >= 0.0 && title.bottom() <= 150.0, "{title:?}");
    assert!(headline(&shown) < before, "the tree was below the fold");
    asked.borrow_mut().as_mut().unwrap().perform(Command::Why(WhyCommand::Selected));
    shown.harness.run_steps(60);
    assert!((headline(&shown) - before).abs() < 1.0, "{} and {before}", headline(&shown));
}

#[test]
fn a_handle_has_the_limits_of_its_setting_as_a_slider() {
    let shown = Shown::pane(Pane::Left, |context| {
        let mut state = fixture::at_step(context, LOST);
        let view = View2d::At { centre: fixture::PIXEL, scale: 1.0 };
        state.perform(Command::View(Zoomable::Left, view));
        state
    });
    let handle = shown.harness.get_by_label("search window size handle, px");
    let node = handle.accesskit_node();
    assert_eq!(node.numeric_value(), Some(143.0));
    assert!(node.data().max_numeric_value().is_some_and(|most| most >= 143.0), "a range ends at 100 without");
}

#[test]
fn predict_shows_the_pose_change_with_sigma_and_error() {
    let shown = Shown::pane(Pane::Inspector, |context| {
        let mut state = fixture::at_step(context, LOST);
        let stop = &mut state.traverse.as_mut().unwrap().stops[LOST];
        let pose = stop.site_from_rover.to_pose() * Pose::translation(0.07, 0.0, 0.0);
        stop.site_from_rover = PoseRecord::from(&pose);
        state.perform(Command::SelectStage(Stage::PREDICT));
        state
    });
    // 1 m and 7 cm ahead; 2 % of the distance along and across; 7 cm too far.
    shown.says("POSE CHANGE SINCE THE STOP BEFORE").says("Δyaw").says("+107.00 cm").says("2.15 cm");
    shown.says("+7.00 cm").says("0.20°");
}

#[test]
fn a_jump_of_the_heading_is_the_headline() {
    let shown = Shown::pane(Pane::Why, |context| {
        let mut state = fixture::at_step(context, LOST);
        let stops = &mut state.traverse.as_mut().unwrap().stops;
        for stop in &mut stops[LOST..] {
            let turn = nalgebra::UnitQuaternion::from_euler_angles(0.0, 0.0, 7_f64.to_radians());
            let pose = stop.site_from_rover.to_pose() * turn;
            stop.site_from_rover = PoseRecord::from(&pose);
        }
        let poses = state.poses().unwrap();
        let mut trace = state.trace().unwrap().clone();
        let now = Sources::site_from_rover(&poses, LOST);
        let place = trace.prediction().unwrap().position_in_rover;
        if let StepKind::Tracked { predict, .. } = &mut trace.trace.kind {
            predict.position_in_site = now * place;
        }
        fixture::load(&mut state, trace);
        state
    });
    shown.says("The heading estimate jumped by 7.0° to the right while the rover drove straight");
}
