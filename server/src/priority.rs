//! The priority of threads: what computes for long yields the processors to what answers requests.

/// From now on the system prefers other threads to this one, where every thread has a priority of its own.
///
/// That is so on Linux. Elsewhere the priority is that of the whole process and stays as it is.
pub(crate) fn yield_to_requests() {
    #[cfg(target_os = "linux")]
    {
        /// The niceness: a thirtieth of the processor time of a thread of ordinary priority.
        const NICE: i32 = 15;
        // A system that refuses it answers more slowly beside long work, but no less correctly.
        let _ = rustix::process::setpriority_process(None, NICE);
    }
}

/// Gives the threads that share the work of one computation the same priority; once, before they are used.
pub(crate) fn begin_shared_threads() {
    let pool = rayon::ThreadPoolBuilder::new().start_handler(|_| yield_to_requests());
    // In a program that computed before, the threads exist and keep their priority.
    let _ = pool.build_global();
}
