//! Memory of the server: usage of its parts, and idle sessions that release theirs.
//!
//! Steps can be recomputed from the saved session. An idle session can therefore release its steps as after a restart; the
//! next request recomputes its runs, with the same bits.

use std::convert::Infallible;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use crate::jobs::lock;
use crate::limits::Limits;
use crate::live_session::LiveSession;
use crate::sessions::Sessions;

impl LiveSession {
    /// Measures the memory of the steps again, after a change of their number.
    pub(crate) fn measure(&self) {
        let bytes = self.with(|session| session.step_bytes());
        self.memory.set(bytes);
    }

    /// Releases the steps, unless they are being computed.
    fn release_steps(&self) {
        self.with(|session| {
            if self.is_computing_any() || self.is_restoring() {
                return;
            }
            if let Ok(light) = session.without_steps() {
                // Before the lock is released, so that any later request restarts the runs.
                self.sleep();
                *session = light;
                self.memory.set(0);
            }
        });
    }
}

/// The memory of the steps of all sessions, bytes.
pub(crate) fn of_steps(sessions: &Mutex<Sessions>) -> usize {
    lock(sessions).by_number.values().map(|live| live.memory.bytes()).sum()
}

/// Whether another step of a session fits into the limit; first releases the steps of other sessions, longest idle first.
pub(crate) fn has_room(sessions: &Mutex<Sessions>, limits: &Limits, live: &LiveSession) -> bool {
    let (limit, min_idle) = (&limits.step_bytes, limits.rest_s.time().unwrap_or_default());
    if of_steps(sessions) < limit.count() {
        return true;
    }
    let mut idle: Vec<(Instant, Arc<LiveSession>)> = lock(sessions)
        .by_number
        .values()
        .filter(|other| other.id != live.id && other.memory.bytes() > 0)
        .map(|other| (other.memory.last_request(), Arc::clone(other)))
        .filter(|(last_request, _)| last_request.elapsed() >= min_idle)
        .collect();
    idle.sort_by_key(|(last_request, _)| *last_request);
    idle.iter().any(|(_, other)| {
        other.release_steps();
        of_steps(sessions) < limit.count()
    })
}

/// Makes the allocator return freed memory to the system every few seconds, also on an idle server.
///
/// The allocator returns memory one second after it was freed, but only when a thread frees more or ends.
pub(crate) async fn return_freed_memory() -> Infallible {
    const PERIOD: Duration = Duration::from_secs(5);
    loop {
        tokio::time::sleep(PERIOD).await;
        let thread = std::thread::Builder::new().name("give-back".to_owned());
        // Freeing a block of this size makes the allocator search for memory to return.
        let freed = || drop(std::hint::black_box(vec![0_u8; 4 << 20]));
        // If no thread can be started, the next round tries again.
        let _ = thread.spawn(freed);
    }
}

/// Number of threads and resident memory, bytes, of this process, if the system reports them.
pub(crate) fn of_process() -> (Option<u64>, Option<u64>) {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let number = |name: &str| {
        let line = status.lines().find_map(|line| line.strip_prefix(name))?;
        line.split_whitespace().next()?.parse::<u64>().ok()
    };
    (number("Threads:"), number("VmRSS:").map(|kib| kib << 10))
}
