//! The types of the command table: a shortcut, a command with name, icon and keys, and a line of the help sheet.

use egui::{Key, Modifiers};

use crate::command::Command;
use crate::state::State;

/// A key with its modifiers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Shortcut {
    /// The key.
    pub key: Key,
    /// Whether it requires Ctrl (or Command).
    pub ctrl: bool,
    /// Whether it requires Shift; `None`: with or without.
    pub shift: Option<bool>,
}

impl Shortcut {
    pub(super) const fn plain(key: Key) -> Self {
        Self { key, ctrl: false, shift: None }
    }

    pub(super) const fn no_shift(key: Key) -> Self {
        Self { key, ctrl: false, shift: Some(false) }
    }

    pub(super) const fn shift(key: Key) -> Self {
        Self { key, ctrl: false, shift: Some(true) }
    }

    pub(super) const fn ctrl(key: Key) -> Self {
        Self { key, ctrl: true, shift: Some(false) }
    }

    pub(super) const fn ctrl_shift(key: Key) -> Self {
        Self { key, ctrl: true, shift: Some(true) }
    }

    /// Whether `key` with `modifiers` is this shortcut.
    pub(crate) fn matches(self, key: Key, modifiers: Modifiers) -> bool {
        let has_ctrl = modifiers.ctrl || modifiers.command;
        self.key == key
            && self.ctrl == has_ctrl
            && !modifiers.alt
            && self.shift.is_none_or(|shift| shift == modifiers.shift)
    }

    /// The text on the help sheet and in tooltips, such as `Ctrl+S`.
    pub(crate) fn words(self) -> String {
        let key = match self.key {
            Key::ArrowRight => "Right",
            Key::ArrowLeft => "Left",
            Key::ArrowUp => "Up",
            Key::ArrowDown => "Down",
            Key::PageUp => "PgUp",
            Key::PageDown => "PgDn",
            Key::Escape => "Esc",
            Key::OpenBracket => "[",
            Key::CloseBracket => "]",
            Key::Backtick => "`",
            Key::Questionmark => "?",
            key => key.name(),
        };
        let ctrl = if self.ctrl { "Ctrl+" } else { "" };
        let shift = if self.shift == Some(true) { "Shift+" } else { "" };
        format!("{ctrl}{shift}{key}")
    }
}

/// A command that the user can give by key, by button or by name.
#[derive(Clone, Copy)]
pub(crate) struct UserCommand {
    /// Name in the palette and in menus; empty: not listed there.
    pub name: &'static str,
    /// Text of its button in the bars; empty: no button.
    pub icon: &'static str,
    /// Tooltip of the button, without the keys.
    pub tip: &'static str,
    /// Shortcuts; the first one is displayed.
    pub shortcuts: &'static [Shortcut],
    /// Returns the command for the current state.
    pub command: fn(&State) -> Command,
}

impl UserCommand {
    /// The text of the displayed shortcut; empty without one.
    pub(crate) fn keys(&self) -> String {
        self.shortcuts.first().map(|shortcut| shortcut.words()).unwrap_or_default()
    }

    /// The tooltip of the button: its effect, and the keys in brackets.
    pub(crate) fn tooltip(&self) -> String {
        self.with_keys(self.tip)
    }

    /// A text followed by the keys in brackets.
    pub(crate) fn with_keys(&self, text: &str) -> String {
        let keys = self.keys();
        if keys.is_empty() { text.to_owned() } else { format!("{text} ({keys})") }
    }
}

/// A group of lines of the help sheet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Group {
    /// Moving along the drive.
    Steps,
    /// Breakpoints, loop and playing.
    Playing,
    /// Targets, runs, and explanations.
    Target,
    /// Images and plots.
    Images,
    /// Comparing runs.
    Compare,
    /// Panels, files, and the page.
    Page,
}

impl Group {
    /// All groups, in the order of the sheet.
    pub(crate) const ALL: [Self; 6] =
        [Self::Steps, Self::Playing, Self::Target, Self::Images, Self::Compare, Self::Page];

    /// The heading on the sheet.
    pub(crate) const fn title(self) -> &'static str {
        match self {
            Self::Steps => "Steps and stages",
            Self::Playing => "Playing and breakpoints",
            Self::Target => "Target, runs and causes",
            Self::Images => "Images and plots",
            Self::Compare => "Comparing runs",
            Self::Page => "Panels, files and page",
        }
    }
}

/// A line of the help sheet, with the commands that it explains.
#[derive(Clone, Copy)]
pub(crate) struct HelpLine {
    /// The group on the help sheet.
    pub group: Group,
    /// Explanation on the help sheet; empty: no line there.
    pub help: &'static str,
    /// Keys or gestures that are not a shortcut of a command; empty: the help sheet shows the commands' shortcuts.
    pub gesture: &'static str,
    /// The commands that the line explains.
    pub commands: &'static [UserCommand],
}

impl HelpLine {
    /// The keys or gestures as displayed on the help sheet.
    pub(crate) fn keys(&self) -> String {
        if self.gesture.is_empty() {
            self.commands.iter().map(UserCommand::keys).collect::<Vec<_>>().join("  ")
        } else {
            self.gesture.to_owned()
        }
    }
}

impl UserCommand {
    pub(super) const fn new(
        name: &'static str,
        shortcuts: &'static [Shortcut],
        command: fn(&State) -> Command,
    ) -> Self {
        Self { name, icon: "", tip: "", shortcuts, command }
    }

    pub(super) const fn button(self, icon: &'static str, tip: &'static str) -> Self {
        Self { icon, tip, ..self }
    }
}
