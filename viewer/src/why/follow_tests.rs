//! Why follows the cursor: to another step, into a branch, and never faster than the server answers.

use sightline_api::wire::Problem;
use sightline_session::Fork;
use sightline_session::view::RunView;
use sightline_session::why::Explanation;

use crate::cache::StepKey;
use crate::command::{Command, Go};
use crate::net::request::{Arrived, Request};
use crate::net::why::{WhyReply, WhyRequest};
use crate::state::State;
use crate::tests::fixture;
use crate::tests::questions::{answer, asked};
use crate::why::{Ask, Told};

/// The step that is lost.
const LOST: usize = 3;

fn key() -> StepKey {
    StepKey { session: "s1".to_owned(), target: 0, run: 0, step: LOST }
}

fn lost() -> State {
    fixture::at_step(&egui::Context::default(), LOST)
}

#[test]
fn the_tree_follows_the_cursor_and_nothing_of_another_step_stands_there_unlabelled() {
    let mut state = fixture::with_history(&egui::Context::default(), LOST);
    let at = |step: usize| StepKey { step, ..key() };
    let explain = |step: usize| WhyRequest::Explain { of: at(step), value: "ncc".to_owned() };
    state.perform(Command::Why(Ask::Value { step: LOST, value: "ncc".to_owned() }));
    state.follow_why();
    assert_eq!(asked(&mut state), vec![explain(LOST)]);
    // While the answer is under way the cursor runs ahead, and only where it rests is asked.
    state.perform(Command::Go(Go::By(-1)));
    state.follow_why();
    state.perform(Command::Go(Go::By(-1)));
    state.follow_why();
    assert!(asked(&mut state).is_empty());
    let empty = Explanation {
        step: LOST,
        sentence: String::new(),
        gates: Vec::new(),
        values: Vec::new(),
        tree: None,
    };
    answer(&mut state, explain(LOST), WhyReply::Explanation(Box::new(empty.clone())));
    state.follow_why();
    assert_eq!(asked(&mut state), vec![explain(1)]);
    let (shown, value, told) = state.explained().unwrap();
    assert_eq!((shown, value, told), (&at(1), "ncc", &Told::Waiting), "the old tree is gone at once");
    answer(&mut state, explain(1), WhyReply::Explanation(Box::new(empty)));
    // A value of an earlier step can be looked into from here.
    state.perform(Command::Why(Ask::Value { step: 0, value: "position".to_owned() }));
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
    state.perform(Command::Why(Ask::Value { step: LOST, value: "ncc".to_owned() }));
    state.follow_why();
    let request = asked(&mut state).remove(0);
    let refused = Problem::new(422, "request", "", "no such value");
    state.arrived(Arrived { request: Request::Why(request), outcome: Err(refused) }, 0.0);
    state.perform(Command::Look { target: 0, run: 1 });
    state.follow_why();
    let branch = StepKey { run: 1, ..key() };
    assert_eq!(asked(&mut state), vec![WhyRequest::Explain { of: branch.clone(), value: "ncc".to_owned() }]);
    assert_eq!((state.explained().unwrap().0, state.why.asked.len()), (&branch, 1));
}

#[test]
fn what_would_have_saved_the_pick_is_answered_without_asking_the_server() {
    let mut state = fixture::at_step(&egui::Context::default(), 0);
    state.take_requests();
    state.perform(Command::Why(Ask::Saved));
    assert!(asked(&mut state).is_empty());
    assert!(state.messages.newest().unwrap().text.contains("picked at this step"));
}
