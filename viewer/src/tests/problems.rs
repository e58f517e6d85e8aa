//! Display of problems: the card, the list of messages, and an unreachable server.

use sightline_api::endpoint::Call;
use sightline_api::endpoints::{ForkRun, MoveCursor, RemoveTarget, ShowSession};
use sightline_api::wire::{Problem, Received};
use sightline_session::Cursor;

use crate::cache::ImageSide;
use crate::command::{Command, Go, Mode};
use crate::files::FilesCommand;
use crate::net::events::Connection;
use crate::panels::card;
use crate::panels::pane::Pane;
use crate::state::State;
use crate::tests::calls::{answer, at_session, bodies, calls, refuse};
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
    refuse::<ForkRun>(&mut state, problem());
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
    let mut state = refused(&egui::Context::default());
    state.perform(Command::RunFromHere(state.draft.clone()));
    assert!(state.messages.card().is_none(), "it is tried again");
    refuse::<ForkRun>(&mut state, problem());
    assert!(state.messages.card().is_some(), "and refused again");
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
fn a_change_without_a_server_is_reported_as_lost() {
    let mut state = fixture::at_step(&egui::Context::default(), 2);
    state.connected(Connection::Gone { attempts: 3 });
    let gone = || Problem::new(0, "unreachable", "", "The server does not answer.");
    let count = |state: &State| state.messages.all().len();
    let before = count(&state);
    state.perform(Command::RemoveTarget(0));
    refuse::<RemoveTarget>(&mut state, gone());
    assert_eq!(count(&state), before + 1);
    assert!(state.messages.newest().unwrap().text.contains("nothing was changed"));
    state.read_session("s1".to_owned());
    refuse::<ShowSession>(&mut state, gone());
    assert_eq!(count(&state), before + 1, "the banner says that");
}

#[test]
fn the_cursor_is_kept_when_a_server_comes_back_that_forgot_its_last_move() {
    let mut state = fixture::at_step(&egui::Context::default(), 2);
    state.connected(Connection::Gone { attempts: 1 });
    state.take_requests();
    state.perform(Command::Go(Go::By(2)));
    state.connected(Connection::Live);
    assert!(calls(&mut state).contains(&Call::to::<ShowSession>(&at_session())));
    // The server reports an outdated cursor: it was ended before it had stored the last move.
    answer::<MoveCursor>(&mut state, &Cursor::default());
    let mut view = state.session.clone().unwrap();
    view.cursor.step = 1;
    answer::<ShowSession>(&mut state, &view);
    assert_eq!(state.cursor.step, 4);
    let again: Vec<usize> = bodies::<MoveCursor>(&mut state).iter().map(|cursor| cursor.step).collect();
    assert_eq!(again, [4]);
    // Later moves by other pages are adopted again.
    answer::<MoveCursor>(&mut state, &Cursor::default());
    view.cursor.step = 3;
    state.read_session("s1".to_owned());
    answer::<ShowSession>(&mut state, &view);
    assert_eq!(state.cursor.step, 3);
}

#[test]
fn an_image_that_cannot_be_read_names_file_and_remedy_and_can_be_tried_again() {
    let broken = |context: &egui::Context| {
        let mut state = fixture::at_step(context, 2);
        let key = state.image_key(2, ImageSide::Left).unwrap();
        let problem = Problem::new(422, "file", "", "cannot read left_0002.png: no such file");
        let problem = Problem { hint: Some("Put the file back.".to_owned()), ..problem };
        state.cache.store(key, Err(problem), 0.0);
        state
    };
    let mut shown = Shown::pane(Pane::Left, broken);
    shown
        .says("The left image of step 2 cannot be shown: cannot read left_0002.png")
        .says("Put the file back.");
    let again = vec![Command::Files(FilesCommand::TryAgain)];
    assert_eq!(shown.click("try the left image of step 2 again"), again);
    let mut state = broken(&egui::Context::default());
    let key = state.image_key(2, ImageSide::Left).unwrap();
    assert!(state.cache.request(std::slice::from_ref(&key), |_| true, 1.0).is_empty(), "a refusal stays");
    state.perform(Command::Files(FilesCommand::TryAgain));
    assert_eq!(state.cache.request(std::slice::from_ref(&key), |_| true, 1.0), vec![key]);
}
