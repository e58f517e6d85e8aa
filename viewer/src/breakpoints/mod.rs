//! Breakpoints, derived columns, and playing along the steps.

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

/// A command of the user.
#[derive(Clone, Debug, PartialEq)]
pub enum Ask {
    /// Changes the text of the expression box.
    Type(String),
    /// Shows the expression box and puts the cursor there.
    Focus,
    /// Puts a text into the expression box, to be checked by the user before it is set.
    Propose(String),
    /// Takes a breakpoint into the box, to change its condition.
    Edit(usize),
    /// Leaves the breakpoint that is being changed as it was.
    CancelEdit,
    /// Sets the breakpoint of the box, or changes the one that was taken into it.
    Set,
    /// Sets a breakpoint at a stop, or removes it.
    BreakAt(usize),
    /// Switches a breakpoint on or off.
    Switch {
        /// The breakpoint's number.
        number: usize,
        /// Whether it is on.
        on: bool,
    },
    /// Removes a breakpoint.
    Remove(usize),
    /// Plots the expression over the steps.
    Plot(String),
    /// Takes a derived column out of the plots.
    Unplot(usize),
    /// Goes to the next hit of any breakpoint.
    NextHit,
    /// Goes to the previous one.
    PreviousHit,
    /// Plays, stops, loops.
    Shuttle(Shuttle),
    /// Shows or hides the state bands of the other targets.
    ShowOthers(bool),
}

/// Breakpoints, derived columns, and time travel.
#[derive(Default)]
pub struct Asking {
    /// The breakpoints with their hits, as last heard.
    pub breakpoints: Vec<BreakpointView>,
    /// The text of the expression box.
    pub text: String,
    /// The breakpoint whose condition is in the box.
    pub edited: Option<usize>,
    /// Whether the expression box is to get the keyboard.
    pub wants_focus: bool,
    /// The derived columns.
    pub derived: Vec<Derived>,
    /// How time is travelled.
    pub play: Play,
    /// Whether the state bands of the other targets are shown.
    pub shows_others: bool,
    stale: bool,
    /// The list is being read; the number of changes when it was requested.
    asked: Option<u64>,
    /// Number of requested changes of the list.
    changes: u64,
    /// How many breakpoints are being set.
    adding: usize,
    /// Conditions of breakpoints that are being set, with the changes that follow.
    pub(super) when_set: Vec<(String, WhenSet)>,
}

/// A change that follows as soon as the server has set a breakpoint and its number is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum WhenSet {
    /// It is switched off: so it was before it was removed, or so it is in the file that lists it.
    SwitchOff,
    /// It is removed.
    Remove,
}

impl Asking {
    /// Marks breakpoints and columns as stale.
    pub(crate) fn make_stale(&mut self) {
        self.stale = true;
        self.derived.iter_mut().for_each(Derived::make_stale);
    }

    /// Forgets everything of another session except the user's texts.
    pub(crate) fn forget(&mut self) {
        self.breakpoints.clear();
        (self.edited, self.asked, self.adding) = (None, None, 0);
        self.when_set.clear();
        self.play.forget();
        self.derived.iter_mut().for_each(Derived::forget);
    }

    /// Breakpoints that are on, each with its place in the list.
    pub fn watched(&self) -> impl Iterator<Item = (usize, &BreakpointView)> {
        self.breakpoints.iter().enumerate().filter(|(_, breakpoint)| breakpoint.on)
    }

    /// The stops that a breakpoint hit in a run, in order.
    pub fn hits(breakpoint: &BreakpointView, target: usize, run: usize) -> &[usize] {
        let of_run = breakpoint.hits.iter().find(|hits| hits.target == target && hits.run == run);
        of_run.map_or(&[], |hits| &hits.steps)
    }
}
