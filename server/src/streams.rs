//! Tracks which sessions are streamed to Rerun: none until requested, and closed again on request.
//!
//! A stream is only the permission to read the session as a live recording. The recording is created for each viewer while
//! it reads, so a stream without viewers uses no memory.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio_util::sync::CancellationToken;

use crate::jobs::lock;
use crate::problem::{ApiError, ApiResult};

/// Maximum number of streamed sessions.
const STREAM_LIMIT: usize = 4;

/// Maximum number of viewers of all streams; each has its own recording threads and batch.
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
    /// Opens the stream of a session, if it is not open.
    ///
    /// # Errors
    /// A problem if too many are open.
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

    /// Closes the stream of a session and disconnects its viewers; returns whether it was open.
    pub(crate) fn close(&self, session: &str) -> bool {
        lock(&self.open).remove(session).inspect(CancellationToken::cancel).is_some()
    }

    /// Registers a viewer of a session's stream.
    ///
    /// # Errors
    /// A problem if the stream is not open, or there are too many viewers.
    pub(crate) fn view(&self, session: &str) -> ApiResult<Viewing> {
        let closed = lock(&self.open).get(session).cloned();
        let closed = closed.ok_or_else(|| {
            let hint = format!("Open it: `POST sessions/{session}/rerun`.");
            ApiError::not_found("This session is not streamed to Rerun.").hint(hint)
        })?;
        let permit = Arc::clone(&self.viewers).try_acquire_owned();
        let permit = permit.map_err(|_| ApiError::busy().hint("Close a Rerun viewer."))?;
        Ok(Viewing { closed, _permit: permit })
    }
}

/// The registration of a viewer, released on drop.
pub(crate) struct Viewing {
    /// Cancelled when the stream is closed.
    pub closed: CancellationToken,
    _permit: OwnedSemaphorePermit,
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
