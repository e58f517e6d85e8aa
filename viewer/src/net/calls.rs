//! Pending calls of endpoints, each with the function of `S` that receives its reply.
//!
//! A feature names the endpoint and handles the typed reply in one place.

use std::collections::BTreeMap;

use sightline_api::endpoint::{Call, Endpoint};
use sightline_api::wire::Problem;

use crate::net::reply::parse;
use crate::net::request::Request;

/// Receives the outcome of a call: the body of the reply, or the problem.
type Take<S> = Box<dyn FnOnce(&mut S, &Call, Result<Vec<u8>, Problem>)>;

/// A pending call.
pub(crate) struct PendingCall<S> {
    call: Call,
    take: Take<S>,
}

impl<S> PendingCall<S> {
    /// Passes the outcome to the receiver.
    pub(crate) fn end(self, state: &mut S, outcome: Result<Vec<u8>, Problem>) {
        (self.take)(state, &self.call, outcome);
    }
}

/// The pending calls, by ticket.
pub(crate) struct Calls<S> {
    pending: BTreeMap<u64, PendingCall<S>>,
    next: u64,
}

impl<S> Default for Calls<S> {
    fn default() -> Self {
        Self { pending: BTreeMap::new(), next: 0 }
    }
}

impl<S> Calls<S> {
    /// Registers a call of `E` and returns its request; `take` receives the call with its reply or problem.
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
        self.pending.insert(ticket, PendingCall { call: call.clone(), take });
        Request::Call { ticket, call }
    }

    /// Removes and returns the call of a ticket; `None` if it was answered before.
    pub(crate) fn take(&mut self, ticket: u64) -> Option<PendingCall<S>> {
        self.pending.remove(&ticket)
    }

    /// The pending calls with their tickets, oldest first.
    #[cfg(test)]
    pub(crate) fn iter(&self) -> impl Iterator<Item = (u64, &Call)> {
        self.pending.iter().map(|(ticket, pending)| (*ticket, &pending.call))
    }
}
