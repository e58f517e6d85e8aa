//! What a person sees of a problem: the card, the list of messages, and a server that is gone.

use sightline_api::wire::{Problem, Received};

use crate::cache::Eye;
use crate::command::{Command, Go, Mode};
use crate::files::Ask;
use crate::net::events::Connection;
use crate::net::request::{Arrived, Reply, Request};
use crate::panels::card;
use crate::panels::pane::Pane;
use crate::state::State;
use crate::tests::{Shown, fixture};

fn problem() -> Problem {
    let received = Received { request_id: "6a-17".to_owned(), time: "2026-11-22T15:00:00Z".to_owned() };
    let hint = Some("The traverse has 6 stops.".to_owned());
    let said = Problem::new(422, "field", "", "from_step: must be from 0 to 5, not 9");
    Problem { hint, received: Some(Box::new(received)), ..said }
}

/// A page whose run from here was refused.
fn refused(context: &egui::Context) -> State {
    let mut state = fixture::at_step(context, 2);
    state.take_requests();
    state.perform(Command::RunFromHere(state.draft.clone()));
    let request = state.take_requests().into_iter().find(|r| matches!(r, Request::NewRun { .. })).unwrap();
    state.arrived(Arrived { request, outcome: Err(problem()) }, 0.0);
    state
}

#[test]
fn a_problem_has_a_card_with_sentence_remedy_code_and_details_until_it_is_closed() {
    let mut shown = Shown::new([900.0, 700.0], refused, card::show);
    shown.says("problem: from_step: must be").says("The traverse has 6 stops.").says("code field");
    shown.click("Details");
    shown
        .says("6a-17")
        .says("2026-11-22T15:00:00Z")
        .says("POST sessions/s1/targets/0/runs")
        .says("from_step");
    assert_eq!(shown.click("close the problem"), vec![Command::CloseCard]);
    let mut state = refused(&egui::Context::default());
    let words = state.messages.card().unwrap().words();
    for part in ["from_step: must be", "what to do: The", "code: field", "field: from_step", "request: 6a-17"]
    {
        assert!(words.contains(part), "{words}");
    }
    state.perform(Command::SetMode(Mode::Look));
    assert!(state.messages.card().is_none(), "Esc closes it");
    assert_eq!(
        state.messages.newest().unwrap().text,
        "from_step: must be from 0 to 5, not 9",
        "it stays listed"
    );
    let mut listed = Shown::pane(Pane::Messages, refused);
    listed.says("code field");
    listed.click("Details");
    listed.says("6a-17");
}

#[test]
fn a_file_that_cannot_be_opened_has_a_card_of_its_own() {
    let dropped = |context: &egui::Context| {
        let mut state = fixture::at_step(context, 2);
        state.file_arrived(crate::files::inbox::Arrival::Refused("“a.rrd” is a Rerun recording.".to_owned()));
        state
    };
    Shown::new([900.0, 700.0], dropped, card::show).says("problem: “a.rrd” is a Rerun").says("code file");
}

#[test]
fn a_deed_that_no_server_heard_of_is_said_to_have_come_to_nothing() {
    let mut state = fixture::at_step(&egui::Context::default(), 2);
    state.connected(Connection::Gone { attempts: 3 });
    let lost = |state: &mut State, request: Request| {
        let before = state.messages.all().len();
        let gone = Problem::new(0, "unreachable", "", "The server does not answer.");
        state.arrived(Arrived { request, outcome: Err(gone) }, 0.0);
        state.messages.all().len() - before
    };
    assert_eq!(lost(&mut state, Request::RemoveTarget { session: "s1".to_owned(), target: 0 }), 1);
    assert!(state.messages.newest().unwrap().text.contains("nothing was changed"));
    assert_eq!(lost(&mut state, Request::Session("s1".to_owned())), 0, "the banner says that");
}

#[test]
fn the_cursor_is_kept_when_a_server_comes_back_that_forgot_its_last_move() {
    let mut state = fixture::at_step(&egui::Context::default(), 2);
    state.connected(Connection::Gone { attempts: 1 });
    state.take_requests();
    state.perform(Command::Go(Go::By(2)));
    state.connected(Connection::Live);
    let requests = state.take_requests();
    let request = Request::Session("s1".to_owned());
    assert!(requests.contains(&request));
    // The server tells of a place where the page was never: it was ended before it had written the last move.
    let put = requests.into_iter().find(|r| matches!(r, Request::PutCursor { .. })).unwrap();
    state.arrived(Arrived { request: put, outcome: Ok(Reply::Done) }, 0.0);
    let mut view = state.session.clone().unwrap();
    view.cursor.step = 1;
    let reply = Reply::Session(Box::new(view.clone()));
    state.arrived(Arrived { request: request.clone(), outcome: Ok(reply) }, 0.0);
    assert_eq!(state.cursor.step, 4);
    let again = state.take_requests();
    assert!(
        again.iter().any(|r| matches!(r, Request::PutCursor { cursor, .. } if cursor.step == 4)),
        "{again:?}"
    );
    // Later moves by others count again.
    for put in again {
        if matches!(put, Request::PutCursor { .. }) {
            state.arrived(Arrived { request: put, outcome: Ok(Reply::Done) }, 0.0);
        }
    }
    view.cursor.step = 3;
    state.arrived(Arrived { request, outcome: Ok(Reply::Session(Box::new(view))) }, 0.0);
    assert_eq!(state.cursor.step, 3);
}

#[test]
fn an_image_that_cannot_be_read_names_file_and_remedy_and_can_be_tried_again() {
    let broken = |context: &egui::Context| {
        let mut state = fixture::at_step(context, 2);
        let key = state.image_key(2, Eye::Left).unwrap();
        let problem = Problem::new(422, "file", "", "cannot read left_0002.png: no such file");
        let problem = Problem { hint: Some("Put the file back.".to_owned()), ..problem };
        state.cache.arrived(key, Err(problem), 0.0);
        state
    };
    let mut shown = Shown::pane(Pane::Left, broken);
    shown
        .says("The left image of step 2 cannot be shown: cannot read left_0002.png")
        .says("Put the file back.");
    let again = vec![Command::Files(Ask::TryAgain)];
    assert_eq!(shown.click("try the left image of step 2 again"), again);
    let mut state = broken(&egui::Context::default());
    let key = state.image_key(2, Eye::Left).unwrap();
    assert!(state.cache.want(std::slice::from_ref(&key), |_| true, 1.0).is_empty(), "a refusal stays");
    state.perform(Command::Files(Ask::TryAgain));
    assert_eq!(state.cache.want(std::slice::from_ref(&key), |_| true, 1.0), vec![key]);
}
