//! Calls of endpoints that wait for their answers, each with the function of `S` that takes its reply.
//!
//! This is how a feature calls the server: it names the endpoint and takes the typed reply, in one place.

use std::collections::BTreeMap;

use sightline_api::endpoint::{Call, Endpoint};
use sightline_api::wire::Problem;

use crate::net::reply::parse;
use crate::net::request::Request;

/// Takes the answer to a call: the body of the reply, or the problem.
type Take<S> = Box<dyn FnOnce(&mut S, &Call, Result<Vec<u8>, Problem>)>;

/// A call that waits for its answer.
pub(crate) struct Waiting<S> {
    call: Call,
    take: Take<S>,
}

impl<S> Waiting<S> {
    /// Passes the answer on.
    pub(crate) fn end(self, state: &mut S, outcome: Result<Vec<u8>, Problem>) {
        (self.take)(state, &self.call, outcome);
    }
}

/// Calls that wait for their answers.
pub(crate) struct Calls<S> {
    waiting: BTreeMap<u64, Waiting<S>>,
    next: u64,
}

impl<S> Default for Calls<S> {
    fn default() -> Self {
        Self { waiting: BTreeMap::new(), next: 0 }
    }
}

impl<S> Calls<S> {
    /// The request that calls `E`; `take` gets the call with the reply or the problem.
    pub(crate) fn begin<E: Endpoint>(
        &mut self,
        call: Call,
        take: impl FnOnce(&mut S, &Call, Result<E::Reply, Problem>) + 'static,
    ) -> Request {
        let ticket = self.next;
        self.next += 1;
        let take: Take<S> = Box::new(|state, call, outcome| {
            take(state, call, outcome.and_then(|bytes| parse::<E>(&bytes)));
        });
        self.waiting.insert(ticket, Waiting { call: call.clone(), take });
        Request::Call { ticket, call }
    }

    /// Takes out the call of a ticket; `None` if it was answered before.
    pub(crate) fn take(&mut self, ticket: u64) -> Option<Waiting<S>> {
        self.waiting.remove(&ticket)
    }

    /// The waiting calls with their tickets, oldest first.
    #[cfg(test)]
    pub(crate) fn iter(&self) -> impl Iterator<Item = (u64, &Call)> {
        self.waiting.iter().map(|(ticket, waiting)| (*ticket, &waiting.call))
    }
}
