//! Breakpoints, the expression box, derived plots, and going to a step: display, messages and requests.

use egui_kittest::kittest::Queryable;
use sightline_api::endpoint::Call;
use sightline_api::endpoints::{
    AddBreakpoint, ChangeBreakpoint, ListBreakpoints, QuerySession, RemoveBreakpoint, ShowSession,
};
use sightline_api::event::Event;
use sightline_api::location::AtBreakpoint;
use sightline_session::breakpoints::{Breakpoint, BreakpointView, NewBreakpoint, RunHits};
use sightline_session::expression::Answers;
use sightline_session::query::{Query, QueryAnswer, RunAnswer};

use crate::breakpoints::BreakpointCommand;
use crate::command::help;
use crate::command::{Command, Go};
use crate::panels::pane::Pane;
use crate::panels::plots;
use crate::state::State;
use crate::tests::calls::{answer, at_session, calls, calls_of};
use crate::tests::{Shown, fixture};

/// A breakpoint with its hits in the first run.
pub(crate) fn breakpoint(number: usize, expression: &str, steps: &[usize]) -> BreakpointView {
    let hits = RunHits { target: 0, run: 0, steps: steps.to_vec() };
    BreakpointView {
        number,
        expression: expression.to_owned(),
        on: true,
        count: steps.len(),
        hits: if steps.is_empty() { vec![] } else { vec![hits] },
        problem: None,
    }
}

/// The fixed drive with two breakpoints.
fn watched(context: &egui::Context, step: usize) -> State {
    let mut state = fixture::at_step(context, step);
    state.breakpoints.list = vec![breakpoint(0, "ncc < 0.6", &[3, 4]), breakpoint(3, "step == 2", &[2])];
    state
}

fn loaded(step: usize) -> State {
    let mut state = watched(&egui::Context::default(), step);
    state.take_requests();
    state
}

/// The calls about breakpoints and columns that follow a command.
fn calls_after(state: &mut State, command: BreakpointCommand) -> Vec<Call> {
    state.perform(Command::Breakpoints(command));
    let is_ours = |call: &Call| call.endpoint.contains("breakpoint") || call.is_to::<QuerySession>();
    calls(state).into_iter().filter(is_ours).collect()
}

/// Sets a breakpoint.
fn add(expression: Option<String>, step: Option<usize>) -> Call {
    Call::with_body::<AddBreakpoint>(&at_session(), &NewBreakpoint { expression, step })
}

/// Whether the list of breakpoints is requested; removes all requests.
fn is_list_read(state: &mut State) -> bool {
    !calls_of::<ListBreakpoints>(state).is_empty()
}

#[test]
fn the_list_has_every_breakpoint_with_its_hits_and_can_switch_edit_and_remove_it() {
    let mut shown = Shown::pane(Pane::Breakpoints, |context| watched(context, 2));
    shown.says("ncc < 0.6").says("2 hits").says("step == 2").says("1 hit").says("3 hits in all runs");
    assert_eq!(
        shown.click("ncc < 0.6"),
        [Command::Breakpoints(BreakpointCommand::Switch { number: 0, on: false })]
    );
    assert_eq!(
        shown.click("remove breakpoint step == 2"),
        [Command::Breakpoints(BreakpointCommand::Remove(3))]
    );
    assert_eq!(shown.click("edit breakpoint ncc < 0.6"), [Command::Breakpoints(BreakpointCommand::Edit(0))]);
    assert_eq!(shown.click("Next hit"), [Command::Breakpoints(BreakpointCommand::NextHit)]);
    assert_eq!(shown.click("Break at step 2"), [Command::Breakpoints(BreakpointCommand::BreakAt(2))]);
}

#[test]
fn without_breakpoints_the_panel_says_how_to_get_one() {
    Shown::pane(Pane::Breakpoints, |context| fixture::at_step(context, 2))
        .says("press B to break at this step");
}

fn with_text(text: &'static str) -> Shown<'static> {
    Shown::pane(Pane::Breakpoints, move |context| {
        let mut state = fixture::at_step(context, 2);
        state.perform(Command::Breakpoints(BreakpointCommand::Type(text.to_owned())));
        state
    })
}

#[test]
fn the_box_says_what_an_expression_is_and_what_is_wrong_with_it_and_where() {
    with_text("ncc < 0.6").says("a condition");
    with_text("sigma_m * 2").says("a number in m");
    with_text("step > 1 && nccc < 0.6")
        .says("At character 13: there is no name `nccc`")
        .says("Did you mean `ncc`?");
    with_text("sigma_m < err_px").says("`sigma_m` is in m and `err_px` is in px");
    let mut whole = with_text("ncc < 0.6");
    assert_eq!(whole.click("Break when true"), [Command::Breakpoints(BreakpointCommand::Set)]);
    assert_eq!(
        whole.click("Plot over the steps"),
        [Command::Breakpoints(BreakpointCommand::Plot("ncc < 0.6".to_owned()))]
    );
    let mut bad = with_text("ncc <");
    assert_eq!(bad.click("Break when true"), [], "what cannot be read cannot be set");
}

/// Keeps the whole state behind the panel, so that entered text remains.
fn live_box() -> egui_kittest::Harness<'static, State> {
    let state = fixture::at_step(&egui::Context::default(), 2);
    let mut harness = egui_kittest::Harness::builder().with_size([520.0, 500.0]).build_ui_state(
        |ui, state: &mut State| {
            let mut out = Vec::new();
            crate::layout::show_pane(ui, Pane::Breakpoints, state, &mut out);
            out.into_iter().for_each(|command| state.perform(command));
        },
        state,
    );
    harness.run_steps(2);
    harness
}

#[test]
fn completion_is_taken_by_arrow_keys_tab_and_enter_and_a_whole_condition_is_set_by_enter() {
    let mut harness = live_box();
    harness.state_mut().perform(Command::Breakpoints(BreakpointCommand::Focus));
    harness.run_steps(3);
    let box_ = || egui_kittest::kittest::by().role(egui::accesskit::Role::TextInput);
    harness.get(box_()).type_text("sig");
    harness.run_steps(3);
    let offered =
        harness.query_all_by(|node| node.label().is_some_and(|label| label.contains("sigma_m"))).count();
    assert!(offered > 0, "suggestions are shown");
    harness.key_press(egui::Key::Tab);
    harness.run_steps(3);
    assert_eq!(harness.state().breakpoints.text, "sigma_m");
    harness.get(box_()).type_text(" > 5 c");
    harness.run_steps(3);
    harness.key_press(egui::Key::ArrowDown);
    harness.key_press(egui::Key::ArrowUp);
    harness.key_press(egui::Key::Tab);
    harness.run_steps(3);
    assert_eq!(harness.state().breakpoints.text, "sigma_m > 5 cm");
    harness.state_mut().take_requests();
    harness.key_press(egui::Key::Enter);
    harness.run_steps(3);
    assert!(calls(harness.state_mut()).contains(&add(Some("sigma_m > 5 cm".to_owned()), None)));
    assert_eq!(harness.state().breakpoints.text, "", "the box is free for the next one");
}

#[test]
fn letters_and_the_enter_behind_them_may_come_in_one_frame() {
    // While suggestions are open for unfinished text, and for letters that complete it while none are open.
    for (before, last) in
        [("step == 2 or step", " == 4"), ("step == 2 or step == ", "4"), ("err_px >", " 2 px")]
    {
        let mut harness = live_box();
        harness.state_mut().perform(Command::Breakpoints(BreakpointCommand::Focus));
        harness.run_steps(3);
        let box_ = || egui_kittest::kittest::by().role(egui::accesskit::Role::TextInput);
        harness.get(box_()).type_text(before);
        harness.run_steps(3);
        harness.state_mut().take_requests();
        let (key, modifiers) = (egui::Key::Enter, egui::Modifiers::NONE);
        let enter = egui::Event::Key { key, physical_key: None, pressed: true, repeat: false, modifiers };
        harness.input_mut().events.extend([egui::Event::Text(last.to_owned()), enter]);
        harness.run_steps(3);
        let expected = add(Some(format!("{before}{last}")), None);
        assert!(calls(harness.state_mut()).contains(&expected), "{before}{last}");
        assert!(!harness.ctx.text_edit_focused(), "keys mean steps again");
    }
}

#[test]
fn breaking_at_a_step_twice_takes_the_breakpoint_back() {
    let mut state = loaded(4);
    assert_eq!(calls_after(&mut state, BreakpointCommand::BreakAt(4)), [add(None, Some(4))]);
    let at = AtBreakpoint { session: "s1".to_owned(), breakpoint: 3 };
    assert_eq!(calls_after(&mut state, BreakpointCommand::BreakAt(2)), [Call::to::<RemoveBreakpoint>(&at)]);
    assert_eq!(state.breakpoints.list.len(), 1, "it is gone at once");
}

#[test]
fn hits_are_visited_in_order_whichever_breakpoint_they_belong_to() {
    let mut state = loaded(0);
    let mut visit = |question: BreakpointCommand| {
        state.perform(Command::Breakpoints(question));
        state.cursor.step
    };
    assert_eq!(
        [
            visit(BreakpointCommand::NextHit),
            visit(BreakpointCommand::NextHit),
            visit(BreakpointCommand::NextHit)
        ],
        [2, 3, 4]
    );
    assert_eq!(visit(BreakpointCommand::NextHit), 4, "there is none after it");
    assert_eq!([visit(BreakpointCommand::PreviousHit), visit(BreakpointCommand::PreviousHit)], [3, 2]);
    state.breakpoints.list[1].on = false;
    state.cursor.step = 0;
    state.perform(Command::Breakpoints(BreakpointCommand::NextHit));
    assert_eq!(state.cursor.step, 3, "what is off does not hit");
}

#[test]
fn hits_are_asked_again_when_the_session_changes_and_once_at_a_time() {
    let mut state = loaded(2);
    let mut view = state.session.clone().unwrap();
    view.breakpoints = vec![Breakpoint { number: 0, expression: "ncc < 0.6".to_owned(), on: true }];
    let heard = |state: &mut State, view: &sightline_session::view::SessionView| {
        state.apply_event(Event::SessionChanged { session: "s1".to_owned() });
        state.take_requests();
        answer::<ShowSession>(state, view);
        is_list_read(state)
    };
    assert!(heard(&mut state, &view));
    assert!(!heard(&mut state, &view), "one is under way");
    answer::<ListBreakpoints>(&mut state, &[breakpoint(0, "ncc < 0.6", &[1, 3])]);
    assert_eq!(state.hit_from(1, true), Some(3));
    assert!(is_list_read(&mut state), "what changed meanwhile is asked for");
}

#[test]
fn a_list_that_was_read_before_a_removal_does_not_bring_the_breakpoint_back() {
    let mut state = loaded(2);
    let mut view = state.session.clone().unwrap();
    view.breakpoints = vec![Breakpoint { number: 0, expression: "ncc < 0.6".to_owned(), on: true }];
    state.session = Some(view);
    state.breakpoints.list = vec![breakpoint(0, "ncc < 0.6", &[1])];
    state.breakpoints.make_stale();
    state.sync_breakpoints();
    assert!(is_list_read(&mut state));
    calls_after(&mut state, BreakpointCommand::Switch { number: 0, on: false });
    calls_after(&mut state, BreakpointCommand::Remove(0));
    answer::<ListBreakpoints>(&mut state, &[breakpoint(0, "ncc < 0.6", &[1])]);
    assert!(state.breakpoints.list.is_empty());
    state.sync_breakpoints();
    assert!(is_list_read(&mut state), "it is read again");
    answer::<ListBreakpoints>(&mut state, &[(); 0]);
    // The reply to a change that was sent before the removal does not restore it either.
    answer::<ChangeBreakpoint>(&mut state, &breakpoint(0, "ncc < 0.6", &[1]));
    assert!(state.breakpoints.list.is_empty());
}

/// A column over the first run whose values are the steps.
fn column(expression: &str, unit: &str) -> QueryAnswer {
    let of_run = RunAnswer {
        target: 0,
        run: 0,
        first_step: 0,
        steps: 5,
        hits: vec![],
        values: vec![None, Some(1.0), Some(2.5), Some(3.0), Some(4.0)],
    };
    QueryAnswer {
        expression: expression.to_owned(),
        answers: Answers::Number,
        unit: unit.to_owned(),
        count: 0,
        runs: vec![of_run],
    }
}

#[test]
fn any_expression_becomes_a_plot_that_can_be_taken_away() {
    let mut state = loaded(2);
    let query = Query { expression: "sigma_m * 2".to_owned(), target: Some(0), values: true };
    let expected = Call::with_body::<QuerySession>(&at_session(), &query);
    assert_eq!(calls_after(&mut state, BreakpointCommand::Plot("sigma_m * 2".to_owned())), [expected]);
    assert_eq!(
        calls_after(&mut state, BreakpointCommand::Plot("sigma_m * 2".to_owned())),
        [],
        "it is plotted already"
    );
    assert_eq!(calls_after(&mut state, BreakpointCommand::Plot("state".to_owned())), []);
    assert!(state.messages.newest().unwrap().text.contains("cannot be plotted"));
    let mut shown = Shown::new(
        [520.0, 520.0],
        move |context| {
            let mut state = watched(context, 2);
            state.perform(Command::Breakpoints(BreakpointCommand::Plot("sigma_m * 2".to_owned())));
            state.take_requests();
            answer::<QuerySession>(&mut state, &column("sigma_m * 2", "m"));
            state
        },
        plots::show,
    );
    shown.says("sigma_m * 2, m").says("2.500").says("plot of sigma_m * 2: 2.500 at step 2, from 1 to 4 m");
    assert_eq!(shown.click("remove plot sigma_m * 2"), [Command::Breakpoints(BreakpointCommand::Unplot(0))]);
}

#[test]
fn a_derived_plot_is_asked_again_when_its_runs_grow() {
    let mut state = loaded(2);
    calls_after(&mut state, BreakpointCommand::Plot("ncc".to_owned()));
    assert_eq!(state.take_requests(), [], "it is under way");
    answer::<QuerySession>(&mut state, &column("ncc", ""));
    assert_eq!(state.take_requests(), []);
    let mut view = state.session.clone().unwrap();
    let rows = &mut view.targets[0].runs[0].rows;
    let mut next = rows[4].clone();
    next.step = 5;
    rows.push(next);
    state.apply_event(Event::SessionChanged { session: "s1".to_owned() });
    state.take_requests();
    answer::<ShowSession>(&mut state, &view);
    assert!(!calls_of::<QuerySession>(&mut state).is_empty());
}

#[test]
fn a_step_is_reached_by_number_difference_time_and_event() {
    let state = loaded(1);
    let go = |text: &str| state.step_meant(text);
    assert_eq!((go("4"), go("+2"), go("-5"), go("−1")), (Ok(4), Ok(3), Ok(0), Ok(0)));
    assert_eq!((go("last"), go("End"), go("first")), (Ok(5), Ok(5), Ok(0)));
    assert_eq!((go("t=130"), go("t = 59.9 s"), go("t=1e9")), (Ok(2), Ok(1), Ok(5)));
    assert_eq!(
        (go("lost"), go("failed"), go("pick"), go("hit"), go("worst")),
        (Ok(3), Ok(4), Ok(0), Ok(2), Ok(4))
    );
    assert!(go("99").unwrap_err().contains("the last one is 5"));
    assert!(go("fault").unwrap_err().contains("No stop of this run"));
    assert!(go("tracking").unwrap_err().contains("is never in the state tracking"));
    assert!(go("soon").unwrap_err().contains("t=3.5"));
    assert!(go("t=now").unwrap_err().contains("not a time in seconds"));
}

#[test]
fn the_go_to_box_shows_what_is_meant_and_keeps_what_cannot_be() {
    let go_to = |text: &'static str| {
        Shown::new(
            [500.0, 400.0],
            move |context| {
                let mut state = watched(context, 1);
                state.mode = crate::command::Mode::GoTo(text.to_owned());
                state
            },
            help::show,
        )
    };
    go_to("lost").says("step 3");
    let mut bad = go_to("nowhere");
    bad.says("is not a step");
    bad.harness.key_press(egui::Key::Enter);
    bad.harness.run_steps(2);
    assert!(!bad.harness.state().contains(&Command::SetMode(crate::command::Mode::Look)));
    let mut good = go_to("+2");
    good.harness.key_press(egui::Key::Enter);
    good.harness.run_steps(2);
    assert!(good.harness.state().contains(&Command::Go(Go::Step(3))));
}
