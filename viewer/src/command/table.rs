//! The table of user commands: name, icon, shortcuts and help text of each, in one place.
//!
//! Keyboard, help sheet, palette and tooltips are views of [`TABLE`]; a new command is one entry here. Commands that
//! belong to data (a step, a run, a panel, a setting) are added to the palette by [`crate::command::actions`].

use egui::{Key, Modifiers};

pub(crate) use super::entry::{Group, HelpLine, Shortcut, UserCommand};

use crate::breakpoints::play::Shuttle;
use crate::command::{Command, Go, Mode, Search};
use crate::compare;
use crate::drawing::stretch::Stretch;
use crate::layout::command::LayoutCommand;
use crate::layout::presets::Preset;
use crate::state::State;
use crate::tour::Turn;
use crate::trackability::limits;
use crate::{breakpoints, exports, files, notes, why};

const fn line(group: Group, help: &'static str, commands: &'static [UserCommand]) -> HelpLine {
    HelpLine { group, help, gesture: "", commands }
}

const fn gesture(group: Group, gesture: &'static str, help: &'static str) -> HelpLine {
    HelpLine { group, help, gesture, commands: &[] }
}

use Group::{Compare, Images, Page, Playing, Steps, Target};
use {Shortcut as On, UserCommand as Do};

/// One step forward.
pub(crate) const NEXT_STEP: Do =
    Do::new("Next step", &[On::no_shift(Key::ArrowRight)], |_| Command::Go(Go::By(1)))
        .button(">", "one step on");
/// One step back.
pub(crate) const PREVIOUS_STEP: Do =
    Do::new("Previous step", &[On::no_shift(Key::ArrowLeft)], |_| Command::Go(Go::By(-1)))
        .button("<", "one step back");
/// To the first step.
pub(crate) const FIRST_STEP: Do =
    Do::new("First step", &[On::plain(Key::Home)], |_| Command::Go(Go::First)).button("|<", "first step");
/// To the last step.
pub(crate) const LAST_STEP: Do =
    Do::new("Last step", &[On::plain(Key::End)], |_| Command::Go(Go::Last)).button(">|", "last step");
/// To the next change of the tracking state.
pub(crate) const NEXT_EVENT: Do =
    Do::new("Next event", &[On::plain(Key::PageDown)], |_| Command::Go(Go::NextEvent))
        .button(">>", "next event");
/// To the previous change of the tracking state.
pub(crate) const PREVIOUS_EVENT: Do =
    Do::new("Previous event", &[On::plain(Key::PageUp)], |_| Command::Go(Go::PreviousEvent))
        .button("<<", "previous event");
/// Starts or ends the designation of a target.
pub(crate) const PICK: Do = Do::new("Pick a target", &[On::plain(Key::T)], |state| {
    Command::SetMode(if state.mode == Mode::Pick { Mode::Look } else { Mode::Pick })
});
/// Adds a note at the current view.
pub(crate) const PIN_NOTE: Do =
    Do::new("Pin a note here", &[On::plain(Key::M)], |_| Command::Notes(notes::NotesCommand::Pin));
/// Undoes the last change.
pub(crate) const UNDO: Do = Do::new("Undo", &[On::ctrl(Key::Z)], |_| Command::Why(why::WhyCommand::Undo));
/// Opens the window of exports.
pub(crate) const EXPORT: Do =
    Do::new("Export: recording, tables, report, pictures", &[On::ctrl(Key::S)], |_| {
        Command::Exports(exports::ExportsCommand::Open)
    })
    .button("Export", "Files, pictures, and any action as a command");
/// Opens the window of files, sessions and drives.
pub(crate) const OPEN: Do = Do::new("Open: a file, a recent session, a drive", &[On::ctrl(Key::O)], |_| {
    Command::Files(files::FilesCommand::Open)
})
.button("Open", "Files, recent sessions, drives");
/// Opens the help sheet.
pub(crate) const HELP: Do =
    Do::new("Keys and conventions", &[On::plain(Key::Questionmark), On::shift(Key::Slash)], |_| {
        Command::SetMode(Mode::Help)
    })
    .button("?", "Keys and conventions");
/// Opens the palette.
pub(crate) const PALETTE: Do =
    Do::new("Command palette", &[On::ctrl(Key::K)], |_| Command::SetMode(Mode::Palette(Search::default())));
/// Copies the link to the current view.
pub(crate) const COPY_LINK: Do =
    Do::new("Copy a link to this view", &[On::plain(Key::Y)], |_| Command::CopyLink);
/// Opens the session in Rerun.
pub(crate) const OPEN_RERUN: Do = Do::new("Open the session in Rerun", &[], |_| Command::OpenRerun)
    .button("Open in Rerun", "Streams this session to a Rerun viewer in a new tab");
/// Closes the live Rerun stream of the session.
pub(crate) const CLOSE_RERUN: Do = Do::new("Close the Rerun stream", &[], |_| Command::CloseRerun);
/// Maximises the current panel, or restores the others.
pub(crate) const MAXIMISE: Do =
    Do::new("Fill the page with the current panel", &[On::plain(Key::Backtick)], |_| {
        Command::Layout(LayoutCommand::Maximise(None))
    });

/// Every user command, in the order of the help sheet.
pub(crate) static TABLE: &[HelpLine] = &[
    line(Steps, "next, previous step", &[NEXT_STEP, PREVIOUS_STEP]),
    line(
        Steps,
        "ten steps on, back",
        &[
            Do::new("Ten steps on", &[On::shift(Key::ArrowRight)], |_| Command::Go(Go::By(10))),
            Do::new("Ten steps back", &[On::shift(Key::ArrowLeft)], |_| Command::Go(Go::By(-10))),
        ],
    ),
    line(Steps, "first, last step", &[FIRST_STEP, LAST_STEP]),
    line(Steps, "next, previous event (change of state)", &[NEXT_EVENT, PREVIOUS_EVENT]),
    line(
        Steps,
        "go to a step: 12, +5, last, t=3.5, or an event such as lost",
        &[Do::new("Go to a step", &[On::plain(Key::G)], |_| Command::SetMode(Mode::GoTo(String::new())))],
    ),
    line(
        Playing,
        "play, pause",
        &[Do::new("Play or pause", &[On::plain(Key::Space)], |_| shuttle(Shuttle::Toggle))],
    ),
    line(
        Playing,
        "play backwards, stop, play forwards; again: twice as fast",
        &[
            Do::new("Play backwards", &[On::plain(Key::J)], |_| shuttle(Shuttle::Reverse)),
            Do::new("Stop playing", &[On::plain(Key::K)], |_| shuttle(Shuttle::Stop)),
            Do::new("Play forwards", &[On::plain(Key::L)], |_| shuttle(Shuttle::Forward)),
        ],
    ),
    line(
        Playing,
        "a loop begins, ends at this step",
        &[
            Do::new("Begin the loop here", &[On::plain(Key::OpenBracket)], |_| shuttle(Shuttle::LoopIn)),
            Do::new("End the loop here", &[On::plain(Key::CloseBracket)], |_| shuttle(Shuttle::LoopOut)),
        ],
    ),
    line(
        Playing,
        "clear the loop",
        &[Do::new("Remove the loop", &[On::plain(Key::Backspace)], |_| shuttle(Shuttle::ClearLoop))],
    ),
    line(
        Playing,
        "next, previous hit of a breakpoint",
        &[
            Do::new("Breakpoints: next hit", &[On::no_shift(Key::N)], |_| {
                Command::Breakpoints(breakpoints::BreakpointCommand::NextHit)
            }),
            Do::new("Breakpoints: previous hit", &[On::shift(Key::N)], |_| {
                Command::Breakpoints(breakpoints::BreakpointCommand::PreviousHit)
            }),
        ],
    ),
    line(
        Playing,
        "toggle a breakpoint at this step",
        &[Do::new("Breakpoints: toggle breakpoint here", &[On::no_shift(Key::B)], |state| {
            Command::Breakpoints(breakpoints::BreakpointCommand::BreakAt(state.cursor.step))
        })],
    ),
    line(
        Playing,
        "break when: write a condition",
        &[Do::new("Breakpoints: write a condition", &[On::shift(Key::B)], |_| {
            Command::Breakpoints(breakpoints::BreakpointCommand::Focus)
        })],
    ),
    gesture(Playing, "Tab  Enter", "in the expression box: take the suggestion, set the breakpoint"),
    gesture(Playing, "Click above the timeline", "toggle a breakpoint at that step"),
    line(
        Steps,
        "previous, next stage",
        &[
            Do::new("Stage before", &[On::plain(Key::ArrowUp)], |_| Command::StageBy(-1)),
            Do::new("Stage after", &[On::plain(Key::ArrowDown)], |_| Command::StageBy(1)),
        ],
    ),
    line(Target, "pick a target: then click in the left image", &[PICK]),
    gesture(Target, "Arrows, Enter", "while picking: move the aim by 0.1 px (Shift 1 px), take it"),
    gesture(Page, "Enter  Backspace  Esc", "in the tour: next, back, skip"),
    line(
        Target,
        "run from this step with the changed settings, or as a branch with the tried values",
        &[Do::new("Run from this step with the changed settings", &[On::plain(Key::R)], run_or_branch)],
    ),
    line(
        Target,
        "why: where the selected value came from",
        &[Do::new("Why: where the selected value came from", &[On::plain(Key::W)], |_| {
            Command::Why(why::WhyCommand::Selected)
        })],
    ),
    line(
        Target,
        "what would have saved this step",
        &[Do::new("What would have saved this step?", &[On::plain(Key::C)], |_| {
            Command::Why(why::WhyCommand::Saved)
        })],
    ),
    line(
        Target,
        "undo, redo",
        &[
            UNDO,
            Do::new("Redo", &[On::ctrl(Key::Y), On::ctrl_shift(Key::Z)], |_| {
                Command::Why(why::WhyCommand::Redo)
            }),
        ],
    ),
    line(
        Images,
        "fit all images to their panels",
        &[Do::new("Fit all images", &[On::plain(Key::F)], |_| Command::FitAll)],
    ),
    line(Target, "pin a note here", &[PIN_NOTE]),
    line(Page, "export: files, pictures, commands", &[EXPORT]),
    line(Page, "open: a file, a recent session, a drive; or drop a file on the page", &[OPEN]),
    line(
        Images,
        "hide or show all marks",
        &[Do::new("Hide or show all marks", &[On::plain(Key::H)], |_| Command::ToggleMarks)],
    ),
    line(
        Images,
        "stretch dark images automatically, or show them as recorded",
        &[Do::new("Stretch dark images, or show them as recorded", &[On::plain(Key::I)], |state| {
            Command::SetStretch(if state.stretch == Stretch::Auto { Stretch::None } else { Stretch::Auto })
        })],
    ),
    line(Page, "cancel what was begun", &[Do::new("", &[On::plain(Key::Escape)], cancel)]),
    line(Page, "this sheet", &[HELP]),
    line(Page, "the command palette: every action by name", &[PALETTE]),
    HelpLine {
        group: Page,
        help: "arrangements of the panels, from the overview to the report",
        gesture: "Shift+1 … Shift+8",
        commands: &[
            Do::new("", &[On::shift(Key::Num1)], |_| arrange(Preset::Overview)),
            Do::new("", &[On::shift(Key::Num2)], |_| arrange(Preset::Match)),
            Do::new("", &[On::shift(Key::Num3)], |_| arrange(Preset::Stereo)),
            Do::new("", &[On::shift(Key::Num4)], |_| arrange(Preset::Map)),
            Do::new("", &[On::shift(Key::Num5)], |_| arrange(Preset::Compare)),
            Do::new("", &[On::shift(Key::Num6)], |_| arrange(Preset::Studies)),
            Do::new("", &[On::shift(Key::Num7)], |_| arrange(Preset::Report)),
            Do::new("", &[On::shift(Key::Num8)], |_| arrange(Preset::Image)),
        ],
    },
    HelpLine {
        group: Page,
        help: "next, previous panel; Tab goes on inside it",
        gesture: "",
        commands: &[
            Do::new("Next panel", &[On::no_shift(Key::Q)], |_| Command::Layout(LayoutCommand::Panel(1))),
            Do::new("Previous panel", &[On::shift(Key::Q)], |_| Command::Layout(LayoutCommand::Panel(-1))),
        ],
    },
    line(Page, "let the panel fill the page, and again to restore", &[MAXIMISE]),
    line(Page, "copy a link to the current view", &[COPY_LINK]),
    gesture(Images, "Wheel", "zoom at the pointer"),
    gesture(Images, "Drag", "pan"),
    gesture(Images, "Double click", "fit the image or plot"),
    line(
        Compare,
        "first divergence of the compared runs: step and stage",
        &[Do::new("Compare: first divergence", &[On::plain(Key::D)], |_| {
            Command::Compare(compare::CompareCommand::FirstDivergence)
        })],
    ),
    line(
        Compare,
        "next way of comparing the left image",
        &[Do::new("Compare: next way of the left image", &[On::plain(Key::V)], |_| {
            Command::Compare(compare::CompareCommand::NextView)
        })],
    ),
    gesture(Compare, "X (hold)", "show the other run while the key is held"),
    line(
        Compare,
        "hold the target still in the left image",
        &[Do::new("Hold the target still in the left image", &[On::plain(Key::S)], |_| {
            Command::Compare(compare::CompareCommand::Stabilise)
        })],
    ),
    // Commands without a key are in the palette only.
    line(
        Page,
        "",
        &[
            Do::new("Trackability: limits of the map", &[], |_| Command::Limits(limits::LimitsCommand::Open)),
            Do::new("Discard the changed settings", &[], |_| Command::ClearDraft),
            Do::new("Open the plain page of this step", &[], |_| {
                Command::Exports(exports::ExportsCommand::PlainPage)
            }),
            OPEN_RERUN,
            CLOSE_RERUN,
            Do::new("Tour: six bubbles from a lost target to a saved one", &[], |_| {
                Command::Tour(Turn::Begin)
            }),
        ],
    ),
];

fn shuttle(what: Shuttle) -> Command {
    Command::Breakpoints(breakpoints::BreakpointCommand::Shuttle(what))
}

fn arrange(preset: Preset) -> Command {
    Command::Layout(LayoutCommand::Use(preset))
}

fn run_or_branch(state: &State) -> Command {
    if state.trial().is_some() {
        Command::Why(why::WhyCommand::Branch)
    } else {
        Command::RunFromHere(state.draft.clone())
    }
}

fn cancel(state: &State) -> Command {
    if state.mode == Mode::Look && state.trial().is_some() {
        Command::Why(why::WhyCommand::Discard)
    } else {
        Command::SetMode(Mode::Look)
    }
}

/// All commands of the table.
pub(crate) fn all() -> impl Iterator<Item = &'static UserCommand> {
    TABLE.iter().flat_map(|line| line.commands)
}

/// The command of a key.
pub(crate) fn of_key(key: Key, modifiers: Modifiers) -> Option<&'static UserCommand> {
    all().find(|entry| entry.shortcuts.iter().any(|shortcut| shortcut.matches(key, modifiers)))
}

/// The keys of a command as the palette shows them; empty without any.
pub(crate) fn keys_of(state: &State, command: &Command) -> String {
    let entry = all().find(|entry| !entry.shortcuts.is_empty() && (entry.command)(state) == *command);
    entry.map(UserCommand::keys).unwrap_or_default()
}

/// The lines of a group of the help sheet: keys or gestures, and the explanation.
pub(crate) fn sheet(group: Group) -> impl Iterator<Item = (String, &'static str)> {
    let lines = TABLE.iter().filter(move |line| line.group == group && !line.help.is_empty());
    lines.map(|line| (line.keys(), line.help))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_shortcut_has_two_commands() {
        let shortcuts: Vec<(&str, Shortcut)> =
            all().flat_map(|entry| entry.shortcuts.iter().map(|shortcut| (entry.name, *shortcut))).collect();
        for (at, (name, a)) in shortcuts.iter().enumerate() {
            for (other, b) in &shortcuts[..at] {
                let is_shift_apart = a.shift.zip(b.shift).is_some_and(|(a, b)| a != b);
                let is_same = a.key == b.key && a.ctrl == b.ctrl && !is_shift_apart;
                assert!(!is_same, "{} gives {name:?} and {other:?}", a.words());
            }
        }
    }

    #[test]
    fn names_in_the_palette_are_unique() {
        let mut names: Vec<&str> = all().map(|entry| entry.name).filter(|name| !name.is_empty()).collect();
        let count = names.len();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), count);
    }

    #[test]
    fn the_sheet_shows_the_keys_that_act() {
        let lines: Vec<(String, &str)> = Group::ALL.into_iter().flat_map(sheet).collect();
        let keys = |help: &str| lines.iter().find(|(_, of)| *of == help).unwrap().0.as_str();
        assert_eq!(keys("next, previous step"), "Right  Left");
        assert_eq!(keys("undo, redo"), "Ctrl+Z  Ctrl+Y");
        assert_eq!(keys("this sheet"), "?");
        assert_eq!(keys("next, previous panel; Tab goes on inside it"), "Q  Shift+Q");
        assert_eq!(lines.len(), 42);
    }
}
