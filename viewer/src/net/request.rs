//! Requests of the page to the server, and their answers.

use sightline_api::endpoint::Call;
use sightline_api::endpoints::{
    AddBreakpoint, AddNote, ChangeBreakpoint, ChangeNote, ListBreakpoints, MoveCursor, RemoveBreakpoint,
    RemoveNote, RemoveRun, RemoveTarget, RenameTarget, RestoreNote, RestoreRun, RestoreTarget,
};
use sightline_api::wire::Problem;

use crate::cache::{Item, Key};

/// A request of the page.
#[derive(Clone, Debug, PartialEq)]
pub enum Request {
    /// Calls an endpoint.
    Call {
        /// The number under which [`crate::net::calls`] stores the receiver of the reply.
        ticket: u64,
        /// The call.
        call: Call,
    },
    /// Reads an image, an array or a record.
    Item(Key),
    /// Reconnects to the events at once.
    Reconnect,
}

/// The calls that are sent one after the other: quick changes that a user makes and undoes, and the list that they change.
/// On parallel connections, a removal could overtake the change that it reverts.
const IN_ORDER: [fn(&Call) -> bool; 13] = [
    Call::is_to::<RemoveTarget>,
    Call::is_to::<RestoreTarget>,
    Call::is_to::<RenameTarget>,
    Call::is_to::<RemoveRun>,
    Call::is_to::<RestoreRun>,
    Call::is_to::<AddNote>,
    Call::is_to::<ChangeNote>,
    Call::is_to::<RemoveNote>,
    Call::is_to::<RestoreNote>,
    Call::is_to::<ListBreakpoints>,
    Call::is_to::<AddBreakpoint>,
    Call::is_to::<ChangeBreakpoint>,
    Call::is_to::<RemoveBreakpoint>,
];

impl Request {
    /// Whether the request is sent only after all earlier requests of this kind are answered.
    pub(crate) fn is_in_order(&self) -> bool {
        matches!(self, Self::Call { call, .. } if IN_ORDER.iter().any(|is_to| is_to(call)))
    }

    /// Whether the answer changes nothing on the screen.
    pub(crate) fn is_invisible(&self) -> bool {
        matches!(self, Self::Call { call, .. } if call.is_to::<MoveCursor>())
    }
}

/// The answer to a request.
pub enum Reply {
    /// The body of the answer to a call.
    Body(Vec<u8>),
    /// An image, an array or a record.
    Item(Item),
}

/// An answer with its request.
pub struct CompletedRequest {
    /// The request.
    pub request: Request,
    /// The answer, or why there is none.
    pub outcome: Result<Reply, Problem>,
}
