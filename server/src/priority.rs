//! The priority of threads: studies run in the background, below the answers to requests and the runs that somebody watches.

use std::sync::OnceLock;

/// Lowers the priority of this thread on Linux; elsewhere a priority belongs to the whole process and is not changed.
pub(crate) fn lower() {
    #[cfg(target_os = "linux")]
    {
        /// The niceness: a thirtieth of the processor time of a thread of ordinary priority.
        const NICE: i32 = 15;
        // If the system refuses, requests are answered more slowly beside a study.
        let _ = rustix::process::setpriority_process(None, NICE);
    }
}

/// Does `work` on a thread pool of low priority; parallel iterators in `work` run on the same pool.
pub(crate) fn in_background<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    static POOL: OnceLock<Option<rayon::ThreadPool>> = OnceLock::new();
    let name = |number| format!("background-{number}");
    let pool = || rayon::ThreadPoolBuilder::new().thread_name(name).start_handler(|_| lower());
    match POOL.get_or_init(|| pool().build().ok()) {
        Some(pool) => pool.install(work),
        // The system starts no threads: `work` runs here, at normal priority.
        None => work(),
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    #[test]
    fn background_work_has_low_priority_and_its_caller_does_not() {
        let niceness = || rustix::process::getpriority_process(None).unwrap();
        let ours = niceness();
        assert_eq!(
            (in_background(niceness), in_background(|| rayon::join(niceness, niceness))),
            (15, (15, 15))
        );
        assert_eq!(niceness(), ours);
    }
}
