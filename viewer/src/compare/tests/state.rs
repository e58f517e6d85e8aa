//! Effects of commands and replies on the compared runs.

use crate::tests::compare::*;

#[test]
fn a_comparison_is_requested_again_when_a_run_grows() {
    let mut state = two_runs(&Context::default(), 2);
    assert_eq!(answer(&mut state), 0, "nothing is compared yet");
    state.perform(Command::Compare(CompareCommand::With { place: 0, run: Some(B) }));
    assert_eq!(answer(&mut state), 1);
    assert!(state.comparison().is_some());
    assert_eq!(answer(&mut state), 0);
    state.session.as_mut().unwrap().targets[0].runs[1].rows.pop();
    assert_eq!(answer(&mut state), 1);
    state.perform(Command::Compare(CompareCommand::Align(Alignment::Distance)));
    assert!(state.comparison().is_none(), "what is known is aligned by step");
    assert_eq!(answer(&mut state), 1);
}

#[test]
fn the_first_divergence_goes_to_step_and_stage_and_says_the_sentence() {
    let mut state = compared(&Context::default(), 1);
    let keys = crate::command::keys::command(Keyboard::D, Modifiers::NONE, &state);
    assert_eq!(keys, Some(Command::Compare(CompareCommand::FirstDivergence)));
    state.perform(keys.unwrap());
    assert_eq!((state.cursor.step, state.stage()), (3, Stage::MATCH_TEMPLATE));
    let said = &state.messages.newest().unwrap().text;
    assert!(said.contains("run A and run B first differ at step 3 in match_template"), "{said}");
    // Requested before the reply has arrived, the jump happens on its arrival.
    let mut early = two_runs(&Context::default(), 0);
    early.perform(Command::Compare(CompareCommand::With { place: 0, run: Some(B) }));
    early.perform(Command::Compare(CompareCommand::FirstDivergence));
    assert_eq!(early.cursor.step, 0);
    answer(&mut early);
    assert_eq!(early.cursor.step, 3);
}

#[test]
fn a_refused_comparison_says_why() {
    let mut state = two_runs(&Context::default(), 1);
    state.perform(Command::Compare(CompareCommand::With { place: 0, run: Some(B) }));
    let problem = Problem {
        code: "request".to_owned(),
        title: String::new(),
        status: 422,
        detail: "target 0 has no run 1".to_owned(),
        hint: None,
        nearest_pixel: None,
        received: None,
    };
    state.take_requests();
    calls::refuse::<CompareRuns>(&mut state, problem);
    assert_eq!(state.comparison_problem(), Some("target 0 has no run 1"));
    state.perform(Command::Compare(CompareCommand::FirstDivergence));
    assert_eq!(state.messages.newest().unwrap().text, "target 0 has no run 1");
}

#[test]
fn without_a_run_to_compare_with_the_keys_say_how_to_get_one() {
    for command in [CompareCommand::FirstDivergence, CompareCommand::NextView] {
        let mut state = fixture::at_step(&Context::default(), 2);
        state.perform(Command::Compare(command));
        let message = state.messages.newest().unwrap();
        assert!(message.text.contains("no run to compare with"), "{}", message.text);
    }
}

#[test]
fn looking_at_the_other_run_exchanges_the_two() {
    let mut state = compared(&Context::default(), 3);
    state.perform(Command::SelectRun { target: 0, run: 1 });
    assert_eq!((state.own_name(), state.compare.others.as_slice()), (Some(B), &[A][..]));
    state.perform(Command::Compare(CompareCommand::Toggle(A)));
    assert!(state.compare.others.is_empty() && !state.is_comparing());
}

#[test]
fn four_runs_have_four_marks_and_a_fifth_is_refused() {
    let mut state = compared(&Context::default(), 3);
    for number in [2, 4, 5] {
        let mut run = state.run().unwrap().clone();
        run.number = number;
        state.session.as_mut().unwrap().targets[0].runs.push(run);
        state.perform(Command::Compare(CompareCommand::Toggle(RunName { target: 0, run: number })));
    }
    assert!(state.messages.newest().unwrap().text.contains("At most 4 runs"));
    let others = state.others();
    assert_eq!(others.len(), 3);
    // Run 4 shares the first mark, which is taken: it gets the free one.
    let marks: Vec<_> = others.iter().map(|other| other.style.mark).collect();
    use crate::drawing::overlay::Mark;
    assert_eq!(marks, [Mark::Square, Mark::Triangle, Mark::Diamond]);
    assert_eq!(state.own_style().mark, Mark::Ring);
}

#[test]
fn letting_the_key_go_ends_the_blinking() {
    let mut state = compared(&Context::default(), 3);
    let context = Context::default();
    assert_eq!(crate::compare::keys::blink_command(&context, &state), None);
    state.perform(Command::Compare(CompareCommand::Blink(true)));
    assert_eq!(
        crate::compare::keys::blink_command(&context, &state),
        Some(Command::Compare(CompareCommand::Blink(false)))
    );
}

#[test]
fn a_visit_goes_to_the_run_and_the_step() {
    let mut state = compared(&Context::default(), 1);
    state.perform(Command::Compare(CompareCommand::Visit { run: B, step: 4 }));
    assert_eq!((state.cursor.run, state.cursor.step), (1, 4));
    assert_eq!(state.compare.others, [A], "what was looked at is what is compared with");
}

#[test]
fn metrics_are_requested_only_while_visible() {
    let mut state = two_runs(&Context::default(), 2);
    let metrics_calls = |state: &mut State| calls_of::<ShowMetrics>(state).len();
    assert_eq!(metrics_calls(&mut state), 0);
    state.compare.wants_metrics = true;
    assert_eq!(metrics_calls(&mut state), 2);
    assert_eq!(metrics_calls(&mut state), 0, "each is asked for once");
}

#[test]
fn only_items_of_the_compared_runs_are_fetched() {
    let state = compared(&Context::default(), 2);
    let wanted = state.needed_items();
    let of_b = |key: &&Key| matches!(key, Key::Trace(step) | Key::Arrays(step) if step.run == 1);
    let steps: Vec<usize> = wanted
        .iter()
        .filter(of_b)
        .filter_map(|key| if let Key::Trace(step) = key { Some(step.step) } else { None })
        .collect();
    assert_eq!(steps, [2, 3, 1]);
    let arrays =
        wanted.iter().filter(of_b).filter(|key| matches!(key, Key::Arrays(step) if step.step == 2)).count();
    assert_eq!(arrays, 1, "of the step that is looked at alone");
    let mut alone = state;
    alone.perform(Command::Compare(CompareCommand::Toggle(B)));
    assert!(!alone.needed_items().iter().any(|key| of_b(&key)));
}

#[test]
fn aligned_by_distance_the_other_run_is_read_at_the_stop_that_stands_beside() {
    let mut state = two_runs(&Context::default(), 2);
    state.perform(Command::Compare(CompareCommand::With { place: 0, run: Some(B) }));
    state.perform(Command::Compare(CompareCommand::Align(Alignment::Distance)));
    twice_as_far(&mut state);
    assert_eq!([0, 1, 2, 4].map(|step| state.aligned_step(B, step)), [Some(0), None, Some(1), Some(2)]);
    assert_eq!(state.own_aligned_step(B, 2), Some(4));
    assert_eq!(state.other_trace(B).ready().unwrap().step, 1);
    state.perform(Command::Go(Go::Step(1)));
    assert!(state.other_trace(B).ready().is_none());
}
