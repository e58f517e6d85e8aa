//! Work that takes long: a few threads with a bounded queue for runs, and lanes for work that a request waits for.
//!
//! The reactor computes nothing. A queue that is full refuses at once, so that nothing piles up unseen.

use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

use tokio::sync::Semaphore;

use crate::problem::{ApiError, ApiResult};

/// Locks, also after a panic elsewhere: what these mutexes guard is never left half changed.
pub fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

type Job = Box<dyn FnOnce() + Send>;

/// A few threads that work off a bounded queue, first come first served.
pub struct Jobs {
    queue: Arc<Queue>,
    limit: usize,
}

#[derive(Default)]
struct Queue {
    waiting: Mutex<Waiting>,
    changed: Condvar,
}

#[derive(Default)]
struct Waiting {
    jobs: VecDeque<Job>,
    closed: bool,
}

impl Jobs {
    /// Starts `workers` threads; at most `limit` jobs wait.
    ///
    /// # Errors
    /// When the system starts no thread.
    pub fn start(workers: usize, limit: usize) -> std::io::Result<Self> {
        let queue = Arc::new(Queue::default());
        for number in 0..workers {
            let queue = Arc::clone(&queue);
            std::thread::Builder::new().name(format!("run-{number}")).spawn(move || work(&queue))?;
        }
        Ok(Self { queue, limit })
    }

    /// Adds a job to the queue.
    ///
    /// # Errors
    /// A problem when too many are waiting already.
    pub fn submit(&self, job: impl FnOnce() + Send + 'static) -> ApiResult<()> {
        let mut waiting = lock(&self.queue.waiting);
        if waiting.jobs.len() >= self.limit {
            return Err(ApiError::busy());
        }
        waiting.jobs.push_back(Box::new(job));
        self.queue.changed.notify_one();
        Ok(())
    }
}

impl Drop for Jobs {
    fn drop(&mut self) {
        let mut waiting = lock(&self.queue.waiting);
        waiting.closed = true;
        waiting.jobs.clear();
        self.queue.changed.notify_all();
    }
}

fn work(queue: &Queue) {
    while let Some(job) = next_job(queue) {
        if catch_unwind(AssertUnwindSafe(job)).is_err() {
            tracing::error!("a job panicked");
        }
    }
}

fn next_job(queue: &Queue) -> Option<Job> {
    let mut waiting = lock(&queue.waiting);
    while !waiting.closed {
        if let Some(job) = waiting.jobs.pop_front() {
            return Some(job);
        }
        waiting = queue.changed.wait(waiting).unwrap_or_else(PoisonError::into_inner);
    }
    None
}

/// Work that a request waits for, on blocking threads: so much at a time, and so much waiting.
pub struct Lane {
    permits: Semaphore,
    waiting: AtomicUsize,
    limit: usize,
}

impl Lane {
    /// A lane for `at_a_time` pieces of work, with at most `limit` more waiting.
    pub fn new(at_a_time: usize, limit: usize) -> Self {
        Self { permits: Semaphore::new(at_a_time), waiting: AtomicUsize::new(0), limit }
    }

    /// Does `work` when its turn comes.
    ///
    /// # Errors
    /// Those of `work`, a problem when too many are waiting, and one without details when `work` panics.
    pub async fn run<T: Send + 'static>(
        &self,
        work: impl FnOnce() -> ApiResult<T> + Send + 'static,
    ) -> ApiResult<T> {
        let _permit = {
            let _place = Place::take(&self.waiting, self.limit)?;
            self.permits.acquire().await.map_err(|closed| ApiError::internal(closed.to_string()))?
        };
        blocking(work).await
    }
}

/// A place in the queue of a lane, also given back when the request goes away.
struct Place<'a>(&'a AtomicUsize);

impl<'a> Place<'a> {
    fn take(waiting: &'a AtomicUsize, limit: usize) -> ApiResult<Self> {
        let before = waiting.fetch_add(1, Ordering::Relaxed);
        let place = Self(waiting);
        if before < limit { Ok(place) } else { Err(ApiError::busy()) }
    }
}

impl Drop for Place<'_> {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Does `work` on a blocking thread.
///
/// # Errors
/// Those of `work`, and one without details when it panics.
pub async fn blocking<T: Send + 'static>(
    work: impl FnOnce() -> ApiResult<T> + Send + 'static,
) -> ApiResult<T> {
    let done = tokio::task::spawn_blocking(work).await;
    done.unwrap_or_else(|failed| Err(ApiError::internal(failed.to_string())))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc;

    #[test]
    fn a_job_that_panics_does_not_take_the_thread_with_it() {
        let jobs = Jobs::start(1, 8).unwrap();
        let (sender, receiver) = mpsc::channel();
        jobs.submit(|| panic!("meant")).unwrap();
        jobs.submit(move || sender.send(7).unwrap()).unwrap();
        assert_eq!(receiver.recv().unwrap(), 7);
    }

    #[test]
    fn a_full_queue_refuses_at_once() {
        let jobs = Jobs::start(0, 2).unwrap();
        assert!(jobs.submit(|| ()).is_ok() && jobs.submit(|| ()).is_ok());
        assert_eq!(jobs.submit(|| ()).unwrap_err().problem().status, 503);
    }

    #[tokio::test]
    async fn a_lane_refuses_what_cannot_wait_and_hides_a_panic() {
        let lane = Lane::new(1, 1);
        assert_eq!(lane.run(|| Ok(3)).await, Ok(3));
        let problem = lane.run::<()>(|| panic!("secret")).await.unwrap_err();
        assert_eq!(problem.problem().code, "internal");
        assert!(!problem.problem().detail.contains("secret"));
        assert_eq!(Lane::new(1, 0).run(|| Ok(())).await.unwrap_err().problem().status, 503);
    }
}
