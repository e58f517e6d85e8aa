//! Prioritises requests: runs that use all processors wait between two steps while requests are answered.
//!
//! A page that shows a step requests its parts one after the other. Runs therefore wait a little longer than each answer
//! takes ([`MAX_GAP`]), but at most [`MAX_WAIT`] before a step: continuous requests slow them down but do not stop them. They
//! do not wait for long answers ([`LONG_ANSWER`]).

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use axum::extract::{Request, State};
use axum::middleware::Next;
use axum::response::Response;

/// Maximum gap between an answer and the next request of a sequence.
const MAX_GAP: Duration = Duration::from_millis(3);

/// Runs do not wait for an answer that takes longer than this.
const LONG_ANSWER: Duration = Duration::from_millis(20);

/// Maximum wait before a step.
const MAX_WAIT: Duration = Duration::from_millis(40);

/// Polling interval of a waiting run.
const POLL_INTERVAL: Duration = Duration::from_micros(500);

/// The requests in progress.
#[derive(Debug)]
pub(crate) struct Requests {
    start: Instant,
    in_progress: AtomicUsize,
    /// Time of the last request or answer, µs since `start`.
    last_us: AtomicU64,
}

impl Default for Requests {
    fn default() -> Self {
        Self { start: Instant::now(), in_progress: AtomicUsize::new(0), last_us: AtomicU64::new(0) }
    }
}

/// A request in progress, until this is dropped.
struct Answering(Arc<Requests>);

impl Answering {
    fn begin(requests: &Arc<Requests>) -> Self {
        requests.in_progress.fetch_add(1, Ordering::Relaxed);
        requests.mark();
        Self(Arc::clone(requests))
    }
}

impl Drop for Answering {
    fn drop(&mut self) {
        self.0.in_progress.fetch_sub(1, Ordering::Relaxed);
        self.0.mark();
    }
}

impl Requests {
    fn mark(&self) {
        self.last_us.store(self.start.elapsed().as_micros() as u64, Ordering::Relaxed);
    }

    /// Whether a client probably waits for answers; `now` is the time since the start.
    fn are_expected(&self, now: Duration) -> bool {
        let last = Duration::from_micros(self.last_us.load(Ordering::Relaxed));
        let limit = if self.in_progress.load(Ordering::Relaxed) > 0 { LONG_ANSWER } else { MAX_GAP };
        now.saturating_sub(last) < limit
    }

    /// Waits until the requests are answered, at most [`MAX_WAIT`].
    pub(crate) fn wait_for_requests(&self) {
        let begun = Instant::now();
        while self.are_expected(self.start.elapsed()) && begun.elapsed() < MAX_WAIT {
            std::thread::sleep(POLL_INTERVAL);
        }
    }
}

/// Counts a request until its answer is ready; the body may still be in transit.
pub(crate) async fn count(State(requests): State<Arc<Requests>>, request: Request, next: Next) -> Response {
    let _answering = Answering::begin(&requests);
    next.run(request).await
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn requests_are_waited_for_while_they_come_and_not_for_ever() {
        let requests = Arc::new(Requests::default());
        let after_ms = |ms: u64| {
            let last = Duration::from_micros(requests.last_us.load(Ordering::Relaxed));
            requests.are_expected(last + Duration::from_millis(ms))
        };
        let answering = Answering::begin(&requests);
        assert_eq!([0, 19, 21].map(after_ms), [true, true, false], "a long answer is not waited for");
        drop(answering);
        assert_eq!([0, 2, 4].map(after_ms), [true, true, false], "the next request may come");
        assert_eq!(requests.in_progress.load(Ordering::Relaxed), 0);
        // Returns although requests arrive continuously.
        requests.last_us.store(u64::MAX, Ordering::Relaxed);
        requests.wait_for_requests();
    }
}
