//! The calls that the page makes in tests, and replies to them.

use sightline_api::endpoint::{Call, Endpoint};
use sightline_api::wire::Problem;

use crate::net::request::{CompletedRequest, Reply, Request};
use crate::state::State;

/// The session of the fixed drive.
pub(crate) fn at_session() -> sightline_api::location::AtSession {
    sightline_api::location::AtSession { session: "s1".to_owned() }
}

/// Removes all requests from the outbox and returns the calls.
pub(crate) fn calls(state: &mut State) -> Vec<Call> {
    let call = |request| match request {
        Request::Call { call, .. } => Some(call),
        Request::Item(_) | Request::Reconnect => None,
    };
    state.take_requests().into_iter().filter_map(call).collect()
}

/// Removes all requests from the outbox and returns the calls of `E`.
pub(crate) fn calls_of<E: Endpoint>(state: &mut State) -> Vec<Call> {
    calls(state).into_iter().filter(Call::is_to::<E>).collect()
}

/// Removes all requests from the outbox and returns the bodies of the calls of `E`.
pub(crate) fn bodies<E: Endpoint>(state: &mut State) -> Vec<E::Body> {
    let body = |call: Call| serde_json::from_slice(&call.body.unwrap()).unwrap();
    calls_of::<E>(state).into_iter().map(body).collect()
}

/// Answers the oldest pending call of `E`.
pub(crate) fn answer<E: Endpoint>(state: &mut State, reply: &impl serde::Serialize) {
    end::<E>(state, Ok(Reply::Body(serde_json::to_vec(reply).unwrap())));
}

/// Refuses the oldest pending call of `E`.
pub(crate) fn refuse<E: Endpoint>(state: &mut State, problem: Problem) {
    end::<E>(state, Err(problem));
}

fn end<E: Endpoint>(state: &mut State, outcome: Result<Reply, Problem>) {
    let waiting = state.pending_calls().find(|(_, call)| call.is_to::<E>());
    let (ticket, call) = waiting.map(|(ticket, call)| (ticket, call.clone())).expect(E::PATH);
    state.apply_reply(CompletedRequest { request: Request::Call { ticket, call }, outcome }, 0.0);
}
