//! Undo: the changes that can be undone and redone, and that every removal offers it.

use egui_kittest::kittest::Queryable;
use serde_json::json;
use sightline_api::endpoint::Call;
use sightline_api::endpoints::{
    AddBreakpoint, ChangeBreakpoint, DesignateTarget, RemoveBreakpoint, RemoveNote, RemoveRun, RemoveTarget,
    RenameTarget, RestoreNote, RestoreRun, RestoreTarget,
};
use sightline_api::location::{AtBreakpoint, AtNote, AtRun, AtTarget};
use sightline_api::wire::Problem;
use sightline_session::Fork;
use sightline_session::breakpoints::{BreakpointChange, BreakpointView, NewBreakpoint};
use sightline_session::notes::{Note, Pin};
use sightline_session::view::{RunView, SessionView};
use sightline_track::settings::Changes;

use crate::command::keys;
use crate::command::{Command, Mode};
use crate::panels::pane::Pane;
use crate::state::State;
use crate::state::targets::Rename;
use crate::state::undoable::UndoableChange;
use crate::tests::calls::{answer, at_session, bodies, calls, calls_of, refuse};
use crate::tests::{Shown, fixture};
use crate::why::WhyCommand;
use crate::{breakpoints, notes};

/// The step at which the target is lost.
const LOST: usize = 3;

fn lost() -> State {
    fixture::at_step(&egui::Context::default(), LOST)
}

/// The calls that change breakpoints.
fn breakpoint_calls(state: &mut State) -> Vec<Call> {
    let is_change = |call: &Call| {
        call.is_to::<AddBreakpoint>() || call.is_to::<ChangeBreakpoint>() || call.is_to::<RemoveBreakpoint>()
    };
    calls(state).into_iter().filter(is_change).collect()
}

fn at(breakpoint: usize) -> AtBreakpoint {
    AtBreakpoint { session: "s1".to_owned(), breakpoint }
}

/// Restores the removed breakpoint.
fn add() -> Call {
    let new = NewBreakpoint { expression: Some("ncc < 0.5".to_owned()), step: None };
    Call::with_body::<AddBreakpoint>(&at_session(), &new)
}

fn undo(state: &mut State) {
    state.perform(Command::Why(WhyCommand::Undo));
}

fn redo(state: &mut State) {
    state.perform(Command::Why(WhyCommand::Redo));
}

fn breakpoint(number: usize, expression: &str, on: bool) -> BreakpointView {
    let expression = expression.to_owned();
    BreakpointView { number, expression, on, count: 0, hits: Vec::new(), problem: None }
}

#[test]
fn changes_can_be_undone_and_redone() {
    let mut state = lost();
    let ctrl = egui::Modifiers::CTRL;
    assert_eq!(keys::command(egui::Key::Z, ctrl, &state), Some(Command::Why(WhyCommand::Undo)));
    assert_eq!(keys::command(egui::Key::Y, ctrl, &state), Some(Command::Why(WhyCommand::Redo)));
    // A removed target is restored, and undoing its removal is not a change.
    state.perform(Command::RemoveTarget(0));
    let view = state.session.clone().unwrap();
    answer::<RemoveTarget>(&mut state, &view);
    assert_eq!(state.undo.ends().0, Some(&UndoableChange::RemovedTarget { target: 0 }));
    state.perform(Command::Why(WhyCommand::Undo));
    let restore = Call::to::<RestoreTarget>(&AtTarget { session: "s1".to_owned(), target: 0 });
    assert_eq!(calls_of::<RestoreTarget>(&mut state), [restore]);
    answer::<RestoreTarget>(&mut state, &view);
    assert_eq!(state.undo.ends(), (None, Some(&UndoableChange::RemovedTarget { target: 0 })));
    // A reply about another session changes nothing.
    state.perform(Command::RemoveTarget(0));
    answer::<RemoveTarget>(&mut state, &SessionView { id: "s2".to_owned(), ..view });
    assert_eq!(state.session.as_ref().unwrap().id, "s1");
    assert_eq!(state.undo.ends().0, None);
    // The draft is undone value by value, a drag as one.
    for value in [0.6, 0.5, 0.4] {
        state.perform(Command::Draft { key: "ncc_min".to_owned(), value: Some(json!(value)) });
    }
    state.perform(Command::Draft { key: "roll".to_owned(), value: Some(json!(false)) });
    state.perform(Command::Why(WhyCommand::Undo));
    assert_eq!(state.draft, Changes::from([("ncc_min".to_owned(), json!(0.4))]));
    state.perform(Command::Why(WhyCommand::Undo));
    assert!(state.draft.is_empty());
    state.perform(Command::Why(WhyCommand::Redo));
    assert_eq!(state.draft, Changes::from([("ncc_min".to_owned(), json!(0.4))]));
}

#[test]
fn a_removed_run_leaves_the_list_and_can_be_taken_back() {
    let two_runs = |context: &egui::Context| {
        let mut state = fixture::at_step(context, LOST);
        let run = RunView { number: 1, fork: Some(Fork::new(0, 2)), ..state.run().unwrap().clone() };
        state.session.as_mut().unwrap().targets[0].runs.push(run);
        state
    };
    let mut shown = Shown::pane(Pane::Targets, two_runs);
    shown.says("from run A at step 2");
    let remove = WhyCommand::RemoveRun { target: 0, run: 1 };
    assert_eq!(shown.click("remove run B"), vec![Command::Why(remove.clone())]);
    let mut state = two_runs(&egui::Context::default());
    state.perform(Command::Why(remove));
    let mut view = state.session.clone().unwrap();
    view.targets[0].runs.truncate(1);
    answer::<RemoveRun>(&mut state, &view);
    assert_eq!(state.target().unwrap().runs.len(), 1);
    state.perform(Command::Why(WhyCommand::Undo));
    let restore = Call::to::<RestoreRun>(&AtRun { session: "s1".to_owned(), target: 0, run: 1 });
    assert_eq!(calls_of::<RestoreRun>(&mut state), [restore]);
}

#[test]
fn a_removed_breakpoint_comes_back_as_it_was_also_where_it_was_off() {
    let mut state = lost();
    state.breakpoints.list = vec![breakpoint(4, "ncc < 0.5", false)];
    state.take_requests();
    state.perform(Command::Breakpoints(breakpoints::BreakpointCommand::Remove(4)));
    let removal = breakpoint_calls(&mut state);
    assert_eq!(removal, [Call::to::<RemoveBreakpoint>(&at(4))]);
    let message = state.messages.newest().unwrap();
    assert_eq!(message.text, "Removed the breakpoint `ncc < 0.5`.");
    assert!(state.undo.is_last(message.change.unwrap()), "the message offers to take it back");
    undo(&mut state);
    assert_eq!(breakpoint_calls(&mut state), [add()]);
    answer::<AddBreakpoint>(&mut state, &breakpoint(5, "ncc < 0.5", true));
    let change = BreakpointChange { on: Some(false), expression: None };
    assert_eq!(breakpoint_calls(&mut state), [Call::with_body::<ChangeBreakpoint>(&at(5), &change)]);
    redo(&mut state);
    let again = breakpoint_calls(&mut state);
    assert_eq!(again, [Call::to::<RemoveBreakpoint>(&at(5))], "under its new number");
}

#[test]
fn a_removal_is_done_again_also_before_the_server_has_set_the_breakpoint() {
    let mut state = lost();
    state.breakpoints.list = vec![breakpoint(4, "ncc < 0.5", true)];
    state.perform(Command::Breakpoints(breakpoints::BreakpointCommand::Remove(4)));
    undo(&mut state);
    assert_eq!(breakpoint_calls(&mut state).pop(), Some(add()));
    redo(&mut state);
    assert!(breakpoint_calls(&mut state).is_empty(), "its number is not known yet");
    answer::<AddBreakpoint>(&mut state, &breakpoint(5, "ncc < 0.5", true));
    assert_eq!(breakpoint_calls(&mut state), [Call::to::<RemoveBreakpoint>(&at(5))]);
    assert!(state.breakpoints.list.is_empty());
}

#[test]
fn a_refused_breakpoint_removal_cannot_be_undone() {
    let mut state = lost();
    state.breakpoints.list = vec![breakpoint(4, "ncc < 0.5", true)];
    state.perform(Command::Breakpoints(breakpoints::BreakpointCommand::Remove(4)));
    refuse::<RemoveBreakpoint>(&mut state, Problem::new(500, "internal", "", "a fault"));
    assert_eq!(state.undo.ends().0, None);
}

#[test]
fn a_removed_plot_comes_back_at_its_place() {
    let mut state = lost();
    for text in ["ncc", "err_px", "sigma_m"] {
        state.perform(Command::Breakpoints(breakpoints::BreakpointCommand::Plot(text.to_owned())));
    }
    let texts = |state: &State| -> Vec<String> {
        state.breakpoints.derived.iter().map(|derived| derived.expression.clone()).collect()
    };
    let before = texts(&state);
    state.perform(Command::Breakpoints(breakpoints::BreakpointCommand::Unplot(1)));
    assert_eq!(texts(&state), ["ncc", "sigma_m"]);
    undo(&mut state);
    assert_eq!(texts(&state), before);
    redo(&mut state);
    assert_eq!(texts(&state), ["ncc", "sigma_m"]);
}

#[test]
fn a_removed_note_comes_back_by_undo_or_by_its_button_but_not_twice() {
    let mut state = lost();
    let note = Note {
        id: 5,
        revision: 3,
        pin: Pin { step: 2, ..Pin::default() },
        text: "here".to_owned(),
        made: String::new(),
        changed: String::new(),
    };
    state.notes.list = Some(vec![note]);
    state.take_requests();
    let remove = |state: &mut State| {
        state.perform(Command::Notes(notes::NotesCommand::Remove(5)));
        answer::<RemoveNote>(state, &());
    };
    let at = AtNote { session: "s1".to_owned(), note: 5 };
    let restored = |state: &mut State| {
        let restoring = calls_of::<RestoreNote>(state);
        restoring.iter().filter(|call| **call == Call::to::<RestoreNote>(&at)).count()
    };
    remove(&mut state);
    assert_eq!(state.undo.ends().0, Some(&UndoableChange::RemovedNote { id: 5, step: 2 }));
    assert_eq!(state.messages.newest().unwrap().text, "Removed the note at step 2.");
    state.perform(Command::Notes(notes::NotesCommand::Restore(5)));
    assert_eq!(restored(&mut state), 1);
    undo(&mut state);
    assert_eq!(restored(&mut state), 0, "the button took the deed back already");
    // Redone, it is the same change, not another one.
    redo(&mut state);
    assert_eq!(calls_of::<RemoveNote>(&mut state), [Call::to::<RemoveNote>(&at).at_revision(3)]);
    answer::<RemoveNote>(&mut state, &());
    assert_eq!(state.undo.ends(), (Some(&UndoableChange::RemovedNote { id: 5, step: 2 }), None));
}

#[test]
fn only_the_last_change_offers_undo() {
    let removed = |with_another: bool| {
        move |context: &egui::Context| {
            let mut state = fixture::at_step(context, LOST);
            state.perform(Command::Breakpoints(breakpoints::BreakpointCommand::Plot("ncc".to_owned())));
            state.perform(Command::Breakpoints(breakpoints::BreakpointCommand::Unplot(0)));
            if with_another {
                state.perform(Command::Draft { key: "ncc_min".to_owned(), value: Some(json!(0.6)) });
            }
            state
        }
    };
    let mut shown = Shown::pane(Pane::Messages, removed(false));
    shown.says("Removed the plot `ncc`.");
    assert_eq!(shown.click("Undo"), vec![Command::Why(WhyCommand::Undo)]);
    let later = Shown::pane(Pane::Messages, removed(true));
    later.says("Removed the plot `ncc`.");
    assert!(later.harness.query_by_label("Undo").is_none(), "it would take something else back");
}

#[test]
fn a_target_is_renamed_and_the_new_name_can_be_undone() {
    let mut state = fixture::at_step(&egui::Context::default(), 2);
    let mut view = state.session.clone().unwrap();
    state.perform(Command::Rename(Rename::Begin(0)));
    assert_eq!(state.renaming.as_ref().unwrap().text, "ridge");
    state.perform(Command::Rename(Rename::Type("tall ridge".to_owned())));
    state.perform(Command::Rename(Rename::Save));
    let sent = |state: &mut State| bodies::<RenameTarget>(state).pop().map(|body| body.label);
    assert_eq!(sent(&mut state).as_deref(), Some("tall ridge"));
    view.targets[0].label = "tall ridge".to_owned();
    answer::<RenameTarget>(&mut state, &view);
    assert_eq!(state.target().unwrap().label, "tall ridge");
    undo(&mut state);
    assert_eq!(sent(&mut state).as_deref(), Some("ridge"));
    // The same name, or closing the field, changes nothing.
    state.perform(Command::Rename(Rename::Begin(0)));
    state.perform(Command::Rename(Rename::Save));
    state.perform(Command::Rename(Rename::Begin(0)));
    state.perform(Command::Rename(Rename::Type("other".to_owned())));
    state.perform(Command::Rename(Rename::Cancel));
    assert!(sent(&mut state).is_none() && state.renaming.is_none());
}

#[test]
fn the_field_of_a_name_takes_text_and_saves_with_enter() {
    let mut shown = Shown::pane(Pane::Targets, |context| {
        let mut state = fixture::at_step(context, 2);
        state.perform(Command::Rename(Rename::Begin(0)));
        state
    });
    shown.harness.get_by_label("name of the target").type_text("!");
    shown.harness.run_steps(2);
    assert_eq!(shown.take_commands(), vec![Command::Rename(Rename::Type("ridge!".to_owned()))]);
    shown.harness.key_press(egui::Key::Enter);
    shown.harness.run_steps(2);
    assert!(shown.take_commands().contains(&Command::Rename(Rename::Save)));
    let mut shown = Shown::pane(Pane::Targets, |context| fixture::at_step(context, 2));
    assert_eq!(shown.click("Rename"), vec![Command::Rename(Rename::Begin(0))]);
}

#[test]
fn the_marks_of_a_target_are_hidden_and_shown() {
    let mut shown = Shown::pane(Pane::Targets, |context| fixture::at_step(context, 2));
    assert_eq!(shown.click("marks of ridge"), vec![Command::ToggleTarget(0)]);
    let mut state = lost();
    assert!(state.shows_target());
    state.perform(Command::ToggleTarget(0));
    assert!(!state.shows_target());
    state.perform(Command::ToggleTarget(0));
    assert!(state.shows_target());
}

#[test]
fn the_marks_of_a_target_have_the_chosen_colour() {
    let mut shown = Shown::pane(Pane::Targets, |context| fixture::at_step(context, 2));
    shown.click("colour of ridge");
    let asked = shown.click("violet");
    assert_eq!(asked, vec![Command::ColourTarget { target: 0, colour: Some(2) }]);
    let mut state = lost();
    let grey = state.colour_of(0);
    state.perform(asked[0].clone());
    assert_eq!(state.colour_of(0), crate::theme::run(2));
    assert_ne!(state.colour_of(0), grey);
    state.perform(Command::ColourTarget { target: 0, colour: None });
    assert_eq!(state.colour_of(0), grey);
}

#[test]
fn a_target_is_designated_again_at_a_later_stop_with_its_settings() {
    let mut shown = Shown::pane(Pane::Targets, |context| fixture::at_step(context, 2));
    assert_eq!(shown.click("Re-pick here"), vec![Command::Repick(0)]);
    Shown::pane(Pane::Targets, |context| fixture::at_step(context, 0)).hides("Re-pick here");
    let mut state = lost();
    let changes: Changes = [("ncc_min".to_owned(), json!(0.6))].into();
    state.session.as_mut().unwrap().targets[0].runs[0].changes = changes.clone();
    let pick = |state: &mut State| {
        state.perform(Command::Pick(sightline_geometry::frames::Pixel::new(20.0, 20.0)));
        bodies::<DesignateTarget>(state).pop().unwrap()
    };
    state.perform(Command::Repick(0));
    assert_eq!(state.mode, Mode::Pick);
    let again = pick(&mut state);
    assert_eq!((again.step, again.label.as_deref()), (LOST, Some("ridge, from stop 3")));
    assert_eq!(again.settings, changes);
    // After cancelling, the next pick is a new target.
    let mut state = lost();
    state.perform(Command::Repick(0));
    state.perform(Command::SetMode(Mode::Look));
    state.perform(Command::SetMode(Mode::Pick));
    assert_eq!(pick(&mut state).label, None);
}
