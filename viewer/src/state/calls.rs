//! Calls of endpoints and their replies.

use sightline_api::endpoint::{Call, Endpoint, Method};
use sightline_api::wire::Problem;

use crate::net::request::Reply;
use crate::state::State;

/// Where the page shows that a call was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Notice {
    /// As a card and in the list of messages.
    Card,
    /// Only in the list of messages: the panel that made the call shows it too.
    List,
}

impl State {
    /// Calls `E`; `take` receives the reply. A refusal is shown as a card.
    pub(crate) fn call<E: Endpoint>(&mut self, call: Call, take: impl FnOnce(&mut Self, E::Reply) + 'static) {
        self.call_or::<E>(call, take, |_, _| Notice::Card);
    }

    /// Calls `E`; `take` receives the reply, `refused` the problem.
    pub(crate) fn call_or<E: Endpoint>(
        &mut self,
        call: Call,
        take: impl FnOnce(&mut Self, E::Reply) + 'static,
        refused: impl FnOnce(&mut Self, &Problem) -> Notice + 'static,
    ) {
        // A retry supersedes the earlier refusal.
        if call.method != Method::Get {
            self.messages.mark_resolved(&format!("{} {}", call.method, call.path));
        }
        let request = self.calls.begin::<E>(call, move |state: &mut Self, call, outcome| match outcome {
            Ok(reply) => {
                state.messages.mark_resolved(&format!("{} {}", call.method, call.path));
                take(state, reply);
            }
            Err(problem) => match refused(state, &problem) {
                Notice::Card => state.show_refusal(call, &problem, false),
                Notice::List => state.show_refusal(call, &problem, true),
            },
        });
        self.outbox.push(request);
    }

    /// Calls `E`; `take` receives the reply or the problem. No message is shown.
    pub(crate) fn call_with_problem<E: Endpoint>(
        &mut self,
        call: Call,
        take: impl FnOnce(&mut Self, Result<E::Reply, Problem>) + 'static,
    ) {
        let request = self.calls.begin::<E>(call, |state, _, outcome| take(state, outcome));
        self.outbox.push(request);
    }

    /// Passes the answer of a call to its receiver.
    pub(crate) fn finish_call(&mut self, ticket: u64, outcome: Result<Reply, Problem>) {
        let outcome = match outcome {
            Ok(Reply::Body(bytes)) => Ok(bytes),
            Ok(Reply::Item(_)) => return,
            Err(problem) => Err(problem),
        };
        if let Some(waiting) = self.calls.take(ticket) {
            waiting.end(self, outcome);
        }
    }

    /// The pending calls with their tickets, oldest first.
    #[cfg(test)]
    pub(crate) fn pending_calls(&self) -> impl Iterator<Item = (u64, &Call)> {
        self.calls.iter()
    }

    /// The id of the open session; shows a message if none is open.
    pub(crate) fn session_id(&mut self) -> Option<String> {
        let id = self.session.as_ref().map(|session| session.id.clone());
        if id.is_none() {
            self.messages.problem("No session is open yet.", None);
        }
        id
    }
}
