//! Which sessions are streamed to Rerun: off until a person asks for it, and closed again on request.
//!
//! A stream is only the permission to read the session as a live recording; the recording itself is made for each viewer
//! while it reads, so that a stream without viewers takes no memory.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio_util::sync::CancellationToken;

use crate::jobs::lock;
use crate::problem::{ApiError, ApiResult};

/// Sessions that may be streamed at a time: more viewers than a person can look at.
const STREAM_LIMIT: usize = 4;

/// Viewers of all streams at a time; each has the threads and the batch of a recording of its own.
const VIEWER_LIMIT: usize = 8;

/// The open streams, by session.
pub(crate) struct Streams {
    open: Mutex<BTreeMap<String, CancellationToken>>,
    viewers: Arc<Semaphore>,
}

impl Default for Streams {
    fn default() -> Self {
        Self { open: Mutex::default(), viewers: Arc::new(Semaphore::new(VIEWER_LIMIT)) }
    }
}

impl Streams {
    /// Opens the stream of a session, which may be open already.
    ///
    /// # Errors
    /// A problem when too many are open.
    pub(crate) fn open(&self, session: &str) -> ApiResult<()> {
        let mut open = lock(&self.open);
        if open.contains_key(session) {
            return Ok(());
        }
        if open.len() >= STREAM_LIMIT {
            let sessions: Vec<_> = open.keys().map(String::as_str).collect();
            let detail = format!("{STREAM_LIMIT} sessions are streamed already: {}.", sessions.join(", "));
            let hint = format!("Close one: `DELETE sessions/{}/rerun`.", sessions[0]);
            return Err(ApiError::conflict(detail).hint(hint));
        }
        open.insert(session.to_owned(), CancellationToken::new());
        Ok(())
    }

    /// Closes the stream of a session, also for the viewers that read it; says whether it was open.
    pub(crate) fn close(&self, session: &str) -> bool {
        lock(&self.open).remove(session).inspect(CancellationToken::cancel).is_some()
    }

    /// Lets a viewer read the stream of a session.
    ///
    /// # Errors
    /// A problem when it is not open, or too many viewers read.
    pub(crate) fn view(&self, session: &str) -> ApiResult<Viewing> {
        let closed = lock(&self.open).get(session).cloned();
        let closed = closed.ok_or_else(|| {
            let hint = format!("Open it: `POST sessions/{session}/rerun`.");
            ApiError::not_found("This session is not streamed to Rerun.").hint(hint)
        })?;
        let place = Arc::clone(&self.viewers).try_acquire_owned();
        let place = place.map_err(|_| ApiError::busy().hint("Close a Rerun viewer."))?;
        Ok(Viewing { closed, _place: place })
    }
}

/// A viewer's place, given back when it is dropped.
pub(crate) struct Viewing {
    /// Cancelled when the stream is closed.
    pub closed: CancellationToken,
    _place: OwnedSemaphorePermit,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fifth_stream_is_refused_with_the_way_out() {
        let streams = Streams::default();
        for session in ["s1", "s2", "s3", "s4", "s1"] {
            streams.open(session).unwrap();
        }
        let refused = streams.open("s5").unwrap_err();
        assert_eq!(refused.problem().status, 409);
        assert_eq!(refused.problem().hint.as_deref(), Some("Close one: `DELETE sessions/s1/rerun`."));
        assert!(streams.close("s1") && !streams.close("s1"));
        streams.open("s5").unwrap();
    }

    #[test]
    fn closing_a_stream_reaches_its_viewers() {
        let streams = Streams::default();
        assert_eq!(streams.view("s1").err().unwrap().problem().status, 404);
        streams.open("s1").unwrap();
        let viewing = streams.view("s1").unwrap();
        assert!(!viewing.closed.is_cancelled());
        streams.close("s1");
        assert!(viewing.closed.is_cancelled());
    }

    #[test]
    fn the_ninth_viewer_waits_for_another_to_leave() {
        let streams = Streams::default();
        streams.open("s1").unwrap();
        let mut all: Vec<_> = (0..VIEWER_LIMIT).map(|_| streams.view("s1").unwrap()).collect();
        assert_eq!(streams.view("s1").err().unwrap().problem().status, 503);
        all.pop();
        assert!(streams.view("s1").is_ok());
    }
}
