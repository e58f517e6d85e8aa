//! Memory of the steps of one session, and the time of its last request.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use crate::jobs::lock;

/// Memory of the steps of one session, with the time of its last request.
#[derive(Debug)]
pub(crate) struct StepMemory {
    bytes: AtomicUsize,
    last_request: Mutex<Instant>,
}

impl Default for StepMemory {
    fn default() -> Self {
        Self { bytes: AtomicUsize::new(0), last_request: Mutex::new(Instant::now()) }
    }
}

impl StepMemory {
    /// Records a request for the session.
    pub(crate) fn mark_requested(&self) {
        *lock(&self.last_request) = Instant::now();
    }

    /// Time of the last request for the session.
    pub(crate) fn last_request(&self) -> Instant {
        *lock(&self.last_request)
    }

    /// The last measured memory, bytes.
    pub(crate) fn bytes(&self) -> usize {
        self.bytes.load(Ordering::Relaxed)
    }

    /// Sets the measured memory, bytes.
    pub(crate) fn set(&self, bytes: usize) {
        self.bytes.store(bytes, Ordering::Relaxed);
    }
}
