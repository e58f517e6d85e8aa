//! Breakpoints, derived columns, and playback of the steps.

pub(crate) mod panel;
pub(crate) mod derived_plot;

mod columns;
pub(crate) mod derived;
pub(crate) mod goto;
pub(crate) mod play;
mod playing;
mod removal;
mod server;
mod update;

use sightline_session::breakpoints::BreakpointView;

use self::derived::Derived;
use self::play::{Play, Shuttle};

/// A command about breakpoints, derived columns or playback.
#[derive(Clone, Debug, PartialEq)]
pub enum BreakpointCommand {
    /// Changes the text of the expression box.
    Type(String),
    /// Shows the expression box and focuses it.
    Focus,
    /// Puts a text into the expression box, for the user to check.
    Propose(String),
    /// Puts a breakpoint's condition into the box, to change it.
    Edit(usize),
    /// Cancels the change of the breakpoint.
    CancelEdit,
    /// Sets a breakpoint with the condition in the box, or changes the one that is being edited.
    Set,
    /// Sets a breakpoint at a stop, or removes it.
    BreakAt(usize),
    /// Enables or disables a breakpoint.
    Switch {
        /// The breakpoint's number.
        number: usize,
        /// Whether to enable it.
        on: bool,
    },
    /// Removes a breakpoint.
    Remove(usize),
    /// Plots the expression over the steps.
    Plot(String),
    /// Removes a derived column from the plots.
    Unplot(usize),
    /// Goes to the next hit of any breakpoint.
    NextHit,
    /// Goes to the previous hit of any breakpoint.
    PreviousHit,
    /// Controls the playback.
    Shuttle(Shuttle),
    /// Shows or hides the state bands of the other targets.
    ShowOthers(bool),
}

/// Breakpoints, derived columns, and playback.
#[derive(Default)]
pub struct BreakpointState {
    /// The breakpoints with their hits, as last received.
    pub list: Vec<BreakpointView>,
    /// The text of the expression box.
    pub text: String,
    /// Number of the breakpoint whose condition is being edited.
    pub edited: Option<usize>,
    /// Whether the expression box requests the focus.
    pub wants_focus: bool,
    /// The derived columns.
    pub derived: Vec<Derived>,
    /// The state of the playback.
    pub play: Play,
    /// Whether the state bands of the other targets are shown.
    pub shows_others: bool,
    stale: bool,
    /// Value of `changes` at the pending request of the list.
    pending_read: Option<u64>,
    /// Number of changes of the list that were requested.
    changes: u64,
    /// Number of breakpoints that are being set.
    adding: usize,
    /// Conditions of breakpoints that are being set, each with the change to apply afterwards.
    pub(super) when_set: Vec<(String, WhenSet)>,
}

/// A change to apply once the server has set a breakpoint and assigned its number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum WhenSet {
    /// Disable it, as it was before its removal or as listed in the file.
    SwitchOff,
    /// Remove it.
    Remove,
}

impl BreakpointState {
    /// Marks breakpoints and columns as stale.
    pub(crate) fn make_stale(&mut self) {
        self.stale = true;
        self.derived.iter_mut().for_each(Derived::make_stale);
    }

    /// Discards the data of the previous session, but keeps the user's texts.
    pub(crate) fn forget(&mut self) {
        self.list.clear();
        (self.edited, self.pending_read, self.adding) = (None, None, 0);
        self.when_set.clear();
        self.play.forget();
        self.derived.iter_mut().for_each(Derived::forget);
    }

    /// Enabled breakpoints, each with its index in the list.
    pub fn watched(&self) -> impl Iterator<Item = (usize, &BreakpointView)> {
        self.list.iter().enumerate().filter(|(_, breakpoint)| breakpoint.on)
    }

    /// The steps at which a breakpoint hits in a run, in order.
    pub fn hits(breakpoint: &BreakpointView, target: usize, run: usize) -> &[usize] {
        let of_run = breakpoint.hits.iter().find(|hits| hits.target == target && hits.run == run);
        of_run.map_or(&[], |hits| &hits.steps)
    }
}
