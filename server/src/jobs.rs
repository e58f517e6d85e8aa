//! Threads for long work. Each lane runs a fixed number of jobs at a time, in order of arrival, and limits the number of
//! waiting ones. A job of many turns queues again after each turn, so that short jobs are not delayed by long ones.
//!
//! The async reactor computes nothing. A full lane rejects new work at once.

use std::collections::BTreeSet;
use std::future::Future;
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Waker};

use sightline_geometry::cancel::Cancel;
use tokio::runtime::Handle;
use tokio::sync::{AcquireError, OwnedSemaphorePermit, Semaphore};

use crate::cancel::{CancelFlag, CancelOnDrop, Deadline};
use crate::limits::SharedLimits;
use crate::problem::{ApiError, ApiResult};

/// Locks even after a panic in another thread: the data behind these mutexes are never left half changed.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A queue with a limited number of threads, for work that a request awaits and for background work.
#[derive(Clone)]
pub(crate) struct Lane {
    permits: Arc<Semaphore>,
    queue: Arc<Queue>,
    at_a_time: usize,
    limit: usize,
    /// Limits with the maximum time of a request's work; `None` without a time limit.
    limits: Option<SharedLimits>,
}

impl Lane {
    /// A lane that runs `at_a_time` jobs and lets at most `limit` more wait.
    pub(crate) fn new(at_a_time: usize, limit: usize) -> Self {
        let permits = Arc::new(Semaphore::new(at_a_time));
        Self { permits, queue: Arc::default(), at_a_time, limit, limits: None }
    }

    /// The same lane with a time limit for the work of [`Self::run_until_dropped`].
    pub(crate) fn with_time_limit(self, limits: &SharedLimits) -> Self {
        Self { limits: Some(Arc::clone(limits)), ..self }
    }

    /// Runs `work` when its turn comes; dropping the request leaves the queue.
    ///
    /// Work that has started occupies the lane until it ends, even if the request is dropped.
    ///
    /// # Errors
    /// Those of `work`, a problem if too many jobs are waiting, and one without details if `work` panics.
    pub(crate) async fn run<T: Send + 'static>(
        &self,
        work: impl FnOnce() -> ApiResult<T> + Send + 'static,
    ) -> ApiResult<T> {
        let permit = {
            let _slot = QueueSlot::take(&self.queue, self.limit, &Position::default())?;
            let turn = Arc::clone(&self.permits).acquire_owned();
            turn.await.map_err(|closed| ApiError::internal(closed.to_string()))?
        };
        blocking(move || {
            let _permit = permit;
            work()
        })
        .await
    }

    /// The same for work that checks a flag, which is set when the request is dropped.
    ///
    /// # Errors
    /// As [`Self::run`].
    pub(crate) async fn run_until_dropped<T: Send + 'static>(
        &self,
        work: impl FnOnce(&CancelFlag) -> ApiResult<T> + Send + 'static,
    ) -> ApiResult<T> {
        let cancel = CancelOnDrop::default();
        let flag = cancel.flag();
        let limits = self.limits.clone();
        self.run(move || {
            Cancel::from(flag.as_ref()).check()?;
            let Some(limits) = limits else { return work(&flag) };
            let deadline = Deadline::begin(limits.step_s.time(), &flag);
            work(&flag).map_err(|problem| match deadline.has_passed() {
                true => ApiError::too_long(&limits.step_s),
                false => problem,
            })
        })
        .await
    }

    /// Runs `job` in the background when its turn comes, independently of the request that submits it.
    ///
    /// Shutdown does not wait for it.
    ///
    /// # Errors
    /// A problem if too many jobs are waiting.
    pub(crate) fn submit(&self, job: impl FnOnce() + Send + 'static) -> ApiResult<()> {
        let mut job = Some(job);
        let once = move || {
            if let Some(job) = job.take() {
                job();
            }
            ControlFlow::Break(())
        };
        self.submit_by_turns(&Position::default(), once)
    }

    /// The same for a job of many turns: after each turn it joins the end of the queue, until it breaks; `position` tracks
    /// its place in the queue.
    ///
    /// # Errors
    /// A problem if too many jobs are waiting; later turns always find a place.
    pub(crate) fn submit_by_turns(
        &self,
        position: &Position,
        job: impl FnMut() -> ControlFlow<()> + Send + 'static,
    ) -> ApiResult<()> {
        self.enqueue(QueueSlot::take(&self.queue, self.limit, position)?, Box::new(job))
    }

    /// Number of running jobs.
    pub(crate) fn running(&self) -> usize {
        self.at_a_time - self.permits.available_permits()
    }

    /// Number of jobs ahead of the one at `position`, including the running ones; `None` unless it waits.
    pub(crate) fn jobs_ahead(&self, position: &Position) -> Option<usize> {
        let slot = (*lock(&position.0))?;
        Some(self.at_a_time + lock(&self.queue.slots).waiting.range(..slot).count())
    }

    /// Starts the next turn of a job once the lane has room.
    fn enqueue(&self, slot: QueueSlot, job: Box<Job>) -> ApiResult<()> {
        let mut turn: Pin<Box<Turn>> = Box::pin(Arc::clone(&self.permits).acquire_owned());
        // The first poll enters the queue of the semaphore, so that turns start in the order of this call.
        match turn.as_mut().poll(&mut Context::from_waker(Waker::noop())) {
            Poll::Ready(permit) => {
                let position = slot.position.clone();
                drop(slot);
                self.start(permit, position, job)
            }
            Poll::Pending => {
                let runtime = Handle::try_current();
                let runtime = runtime.map_err(|missing| ApiError::internal(missing.to_string()))?;
                let lane = self.clone();
                runtime.spawn(async move {
                    let permit = turn.await;
                    let position = slot.position.clone();
                    drop(slot);
                    if let Err(problem) = lane.start(permit, position, job) {
                        tracing::error!("a job was not started: {}", problem.problem().detail);
                    }
                });
                Ok(())
            }
        }
    }

    /// Runs a turn of `job` on its own thread, and further turns while no other job waits.
    fn start(
        &self,
        permit: Result<OwnedSemaphorePermit, AcquireError>,
        position: Position,
        mut job: Box<Job>,
    ) -> ApiResult<()> {
        let permit = permit.map_err(|closed| ApiError::internal(closed.to_string()))?;
        // Jobs submit other jobs when a run is forked or a session is restored.
        let runtime = Handle::try_current().ok();
        let lane = self.clone();
        let work = move || {
            let permit = permit;
            let _inside = runtime.as_ref().map(Handle::enter);
            loop {
                match catch_unwind(AssertUnwindSafe(&mut job)) {
                    Ok(ControlFlow::Continue(())) if lane.queue.is_empty() => {}
                    Ok(ControlFlow::Continue(())) => break,
                    Ok(ControlFlow::Break(())) => return,
                    Err(_) => {
                        tracing::error!("a job panicked");
                        return;
                    }
                }
            }
            // A job that is already in the lane always finds a place.
            let Some(slot) = QueueSlot::enter(&lane.queue, usize::MAX, &position) else { return };
            // The job joins the queue before it gives its permit back; otherwise the next job could finish its turn and overtake it.
            if let Err(problem) = lane.enqueue(slot, job) {
                tracing::error!("a job was not continued: {}", problem.problem().detail);
            }
            drop(permit);
        };
        let started = std::thread::Builder::new().name("job".to_owned()).spawn(work);
        started.map(|_| ()).map_err(|error| ApiError::internal(format!("cannot start a thread: {error}")))
    }
}

/// A turn of a job; returns whether to continue.
type Job = dyn FnMut() -> ControlFlow<()> + Send;

/// Waits for a permit to run.
type Turn = dyn Future<Output = Result<OwnedSemaphorePermit, AcquireError>> + Send;

/// The waiting jobs of a lane.
#[derive(Default)]
struct Queue {
    slots: Mutex<Slots>,
}

#[derive(Default)]
struct Slots {
    waiting: BTreeSet<u64>,
    next: u64,
}

impl Queue {
    fn is_empty(&self) -> bool {
        lock(&self.slots).waiting.is_empty()
    }
}

/// The place number of a job in the queue of its lane; `None` unless it waits.
#[derive(Clone, Default)]
pub(crate) struct Position(Arc<Mutex<Option<u64>>>);

/// A place in the queue of a lane, released on drop.
struct QueueSlot {
    queue: Arc<Queue>,
    number: u64,
    position: Position,
}

impl QueueSlot {
    fn take(queue: &Arc<Queue>, limit: usize, position: &Position) -> ApiResult<Self> {
        Self::enter(queue, limit, position).ok_or_else(ApiError::busy)
    }

    /// Takes the last place; `None` if `limit` jobs are waiting.
    fn enter(queue: &Arc<Queue>, limit: usize, position: &Position) -> Option<Self> {
        let number = {
            let mut slots = lock(&queue.slots);
            if slots.waiting.len() >= limit {
                return None;
            }
            let number = slots.next;
            slots.next += 1;
            slots.waiting.insert(number);
            number
        };
        *lock(&position.0) = Some(number);
        Some(Self { queue: Arc::clone(queue), number, position: position.clone() })
    }
}

impl Drop for QueueSlot {
    fn drop(&mut self) {
        lock(&self.queue.slots).waiting.remove(&self.number);
        *lock(&self.position.0) = None;
    }
}

/// Runs `work` on a blocking thread.
///
/// # Errors
/// Those of `work`, and one without details if it panics.
pub(crate) async fn blocking<T: Send + 'static>(
    work: impl FnOnce() -> ApiResult<T> + Send + 'static,
) -> ApiResult<T> {
    let done = tokio::task::spawn_blocking(work).await;
    done.unwrap_or_else(|failed| Err(ApiError::internal(failed.to_string())))
}

#[cfg(test)]
#[path = "jobs_tests.rs"]
mod tests;
