//! The memory of a server: what its parts take, and sessions that give theirs back.
//!
//! Steps are computed again from what a person did, so that a session that nobody asks for can rest as after a restart: its
//! runs lose their steps and are computed when somebody asks for it again, with the same bits.

use std::convert::Infallible;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use crate::jobs::lock;
use crate::limits::Limits;
use crate::live_session::LiveSession;
use crate::sessions::Sessions;

impl LiveSession {
    /// Measures the memory of the steps anew, after some were added or removed.
    pub(crate) fn measure(&self) {
        let bytes = self.with(|session| session.step_bytes());
        self.memory.set(bytes);
    }

    /// Gives the steps back, unless they are being computed.
    fn rest(&self) {
        self.with(|session| {
            if self.is_computing_any() || self.is_restoring() {
                return;
            }
            if let Ok(light) = session.without_steps() {
                // Before the lock is given back: whoever asks from now on has the runs computed.
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

/// Whether another step of a session fits into the limit; other sessions rest for it, the one unasked for longest first.
pub(crate) fn has_room(sessions: &Mutex<Sessions>, limits: &Limits, live: &LiveSession) -> bool {
    let (limit, unasked) = (&limits.step_bytes, limits.rest_s.time().unwrap_or_default());
    if of_steps(sessions) < limit.count() {
        return true;
    }
    let mut idle: Vec<(Instant, Arc<LiveSession>)> = lock(sessions)
        .by_number
        .values()
        .filter(|other| other.id != live.id && other.memory.bytes() > 0)
        .map(|other| (other.memory.asked(), Arc::clone(other)))
        .filter(|(asked, _)| asked.elapsed() >= unasked)
        .collect();
    idle.sort_by_key(|(asked, _)| *asked);
    idle.iter().any(|(_, other)| {
        other.rest();
        of_steps(sessions) < limit.count()
    })
}

/// Makes the allocator return freed memory to the system every few seconds, also on an idle server.
///
/// The allocator returns memory a second after it was freed, but only when a thread frees more or ends.
pub(crate) async fn give_back() -> Infallible {
    const PERIOD: Duration = Duration::from_secs(5);
    loop {
        tokio::time::sleep(PERIOD).await;
        let thread = std::thread::Builder::new().name("give-back".to_owned());
        // Freeing a block of this size makes the allocator look for memory to return.
        let freed = || drop(std::hint::black_box(vec![0_u8; 4 << 20]));
        // If the system starts no thread, the next round tries again.
        let _ = thread.spawn(freed);
    }
}

/// Threads and resident memory of this process, bytes, where the system tells.
pub(crate) fn of_process() -> (Option<u64>, Option<u64>) {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let number = |name: &str| {
        let line = status.lines().find_map(|line| line.strip_prefix(name))?;
        line.split_whitespace().next()?.parse::<u64>().ok()
    };
    (number("Threads:"), number("VmRSS:").map(|kib| kib << 10))
}
