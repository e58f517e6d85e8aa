//! The priority of threads: what nobody waits for yields the processors to what somebody looks at.

use std::sync::OnceLock;

/// From now on the system prefers other threads to this one, where every thread has a priority of its own.
///
/// That is so on Linux. Elsewhere the priority is that of the whole process and stays as it is.
pub(crate) fn yield_to_others() {
    #[cfg(target_os = "linux")]
    {
        /// The niceness: a thirtieth of the processor time of a thread of ordinary priority.
        const NICE: i32 = 15;
        // A system that refuses it answers more slowly beside long work, but no less correctly.
        let _ = rustix::process::setpriority_process(None, NICE);
    }
}

/// Does `work`, and what it shares between threads, on threads that yield to all others.
pub(crate) fn in_background<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    static POOL: OnceLock<Option<rayon::ThreadPool>> = OnceLock::new();
    let name = |number| format!("background-{number}");
    let pool = || rayon::ThreadPoolBuilder::new().thread_name(name).start_handler(|_| yield_to_others());
    match POOL.get_or_init(|| pool().build().ok()) {
        Some(pool) => pool.install(work),
        // The system refuses threads: then those of the tracker have to do.
        None => work(),
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    #[test]
    fn work_in_the_background_yields_and_what_begins_it_does_not() {
        let niceness = || rustix::process::getpriority_process(None).unwrap();
        let ours = niceness();
        assert_eq!(
            (in_background(niceness), in_background(|| rayon::join(niceness, niceness))),
            (15, (15, 15))
        );
        assert_eq!(niceness(), ours);
    }
}
