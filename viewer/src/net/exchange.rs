//! Which endpoint each request calls, and how its reply is read: types of endpoints, no paths.

use sightline_api::endpoint::{Call, Endpoint, NoBody};
use sightline_api::endpoints::{
    AddBreakpoint, AddNote, AskCounterfactual, CancelCounterfactual, CancelRun, CancelTrackability,
    ChangeBreakpoint, ChangeNote, CompareRuns, DesignateTarget, ForkRun, ListBreakpoints, ListNotes,
    MoveCursor, QuerySession, RemoveBreakpoint, RemoveNote, RemoveRun, RemoveTarget, RestoreNote, RestoreRun,
    RestoreTarget, ResumeRun, ShowCounterfactual, ShowCursor, ShowMetrics, ShowRun, ShowSession,
    ShowTrackability, ShowWhy, TryStep,
};
use sightline_api::location::{AtBreakpoint, AtNote, AtRun, AtSession, AtStop, AtTarget};
use sightline_api::query::{FirstRow, MapLimits, ValueName};
use sightline_api::wire::{Designated, Problem};
use sightline_rover::trackability::TrackabilityLimits;
use sightline_session::compare::RunName;
use sightline_track::settings::Changes;

use crate::breakpoints::{AskReply, AskRequest};
use crate::cache::Key;
use crate::net::items;
use crate::net::reply::parse;
use crate::net::request::{Reply, Request};
use crate::net::why::{WhyReply, WhyRequest};

/// A request as it is sent, with the reader of its reply.
pub(super) struct Exchange {
    /// The request.
    pub(super) call: Call,
    /// How the reply is read.
    pub(super) reader: Reader,
}

/// Parses the body of a JSON reply.
type Parse = Box<dyn Fn(&[u8]) -> Result<Reply, Problem> + Send>;

/// How a reply is read.
pub(super) enum Reader {
    /// As JSON.
    Json(Parse),
    /// As the file of an item.
    Item(Key),
}

/// A call of `E` whose reply becomes `reply`.
fn exchange<E: Endpoint>(call: Call, reply: impl Fn(E::Reply) -> Reply + Send + 'static) -> Exchange {
    Exchange { call, reader: Reader::Json(Box::new(move |bytes| parse::<E>(bytes).map(&reply))) }
}

/// A call of `E` without a body.
fn to<E: Endpoint<Body = NoBody>>(
    at: &E::At,
    reply: impl Fn(E::Reply) -> Reply + Send + 'static,
) -> Exchange {
    exchange::<E>(Call::to::<E>(at), reply)
}

/// A call of `E` with a body.
fn send<E: Endpoint>(
    at: &E::At,
    body: &E::Body,
    reply: impl Fn(E::Reply) -> Reply + Send + 'static,
) -> Exchange {
    exchange::<E>(Call::with_body::<E>(at, body), reply)
}

/// A call whose reply nobody reads.
fn order(call: Call) -> Exchange {
    Exchange { call, reader: Reader::Json(Box::new(|_| Ok(Reply::Done))) }
}

fn session(id: &str) -> AtSession {
    AtSession { session: id.to_owned() }
}

fn target(session: &str, target: usize) -> AtTarget {
    AtTarget { session: session.to_owned(), target }
}

fn run(session: &str, target: usize, run: usize) -> AtRun {
    AtRun { session: session.to_owned(), target, run }
}

fn note(session: &str, note: u64) -> AtNote {
    AtNote { session: session.to_owned(), note }
}

impl Request {
    /// The call; none for what is not sent.
    pub(crate) fn call(&self) -> Option<Call> {
        Some(self.exchange()?.call)
    }

    /// The call and the reader of its reply; none for what is not sent.
    pub(super) fn exchange(&self) -> Option<Exchange> {
        Some(match self {
            Self::Reconnect => return None,
            Self::Item(key) => Exchange { call: items::call(key), reader: Reader::Item(key.clone()) },
            Self::Trackability { traverse, step, limits } => {
                let (at, limits) = map(traverse, *step, limits);
                let call = Call::with_query::<ShowTrackability>(&at, &limits);
                exchange::<ShowTrackability>(call, |map| Reply::Trackability(Box::new(map)))
            }
            Self::CancelTrackability { traverse, step, limits } => {
                let (at, limits) = map(traverse, *step, limits);
                order(Call::with_query::<CancelTrackability>(&at, &limits))
            }
            Self::Call { call, .. } => {
                let read = |bytes: &[u8]| Ok(Reply::Body(bytes.to_vec()));
                Exchange { call: call.clone(), reader: Reader::Json(Box::new(read)) }
            }
            Self::Why(request) => request.exchange(),
            Self::Ask(request) => request.exchange(),
            _ => return self.about_session(),
        })
    }

    /// A request about a session, its targets, runs and notes.
    fn about_session(&self) -> Option<Exchange> {
        Some(match self {
            Self::Session(id) => to::<ShowSession>(&session(id), |view| Reply::Session(Box::new(view))),
            Self::Cursor(id) => to::<ShowCursor>(&session(id), Reply::Cursor),
            Self::PutCursor { session: id, cursor } => {
                order(Call::with_body::<MoveCursor>(&session(id), cursor))
            }
            Self::NewTarget { session: id, target } => {
                send::<DesignateTarget>(&session(id), target, |Designated { target, session, .. }| {
                    Reply::Designated { target, session: Box::new(session) }
                })
            }
            Self::RemoveTarget { session, target: number } => {
                order(Call::to::<RemoveTarget>(&target(session, *number)))
            }
            Self::Rows { session, target, run: number, from_row } => {
                let at = run(session, *target, *number);
                let call = Call::with_query::<ShowRun>(&at, &FirstRow { from_row: *from_row });
                exchange::<ShowRun>(call, |view| Reply::Run(Box::new(view)))
            }
            Self::NewRun { session, target: number, new } => {
                send::<ForkRun>(&target(session, *number), new, |view| Reply::Run(Box::new(view)))
            }
            Self::CancelRun { session, target, run: number } => {
                order(Call::to::<CancelRun>(&run(session, *target, *number)))
            }
            Self::ResumeRun { session, target, run: number } => {
                order(Call::to::<ResumeRun>(&run(session, *target, *number)))
            }
            Self::Metrics { session, run: RunName { target, run: number } } => {
                to::<ShowMetrics>(&run(session, *target, *number), |found| Reply::Metrics(Box::new(found)))
            }
            Self::Compare { session: id, new } => {
                send::<CompareRuns>(&session(id), new, |found| Reply::Compared(Box::new(found)))
            }
            Self::Notes(id) => to::<ListNotes>(&session(id), Reply::Notes),
            Self::NewNote { session: id, new } => order(Call::with_body::<AddNote>(&session(id), new)),
            Self::EditNote { session, id, revision, edit } => {
                let call = Call::with_body::<ChangeNote>(&note(session, *id), edit);
                order(call.at_revision(*revision))
            }
            Self::RemoveNote { session, id, revision } => {
                order(Call::to::<RemoveNote>(&note(session, *id)).at_revision(*revision))
            }
            Self::RestoreNote { session, id } => order(Call::to::<RestoreNote>(&note(session, *id))),
            _ => return None,
        })
    }
}

/// A stop and the limits of its map that are not the defaults.
fn map(traverse: &str, step: usize, limits: &Changes) -> (AtStop, MapLimits) {
    let limits = (!limits.is_empty()).then(|| TrackabilityLimits::text(limits));
    (AtStop { id: traverse.to_owned(), step }, MapLimits { limits })
}

impl WhyRequest {
    fn exchange(&self) -> Exchange {
        let question = |question| Reply::Why(WhyReply::Question(Box::new(question)));
        let view = |view| Reply::Why(WhyReply::Session(Box::new(view)));
        match self {
            Self::Explain { of, value } => {
                let call = Call::with_query::<ShowWhy>(of, &ValueName { value: Some(value.clone()) });
                exchange::<ShowWhy>(call, |found| Reply::Why(WhyReply::Explanation(Box::new(found))))
            }
            Self::WhatIf { of, what_if } => {
                send::<TryStep>(of, what_if, |ghost| Reply::Why(WhyReply::Ghost(Box::new(ghost))))
            }
            Self::Question(of) => to::<ShowCounterfactual>(of, question),
            Self::AskQuestion(of) => to::<AskCounterfactual>(of, question),
            Self::CancelQuestion(of) => to::<CancelCounterfactual>(of, question),
            Self::RemoveRun { session, target, run: number } => {
                to::<RemoveRun>(&run(session, *target, *number), view)
            }
            Self::RestoreRun { session, target, run: number } => {
                to::<RestoreRun>(&run(session, *target, *number), view)
            }
            Self::RestoreTarget { session, target: number } => {
                to::<RestoreTarget>(&target(session, *number), view)
            }
        }
    }
}

impl AskRequest {
    fn exchange(&self) -> Exchange {
        let breakpoint = |view| Reply::Ask(AskReply::Breakpoint(view));
        let at = |id: &str, number: usize| AtBreakpoint { session: id.to_owned(), breakpoint: number };
        match self {
            Self::Breakpoints(id) => {
                to::<ListBreakpoints>(&session(id), |list| Reply::Ask(AskReply::Breakpoints(list)))
            }
            Self::Add { session: id, new } => send::<AddBreakpoint>(&session(id), new, breakpoint),
            Self::Change { session, number, change } => {
                send::<ChangeBreakpoint>(&at(session, *number), change, breakpoint)
            }
            Self::Remove { session, number } => {
                to::<RemoveBreakpoint>(&at(session, *number), |_| Reply::Ask(AskReply::Done))
            }
            Self::Query { session: id, query } => {
                send::<QuerySession>(&session(id), query, |answer| Reply::Ask(AskReply::Answer(answer)))
            }
        }
    }
}

#[cfg(test)]
impl Request {
    /// Whether this calls `E` at this location.
    pub(crate) fn calls<E: Endpoint>(&self, at: &E::At) -> bool {
        let path = sightline_api::endpoint::path::<E>(at, &E::Query::default());
        let is_it =
            |call: &Call| call.method == E::METHOD && call.path.split('?').next() == path.split('?').next();
        self.call().as_ref().is_some_and(is_it)
    }

    /// The body with which this calls `E` at this location.
    pub(crate) fn body_of<E: Endpoint>(&self, at: &E::At) -> Option<E::Body> {
        let call = self.call().filter(|_| self.calls::<E>(at))?;
        serde_json::from_slice(&call.body?).ok()
    }
}
