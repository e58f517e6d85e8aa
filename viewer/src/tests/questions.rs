//! What the page asks about a step, and answers to it.

use crate::net::request::{Arrived, Reply, Request};
use crate::net::why::{WhyReply, WhyRequest};
use crate::state::State;

/// Answers a question.
pub(crate) fn answer(state: &mut State, request: WhyRequest, reply: WhyReply) {
    state.arrived(Arrived { request: Request::Why(request), outcome: Ok(Reply::Why(reply)) }, 0.0);
}

/// What is asked about steps, taken out of the outbox.
pub(crate) fn asked(state: &mut State) -> Vec<WhyRequest> {
    let why = |request| match request {
        Request::Why(request) => Some(request),
        _ => None,
    };
    state.take_requests().into_iter().filter_map(why).collect()
}
