//! Notes and exports: display, requests, and that no text is lost.

use sightline_api::endpoint::{Call, Endpoint};
use sightline_api::endpoints::{AddNote, ChangeNote, ListExports, ListNotes, RemoveNote, RestoreNote};
use sightline_api::event::Event;
use sightline_api::location::AtNote;
use sightline_api::wire::Problem;
use sightline_session::exports::{ExportEntry, Size};
use sightline_session::notes::{EditNote, Note, Pin};
use sightline_session::shell::WITH_TOKEN;

use egui_kittest::kittest::Queryable;

use crate::command::{Command, Stage};
use crate::exports;
use crate::exports::window;
use crate::figure::request::{FigureFormat, FigureRequest};
use crate::notes::NotesCommand;
use crate::notes::panel;
use crate::panels::pane::Pane;
use crate::state::State;
use crate::state::effect::Effect;
use crate::tests::calls::{self, answer, bodies, calls_of};
use crate::tests::{Shown, fixture};

fn note(id: u64, step: usize, target: Option<usize>, text: &str) -> Note {
    let stage = target.map(|_| "judge".to_owned());
    let pin = Pin { target, run: 0, step, stage, pixel: None };
    let time = || "2026-11-22T12:00:00Z".to_owned();
    Note { id, revision: 3, pin, text: text.to_owned(), made: time(), changed: time() }
}

/// A session at step 2 with three notes.
fn noted(context: &egui::Context) -> State {
    let mut state = fixture::at_step(context, 2);
    state.notes.list = Some(vec![
        note(4, 3, Some(0), "the **shade** moved"),
        note(7, 1, None, "a dusty stop"),
        note(5, 2, Some(0), "still fine"),
    ]);
    state
}

fn perform(state: &mut State, command: NotesCommand) {
    state.perform(Command::Notes(command));
}

fn refuse<E: Endpoint>(state: &mut State) {
    let detail = "Note 5 was changed meanwhile.".to_owned();
    let (code, title) = ("changed".to_owned(), String::new());
    let problem =
        Problem { code, title, status: 412, detail, hint: None, nearest_pixel: None, received: None };
    calls::refuse::<E>(state, problem);
}

fn at_note() -> AtNote {
    AtNote { session: "s1".to_owned(), note: 5 }
}

#[test]
fn notes_are_listed_in_their_order_and_a_click_goes_there() {
    let mut shown = Shown::pane(Pane::Notes, noted);
    shown.says("go to note 1: step 3, ridge, run A, judge").says("the shade moved");
    shown.says("go to note 2: step 1").says("a dusty stop");
    let commands = shown.click("go to note 1: step 3, ridge, run A, judge");
    assert_eq!(commands, vec![Command::Notes(NotesCommand::GoTo(4))]);
    assert_eq!(shown.click("remove note 2"), vec![Command::Notes(NotesCommand::Remove(7))]);
    assert_eq!(
        shown.click("later in the tour: note 1"),
        vec![Command::Notes(NotesCommand::Move { id: 4, place: 1 })]
    );
    assert_eq!(shown.click("Pin a note here  (M)"), vec![Command::Notes(NotesCommand::Pin)]);
    Shown::pane(Pane::Notes, |context| fixture::at_step(context, 2)).says("Loading the notes");
    let none = |context: &egui::Context| {
        let mut state = fixture::at_step(context, 2);
        state.notes.list = Some(Vec::new());
        state
    };
    Shown::pane(Pane::Notes, none).says("No notes yet").says("press M");
}

#[test]
fn a_note_of_a_step_is_found_by_the_step_and_its_run() {
    let mut state = noted(&egui::Context::default());
    let ids =
        |state: &State, step: usize| state.notes_at(step).iter().map(|note| note.id).collect::<Vec<_>>();
    assert_eq!((ids(&state, 3), ids(&state, 1), ids(&state, 0)), (vec![4], vec![7], vec![]));
    state.cursor.run = 1;
    assert_eq!(
        (ids(&state, 3), ids(&state, 1)),
        (vec![], vec![7]),
        "a note of another run is not of this one"
    );
}

#[test]
fn the_tour_goes_through_the_notes_in_their_order_and_ends_at_its_ends() {
    let mut state = noted(&egui::Context::default());
    let mut tour = |by: isize| {
        perform(&mut state, NotesCommand::Tour(by));
        (state.cursor.step, state.stage)
    };
    assert_eq!(tour(1), (3, Stage::JUDGE));
    assert_eq!(tour(1).0, 1);
    assert_eq!((tour(1).0, tour(1).0), (2, 2));
    assert_eq!((tour(-1).0, tour(-1).0, tour(-1).0), (1, 3, 3));
}

#[test]
fn a_note_is_pinned_to_what_is_looked_at_and_its_words_are_never_lost() {
    let mut state = noted(&egui::Context::default());
    state.take_requests();
    state.stage = Stage::MATCH_TEMPLATE;
    perform(&mut state, NotesCommand::Pin);
    perform(&mut state, NotesCommand::Write("half a thought".to_owned()));
    perform(&mut state, NotesCommand::Close);
    assert!(state.notes.draft.is_none());
    perform(&mut state, NotesCommand::Pin);
    assert_eq!(state.notes.draft.as_ref().unwrap().text, "half a thought", "closing keeps the words");
    perform(&mut state, NotesCommand::Save);
    let [new] = bodies::<AddNote>(&mut state).try_into().unwrap();
    let stage = Some("match_template".to_owned());
    assert_eq!((new.pin.target, new.pin.run, new.pin.step, &new.pin.stage), (Some(0), 0, 2, &stage));
    assert_eq!((new.text.as_str(), new.pin.pixel), ("half a thought", Some(fixture::PIXEL)));
    refuse::<AddNote>(&mut state);
    assert_eq!(state.notes.draft.as_ref().unwrap().text, "half a thought", "a refusal keeps them, too");
    perform(&mut state, NotesCommand::Write("  ".to_owned()));
    perform(&mut state, NotesCommand::Save);
    assert!(state.take_requests().is_empty() && state.notes.draft.is_some(), "nothing is no note");
}

#[test]
fn an_edit_that_came_too_late_shows_its_words_again_and_reads_the_notes() {
    let mut state = noted(&egui::Context::default());
    state.take_requests();
    perform(&mut state, NotesCommand::Edit(5));
    perform(&mut state, NotesCommand::Write("not so fine".to_owned()));
    perform(&mut state, NotesCommand::Save);
    let edit = EditNote { text: Some("not so fine".to_owned()), place: None };
    let expected = Call::with_body::<ChangeNote>(&at_note(), &edit).at_revision(3);
    assert_eq!(calls::calls(&mut state), [expected]);
    refuse::<ChangeNote>(&mut state);
    assert_eq!(calls_of::<ListNotes>(&mut state).len(), 1);
    assert_eq!(state.notes.draft.as_ref().unwrap().text, "not so fine");
    assert!(state.messages.newest().unwrap().text.contains("changed meanwhile"));
}

#[test]
fn a_removed_note_can_be_brought_back() {
    let mut state = noted(&egui::Context::default());
    state.take_requests();
    perform(&mut state, NotesCommand::Remove(5));
    assert_eq!(calls::calls(&mut state), [Call::to::<RemoveNote>(&at_note()).at_revision(3)]);
    let removed = |context: &egui::Context| {
        let mut state = noted(context);
        perform(&mut state, NotesCommand::Remove(5));
        state
    };
    let mut shown = Shown::pane(Pane::Notes, removed);
    shown.says("A note at step 2 was removed");
    assert_eq!(shown.click("bring the removed note back"), vec![Command::Notes(NotesCommand::Restore(5))]);
    perform(&mut state, NotesCommand::Restore(5));
    assert_eq!(calls::calls(&mut state), [Call::to::<RestoreNote>(&at_note())]);
}

#[test]
fn notes_that_changed_elsewhere_are_read_again() {
    let mut state = fixture::nothing();
    let view = noted(&egui::Context::default()).session.unwrap();
    state.adopt(view, false);
    let list_calls = |state: &mut State| calls_of::<ListNotes>(state).len();
    assert_eq!(list_calls(&mut state), 1, "the notes of an opened session are read");
    answer::<ListNotes>(&mut state, &[note(1, 0, None, "x")]);
    assert_eq!(state.notes_at(0).len(), 1);
    state.apply_event(Event::NotesChanged { session: "other".to_owned() });
    assert_eq!(list_calls(&mut state), 0);
    state.apply_event(Event::NotesChanged { session: "s1".to_owned() });
    assert_eq!(list_calls(&mut state), 1);
}

#[test]
fn the_editor_names_the_place_and_saves() {
    let mut shown = Shown::new(
        [700.0, 500.0],
        |context| {
            let mut state = noted(context);
            perform(&mut state, NotesCommand::Pin);
            perform(&mut state, NotesCommand::Write("done".to_owned()));
            state
        },
        panel::editor,
    );
    shown.says("NEW NOTE AT STEP 2");
    assert_eq!(shown.click("Save note"), vec![Command::Notes(NotesCommand::Save)]);
}

/// The window of exports with a file.
fn opened(context: &egui::Context) -> State {
    let mut state = noted(context);
    state.perform(Command::Exports(exports::ExportsCommand::Open));
    assert!(!calls_of::<ListExports>(&mut state).is_empty());
    state.exports.panes = vec![Pane::Map];
    state.exports.entries = Some(vec![ExportEntry {
        name: "rows.csv".to_owned(),
        title: "Rows, CSV".to_owned(),
        sentence: "One line a step.".to_owned(),
        file: "sightline-s1-rows.csv".to_owned(),
        size: Size { bytes: 1234, is_exact: true },
        path: "sessions/s1/exports/rows.csv".to_owned(),
        command: "sightline export rows.csv --session s1".to_owned(),
    }]);
    state
}

#[test]
fn the_export_window_lists_files_with_sizes_and_ways_to_copy_them() {
    let mut shown = Shown::new([900.0, 800.0], opened, window::show);
    // A long window is positioned within a few frames.
    shown.harness.run_steps(4);
    shown.says("Rows, CSV").says("1 kB").says("One line a step.").says("pick ridge");
    let download = exports::ExportsCommand::Download("sessions/s1/exports/rows.csv".to_owned());
    assert_eq!(shown.click("download: Rows, CSV"), vec![Command::Exports(download)]);
    let copied = |shown: &mut Shown<'_>, label: &str| {
        shown.harness.get_by_label(label).click();
        shown.harness.step();
        let text = shown.harness.output().platform_output.commands.iter().find_map(|command| match command {
            egui::OutputCommand::CopyText(text) => Some(text.clone()),
            _ => None,
        });
        text.unwrap_or_else(|| panic!("{label} copies nothing"))
    };
    assert_eq!(copied(&mut shown, "copy as command: Rows, CSV"), "sightline export rows.csv --session s1");
    let curl = copied(&mut shown, "copy as HTTP: Rows, CSV");
    assert_eq!(
        curl,
        format!(
            "{WITH_TOKEN} | curl -fsS -H @- -o sightline-s1-rows.csv \
             http://localhost/api/v1/sessions/s1/exports/rows.csv"
        )
    );
    let figure = shown.click("figure of Map, site frame");
    let request = FigureRequest { pane: Pane::Map, kind: FigureFormat::Png(2) };
    assert_eq!(figure, vec![Command::Exports(exports::ExportsCommand::Figure(request))]);
    assert_eq!(
        shown.click("SVG"),
        vec![Command::Exports(exports::ExportsCommand::Format(FigureFormat::Svg))]
    );
}

#[test]
fn the_export_window_does_not_move_when_its_files_arrive() {
    let arrive = std::rc::Rc::new(std::cell::Cell::new(false));
    let arrived = std::rc::Rc::clone(&arrive);
    let mut shown = Shown::new([1440.0, 900.0], opened, move |ui, state, out| {
        if arrived.get() {
            return window::show(ui, state, out);
        }
        let mut waiting = fixture::at_step(ui.ctx(), 2);
        waiting.exports.is_open = true;
        window::show(ui, &waiting, out);
    });
    let close = |shown: &Shown<'_>| shown.harness.get_by_label("Close").rect();
    let before = close(&shown);
    arrive.set(true);
    shown.harness.run_steps(1);
    assert_eq!(close(&shown), before);
}

#[test]
fn the_export_window_rests_from_the_second_frame_on() {
    let is_open = std::rc::Rc::new(std::cell::Cell::new(false));
    let opens = std::rc::Rc::clone(&is_open);
    let mut shown = Shown::new([1440.0, 900.0], opened, move |ui, state, out| {
        if opens.get() {
            window::show(ui, state, out);
        }
    });
    is_open.set(true);
    // The frame of the key and the next one; without another event no further one is drawn.
    shown.harness.run_steps(2);
    let close = |shown: &Shown<'_>| shown.harness.get_by_label("Close").rect();
    let before = close(&shown);
    assert!(before.bottom() > 800.0, "the window has half of its height: {before:?}");
    shown.harness.hover_at(egui::pos2(700.0, 400.0));
    shown.harness.run_steps(4);
    assert_eq!(close(&shown), before);
}

#[test]
fn the_buttons_of_a_note_leave_its_title_free() {
    for width in [240.0, 300.0, 520.0] {
        let shown = Shown::new([width, 420.0], noted, |ui, state, out| {
            crate::layout::show_pane(ui, Pane::Notes, state, out);
        });
        let rect = |label: &str| shown.harness.get_by_label(label).rect();
        let title = rect("go to note 1: step 3, ridge, run A, judge");
        let buttons =
            ["remove note 1", "edit note 1", "later in the tour: note 1", "earlier in the tour: note 1"];
        for button in buttons.map(rect) {
            assert!(!button.shrink(1.0).intersects(title), "{width}: {button:?} covers {title:?}");
            assert!(button.left() >= 0.0 && button.right() <= width, "{width}: {button:?} is cut off");
        }
    }
}

#[test]
fn the_plain_page_of_what_is_looked_at_is_opened() {
    let mut state = noted(&egui::Context::default());
    state.perform(Command::Exports(exports::ExportsCommand::PlainPage));
    let expected = "http://localhost/api/v1/sessions/s1/targets/0/runs/0/steps/2/page";
    assert!(state.take_effects().contains(&Effect::OpenUrl(expected.to_owned())));
}
