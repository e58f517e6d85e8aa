//! Keys and what they ask for. Never a key that the browser needs.

use egui::{Context, Event, Key, Modifiers};

use crate::command::{Command, Go, Mode, Stage};
use crate::state::State;
use crate::state::ask::Ask;
use crate::state::ask::play::Shuttle;
use crate::stretch::Stretch;

/// Every key with its meaning, as the help sheet lists them.
pub const SHEET: [(&str, &str); 25] = [
    ("Right  Left", "next, previous step"),
    ("Shift+Right  Shift+Left", "ten steps on, back"),
    ("Home  End", "first, last step"),
    ("PgDn  PgUp", "next, previous event (change of state)"),
    ("G", "go to a step: 12, +5, last, t=3.5, or an event such as lost"),
    ("Space", "play, pause"),
    ("J  K  L", "play backwards, stop, play forwards; again: twice as fast"),
    ("[  ]", "a loop begins, ends at this step"),
    ("Backspace", "no loop any more"),
    ("N  Shift+N", "next, previous hit of a breakpoint"),
    ("B", "break at this step, or no longer"),
    ("Shift+B", "break when: write a condition"),
    ("Tab  Enter", "in the expression box: take the suggestion, set the breakpoint"),
    ("Click above the timeline", "break at that step, or no longer"),
    ("Up  Down", "previous, next stage"),
    ("T", "pick a target: then click in the left image"),
    ("R", "run from this step with the changed settings"),
    ("F", "fit all images to their panels"),
    ("H", "hide or show all marks"),
    ("I", "stretch dark images automatically, or show them as recorded"),
    ("Esc", "cancel what was begun"),
    ("?", "this sheet"),
    ("Wheel", "zoom at the pointer"),
    ("Drag", "pan"),
    ("Double click", "fit the image or plot"),
];

/// The commands of the keys pressed in this frame.
pub fn commands(context: &Context, state: &State) -> Vec<Command> {
    if context.text_edit_focused() {
        return Vec::new();
    }
    // Space presses the button that has the keyboard.
    let is_taken = |key: Key| key == Key::Space && context.memory(|memory| memory.focused().is_some());
    context.input(|input| {
        let pressed = input.events.iter().filter_map(|event| match event {
            Event::Key { key, pressed: true, modifiers, .. } if !is_taken(*key) => {
                command(*key, *modifiers, state)
            }
            _ => None,
        });
        pressed.collect()
    })
}

/// What a key asks for.
pub fn command(key: Key, modifiers: Modifiers, state: &State) -> Option<Command> {
    if modifiers.ctrl || modifiers.command || modifiers.alt {
        return None;
    }
    let shift = modifiers.shift;
    if !matches!(state.mode, Mode::Look | Mode::Pick) {
        return (key == Key::Escape).then_some(Command::SetMode(Mode::Look));
    }
    Some(match key {
        Key::ArrowRight => Command::Go(Go::By(if shift { 10 } else { 1 })),
        Key::ArrowLeft => Command::Go(Go::By(if shift { -10 } else { -1 })),
        Key::Home => Command::Go(Go::First),
        Key::End => Command::Go(Go::Last),
        Key::PageDown => Command::Go(Go::NextEvent),
        Key::PageUp => Command::Go(Go::PreviousEvent),
        Key::ArrowUp => Command::SelectStage(neighbour(state, -1)),
        Key::ArrowDown => Command::SelectStage(neighbour(state, 1)),
        Key::G => Command::SetMode(Mode::GoTo(String::new())),
        Key::T if state.mode == Mode::Pick => Command::SetMode(Mode::Look),
        Key::T => Command::SetMode(Mode::Pick),
        Key::R => Command::RunFromHere(state.draft.clone()),
        Key::F => Command::FitAll,
        Key::H => Command::ToggleMarks,
        Key::I if state.stretch == Stretch::None => Command::SetStretch(Stretch::Auto),
        Key::I => Command::SetStretch(Stretch::None),
        Key::Escape => Command::SetMode(Mode::Look),
        Key::Questionmark => Command::SetMode(Mode::Help),
        Key::Slash if shift => Command::SetMode(Mode::Help),
        key => Command::Ask(of_time_and_breakpoints(key, shift, state)?),
    })
}

/// What a key asks for of breakpoints and of time.
fn of_time_and_breakpoints(key: Key, shift: bool, state: &State) -> Option<Ask> {
    Some(match key {
        Key::Space => Ask::Shuttle(Shuttle::Toggle),
        Key::J => Ask::Shuttle(Shuttle::Reverse),
        Key::K => Ask::Shuttle(Shuttle::Stop),
        Key::L => Ask::Shuttle(Shuttle::Forward),
        Key::OpenBracket => Ask::Shuttle(Shuttle::LoopIn),
        Key::CloseBracket => Ask::Shuttle(Shuttle::LoopOut),
        Key::Backspace => Ask::Shuttle(Shuttle::ClearLoop),
        Key::N if shift => Ask::PreviousHit,
        Key::N => Ask::NextHit,
        Key::B if shift => Ask::Focus,
        Key::B => Ask::BreakAt(state.cursor.step),
        _ => return None,
    })
}

fn neighbour(state: &State, by: isize) -> Stage {
    let (stages, stage) = (Stage::of(state.tracker()), state.stage());
    let at = stages.iter().position(|&s| s == stage).unwrap_or(0);
    stages[at.saturating_add_signed(by).min(stages.len() - 1)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state() -> State {
        State::new("http://localhost".to_owned(), None)
    }

    fn press(key: Key, state: &State) -> Option<Command> {
        command(key, Modifiers::NONE, state)
    }

    #[test]
    fn the_keys_of_the_sheet_do_what_it_says() {
        let state = state();
        assert_eq!(press(Key::ArrowRight, &state), Some(Command::Go(Go::By(1))));
        assert_eq!(press(Key::ArrowLeft, &state), Some(Command::Go(Go::By(-1))));
        assert_eq!(command(Key::ArrowRight, Modifiers::SHIFT, &state), Some(Command::Go(Go::By(10))));
        assert_eq!(press(Key::Home, &state), Some(Command::Go(Go::First)));
        assert_eq!(press(Key::End, &state), Some(Command::Go(Go::Last)));
        assert_eq!(press(Key::PageDown, &state), Some(Command::Go(Go::NextEvent)));
        assert_eq!(press(Key::PageUp, &state), Some(Command::Go(Go::PreviousEvent)));
        assert_eq!(press(Key::G, &state), Some(Command::SetMode(Mode::GoTo(String::new()))));
        assert_eq!(press(Key::T, &state), Some(Command::SetMode(Mode::Pick)));
        assert_eq!(press(Key::F, &state), Some(Command::FitAll));
        assert_eq!(press(Key::I, &state), Some(Command::SetStretch(Stretch::Auto)));
        assert_eq!(press(Key::Escape, &state), Some(Command::SetMode(Mode::Look)));
        assert_eq!(press(Key::Questionmark, &state), Some(Command::SetMode(Mode::Help)));
        assert_eq!(press(Key::Q, &state), None);
    }

    #[test]
    fn keys_of_the_browser_are_left_alone() {
        assert_eq!(command(Key::R, Modifiers::CTRL, &state()), None);
        assert_eq!(command(Key::ArrowLeft, Modifiers::ALT, &state()), None);
    }

    #[test]
    fn while_a_sheet_is_open_only_escape_means_something() {
        let mut state = state();
        state.mode = Mode::Help;
        assert_eq!(press(Key::T, &state), None);
        assert_eq!(press(Key::Escape, &state), Some(Command::SetMode(Mode::Look)));
    }

    #[test]
    fn stages_end_at_the_first_and_the_last() {
        let from = |stage: Stage, by: isize| {
            let mut state = state();
            state.stage = stage;
            neighbour(&state, by)
        };
        assert_eq!(from(Stage::Predict, -1), Stage::Predict);
        assert_eq!(from(Stage::Predict, 1), Stage::PointMast);
        assert_eq!(from(Stage::Update, 1), Stage::Update);
        // A stage of the other tracker counts as the one in its place.
        assert_eq!(from(Stage::FitMotion, 1), Stage::Judge);
    }
}
