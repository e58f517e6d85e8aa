//! Why follows the cursor: to another step, into a branch, and never faster than the server replies.

use std::sync::Arc;

use sightline_api::endpoint::Call;
use sightline_api::endpoints::{AskCounterfactual, ShowWhy};
use sightline_api::query::ValueName;
use sightline_api::wire::Problem;
use sightline_session::Fork;
use sightline_session::view::RunView;
use sightline_session::why::Explanation;

use crate::cache::{Item, Key, StepKey};
use crate::command::{Command, Go};
use crate::state::State;
use crate::tests::calls::{answer, calls_of, refuse};
use crate::tests::fixture;
use crate::tests::fixture::trace;
use crate::why::{Remote, WhyCommand};

/// The step at which the target is lost.
const LOST: usize = 3;

fn key() -> StepKey {
    StepKey { session: "s1".to_owned(), target: 0, run: 0, step: LOST }
}

fn explain(at: &StepKey) -> Call {
    Call::with_query::<ShowWhy>(at, &ValueName { value: Some("ncc".to_owned()) })
}

fn lost() -> State {
    fixture::at_step(&egui::Context::default(), LOST)
}

#[test]
fn the_tree_follows_the_cursor_and_nothing_of_another_step_stands_there_unlabelled() {
    let mut state = fixture::with_history(&egui::Context::default(), LOST);
    let at = |step: usize| StepKey { step, ..key() };
    state.perform(Command::Why(WhyCommand::Value { step: LOST, value: "ncc".to_owned() }));
    state.follow_why();
    assert_eq!(calls_of::<ShowWhy>(&mut state), [explain(&at(LOST))]);
    // While the reply is pending the cursor moves on, and only the step where it stops is requested.
    state.perform(Command::Go(Go::By(-1)));
    state.follow_why();
    state.perform(Command::Go(Go::By(-1)));
    state.follow_why();
    assert!(calls_of::<ShowWhy>(&mut state).is_empty());
    let empty = Explanation {
        step: LOST,
        sentence: String::new(),
        gates: Vec::new(),
        values: Vec::new(),
        tree: None,
    };
    answer::<ShowWhy>(&mut state, &empty);
    state.follow_why();
    assert_eq!(calls_of::<ShowWhy>(&mut state), [explain(&at(1))]);
    let (shown, value, remote) = state.explained().unwrap();
    assert_eq!((shown, value, remote), (&at(1), "ncc", &Remote::Pending), "the old tree is gone at once");
    answer::<ShowWhy>(&mut state, &empty);
    // A value of an earlier step can be examined from here.
    state.perform(Command::Why(WhyCommand::Value { step: 0, value: "position".to_owned() }));
    state.follow_why();
    assert_eq!(state.explained().unwrap().0, &at(0));
    assert_eq!(state.whose(&at(0)), "run A, step 0");
    let other = StepKey { target: 7, run: 1, ..at(2) };
    assert_eq!(state.whose(&other), "run B, step 2");
}

#[test]
fn a_branch_that_is_looked_at_gets_its_own_tree() {
    let mut state = lost();
    let run = RunView { number: 1, fork: Some(Fork::new(0, 2)), ..state.run().unwrap().clone() };
    state.session.as_mut().unwrap().targets[0].runs.push(run);
    state.perform(Command::Why(WhyCommand::Value { step: LOST, value: "ncc".to_owned() }));
    state.follow_why();
    refuse::<ShowWhy>(&mut state, Problem::new(422, "request", "", "no such value"));
    state.take_requests();
    state.perform(Command::SelectRun { target: 0, run: 1 });
    state.follow_why();
    assert!(calls_of::<ShowWhy>(&mut state).is_empty(), "nobody knows yet what the step of the branch has");
    let branch = StepKey { run: 1, ..key() };
    let record = Item::Trace(Arc::new(trace(LOST)));
    state.cache.store(Key::Trace(branch.clone()), Ok(record), 0.0);
    state.follow_why();
    assert_eq!(calls_of::<ShowWhy>(&mut state), [explain(&branch)]);
    assert_eq!((state.explained().unwrap().0, state.why.history.len()), (&branch, 1));
}

#[test]
fn a_value_that_a_step_lacks_is_not_asked_for_there() {
    let mut state = fixture::with_history(&egui::Context::default(), LOST);
    state.perform(Command::Why(WhyCommand::Value { step: LOST, value: "gate.ncc".to_owned() }));
    state.follow_why();
    refuse::<ShowWhy>(&mut state, Problem::new(422, "request", "", "no such value"));
    state.take_requests();
    // At the designation there is no match.
    state.perform(Command::Go(Go::Step(0)));
    state.follow_why();
    assert!(calls_of::<ShowWhy>(&mut state).is_empty());
    assert_eq!(state.explained().unwrap().0, &key());
    state.perform(Command::Why(WhyCommand::Selected));
    let asked = Call::with_query::<ShowWhy>(
        &StepKey { step: 0, ..key() },
        &ValueName { value: Some("state".to_owned()) },
    );
    assert_eq!(calls_of::<ShowWhy>(&mut state), [asked]);
}

#[test]
fn counterfactuals_of_the_pick_need_no_request() {
    let mut state = fixture::at_step(&egui::Context::default(), 0);
    state.take_requests();
    state.perform(Command::Why(WhyCommand::Saved));
    assert!(calls_of::<AskCounterfactual>(&mut state).is_empty());
    assert!(state.messages.newest().unwrap().text.contains("picked at this step"));
}

#[test]
fn another_session_shows_no_value_of_the_last_one() {
    let mut state = lost();
    state.perform(Command::Why(WhyCommand::Value { step: LOST, value: "ncc".to_owned() }));
    assert!(state.explained().is_some());
    let mut other = state.session.clone().expect("a session");
    other.id = "s2".to_owned();
    state.adopt(other, true);
    assert!(state.explained().is_none());
}
