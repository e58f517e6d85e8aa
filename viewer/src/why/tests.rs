//! Why, what-if, and counterfactuals: display of the panels and requests of the state.

use egui_kittest::kittest::{NodeT, Queryable};
use serde_json::json;
use sightline_api::endpoint::Call;
use sightline_api::endpoints::{AskCounterfactual, ForkRun, ShowCounterfactual, ShowWhy, TryStep};
use sightline_api::event::Event;
use sightline_api::query::ValueName;
use sightline_api::wire::Problem;
use sightline_geometry::frames::Pixel;
use sightline_session::Fork;
use sightline_session::counterfactual::wire::{Question, QuestionState};
use sightline_session::counterfactual::{Answer, Finding, Goal, Moved, Outcome, SettingChange};
use sightline_session::view::RunView;
use sightline_session::what_if::{Deltas, Ghost, WhatIf};
use sightline_session::why::{Explanation, Node, Origin, OriginKind};
use sightline_track::settings::Changes;

use crate::cache::StepKey;
use crate::command::keys;
use crate::command::{Command, Go, Zoomable};
use crate::drawing::view2d::View2d;
use crate::panels::pane::Pane;
use crate::state::State;
use crate::state::effect::Effect;
use crate::tests::calls::{answer, bodies, calls_of, refuse};
use crate::tests::{Shown, fixture};
use crate::why::{Remote, WhyCommand};

/// The step at which the target is lost.
pub(super) const LOST: usize = 3;

pub(super) fn key() -> StepKey {
    StepKey { session: "s1".to_owned(), target: 0, run: 0, step: LOST }
}

/// Explains a value of that step.
fn explain(value: &str) -> Call {
    Call::with_query::<ShowWhy>(&key(), &ValueName { value: Some(value.to_owned()) })
}

pub(super) fn lost() -> State {
    fixture::at_step(&egui::Context::default(), LOST)
}

pub(super) fn changing(setting: &str, value: serde_json::Value) -> WhatIf {
    WhatIf { settings: Changes::from([(setting.to_owned(), value)]), ..WhatIf::default() }
}

pub(super) fn ghost(what_if: WhatIf) -> Ghost {
    let tried = fixture::trace(2);
    let deltas = Deltas { state_recorded: "lost".to_owned(), ncc: Some(0.42), ..Deltas::default() };
    let mut ghost = Ghost::new(what_if, &tried, &fixture::trace(LOST), &Default::default());
    ghost.deltas = deltas;
    ghost
}

fn finding(setting: &str, to: f64, outcome: Outcome) -> Finding {
    let change =
        SettingChange { setting: setting.to_owned(), from: json!(0.7), to: json!(to), unit: String::new() };
    Finding {
        changes: vec![change],
        moved: None,
        with_margin: None,
        relative: 0.42,
        outcome,
        gate: Some("ncc".to_owned()),
        gate_unit: String::new(),
        margin_after: Some(0.01),
        row: fixture::trace(2).row(),
        runs: 3,
        sentence: format!("{setting} {to} instead of 0.7: accepted."),
    }
}

fn question(state: QuestionState, findings: Vec<Finding>) -> Question {
    let answer = Answer {
        goal: Goal::Accepted,
        k: 4,
        n: 31,
        doing: "kernel".to_owned(),
        runs: 55,
        findings,
        without: vec!["roll".to_owned()],
    };
    let StepKey { session, target, run, step } = key();
    Question { session, target, run, step, state, answer: Some(answer), problem: None }
}

#[test]
fn the_panel_says_the_verdict_and_lists_the_criteria_worst_first() {
    let mut shown = Shown::pane(Pane::Why, |context| fixture::at_step(context, LOST));
    shown.says("Rejected: match score 0.410 is below 0.700 by 0.290").says("px from the truth");
    shown.says("Correct rejection: the match is ");
    let value = |name: &str| vec![Command::Why(WhyCommand::Value { step: LOST, value: name.to_owned() })];
    assert_eq!(shown.click("Why this state?"), value("state"));
    assert_eq!(shown.click("What would have saved it?"), vec![Command::Why(WhyCommand::Saved)]);
}

#[test]
fn a_limit_is_tried_by_its_slider_and_a_displacement_by_its_own() {
    let shown = Shown::new(
        [520.0, 900.0],
        |context| fixture::at_step(context, LOST),
        |ui, state, out| {
            crate::layout::show_pane(ui, Pane::Why, state, out);
        },
    );
    for name in ["try match score limit", "try search window", "try template", "move prediction x"] {
        shown.harness.get_by_role_and_label(egui::accesskit::Role::Slider, name);
    }
}

#[test]
fn a_slider_stays_the_same_one_when_a_value_is_explained_above_it() {
    let sliders = |is_explained: bool| {
        let shown = Shown::new(
            [520.0, 900.0],
            move |context| {
                let mut state = fixture::at_step(context, LOST);
                if is_explained {
                    state.perform(Command::Why(WhyCommand::Value { step: LOST, value: "ncc".to_owned() }));
                }
                state
            },
            |ui, state, out| {
                crate::layout::show_pane(ui, Pane::Why, state, out);
            },
        );
        ["try match score limit", "try search window"].map(|name| {
            let found = shown.harness.get_by_role_and_label(egui::accesskit::Role::Slider, name);
            (found.accesskit_node().locate().0, found.rect().top())
        })
    };
    let (before, after) = (sliders(false), sliders(true));
    for ((id, top), (later, moved)) in before.into_iter().zip(after) {
        assert!(moved > top, "something came in above it");
        assert_eq!(id, later, "who holds it still holds it");
    }
}

#[test]
fn while_a_change_is_tried_only_the_newest_is_asked_for_next() {
    let mut state = lost();
    let side = |side: u64| changing("search_window_px", json!(side));
    for value in [61, 81, 101] {
        state.perform(Command::Why(WhyCommand::Change {
            key: "search_window_px".to_owned(),
            value: Some(json!(value)),
        }));
    }
    let trial = |value: u64| Call::with_body::<TryStep>(&key(), &side(value));
    assert_eq!(calls_of::<TryStep>(&mut state), [trial(61)], "one at a time");
    answer::<TryStep>(&mut state, &ghost(side(61)));
    assert_eq!(state.trial().unwrap().ghost.as_ref().unwrap().what_if, side(61), "the last answer stands");
    assert_eq!(calls_of::<TryStep>(&mut state), [trial(101)], "the newest, not the next");
    answer::<TryStep>(&mut state, &ghost(side(101)));
    assert!(calls_of::<TryStep>(&mut state).is_empty());
    // A drag is one change.
    state.perform(Command::Why(WhyCommand::Undo));
    assert!(state.trial().is_none());
    state.perform(Command::Why(WhyCommand::Redo));
    assert_eq!(state.trial().unwrap().what_if, side(101));
    // Another step has no trial.
    state.perform(Command::Go(Go::By(-1)));
    assert!(state.trial().is_none());
}

#[test]
fn a_change_that_is_refused_says_so_in_the_card_and_loses_nothing() {
    let mut state = lost();
    state.perform(Command::Why(WhyCommand::Try(changing("search_window_px", json!(61)))));
    let (code, title, detail) =
        ("setting".to_owned(), String::new(), "search_window_px must be odd".to_owned());
    let problem =
        Problem { code, title, status: 422, detail, hint: None, nearest_pixel: None, received: None };
    state.take_requests();
    refuse::<TryStep>(&mut state, problem);
    assert_eq!(state.trial().unwrap().refused.as_deref(), Some("search_window_px must be odd"));
    assert!(calls_of::<TryStep>(&mut state).is_empty(), "it is not asked for again and again");
}

#[test]
fn the_ghost_has_a_card_with_what_changed_and_what_can_be_done() {
    let mut shown = Shown::pane(Pane::Left, |context| {
        let mut state = fixture::at_step(context, LOST);
        let what_if = changing("search_window_px", json!(81));
        state.perform(Command::Why(WhyCommand::Try(what_if.clone())));
        answer::<TryStep>(&mut state, &ghost(what_if));
        state
    });
    shown.says("search window 143 → 81 px").says("Lost → Tracking").says("Δ +0.420");
    assert_eq!(shown.click("Run from here as branch"), vec![Command::Why(WhyCommand::Branch)]);
    assert_eq!(shown.click("discard what if"), vec![Command::Why(WhyCommand::Discard)]);
}

#[test]
fn the_left_image_has_handles_with_names() {
    let shown = Shown::pane(Pane::Left, |context| {
        let mut state = fixture::at_step(context, LOST);
        let view = View2d::At { centre: fixture::PIXEL, scale: 1.0 };
        state.perform(Command::View(Zoomable::Left, view));
        state
    });
    let roles = [
        (egui::accesskit::Role::Slider, "search window size handle, px"),
        (egui::accesskit::Role::Slider, "template size handle, px"),
    ];
    for (role, name) in roles {
        shown.harness.get_by_role_and_label(role, name);
    }
    shown.says("prediction handle, at 515.3, 478.6 px");
}

#[test]
fn a_branch_takes_settings_and_prediction_along() {
    let mut state = lost();
    let pixel = Pixel::new(500.0, 470.0);
    state.perform(Command::Why(WhyCommand::Change { key: "ncc_min".to_owned(), value: Some(json!(0.4)) }));
    state.perform(Command::Why(WhyCommand::Displace(Some(pixel))));
    assert_eq!(
        keys::command(egui::Key::R, egui::Modifiers::NONE, &state),
        Some(Command::Why(WhyCommand::Branch))
    );
    assert_eq!(
        keys::command(egui::Key::Escape, egui::Modifiers::NONE, &state),
        Some(Command::Why(WhyCommand::Discard))
    );
    state.perform(Command::Why(WhyCommand::Branch));
    let [new] = bodies::<ForkRun>(&mut state).try_into().unwrap();
    assert_eq!((new.run, new.from_step, new.prediction_px), (0, LOST, Some(pixel)));
    assert_eq!(new.settings, Changes::from([("ncc_min".to_owned(), json!(0.4))]));
}

#[test]
fn the_findings_can_be_tried_and_run_from_here() {
    let false_one = finding("ncc_min", 0.4, Outcome::False);
    let moved = Moved {
        from: Pixel::new(510.0, 480.0),
        to: Pixel::new(515.0, 480.0),
        because: "towards the truth".to_owned(),
    };
    let margin = SettingChange {
        setting: "search_window_px".to_owned(),
        from: json!(143),
        to: json!(223),
        unit: "px".to_owned(),
    };
    let wide = changing("search_window_px", json!(223));
    let right = Finding {
        changes: Vec::new(),
        moved: Some(moved),
        with_margin: Some(margin),
        ..finding("none", 0.0, Outcome::Right)
    };
    let (tried, run) = (right.what_if(), false_one.what_if());
    let mut shown = Shown::new(
        [520.0, 900.0],
        move |context| {
            let mut state = fixture::at_step(context, LOST);
            let question = question(QuestionState::Done, vec![right, false_one]);
            state.perform(Command::Why(WhyCommand::Saved));
            answer::<AskCounterfactual>(&mut state, &question);
            state
        },
        |ui, state, out| {
            crate::layout::show_pane(ui, Pane::Why, state, out);
        },
    );
    shown.says("Correct").says("change 42 %").says("prediction moved by (+5.0, +0.0) px");
    shown.says("Searched 31 changes (55 re-runs of this step)").says("1 without effect");
    assert_eq!(shown.click("try finding 1"), vec![Command::Why(WhyCommand::Try(tried))]);
    assert_eq!(shown.click("try finding 1 with margin"), vec![Command::Why(WhyCommand::Try(wide))]);
    shown.hides("Wrong target");
    shown.click("1 change leads to a wrong target");
    shown.harness.run_steps(20);
    assert_eq!(shown.click("run from here with finding 2"), vec![Command::Why(WhyCommand::BranchWith(run))]);
}

#[test]
fn a_finding_that_was_branched_says_how_long_it_stays_tracked() {
    let mut state = lost();
    let what_if = changing("ncc_min", json!(0.4));
    let settings = state.run().unwrap().settings.with(&what_if.settings).unwrap();
    let branch = RunView {
        number: 1,
        fork: Some(Fork::new(0, LOST)),
        changes: what_if.settings.clone(),
        settings,
        ..state.run().unwrap().clone()
    };
    assert!(state.branch_of(&what_if).is_none());
    state.session.as_mut().unwrap().targets[0].runs.push(branch);
    assert_eq!(state.branch_of(&what_if).unwrap().number, 1);
    let elsewhere = WhatIf { prediction_px: Some(Pixel::new(1.0, 2.0)), ..what_if };
    assert!(state.branch_of(&elsewhere).is_none());
}

#[test]
fn a_question_that_goes_on_shows_how_far_and_can_be_cancelled() {
    let mut shown = Shown::pane(Pane::Why, |context| {
        let mut state = fixture::at_step(context, LOST);
        let question = question(QuestionState::Running, vec![finding("ncc_min", 0.4, Outcome::Unknown)]);
        state.read_question_once();
        answer::<ShowCounterfactual>(&mut state, &question);
        state
    });
    shown.says("4 of 31: kernel").says("match score limit 0.7 → 0.4");
    assert_eq!(shown.click("Cancel search"), vec![Command::Why(WhyCommand::CancelSaved)]);
}

#[test]
fn an_explanation_of_another_target_is_not_shown() {
    let mut state = lost();
    state.perform(Command::Why(WhyCommand::Value { step: LOST, value: "state".to_owned() }));
    assert!(state.explained().is_some());
    state.cursor.target = Some(1);
    assert!(state.explained().is_none());
    state.cursor.target = Some(0);
    assert!(state.explained().is_some(), "it is there again with its target");
}

#[test]
fn a_question_is_asked_once_followed_by_events_and_found_again_by_a_new_page() {
    let mut state = lost();
    state.read_question_once();
    state.read_question_once();
    let reads = |state: &mut State| calls_of::<ShowCounterfactual>(state).len();
    let unasked = question(QuestionState::Unasked, Vec::new());
    assert_eq!(reads(&mut state), 1, "looked for once");
    answer::<ShowCounterfactual>(&mut state, &unasked);
    state.perform(Command::Why(WhyCommand::Saved));
    state.perform(Command::Why(WhyCommand::Saved));
    assert_eq!(calls_of::<AskCounterfactual>(&mut state), [Call::to::<AskCounterfactual>(&key())]);
    let StepKey { session, target, run, step } = key();
    state.apply_event(Event::QuestionProgress { session, target, run, step, k: 1, n: 9, ended: false });
    assert_eq!(reads(&mut state), 1);
    assert_eq!(state.question(), Some(&Remote::Pending));
    // A page that missed events reads the session and the unfinished searches again.
    let running = question(QuestionState::Running, Vec::new());
    answer::<ShowCounterfactual>(&mut state, &running);
    state.apply_event(Event::SessionChanged { session: "s1".to_owned() });
    assert_eq!(reads(&mut state), 1);
    let done = question(QuestionState::Done, Vec::new());
    answer::<ShowCounterfactual>(&mut state, &done);
    state.apply_event(Event::SessionChanged { session: "s1".to_owned() });
    assert_eq!(reads(&mut state), 0);
}

#[test]
fn a_value_shows_its_tree_and_each_line_of_it_can_be_asked_about() {
    let input = Node {
        value: "peak_score".to_owned(),
        step: LOST,
        label: "score at the peak".to_owned(),
        numbers: vec![Some(0.41)],
        text: None,
        unit: String::new(),
        formula: Some("normalised correlation".to_owned()),
        is_closed_form: false,
        stage: "match_template".to_owned(),
        origin: Some(Origin {
            kind: OriginKind::Image,
            name: "images/left_0003.png".to_owned(),
            step: Some(LOST),
        }),
        has_more: false,
        inputs: Vec::new(),
    };
    let tree = Node {
        value: "ncc".to_owned(),
        label: "score of the match".to_owned(),
        formula: Some("the score of the peak".to_owned()),
        is_closed_form: true,
        origin: None,
        inputs: vec![input.clone()],
        ..input
    };
    let explanation = Explanation {
        step: LOST,
        sentence: String::new(),
        gates: Vec::new(),
        values: Vec::new(),
        tree: Some(tree),
    };
    let mut shown = Shown::pane(Pane::Why, move |context| {
        let mut state = fixture::at_step(context, LOST);
        state.perform(Command::Why(WhyCommand::Value { step: LOST, value: "ncc".to_owned() }));
        assert_eq!(calls_of::<ShowWhy>(&mut state), [explain("ncc")]);
        assert!(state.take_effects().contains(&Effect::reveal(Pane::Why)), "the panel comes to the front");
        answer::<ShowWhy>(&mut state, &explanation);
        state
    });
    shown.says("= the score of the peak").says("from file: images/left_0003.png").says("· match_template");
    let next = vec![Command::Why(WhyCommand::Value { step: LOST, value: "peak_score".to_owned() })];
    assert_eq!(shown.click("score at the peak"), next);
}

#[test]
fn w_asks_for_the_worst_criterion_first_and_numbers_elsewhere_lead_to_why() {
    let mut state = lost();
    assert_eq!(
        keys::command(egui::Key::W, egui::Modifiers::NONE, &state),
        Some(Command::Why(WhyCommand::Selected))
    );
    assert_eq!(
        keys::command(egui::Key::C, egui::Modifiers::NONE, &state),
        Some(Command::Why(WhyCommand::Saved))
    );
    state.perform(Command::Why(WhyCommand::Selected));
    assert_eq!(calls_of::<ShowWhy>(&mut state), [explain("gate.ncc")]);
    let value = |name: &str| vec![Command::Why(WhyCommand::Value { step: LOST, value: name.to_owned() })];
    let mut gates = Shown::pane(Pane::Gates, |context| fixture::at_step(context, LOST));
    assert_eq!(gates.click("match score"), value("gate.ncc"));
    let mut status =
        Shown::new([1200.0, 60.0], |context| fixture::at_step(context, LOST), crate::panels::bars::top);
    assert_eq!(status.click("0.41"), value("ncc"));
}
