//! Effects of commands and replies on the state: cursor, targets, refusals and requests.

use sightline_api::endpoint::Call;
use sightline_api::endpoints::{
    DesignateTarget, ListSessions, ListSettings, ListTraverses, MoveCursor, ShowCursor, ShowRun, ShowSession,
};
use sightline_api::event::Event;
use sightline_api::location::{Anywhere, AtRun, AtSession};
use sightline_api::query::FirstRow;
use sightline_api::wire::{Problem, SessionEntry};
use sightline_geometry::frames::Pixel;
use sightline_session::Cursor;
use sightline_session::compare::RunName;
use sightline_session::step::StepRow;
use sightline_session::view::RunView;

use crate::cache::{ImageSide, Key, Slot};
use crate::command::{Command, Go, Mode};
use crate::net::events::Connection;
use crate::net::request::{CompletedRequest, Request};
use crate::state::{State, events};
use crate::tests::calls::{answer, at_session, bodies, calls, calls_of, refuse};
use crate::tests::fixture::{STOPS, at_step, nothing, without_target};

fn loaded(step: usize) -> State {
    at_step(&egui::Context::default(), step)
}

/// As [`loaded`], with the cursor sent to the server.
fn settled(step: usize) -> State {
    let mut state = loaded(step);
    assert_eq!(moves(&mut state), [step]);
    take_cursor(&mut state);
    state
}

/// Removes all requests; returns the steps to which the server's cursor is moved.
fn moves(state: &mut State) -> Vec<usize> {
    bodies::<MoveCursor>(state).into_iter().map(|cursor| cursor.step).collect()
}

/// The server acknowledges the pending cursor.
fn take_cursor(state: &mut State) {
    answer::<MoveCursor>(state, &Cursor::default());
}

pub(super) fn problem(status: u16) -> Problem {
    Problem {
        code: "target".to_owned(),
        title: String::new(),
        status,
        detail: "no 3-D position".to_owned(),
        hint: None,
        nearest_pixel: None,
        received: None,
    }
}

#[test]
fn a_page_that_is_opened_late_shows_what_a_run_waits_for() {
    let mut state = loaded(0);
    let mut view = state.session.clone().unwrap();
    view.targets[0].runs[0].waits_for = Some(2);
    state.adopt(view, false);
    assert_eq!(state.progress[&(0, 0)].doing, "waiting for 2 runs before it");
}

#[test]
fn the_cursor_stays_on_the_drive_and_jumps_between_events() {
    let mut state = loaded(0);
    let mut go = |go: Go| {
        state.perform(Command::Go(go));
        state.cursor.step
    };
    assert_eq!(go(Go::By(1)), 1);
    assert_eq!(go(Go::By(-10)), 0);
    assert_eq!(go(Go::Last), STOPS - 1);
    assert_eq!(go(Go::By(1)), STOPS - 1);
    assert_eq!(go(Go::First), 0);
    assert_eq!(go(Go::NextEvent), 3, "tracking → lost");
    assert_eq!(go(Go::NextEvent), 4, "lost → failed");
    assert_eq!(go(Go::NextEvent), 4, "there is none after it");
    assert_eq!(go(Go::PreviousEvent), 3);
    assert_eq!(go(Go::PreviousEvent), 0, "the designation");
    assert_eq!(events(state.run().unwrap()), vec![0, 3, 4]);
}

#[test]
fn a_page_without_a_link_opens_the_latest_session_of_the_first_traverse() {
    let mut state = nothing();
    state.begin();
    let anywhere = Anywhere {};
    let expected = [Call::to::<ListSettings>(&anywhere), Call::to::<ListTraverses>(&anywhere)];
    assert_eq!(calls(&mut state), expected);
    answer::<ListTraverses>(&mut state, &[super::fixture::entry()]);
    assert_eq!(calls(&mut state), [Call::to::<ListSessions>(&anywhere)]);
    let entry = |id: &str, traverse: &str| SessionEntry {
        id: id.to_owned(),
        traverse: traverse.to_owned(),
        target_count: 1,
        traverse_name: traverse.to_owned(),
        run_count: 1,
        step: 0,
        stop_count: 5,
        used: None,
        idle_s: None,
    };
    let list = [entry("a", "drive"), entry("b", "drive"), entry("c", "other")];
    answer::<ListSessions>(&mut state, &list);
    assert_eq!(calls(&mut state), [Call::to::<ShowSession>(&AtSession { session: "b".to_owned() })]);
}

#[test]
fn a_refused_designation_is_shown_at_its_place_with_the_servers_sentence() {
    let mut state = without_target();
    state.perform(Command::SetMode(Mode::Pick));
    state.perform(Command::Pick(Pixel::new(10.0, 20.0)));
    assert!(state.designating.is_some());
    refuse::<DesignateTarget>(&mut state, problem(422));
    let refusal = state.refusal.as_ref().unwrap();
    assert_eq!((refusal.place.pixel, refusal.sentence.as_str()), (Pixel::new(10.0, 20.0), "no 3-D position"));
    assert_eq!(state.messages.newest().unwrap().text, "no 3-D position");
    assert_eq!(state.mode, Mode::Pick, "another pixel can be tried at once");
    state.perform(Command::SetMode(Mode::Look));
    state.perform(Command::SetMode(Mode::Look));
    assert!(state.refusal.is_none());
}

#[test]
fn the_cursor_is_sent_once_at_a_time_and_an_older_answer_does_not_move_it_back() {
    let mut state = settled(0);
    state.perform(Command::Go(Go::By(1)));
    assert_eq!(moves(&mut state), [1]);
    assert!(state.take_requests().is_empty(), "nothing is sent while one is under way");
    state.perform(Command::Go(Go::By(1)));
    let mut view = state.session.clone().unwrap();
    view.cursor = Cursor::default();
    state.read_session("s1".to_owned());
    answer::<ShowSession>(&mut state, &view);
    assert_eq!(state.cursor.step, 2);
    take_cursor(&mut state);
    assert_eq!(moves(&mut state), [2], "the newest cursor is sent");
}

#[test]
fn an_answer_from_before_the_cursor_was_taken_does_not_move_it_back() {
    let mut state = settled(0);
    state.perform(Command::Go(Go::By(1)));
    assert_eq!(moves(&mut state), [1]);
    state.apply_event(Event::SessionChanged { session: "s1".to_owned() });
    assert_eq!(calls(&mut state), [Call::to::<ShowSession>(&at_session())]);
    let mut view = state.session.clone().unwrap();
    view.cursor = Cursor { target: Some(0), run: 0, step: 0 };
    take_cursor(&mut state);
    answer::<ShowSession>(&mut state, &view);
    assert_eq!(state.cursor.step, 1, "the session was read before the server took the cursor");
    state.apply_event(Event::SessionChanged { session: "s1".to_owned() });
    assert_eq!(calls(&mut state), [Call::to::<ShowSession>(&at_session())]);
    view.cursor.step = 4;
    answer::<ShowSession>(&mut state, &view);
    assert_eq!(state.cursor.step, 4, "another page moved it");
}

#[test]
fn progress_of_a_run_reads_the_session_again_and_ends() {
    let mut state = loaded(2);
    state.take_requests();
    let progress = |ended: bool| Event::RunProgress {
        session: "s1".to_owned(),
        target: 0,
        run: 0,
        k: 5,
        n: 6,
        ended,
        doing: "step 5".to_owned(),
    };
    let rows = |state: &State| state.run().unwrap().rows.len();
    let (had, whole) = (rows(&state), state.run().unwrap().clone());
    state.apply_event(progress(false));
    assert_eq!(state.run_progress().unwrap().k, 5);
    let rows_from = |from_row: usize| {
        let at = AtRun { session: "s1".to_owned(), target: 0, run: 0 };
        Call::with_query::<ShowRun>(&at, &FirstRow { from_row })
    };
    assert_eq!(calls(&mut state), [rows_from(had)], "only the new rows are read");
    state.apply_event(progress(true));
    assert!(state.run_progress().is_none());
    assert!(state.take_requests().is_empty(), "one question at a time");
    let new = StepRow { step: had, ..whole.rows[had - 1].clone() };
    let tail = RunView { rows: vec![new.clone()], complete: true, ..whole.clone() };
    answer::<ShowRun>(&mut state, &tail);
    assert_eq!(rows(&state), had + 1);
    assert_eq!(state.run().unwrap().rows.last(), Some(&new));
    assert!(state.run().unwrap().complete);
    // The run ended while the rows were read: the rows until then are also read, but not added twice.
    assert_eq!(calls_of::<ShowRun>(&mut state), [rows_from(had + 1)]);
    refuse::<ShowRun>(&mut state, problem(404));
    assert!(calls(&mut state).contains(&Call::to::<ShowSession>(&at_session())), "the run may be removed");
    let name = RunName { target: 0, run: 0 };
    state.read_rows("s1".to_owned(), name, had);
    answer::<ShowRun>(&mut state, &whole);
    assert_eq!(rows(&state), had + 1, "an answer that begins at another row is not taken");
    let tail = RunView { rows: vec![new], ..whole };
    state.read_rows("s2".to_owned(), name, had + 1);
    answer::<ShowRun>(&mut state, &tail);
    assert_eq!(rows(&state), had + 1, "an answer about another session is not taken either");
}

#[test]
fn a_cursor_that_another_page_moved_is_followed_and_the_own_one_is_not_read_back() {
    let mut state = settled(0);
    let cursor_moved = |step: usize| Event::CursorMoved {
        session: "s1".to_owned(),
        cursor: Cursor { target: Some(0), run: 0, step },
    };
    let read = |state: &mut State, step: usize| {
        answer::<ShowCursor>(state, &Cursor { target: Some(0), run: 0, step });
    };
    let reading = [Call::to::<ShowCursor>(&at_session())];
    state.perform(Command::Go(Go::By(1)));
    assert_eq!(moves(&mut state), [1]);
    state.apply_event(cursor_moved(1));
    take_cursor(&mut state);
    state.apply_event(cursor_moved(1));
    assert!(state.take_requests().is_empty(), "that is this page's own cursor");
    // Another page goes to step 4; a late event is ignored, a read is adopted.
    state.apply_event(cursor_moved(3));
    assert_eq!(calls(&mut state), reading);
    read(&mut state, 4);
    assert_eq!(state.cursor.step, 4);
    assert!(state.take_requests().is_empty(), "and is not sent back");
    // A reply that crossed a cursor of this page may be older than that cursor.
    state.apply_event(cursor_moved(2));
    assert_eq!(calls(&mut state), reading);
    state.perform(Command::Go(Go::By(1)));
    assert_eq!(moves(&mut state), [5]);
    take_cursor(&mut state);
    read(&mut state, 2);
    assert_eq!(state.cursor.step, 5);
    // A cursor of another session is ignored too.
    state.apply_event(cursor_moved(3));
    assert_eq!(calls(&mut state), reading);
    state.session.as_mut().unwrap().id = "s2".to_owned();
    read(&mut state, 3);
    assert_eq!(state.cursor.step, 5);
}

#[test]
fn needed_items_start_with_the_cursor_then_its_neighbours() {
    let state = loaded(2);
    let wanted = state.needed_items();
    let key = state.step_key(2).unwrap();
    assert_eq!(wanted[0], Key::Trace(key.clone()));
    assert_eq!(wanted[1], Key::Arrays(key));
    assert!(wanted.contains(&Key::Trace(state.step_key(1).unwrap())));
    assert!(wanted.contains(&Key::Trace(state.step_key(3).unwrap())));
    let last = loaded(STOPS - 2).needed_items();
    let unrendered = state.image_key(STOPS - 1, ImageSide::Left).unwrap();
    assert!(!last.contains(&unrendered), "rendering ahead is the server's to decide");
    assert!(loaded(STOPS - 1).needed_items().contains(&unrendered), "but what is looked at is asked for");
}

#[test]
fn loaded_steps_stay_when_the_server_goes_and_all_is_asked_again_when_it_comes_back() {
    let mut state = loaded(2);
    state.connected(Connection::Gone { attempts: 1 });
    assert!(state.messages.newest().unwrap().text.contains("does not answer"));
    assert!(matches!(state.trace_at(2), Slot::Ready(_)));
    state.perform(Command::Go(Go::By(1)));
    assert_eq!(state.cursor.step, 3);
    assert!(state.take_requests().is_empty());
    state.connected(Connection::Live);
    let calls = calls(&mut state);
    assert!(calls.contains(&Call::to::<ShowSession>(&at_session())));
    assert!(calls.contains(&Call::with_body::<MoveCursor>(&at_session(), &state.cursor)));
    assert_eq!(state.cursor.step, 3);
}

#[test]
fn a_stop_that_was_rendered_is_asked_for_again() {
    let mut state = without_target();
    state.cursor.step = STOPS - 1;
    let key = state.image_key(STOPS - 1, ImageSide::Left).unwrap();
    state.cache.request(std::slice::from_ref(&key), |_| true, 0.0);
    state.apply_reply(
        CompletedRequest { request: Request::Item(key.clone()), outcome: Err(problem(503)) },
        0.0,
    );
    assert!(state.cache.request(std::slice::from_ref(&key), |_| true, 0.1).is_empty());
    let (traverse, ready) = ("drive".to_owned(), Some(STOPS - 1));
    state.apply_event(Event::RenderProgress { traverse, k: STOPS, n: STOPS, ready });
    assert_eq!(state.cache.request(std::slice::from_ref(&key), |_| true, 0.1), vec![key]);
    assert!(state.stop().unwrap().ready && state.rendering.is_none());
}
