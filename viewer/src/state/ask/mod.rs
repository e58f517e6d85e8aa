//! What the person asks of the steps: breakpoints, derived columns, and how time is travelled.

pub mod derived;
pub mod goto;
pub mod play;
mod removal;

use sightline_core::session::breakpoints::{BreakpointChange, BreakpointView, NewBreakpoint};
use sightline_core::session::expression::Expression;
use sightline_core::session::query::{Query, QueryAnswer};
use sightline_core::session::wire::Problem;

use self::derived::Derived;
use self::play::{Play, Shuttle};
use super::undo::Deed;
use super::{Connection, State};
use crate::command::Go;
use crate::net::Request;

/// What a person can ask for.
#[derive(Clone, Debug, PartialEq)]
pub enum Ask {
    /// Changes the text of the expression box.
    Type(String),
    /// Shows the expression box and puts the cursor there.
    Focus,
    /// Puts a text into the expression box, to be looked at before it is set.
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
        /// Whether it is looked for.
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

/// What is asked of the server.
#[derive(Clone, Debug, PartialEq)]
pub enum AskRequest {
    /// The breakpoints with their hits.
    Breakpoints(String),
    /// To set a breakpoint.
    Add {
        /// The session.
        session: String,
        /// The breakpoint.
        new: NewBreakpoint,
    },
    /// To change a breakpoint.
    Change {
        /// The session.
        session: String,
        /// The breakpoint's number.
        number: usize,
        /// What changes.
        change: BreakpointChange,
    },
    /// To remove a breakpoint.
    Remove {
        /// The session.
        session: String,
        /// The breakpoint's number.
        number: usize,
    },
    /// An expression at every step.
    Query {
        /// The session.
        session: String,
        /// The expression.
        query: Query,
    },
}

/// What the server answered.
#[derive(Clone, Debug, PartialEq)]
pub enum AskReply {
    /// The breakpoints with their hits.
    Breakpoints(Vec<BreakpointView>),
    /// A breakpoint that was set or changed.
    Breakpoint(BreakpointView),
    /// An expression at every step.
    Answer(QueryAnswer),
    /// It is done.
    Done,
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
    /// Whether the panel with the box is to be brought to the front.
    pub reveal: bool,
    /// The derived columns.
    pub derived: Vec<Derived>,
    /// How time is travelled.
    pub play: Play,
    /// Whether the state bands of the other targets are shown.
    pub shows_others: bool,
    stale: bool,
    asked: bool,
}

impl Asking {
    /// Whether the panel with the box is to be brought to the front; asking takes the wish away.
    pub fn take_reveal(&mut self) -> bool {
        std::mem::take(&mut self.reveal)
    }

    /// Everything is to be asked again.
    pub(super) fn make_stale(&mut self) {
        self.stale = true;
        self.derived.iter_mut().for_each(Derived::make_stale);
    }

    /// Nothing of another session stays, but the texts that the person wrote.
    pub(super) fn forget(&mut self) {
        self.breakpoints.clear();
        (self.edited, self.asked) = (None, false);
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

impl State {
    /// Carries out what the person asked for.
    pub(super) fn apply_ask(&mut self, ask: Ask) {
        match ask {
            Ask::Type(text) => (self.ask.text, self.ask.wants_focus) = (text, false),
            Ask::Focus => (self.ask.wants_focus, self.ask.reveal) = (true, true),
            Ask::Propose(text) => {
                self.ask.text = text;
                (self.ask.wants_focus, self.ask.reveal, self.ask.edited) = (true, true, None);
            }
            Ask::Edit(number) => self.edit_breakpoint(number),
            Ask::CancelEdit => {
                (self.ask.edited, self.ask.text) = (None, String::new());
            }
            Ask::Set => self.set_breakpoint(),
            Ask::BreakAt(step) => self.break_at(step),
            Ask::Switch { number, on } => {
                let change = BreakpointChange { on: Some(on), expression: None };
                self.ask_server(|session| AskRequest::Change { session, number, change });
                if let Some(known) = self.ask.breakpoints.iter_mut().find(|known| known.number == number) {
                    known.on = on;
                }
            }
            Ask::Remove(number) => self.remove_breakpoint(number),
            Ask::Plot(text) => self.plot_expression(text),
            Ask::Unplot(place) => self.unplot(place),
            Ask::NextHit => self.go_to_hit(true),
            Ask::PreviousHit => self.go_to_hit(false),
            Ask::Shuttle(shuttle) => self.shuttle(shuttle),
            Ask::ShowOthers(shown) => self.ask.shows_others = shown,
        }
    }

    fn edit_breakpoint(&mut self, number: usize) {
        let found = self.ask.breakpoints.iter().find(|breakpoint| breakpoint.number == number);
        if let Some(text) = found.map(|breakpoint| breakpoint.expression.clone()) {
            self.ask.text = text;
            (self.ask.edited, self.ask.wants_focus) = (Some(number), true);
        }
    }

    fn set_breakpoint(&mut self) {
        let text = self.ask.text.trim().to_owned();
        // What is wrong with the text stands under the box already.
        if Expression::condition(&text).is_err() {
            return;
        }
        let edited = self.ask.edited;
        let asked = self.ask_server(|session| match edited {
            Some(number) => {
                let change = BreakpointChange { expression: Some(text), on: None };
                AskRequest::Change { session, number, change }
            }
            None => {
                let new = NewBreakpoint { expression: Some(text), step: None };
                AskRequest::Add { session, new }
            }
        });
        if asked {
            (self.ask.text, self.ask.edited) = (String::new(), None);
        }
    }

    fn break_at(&mut self, step: usize) {
        let is_here = |breakpoint: &&BreakpointView| {
            Expression::condition(&breakpoint.expression).is_ok_and(|read| read.step_named() == Some(step))
        };
        match self.ask.breakpoints.iter().find(is_here).map(|breakpoint| breakpoint.number) {
            Some(number) => self.remove_breakpoint(number),
            None => {
                let new = NewBreakpoint { expression: None, step: Some(step) };
                self.ask_server(|session| AskRequest::Add { session, new });
            }
        }
    }

    fn remove_breakpoint(&mut self, number: usize) {
        if let Some(removed) = self.take_breakpoint_out(number) {
            let (expression, is_on) = (removed.expression, removed.on);
            let what = format!("the breakpoint `{expression}`");
            self.did_remove(&what, Deed::RemovedBreakpoint { expression, is_on });
        }
    }

    /// The next hit after a step, or the last one before it, in the run that is looked at.
    pub fn hit_from(&self, step: usize, is_forward: bool) -> Option<usize> {
        let (target, run) = (self.cursor.target?, self.cursor.run);
        let hits = self.ask.watched().map(|(_, breakpoint)| Asking::hits(breakpoint, target, run));
        if is_forward {
            hits.filter_map(|steps| steps.get(steps.partition_point(|hit| *hit <= step)).copied()).min()
        } else {
            let before = |steps: &[usize]| steps.partition_point(|hit| *hit < step).checked_sub(1);
            hits.filter_map(|steps| before(steps).map(|at| steps[at])).max()
        }
    }

    /// The conditions of the breakpoints that a step hits in the run that is looked at.
    pub fn hit_at(&self, step: usize) -> Vec<&str> {
        let Some(target) = self.cursor.target else { return Vec::new() };
        let is_hit = |breakpoint: &BreakpointView| {
            Asking::hits(breakpoint, target, self.cursor.run).binary_search(&step).is_ok()
        };
        let hit = self.ask.watched().filter(|(_, breakpoint)| is_hit(breakpoint));
        hit.map(|(_, breakpoint)| breakpoint.expression.as_str()).collect()
    }

    fn go_to_hit(&mut self, is_forward: bool) {
        match self.hit_from(self.cursor.step, is_forward) {
            Some(step) => self.apply(crate::command::Command::Go(Go::Step(step))),
            None if self.ask.watched().next().is_none() => {
                let hint = "B breaks at this step, Shift+B asks for a condition.".to_owned();
                self.messages.problem("There is no breakpoint that is on.", Some(hint));
            }
            None => {
                let side = if is_forward { "after" } else { "before" };
                self.messages.note(format!("No breakpoint is hit {side} this step in this run."));
            }
        }
    }

    /// Asks the server about the open session; says so when there is none.
    fn ask_server(&mut self, request: impl FnOnce(String) -> AskRequest) -> bool {
        match self.session.as_ref().map(|session| session.id.clone()) {
            Some(session) => {
                self.outbox.push(Request::Ask(request(session)));
                true
            }
            None => {
                self.messages.problem("No session is open yet.", None);
                false
            }
        }
    }

    /// Asks for what is not known any more.
    pub(super) fn sync_ask(&mut self) {
        let Some(session) = &self.session else { return };
        if self.connection != Connection::Live {
            return;
        }
        let id = session.id.clone();
        if self.ask.stale && !self.ask.asked {
            self.ask.stale = false;
            // Without any there is nothing to hear.
            if session.breakpoints.is_empty() {
                self.ask.breakpoints.clear();
            } else {
                self.ask.asked = true;
                self.outbox.push(Request::Ask(AskRequest::Breakpoints(id.clone())));
            }
        }
        self.sync_derived(&id);
    }

    /// Takes in an answer.
    pub(super) fn answered_ask(&mut self, request: &AskRequest, reply: AskReply) {
        match (request, reply) {
            (AskRequest::Breakpoints(_), AskReply::Breakpoints(list)) => {
                self.ask.asked = false;
                self.ask.breakpoints = list;
            }
            (_, AskReply::Breakpoint(view)) => {
                self.switch_off_again(&view);
                match self.ask.breakpoints.iter_mut().find(|known| known.number == view.number) {
                    Some(known) => *known = view,
                    None => self.ask.breakpoints.push(view),
                }
            }
            (AskRequest::Query { query, .. }, AskReply::Answer(answer)) => {
                self.took_column(query, Ok(answer));
            }
            _ => {}
        }
    }

    /// Takes in a refusal.
    pub(super) fn refused_ask(&mut self, request: &AskRequest, problem: &Problem) {
        match request {
            AskRequest::Breakpoints(_) => self.ask.asked = false,
            AskRequest::Query { query, .. } => self.took_column(query, Err(problem.detail.clone())),
            // What the page believed of the list may be wrong now.
            AskRequest::Remove { .. } => {
                self.undo.forget_last(|deed| matches!(deed, Deed::RemovedBreakpoint { .. }));
                self.ask.stale = true;
            }
            _ => self.ask.stale = true,
        }
    }
}
