//! The memory of the steps of one session, and when somebody asked for it last.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use crate::jobs::lock;

/// The memory of the steps of one session.
#[derive(Debug)]
pub(crate) struct StepMemory {
    bytes: AtomicUsize,
    asked: Mutex<Instant>,
}

impl Default for StepMemory {
    fn default() -> Self {
        Self { bytes: AtomicUsize::new(0), asked: Mutex::new(Instant::now()) }
    }
}

impl StepMemory {
    /// Remembers that somebody asks for the session now.
    pub(crate) fn is_asked_for(&self) {
        *lock(&self.asked) = Instant::now();
    }

    /// When somebody asked for the session last.
    pub(crate) fn asked(&self) -> Instant {
        *lock(&self.asked)
    }

    /// The memory as it was measured last, bytes.
    pub(crate) fn bytes(&self) -> usize {
        self.bytes.load(Ordering::Relaxed)
    }

    /// Remembers the memory.
    pub(crate) fn set(&self, bytes: usize) {
        self.bytes.store(bytes, Ordering::Relaxed);
    }
}
