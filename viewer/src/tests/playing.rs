//! Playback of the steps with a simulated clock.

use crate::breakpoints::BreakpointCommand;
use crate::breakpoints::play::Shuttle;
use crate::command::keys;
use crate::command::{Command, Go};
use crate::panels::bars;
use crate::state::State;
use crate::tests::breakpoints::breakpoint;
use crate::tests::{Shown, fixture};

/// The fixed drive at a step, with every step loaded; its run is computed up to step 4.
fn drive(step: usize) -> State {
    let mut state = fixture::with_history(&egui::Context::default(), step);
    state.breakpoints.play.rate = 2.0;
    state
}

fn shuttle(state: &mut State, shuttle: Shuttle) {
    state.perform(Command::Breakpoints(BreakpointCommand::Shuttle(shuttle)));
}

/// The steps that are shown at these times, s.
fn at_times(state: &mut State, times: &[f64]) -> Vec<usize> {
    let mut shown = Vec::new();
    for &now in times {
        state.tick(now);
        shown.push(state.cursor.step);
    }
    shown
}

#[test]
fn nothing_plays_until_it_is_asked_to() {
    let mut state = drive(0);
    assert_eq!((state.tick(0.0), state.tick(1e6), state.cursor.step), (None, None, 0));
}

#[test]
fn it_plays_at_its_rate_and_stops_where_the_run_ends() {
    let mut state = drive(0);
    shuttle(&mut state, Shuttle::Toggle);
    assert_eq!(state.tick(10.0), Some(10.5), "two steps a second");
    assert_eq!(at_times(&mut state, &[10.4, 10.5, 10.9, 11.0, 12.1]), [0, 1, 1, 2, 4]);
    assert_eq!(at_times(&mut state, &[99.0]), [4]);
    assert!(!state.breakpoints.play.is_playing(), "step 5 is not computed");
    shuttle(&mut state, Shuttle::Toggle);
    assert_eq!((state.cursor.step, state.breakpoints.play.speed), (0, 1), "from the end it begins anew");
}

#[test]
fn repeated_presses_double_the_speed_and_the_other_direction_begins_at_one() {
    let mut state = drive(4);
    shuttle(&mut state, Shuttle::Reverse);
    shuttle(&mut state, Shuttle::Reverse);
    assert_eq!(state.breakpoints.play.speed, -2);
    state.tick(0.0);
    assert_eq!(at_times(&mut state, &[0.25, 0.5]), [3, 2]);
    assert_eq!(state.breakpoints.play.in_words(), "reverse ×2, 4 steps/s");
    shuttle(&mut state, Shuttle::Forward);
    assert_eq!(state.breakpoints.play.speed, 1);
    (0..20).for_each(|_| shuttle(&mut state, Shuttle::Forward));
    assert_eq!(state.breakpoints.play.speed, 64);
    shuttle(&mut state, Shuttle::Stop);
    assert_eq!((state.breakpoints.play.speed, state.tick(50.0)), (0, None));
    shuttle(&mut state, Shuttle::Rate(1000.0));
    assert_eq!(state.breakpoints.play.rate, 60.0);
}

#[test]
fn it_stops_at_a_hit_and_says_which() {
    let mut state = drive(0);
    state.breakpoints.list = vec![breakpoint(0, "ncc < 0.6", &[3, 4])];
    shuttle(&mut state, Shuttle::Toggle);
    state.tick(0.0);
    assert_eq!(at_times(&mut state, &[60.0]), [3]);
    assert!(!state.breakpoints.play.is_playing());
    assert_eq!(state.messages.newest().unwrap().text, "Stopped at step 3: `ncc < 0.6`.");
    shuttle(&mut state, Shuttle::Toggle);
    state.tick(100.0);
    assert_eq!(at_times(&mut state, &[100.5]), [4], "it goes on from a hit");
}

#[test]
fn a_loop_is_played_round_in_both_directions() {
    let mut state = drive(1);
    shuttle(&mut state, Shuttle::LoopIn);
    state.perform(Command::Go(Go::Step(3)));
    shuttle(&mut state, Shuttle::LoopOut);
    shuttle(&mut state, Shuttle::Forward);
    state.tick(0.0);
    assert_eq!(at_times(&mut state, &[0.5, 1.0, 1.5, 2.0, 2.5]), [1, 2, 3, 1, 2]);
    shuttle(&mut state, Shuttle::Reverse);
    state.tick(10.0);
    assert_eq!(at_times(&mut state, &[10.5, 11.0]), [1, 3]);
    state.perform(Command::Go(Go::Step(0)));
    shuttle(&mut state, Shuttle::LoopOut);
    assert_eq!(
        (state.breakpoints.play.loop_in, state.breakpoints.play.loop_out),
        (None, Some(0)),
        "a loop never ends before it begins"
    );
    shuttle(&mut state, Shuttle::ClearLoop);
    assert_eq!((state.breakpoints.play.loop_in, state.breakpoints.play.loop_out), (None, None));
}

#[test]
fn stepping_by_hand_stops_playing() {
    let mut state = drive(0);
    shuttle(&mut state, Shuttle::Toggle);
    state.perform(Command::Go(Go::By(1)));
    assert!(!state.breakpoints.play.is_playing());
}

#[test]
fn a_step_that_is_being_loaded_is_waited_for_but_not_for_ever() {
    let mut state = fixture::at_step(&egui::Context::default(), 0);
    state.breakpoints.play.rate = 2.0;
    shuttle(&mut state, Shuttle::Toggle);
    state.tick(0.0);
    assert_eq!(at_times(&mut state, &[0.5, 1.0, 1.4]), [1, 1, 1], "step 1 is not here yet");
    fixture::load(&mut state, fixture::trace(1));
    assert_eq!(at_times(&mut state, &[1.5]), [2]);
    assert_eq!(at_times(&mut state, &[2.0, 2.5, 3.5]), [2, 2, 3], "after a second it goes on without");
}

#[test]
fn every_key_of_time_travel_is_on_the_sheet_and_means_what_it_says() {
    use egui::{Key, Modifiers};
    let state = drive(2);
    let press = |key: Key, modifiers: Modifiers| keys::command(key, modifiers, &state);
    let plays = |what: Shuttle| Some(Command::Breakpoints(BreakpointCommand::Shuttle(what)));
    let plain = Modifiers::NONE;
    assert_eq!(press(Key::Space, plain), plays(Shuttle::Toggle));
    assert_eq!(press(Key::J, plain), plays(Shuttle::Reverse));
    assert_eq!(press(Key::K, plain), plays(Shuttle::Stop));
    assert_eq!(press(Key::L, plain), plays(Shuttle::Forward));
    assert_eq!(press(Key::OpenBracket, plain), plays(Shuttle::LoopIn));
    assert_eq!(press(Key::CloseBracket, plain), plays(Shuttle::LoopOut));
    assert_eq!(press(Key::Backspace, plain), plays(Shuttle::ClearLoop));
    assert_eq!(press(Key::N, plain), Some(Command::Breakpoints(BreakpointCommand::NextHit)));
    assert_eq!(press(Key::N, Modifiers::SHIFT), Some(Command::Breakpoints(BreakpointCommand::PreviousHit)));
    assert_eq!(press(Key::B, plain), Some(Command::Breakpoints(BreakpointCommand::BreakAt(2))));
    assert_eq!(press(Key::B, Modifiers::SHIFT), Some(Command::Breakpoints(BreakpointCommand::Focus)));
    let lines: Vec<(String, &str)> = {
        use crate::command::table::{Group, sheet};
        Group::ALL.into_iter().flat_map(sheet).collect()
    };
    let sheet: Vec<&str> = lines.iter().flat_map(|(keys, _)| keys.split_whitespace()).collect();
    for key in
        ["Space", "J", "K", "L", "[", "]", "Backspace", "N", "Shift+N", "B", "Shift+B", "G", "PgUp", "PgDn"]
    {
        assert!(sheet.contains(&key), "{key} is not on the sheet");
    }
}

#[test]
fn the_controls_have_names_and_say_how_it_plays() {
    let mut shown = Shown::new([1500.0, 60.0], |_| drive(2), bars::transport);
    shown.says("paused");
    assert_eq!(shown.click("play"), [Command::Breakpoints(BreakpointCommand::Shuttle(Shuttle::Toggle))]);
    assert_eq!(
        shown.click("play backwards"),
        [Command::Breakpoints(BreakpointCommand::Shuttle(Shuttle::Reverse))]
    );
    assert_eq!(shown.click("loop in"), [Command::Breakpoints(BreakpointCommand::Shuttle(Shuttle::LoopIn))]);
    let playing = |_: &egui::Context| {
        let mut state = drive(2);
        shuttle(&mut state, Shuttle::LoopIn);
        shuttle(&mut state, Shuttle::Forward);
        state
    };
    let mut shown = Shown::new([1500.0, 60.0], playing, bars::transport);
    shown.says("forward ×1, 2 steps/s").says("loop 2 to …");
    assert_eq!(shown.click("pause"), [Command::Breakpoints(BreakpointCommand::Shuttle(Shuttle::Toggle))]);
    assert_eq!(
        shown.click("no loop"),
        [Command::Breakpoints(BreakpointCommand::Shuttle(Shuttle::ClearLoop))]
    );
}
