//! The priority of threads: studies run in the background, where neither requests nor runs need the processors.

use std::sync::OnceLock;

/// Lets this thread run only where a processor is idle, on Linux; elsewhere its priority is not changed.
///
/// A low priority would not do: the scheduler lets a running thread of any priority finish its slice of some milliseconds
/// before an answer can go on, unless the thread is one of these.
fn yield_to_all() {
    #[cfg(target_os = "linux")]
    {
        use thread_priority::{NormalThreadSchedulePolicy, ThreadPriority, ThreadSchedulePolicy, unix};
        let idle = ThreadSchedulePolicy::Normal(NormalThreadSchedulePolicy::Idle);
        // If the system refuses, requests are answered more slowly beside a study.
        let _ = unix::set_thread_priority_and_policy(unix::thread_native_id(), ThreadPriority::Min, idle);
    }
}

/// Does `work` on a thread pool that runs where processors are idle; parallel iterators in `work` run on the same pool.
pub(crate) fn in_background<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    static POOL: OnceLock<Option<rayon::ThreadPool>> = OnceLock::new();
    let name = |number| format!("background-{number}");
    let pool = || rayon::ThreadPoolBuilder::new().thread_name(name).start_handler(|_| yield_to_all());
    match POOL.get_or_init(|| pool().build().ok()) {
        Some(pool) => pool.install(work),
        // The system starts no threads: `work` runs here, at normal priority.
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
