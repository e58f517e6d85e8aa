//! Maps keys to commands. No key is used that the browser needs.

use egui::{Context, Event, Key, Modifiers};

use crate::command::{Command, Go, Mode};
use crate::command::{actions, table};
use crate::compare::keys as comparison;
use crate::layout;
use crate::panels::legend;
use crate::picking::aim::Aim;
use crate::state::State;
use crate::tour::update as tour;

/// Removes the focus from a clicked control, so that the keys belong to the page again. Text fields and controls that were
/// focused by Tab keep it.
pub(crate) fn leave_clicked(context: &Context) {
    let is_clicked = context.input(|input| input.pointer.any_released());
    if is_clicked && !context.text_edit_focused() {
        context.memory_mut(|memory| {
            if let Some(held) = memory.focused() {
                memory.surrender_focus(held);
            }
        });
    }
}

/// The commands of the keys pressed in this frame.
pub(crate) fn commands(context: &Context, state: &State) -> Vec<Command> {
    if context.text_edit_focused() {
        return Vec::new();
    }
    let is_focused = context.memory(egui::Memory::focused).is_some_and(|id| !layout::is_panel(context, id));
    // An open list receives the keys that move the selection in it.
    let is_listing = egui::Popup::is_any_open(context) && !legend::is_open(context);
    let is_held = is_focused || is_listing;
    let is_divided = comparison::is_divider_focused(context);
    let blink = comparison::blink_command(context, state);
    context.input(|input| {
        let mut out = Vec::new();
        // Text entered in the same frame after the key that opens a field belongs to the field.
        let mut typed: Option<Typed> = None;
        for event in &input.events {
            match (&mut typed, event) {
                (Some(typed), Event::Text(text)) if !typed.is_entered => typed.words.push_str(text),
                (Some(typed), Event::Key { key: Key::Enter, pressed: true, .. }) => typed.is_entered = true,
                (None, Event::Key { key, pressed: true, modifiers, physical_key, .. }) => {
                    let is_of_divider = is_divided && comparison::is_of_divider(*key);
                    if is_of_divider || is_held && is_of_widgets(*key, *modifiers) {
                        continue;
                    }
                    // Shift turns a digit into a character that depends on the keyboard layout.
                    let digit = physical_key.filter(|key| modifiers.shift && is_of_arrangements(*key));
                    let found = command(digit.unwrap_or(*key), *modifiers, state);
                    let opens = matches!(found, Some(Command::SetMode(Mode::Palette(_) | Mode::GoTo(_))));
                    typed = opens.then(Typed::default);
                    out.extend(found);
                }
                _ => {}
            }
        }
        if let Some((typed, opening)) = typed.zip(out.last_mut()) {
            typed.into_field(opening, state);
        }
        out.extend(blink);
        out
    })
}

/// Text entered in the frame in which a field opens.
#[derive(Default)]
struct Typed {
    words: String,
    /// Whether Enter followed the text.
    is_entered: bool,
}

impl Typed {
    /// Puts the text into the field that `opening` opens; after Enter, replaces `opening` by the resulting command if there
    /// is one.
    fn into_field(self, opening: &mut Command, state: &State) {
        match opening {
            Command::SetMode(Mode::Palette(search)) => {
                let action = actions::find(state, &self.words).into_iter().next();
                match action.filter(|_| self.is_entered && !self.words.is_empty()) {
                    Some(action) => *opening = action.command,
                    None => search.words = self.words,
                }
            }
            Command::SetMode(Mode::GoTo(text)) => {
                // The letter that opened the field also arrives as text.
                let words = self.words.trim_start_matches(['g', 'G']);
                match state.step_meant(words).ok().filter(|_| self.is_entered) {
                    Some(step) => *opening = Command::Go(Go::Step(step)),
                    None => words.clone_into(text),
                }
            }
            _ => {}
        }
    }
}

/// Text entered before a field that has just opened has the focus; it would otherwise be lost.
pub(crate) fn typed_ahead(context: &Context, is_part: impl Fn(char) -> bool) -> String {
    if context.text_edit_focused() {
        return String::new();
    }
    context.input(|input| {
        let texts = input.events.iter().filter_map(|event| match event {
            Event::Text(text) => Some(text.as_str()),
            _ => None,
        });
        texts.flat_map(str::chars).filter(|&c| is_part(c)).collect()
    })
}

/// Whether a key belongs to the focused control: it moves a slider or presses a button.
fn is_of_widgets(key: Key, modifiers: Modifiers) -> bool {
    let arrows = [Key::ArrowUp, Key::ArrowDown, Key::ArrowLeft, Key::ArrowRight];
    modifiers.is_none() && (arrows.contains(&key) || matches!(key, Key::Space | Key::Enter))
}

/// Whether Shift and this key choose a layout of panels.
fn is_of_arrangements(key: Key) -> bool {
    use Key::*;
    [Num1, Num2, Num3, Num4, Num5, Num6, Num7, Num8].contains(&key)
}

/// Whether a key types a character. Users of speech input can disable such shortcuts (WCAG 2.1.4).
fn is_character(key: Key) -> bool {
    use Key::*;
    let moves = [ArrowLeft, ArrowRight, ArrowUp, ArrowDown, Home, End, PageUp, PageDown];
    !moves.contains(&key) && ![Escape, Enter, Tab, Backspace, Delete].contains(&key)
}

/// The command of a key: the table entry with this shortcut, unless a window or a mode uses the key.
pub(crate) fn command(key: Key, modifiers: Modifiers, state: &State) -> Option<Command> {
    let is_window_open = state.exports.is_open
        || state.notes.draft.is_some()
        || state.files.is_open
        || state.trackability.form.is_some();
    let meant = table::of_key(key, modifiers).map(|entry| (entry.command)(state));
    if (modifiers.ctrl || modifiers.command) && !modifiers.alt {
        let is_free = state.mode == Mode::Look && !is_window_open;
        let opens_window = matches!(meant, Some(Command::Exports(_) | Command::Files(_)));
        return meant.filter(|_| is_free || !opens_window);
    }
    // An open window handles its own keys.
    if modifiers.alt || is_window_open {
        return None;
    }
    if !state.single_keys && is_character(key) {
        return None;
    }
    if !matches!(state.mode, Mode::Look | Mode::Pick) {
        return (key == Key::Escape).then_some(Command::SetMode(Mode::Look));
    }
    if let Some(aim) = Aim::of_key(key, modifiers.shift).filter(|_| state.mode == Mode::Pick) {
        return Some(Command::Aim(aim));
    }
    if let Some(turn) = tour::of_key(key, state) {
        return Some(Command::Tour(turn));
    }
    meant
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::Stage;
    use crate::drawing::stretch::Stretch;
    use crate::layout::command::LayoutCommand;
    use crate::layout::presets::Preset;
    use crate::{exports, files, notes};

    fn state() -> State {
        State::new("http://localhost".to_owned(), None)
    }

    fn palette() -> Command {
        Command::SetMode(Mode::Palette(crate::command::Search::default()))
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
        assert_eq!(press(Key::I, &state), Some(Command::SetStretch(Stretch::None)));
        assert_eq!(press(Key::M, &state), Some(Command::Notes(notes::NotesCommand::Pin)));
        let save = command(Key::S, Modifiers::COMMAND, &state);
        assert_eq!(save, Some(Command::Exports(exports::ExportsCommand::Open)));
        assert_eq!(
            command(Key::O, Modifiers::COMMAND, &state),
            Some(Command::Files(files::FilesCommand::Open))
        );
        assert_eq!(press(Key::Escape, &state), Some(Command::SetMode(Mode::Look)));
        assert_eq!(press(Key::Questionmark, &state), Some(Command::SetMode(Mode::Help)));
        assert_eq!(press(Key::Q, &state), Some(Command::Layout(LayoutCommand::Panel(1))));
        assert_eq!(command(Key::K, Modifiers::COMMAND, &state), Some(palette()));
        let shifted = |key| command(key, Modifiers::SHIFT, &state);
        assert_eq!(shifted(Key::Num3), Some(Command::Layout(LayoutCommand::Use(Preset::Stereo))));
        assert_eq!(press(Key::Num3, &state), None);
    }

    #[test]
    fn text_typed_in_the_opening_frame_goes_into_the_field() {
        let context = Context::default();
        let key =
            |key, modifiers| Event::Key { key, physical_key: None, pressed: true, repeat: false, modifiers };
        let events = vec![
            key(Key::K, Modifiers::COMMAND),
            key(Key::T, Modifiers::NONE),
            Event::Text("t".to_owned()),
            key(Key::R, Modifiers::NONE),
            Event::Text("r".to_owned()),
        ];
        let input = egui::RawInput { events, ..Default::default() };
        let mut found = Vec::new();
        let mut output = context.run_ui(input, |ui| found = commands(ui.ctx(), &state()));
        output.textures_delta.clear();
        let words = crate::command::Search { words: "tr".to_owned(), chosen: 0 };
        assert_eq!(found, [Command::SetMode(Mode::Palette(words))], "no target is picked, nothing is run");
    }

    #[test]
    fn enter_in_the_opening_frame_runs_the_command() {
        let state = crate::tests::fixture::at_step(&Context::default(), 2);
        let found = |opening: (Key, Modifiers), text: &str| {
            let key = |(key, modifiers)| Event::Key {
                key,
                physical_key: None,
                pressed: true,
                repeat: false,
                modifiers,
            };
            let events = vec![key(opening), Event::Text(text.to_owned()), key((Key::Enter, Modifiers::NONE))];
            let mut found = Vec::new();
            let input = egui::RawInput { events, ..Default::default() };
            let mut output = Context::default().run_ui(input, |ui| found = commands(ui.ctx(), &state));
            output.textures_delta.clear();
            found
        };
        let palette = (Key::K, Modifiers::COMMAND);
        let stereo = Command::Layout(LayoutCommand::Use(Preset::Stereo));
        assert_eq!(found(palette, "layout stereo"), [stereo]);
        let go_to = (Key::G, Modifiers::NONE);
        assert_eq!(found(go_to, "g4"), [Command::Go(Go::Step(4))]);
        // Invalid input stays in the field.
        assert_eq!(found(go_to, "gnowhere"), [Command::SetMode(Mode::GoTo("nowhere".to_owned()))]);
        let search = crate::command::Search { words: "xyzzy".to_owned(), chosen: 0 };
        assert_eq!(found(palette, "xyzzy"), [Command::SetMode(Mode::Palette(search))]);
    }

    #[test]
    fn every_press_of_one_frame_counts() {
        let context = Context::default();
        let down = Event::Key {
            key: Key::ArrowDown,
            physical_key: None,
            pressed: true,
            repeat: false,
            modifiers: Modifiers::NONE,
        };
        let input = egui::RawInput { events: vec![down; 3], ..Default::default() };
        let mut state = state();
        state.stage = Stage::PREDICT;
        let mut output = context.run_ui(input, |ui| {
            commands(ui.ctx(), &state).into_iter().for_each(|command| state.perform(command));
        });
        output.textures_delta.clear();
        assert_eq!(state.stage(), Stage::LOCATE, "three stages below the first");
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
}
