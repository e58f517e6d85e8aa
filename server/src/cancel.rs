//! Flags that cancel work: on request, when the HTTP request that waits for it is dropped, or after a deadline.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use tokio::runtime::Handle;
use tokio::task::AbortHandle;

/// Cancels one computation when set.
pub(crate) type CancelFlag = Arc<AtomicBool>;

/// Cancels the work for a request when the request is dropped.
#[derive(Default)]
pub(crate) struct CancelOnDrop(CancelFlag);

impl CancelOnDrop {
    /// The flag that is set on drop.
    pub(crate) fn flag(&self) -> CancelFlag {
        Arc::clone(&self.0)
    }
}

impl Drop for CancelOnDrop {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Sets a flag after a time limit, unless dropped before.
pub(crate) struct Deadline {
    watch: Option<AbortHandle>,
    passed: CancelFlag,
}

impl Deadline {
    /// Starts the clock; without a limit the flag is never set.
    pub(crate) fn begin(limit: Option<Duration>, flag: &CancelFlag) -> Self {
        let passed = CancelFlag::default();
        let (own, flag) = (Arc::clone(&passed), Arc::clone(flag));
        let watch = limit.zip(Handle::try_current().ok()).map(|(limit, runtime)| {
            let watch = runtime.spawn(async move {
                tokio::time::sleep(limit).await;
                own.store(true, Ordering::Relaxed);
                flag.store(true, Ordering::Relaxed);
            });
            watch.abort_handle()
        });
        Self { watch, passed }
    }

    /// Whether the limit has passed.
    pub(crate) fn has_passed(&self) -> bool {
        self.passed.load(Ordering::Relaxed)
    }
}

impl Drop for Deadline {
    fn drop(&mut self) {
        if let Some(watch) = &self.watch {
            watch.abort();
        }
    }
}
