//! Flags that end work: set by a person, or when the request that waits for the work goes away.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Tells one computation to end.
pub(crate) type CancelFlag = Arc<AtomicBool>;

/// Cancels the work for a request that goes away.
#[derive(Default)]
pub(crate) struct CancelOnDrop(CancelFlag);

impl CancelOnDrop {
    /// The flag that is set when the request goes away.
    pub(crate) fn flag(&self) -> CancelFlag {
        Arc::clone(&self.0)
    }
}

impl Drop for CancelOnDrop {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}
