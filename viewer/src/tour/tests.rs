//! The tour: used by keyboard and by buttons, skipped, consistent with the state, and started only once by itself.

use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable;
use sightline_world::library;

use crate::command::help;
use crate::command::keys;
use crate::command::{Command, Go, Mode};
use crate::hovered::Hovered;
use crate::panels::pane::Pane;
use crate::state::State;
use crate::state::effect::Effect;
use crate::tests::{Shown, fixture};
use crate::tour::bubbles;
use crate::tour::{Bubble, Turn};

fn touring(at: usize) -> impl FnOnce(&egui::Context) -> State {
    move |context| {
        let mut state = fixture::at_step(context, 0);
        state.tour.at = Some(at);
        state
    }
}

fn shown(at: usize) -> Shown<'static> {
    Shown::new([1280.0, 720.0], touring(at), |ui, state, out| bubbles::show(ui, state, out))
}

#[test]
fn every_bubble_says_where_in_the_tour_it_is_and_the_buttons_lead_on_back_and_out() {
    for (at, bubble) in Bubble::ALL.into_iter().enumerate() {
        let mut bubbles = shown(at);
        bubbles.says(bubble.title()).says(&format!("{} of 6", at + 1));
        let next = if at == 5 { "Done" } else { "Next" };
        assert_eq!(bubbles.click(next), vec![Command::Tour(Turn::Next)]);
    }
    assert_eq!(shown(2).click("Back"), vec![Command::Tour(Turn::Back)]);
    assert_eq!(shown(2).click("Skip"), vec![Command::Tour(Turn::End)]);
}

#[test]
fn the_tour_is_walked_and_skipped_by_keyboard() {
    let mut state = fixture::at_step(&egui::Context::default(), 0);
    state.perform(Command::Tour(Turn::Begin));
    let press = |state: &mut State, key: Key| {
        let command = keys::command(key, Modifiers::NONE, state).expect("a command");
        state.perform(command);
        state.tour.at
    };
    assert_eq!(press(&mut state, Key::Enter), Some(1));
    assert_eq!(press(&mut state, Key::Backspace), Some(0));
    assert_eq!(press(&mut state, Key::Escape), None);
    assert!(state.tour.is_seen);
    state.perform(Command::Tour(Turn::Begin));
    for _ in 0..5 {
        press(&mut state, Key::Enter);
    }
    assert_eq!(state.tour.bubble(), Some(Bubble::Share));
    assert_eq!(press(&mut state, Key::Enter), None);
    // Without a tour Enter has no effect, and while one is open the user can step along the drive.
    assert_eq!(keys::command(Key::Enter, Modifiers::NONE, &state), None);
    state.perform(Command::Tour(Turn::Begin));
    assert!(matches!(keys::command(Key::ArrowRight, Modifiers::NONE, &state), Some(Command::Go(_))));
}

#[test]
fn the_second_bubble_names_the_step_at_which_the_target_is_lost() {
    shown(1).says("lost at step 3");
    let words = Bubble::Lost.words(&fixture::without_target());
    assert!(words.contains("press T"), "{words}");
}

#[test]
fn the_first_drive_opens_at_its_loss_once_the_tour_was_seen() {
    let opened = |step: usize| {
        let mut state = fixture::at_step(&egui::Context::default(), step);
        if let Some(traverse) = &mut state.traverse {
            traverse.name = library::FIRST_NAME.to_owned();
        }
        state.tour.is_seen = true;
        state.sync_tour();
        state
    };
    let mut state = opened(0);
    assert_eq!((state.cursor.step, state.tour.at), (3, None));
    state.perform(Command::Go(Go::Step(0)));
    state.sync_tour();
    assert_eq!(state.cursor.step, 0, "only once");
    let mut elsewhere = opened(1);
    assert_eq!(elsewhere.cursor.step, 1, "a link or an earlier visit named the step");
    elsewhere.perform(Command::Go(Go::Step(0)));
    elsewhere.sync_tour();
    assert_eq!(elsewhere.cursor.step, 0);
}

#[test]
fn the_tour_does_what_it_speaks_of() {
    let mut state = fixture::at_step(&egui::Context::default(), 0);
    state.perform(Command::Tour(Turn::Begin));
    assert_eq!(state.cursor.step, 2, "just before the loss");
    state.perform(Command::Tour(Turn::Next));
    assert_eq!(state.cursor.step, 3, "at the loss");
    state.perform(Command::Go(Go::Step(0)));
    let _ = state.take_effects();
    state.perform(Command::Tour(Turn::Next));
    assert_eq!(state.cursor.step, 3);
    let reveals = |state: &mut State, pane| state.take_effects().contains(&Effect::reveal(pane));
    assert!(reveals(&mut state, Pane::Why), "W was pressed");
}

#[test]
fn the_pointer_on_a_bubble_points_at_nothing_below_it() {
    let hovered = std::rc::Rc::new(std::cell::Cell::new(None));
    let kept = std::rc::Rc::clone(&hovered);
    // Everything below the bubble hovers a step, as the timeline and the map do.
    let mut shown = Shown::new([1280.0, 720.0], touring(2), move |ui, state, out| {
        crate::layout::show_pane(ui, Pane::Map, state, out);
        bubbles::show(ui, state, out);
        out.push(Command::Hover(Hovered::Step(4)));
        kept.set(crate::state::hovered::take_hovered(ui.ctx(), out));
    });
    let next = shown.harness.get_by_label("Next").rect().center();
    let mut at = |place| {
        shown.harness.hover_at(place);
        shown.harness.run_steps(3);
        hovered.get()
    };
    assert_eq!(at(egui::pos2(5.0, 5.0)), Some(Hovered::Step(4)));
    assert_eq!(at(next), None);
}

#[test]
fn the_help_sheet_begins_the_tour_again() {
    let mut sheet = Shown::new(
        [900.0, 900.0],
        |context| {
            let mut state = fixture::at_step(context, 2);
            state.mode = Mode::Help;
            state
        },
        help::show,
    );
    let commands = sheet.click("Take the tour");
    assert!(commands.contains(&Command::Tour(Turn::Begin)), "{commands:?}");
}

#[test]
fn it_begins_by_itself_on_the_first_drive_alone_and_only_once() {
    let mut state = fixture::at_step(&egui::Context::default(), 0);
    state.take_requests();
    assert_eq!(state.tour.at, None, "another drive");
    if let Some(traverse) = &mut state.traverse {
        traverse.name = library::FIRST_NAME.to_owned();
    }
    state.take_requests();
    assert_eq!(state.tour.at, Some(0));
    state.perform(Command::Tour(Turn::End));
    state.take_requests();
    assert_eq!(state.tour.at, None);
    // Before the target is loaded, the tour would describe content that is not visible.
    let mut early = fixture::without_target();
    if let Some(traverse) = &mut early.traverse {
        traverse.name = library::FIRST_NAME.to_owned();
    }
    early.take_requests();
    assert_eq!(early.tour.at, None);
}

#[test]
fn the_tour_ends_when_another_drive_is_opened() {
    let mut state = touring(0)(&egui::Context::default());
    let same = state.session.clone().unwrap();
    state.adopt(same.clone(), false);
    assert_eq!(state.tour.at, Some(0), "the same session, read again");
    state.adopt(sightline_session::view::SessionView { id: "s2".to_owned(), ..same }, false);
    assert_eq!((state.tour.at, state.tour.is_seen), (None, true));
}
