//! Requests come first: runs that keep all processors busy wait between two steps while requests are answered.
//!
//! A person who looks at a step asks for its parts one after the other, so that runs wait a little longer than each answer
//! takes ([`PAUSE`]), but never longer than [`LONGEST`] before a step: a program that asks without end slows them, it does
//! not stop them. They do not wait for long answers ([`LONG`]).

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use axum::extract::{Request, State};
use axum::middleware::Next;
use axum::response::Response;

/// How long after an answer the next request may come.
const PAUSE: Duration = Duration::from_millis(3);

/// An answer that takes longer is not waited for.
const LONG: Duration = Duration::from_millis(20);

/// The longest wait before a step.
const LONGEST: Duration = Duration::from_millis(40);

/// How often a waiting run looks.
const LOOK: Duration = Duration::from_micros(500);

/// The requests that are being answered.
#[derive(Debug)]
pub(crate) struct Requests {
    start: Instant,
    in_work: AtomicUsize,
    /// When a request last came or was answered, µs since `start`.
    last_us: AtomicU64,
}

impl Default for Requests {
    fn default() -> Self {
        Self { start: Instant::now(), in_work: AtomicUsize::new(0), last_us: AtomicU64::new(0) }
    }
}

/// A request that is being answered, until this goes away.
struct Answering(Arc<Requests>);

impl Answering {
    fn begin(requests: &Arc<Requests>) -> Self {
        requests.in_work.fetch_add(1, Ordering::Relaxed);
        requests.mark();
        Self(Arc::clone(requests))
    }
}

impl Drop for Answering {
    fn drop(&mut self) {
        self.0.in_work.fetch_sub(1, Ordering::Relaxed);
        self.0.mark();
    }
}

impl Requests {
    fn mark(&self) {
        self.last_us.store(self.start.elapsed().as_micros() as u64, Ordering::Relaxed);
    }

    /// Whether a person seems to wait for answers, so long after the start.
    fn are_coming(&self, now: Duration) -> bool {
        let last = Duration::from_micros(self.last_us.load(Ordering::Relaxed));
        let limit = if self.in_work.load(Ordering::Relaxed) > 0 { LONG } else { PAUSE };
        now.saturating_sub(last) < limit
    }

    /// Waits until the requests are answered, or for [`LONGEST`].
    pub(crate) fn give_way(&self) {
        let begun = Instant::now();
        while self.are_coming(self.start.elapsed()) && begun.elapsed() < LONGEST {
            std::thread::sleep(LOOK);
        }
    }
}

/// Counts a request until it is answered; the body of the answer may still be on its way.
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
            requests.are_coming(last + Duration::from_millis(ms))
        };
        let answering = Answering::begin(&requests);
        assert_eq!([0, 19, 21].map(after_ms), [true, true, false], "a long answer is not waited for");
        drop(answering);
        assert_eq!([0, 2, 4].map(after_ms), [true, true, false], "the next request may come");
        assert_eq!(requests.in_work.load(Ordering::Relaxed), 0);
        // Ends although requests come without end.
        requests.last_us.store(u64::MAX, Ordering::Relaxed);
        requests.give_way();
    }
}
