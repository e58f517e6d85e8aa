//! Calls of endpoints that wait for their answers, each with what `S` does with its reply.
//!
//! This is how a feature asks the server: it names the endpoint and takes the typed reply, in one place.

use std::collections::BTreeMap;

use sightline_api::endpoint::{Call, Endpoint};
use sightline_api::wire::Problem;

use crate::net::reply::parse;
use crate::net::request::Request;

/// Takes in an answer: the body of the reply, or the problem.
pub(crate) type Take<S> = Box<dyn FnOnce(&mut S, Result<Vec<u8>, Problem>)>;

/// Calls that wait for their answers.
pub(crate) struct Calls<S> {
    waiting: BTreeMap<u64, Take<S>>,
    next: u64,
}

impl<S> Default for Calls<S> {
    fn default() -> Self {
        Self { waiting: BTreeMap::new(), next: 0 }
    }
}

impl<S> Calls<S> {
    /// The request that calls `E`; `take` gets the reply or the problem.
    pub(crate) fn begin<E: Endpoint>(
        &mut self,
        call: Call,
        take: impl FnOnce(&mut S, Result<E::Reply, Problem>) + 'static,
    ) -> Request {
        let ticket = self.next;
        self.next += 1;
        self.waiting.insert(
            ticket,
            Box::new(|state, outcome| take(state, outcome.and_then(|bytes| parse::<E>(&bytes)))),
        );
        Request::Call { ticket, call }
    }

    /// What takes the answer to a call; `None` if it was answered before.
    pub(crate) fn end(&mut self, ticket: u64) -> Option<Take<S>> {
        self.waiting.remove(&ticket)
    }
}
