//! Calls of endpoints and their answers.

use sightline_api::endpoint::{Call, Endpoint};
use sightline_api::wire::Problem;

use crate::net::request::Reply;
use crate::state::State;

impl State {
    /// Calls `E`; `take` gets the reply, and a problem is shown as a message.
    pub(crate) fn call<E: Endpoint>(&mut self, call: Call, take: impl FnOnce(&mut Self, E::Reply) + 'static) {
        let shown = call.clone();
        self.call_with_problem::<E>(call, move |state, outcome| match outcome {
            Ok(reply) => take(state, reply),
            Err(problem) => state.show_refusal(&shown, &problem, false),
        });
    }

    /// Calls `E`; `take` gets the reply or the problem.
    pub(crate) fn call_with_problem<E: Endpoint>(
        &mut self,
        call: Call,
        take: impl FnOnce(&mut Self, Result<E::Reply, Problem>) + 'static,
    ) {
        let request = self.calls.begin::<E>(call, take);
        self.outbox.push(request);
    }

    /// Takes in the answer to a call.
    pub(crate) fn answered_call(&mut self, ticket: u64, outcome: Result<Reply, Problem>) {
        let outcome = match outcome {
            Ok(Reply::Body(bytes)) => Ok(bytes),
            Ok(_) => return,
            Err(problem) => Err(problem),
        };
        if let Some(take) = self.calls.end(ticket) {
            take(self, outcome);
        }
    }

    /// The id of the open session; says so if there is none.
    pub(crate) fn session_id(&mut self) -> Option<String> {
        let id = self.session.as_ref().map(|session| session.id.clone());
        if id.is_none() {
            self.messages.problem("No session is open yet.", None);
        }
        id
    }
}
