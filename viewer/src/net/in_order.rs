//! Requests that are sent one after the other. On parallel connections, a removal could overtake the change that it
//! reverts.

use std::collections::VecDeque;

use crate::net::request::Request;

/// The unanswered requests, oldest first; the first one has been sent.
#[derive(Default)]
pub(super) struct InOrder(VecDeque<Request>);

impl InOrder {
    /// Appends a request; returns it if it can be sent at once.
    pub(super) fn add(&mut self, request: Request) -> Option<Request> {
        self.0.push_back(request);
        if self.0.len() == 1 { self.0.front().cloned() } else { None }
    }

    /// Removes an answered request; returns the one that can be sent next.
    pub(super) fn answered(&mut self, request: &Request) -> Option<Request> {
        if self.0.front() != Some(request) {
            return None;
        }
        self.0.pop_front();
        self.0.front().cloned()
    }
}

#[cfg(test)]
mod tests {
    use sightline_api::endpoint::Call;
    use sightline_api::endpoints::RestoreNote;
    use sightline_api::location::AtNote;

    use super::*;

    fn note(ticket: u64) -> Request {
        let call = Call::to::<RestoreNote>(&AtNote { session: "s1".to_owned(), note: ticket });
        Request::Call { ticket, call }
    }

    #[test]
    fn a_request_is_sent_when_those_before_it_are_answered() {
        let mut requests = InOrder::default();
        assert_eq!(requests.add(note(1)), Some(note(1)));
        assert_eq!(requests.add(note(2)), None);
        assert_eq!(requests.add(note(2)), None, "the same request twice is sent twice");
        assert_eq!(requests.answered(&note(7)), None, "another request");
        assert_eq!(requests.answered(&note(1)), Some(note(2)));
        assert_eq!(requests.answered(&note(2)), Some(note(2)));
        assert_eq!(requests.answered(&note(2)), None);
        assert_eq!(requests.add(note(3)), Some(note(3)));
    }
}
