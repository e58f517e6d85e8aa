//! Thread priority: studies run in the background, on processors that neither requests nor runs use.

use std::sync::OnceLock;

/// Gives this thread the idle scheduling policy on Linux; no effect elsewhere.
///
/// A low priority is not sufficient: the scheduler lets a running thread of any priority finish its time slice of some
/// milliseconds before an answer can continue, unless the thread has the idle policy.
fn yield_to_all() {
    #[cfg(target_os = "linux")]
    {
        use thread_priority::{NormalThreadSchedulePolicy, ThreadPriority, ThreadSchedulePolicy, unix};
        let idle = ThreadSchedulePolicy::Normal(NormalThreadSchedulePolicy::Idle);
        // If the system refuses, requests are answered more slowly during a study.
        let _ = unix::set_thread_priority_and_policy(unix::thread_native_id(), ThreadPriority::Min, idle);
    }
}

/// Runs `work` on a thread pool with the idle policy; parallel iterators in `work` use the same pool.
pub(crate) fn in_background<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    static POOL: OnceLock<Option<rayon::ThreadPool>> = OnceLock::new();
    let name = |number| format!("background-{number}");
    let pool = || rayon::ThreadPoolBuilder::new().thread_name(name).start_handler(|_| yield_to_all());
    match POOL.get_or_init(|| pool().build().ok()) {
        Some(pool) => pool.install(work),
        // No threads could be started: `work` runs here, at normal priority.
        None => work(),
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use thread_priority::{NormalThreadSchedulePolicy, ThreadSchedulePolicy, unix};

    use super::*;

    #[test]
    fn background_work_yields_and_its_caller_does_not() {
        let policy = || unix::thread_schedule_policy().unwrap();
        let ours = policy();
        let idle = ThreadSchedulePolicy::Normal(NormalThreadSchedulePolicy::Idle);
        assert_eq!(
            (in_background(policy), in_background(|| rayon::join(policy, policy))),
            (idle, (idle, idle))
        );
        assert_eq!(policy(), ours);
        assert_ne!(ours, idle);
    }
}
