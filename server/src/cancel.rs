//! Flags that end work: set by a person, when the request that waits for the work goes away, or after too long a time.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use tokio::runtime::Handle;
use tokio::task::AbortHandle;

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

/// Sets a flag when some work has taken too long, unless it is dropped before.
pub(crate) struct Deadline {
    watch: Option<AbortHandle>,
    passed: CancelFlag,
}

impl Deadline {
    /// Begins to count; without a limit the flag is never set.
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

    /// Whether the work was told to end.
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
