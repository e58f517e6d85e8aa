//! Work that takes long, on threads of its own: each lane does so much at a time, first come first served, and lets
//! so much wait. A job of many turns queues again after each, so that short ones do not wait for long ones.
//!
//! The reactor computes nothing. A lane that is full refuses at once, so that nothing piles up unseen.

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

/// Locks, also after a panic elsewhere: what these mutexes guard is never left half changed.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A queue with a limited number of threads: for work that a request waits for, and for work in the background.
#[derive(Clone)]
pub(crate) struct Lane {
    permits: Arc<Semaphore>,
    queue: Arc<Queue>,
    at_a_time: usize,
    limit: usize,
    /// Where the work for a request has a limit of its time.
    limits: Option<SharedLimits>,
}

impl Lane {
    /// A lane for `at_a_time` pieces of work, with at most `limit` more waiting.
    pub(crate) fn new(at_a_time: usize, limit: usize) -> Self {
        let permits = Arc::new(Semaphore::new(at_a_time));
        Self { permits, queue: Arc::default(), at_a_time, limit, limits: None }
    }

    /// The same lane, whose work by [`Self::run_until_dropped`] ends when a step has taken too long.
    pub(crate) fn within(self, limits: &SharedLimits) -> Self {
        Self { limits: Some(Arc::clone(limits)), ..self }
    }

    /// Does `work` when its turn comes; a request that goes away gives its place in the queue back.
    ///
    /// Once begun, the work counts among those of the lane until it ends, also when the request goes away.
    ///
    /// # Errors
    /// Those of `work`, a problem when too many are waiting, and one without details when `work` panics.
    pub(crate) async fn run<T: Send + 'static>(
        &self,
        work: impl FnOnce() -> ApiResult<T> + Send + 'static,
    ) -> ApiResult<T> {
        let permit = {
            let _place = Place::take(&self.queue, self.limit, &Position::default())?;
            let turn = Arc::clone(&self.permits).acquire_owned();
            turn.await.map_err(|closed| ApiError::internal(closed.to_string()))?
        };
        blocking(move || {
            let _permit = permit;
            work()
        })
        .await
    }

    /// The same for work that looks at a flag, which is set when the request goes away.
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

    /// Does `job` in the background when its turn comes, also after the request that submits it.
    ///
    /// The end of the program does not wait for it.
    ///
    /// # Errors
    /// A problem when too many are waiting already.
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

    /// The same for a job of many turns: after each it goes to the end of the queue, until it breaks; `position` follows where
    /// it is in the queue.
    ///
    /// # Errors
    /// A problem when too many are waiting already; later turns always find a place.
    pub(crate) fn submit_by_turns(
        &self,
        position: &Position,
        job: impl FnMut() -> ControlFlow<()> + Send + 'static,
    ) -> ApiResult<()> {
        self.enqueue(Place::take(&self.queue, self.limit, position)?, Box::new(job))
    }

    /// How many jobs are being done.
    pub(crate) fn running(&self) -> usize {
        self.at_a_time - self.permits.available_permits()
    }

    /// How many jobs are before the one at `position`, those that are being done included; `None` unless it waits.
    pub(crate) fn before(&self, position: &Position) -> Option<usize> {
        let place = (*lock(&position.0))?;
        Some(self.at_a_time + lock(&self.queue.places).waiting.range(..place).count())
    }

    /// Starts the next turn of a job when the lane has room.
    fn enqueue(&self, place: Place, job: Box<Job>) -> ApiResult<()> {
        let mut turn: Pin<Box<Turn>> = Box::pin(Arc::clone(&self.permits).acquire_owned());
        // The first poll enters the queue of the semaphore, so that turns start in the order of this call.
        match turn.as_mut().poll(&mut Context::from_waker(Waker::noop())) {
            Poll::Ready(permit) => {
                let position = place.position.clone();
                drop(place);
                self.start(permit, position, job)
            }
            Poll::Pending => {
                let runtime = Handle::try_current();
                let runtime = runtime.map_err(|missing| ApiError::internal(missing.to_string()))?;
                let lane = self.clone();
                runtime.spawn(async move {
                    let permit = turn.await;
                    let position = place.position.clone();
                    drop(place);
                    if let Err(problem) = lane.start(permit, position, job) {
                        tracing::error!("a job was not started: {}", problem.problem().detail);
                    }
                });
                Ok(())
            }
        }
    }

    /// Does a turn of `job` on a thread of its own, and those after it while nobody else waits.
    fn start(
        &self,
        permit: Result<OwnedSemaphorePermit, AcquireError>,
        position: Position,
        mut job: Box<Job>,
    ) -> ApiResult<()> {
        let permit = permit.map_err(|closed| ApiError::internal(closed.to_string()))?;
        // Jobs submit others when a run is forked or a session is read back.
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
            // A job that was in the lane already always finds a place.
            let Some(place) = Place::enter(&lane.queue, usize::MAX, &position) else { return };
            // The job joins the queue before it gives its permit back; otherwise the next job could finish its turn and overtake it.
            if let Err(problem) = lane.enqueue(place, job) {
                tracing::error!("a job was not continued: {}", problem.problem().detail);
            }
            drop(permit);
        };
        let started = std::thread::Builder::new().name("job".to_owned()).spawn(work);
        started.map(|_| ()).map_err(|error| ApiError::internal(format!("cannot start a thread: {error}")))
    }
}

/// A turn of a job; whether there are more.
type Job = dyn FnMut() -> ControlFlow<()> + Send;

/// Waits for the right to work.
type Turn = dyn Future<Output = Result<OwnedSemaphorePermit, AcquireError>> + Send;

/// What waits in a lane.
#[derive(Default)]
struct Queue {
    places: Mutex<Places>,
}

#[derive(Default)]
struct Places {
    waiting: BTreeSet<u64>,
    next: u64,
}

impl Queue {
    fn is_empty(&self) -> bool {
        lock(&self.places).waiting.is_empty()
    }
}

/// Where a job is in the queue of its lane: the number of its place, `None` unless it waits.
#[derive(Clone, Default)]
pub(crate) struct Position(Arc<Mutex<Option<u64>>>);

/// A place in the queue of a lane, also given back when the request goes away.
struct Place {
    queue: Arc<Queue>,
    number: u64,
    position: Position,
}

impl Place {
    fn take(queue: &Arc<Queue>, limit: usize, position: &Position) -> ApiResult<Self> {
        Self::enter(queue, limit, position).ok_or_else(ApiError::busy)
    }

    /// A place behind the others; `None` where `limit` of them wait already.
    fn enter(queue: &Arc<Queue>, limit: usize, position: &Position) -> Option<Self> {
        let number = {
            let mut places = lock(&queue.places);
            if places.waiting.len() >= limit {
                return None;
            }
            let number = places.next;
            places.next += 1;
            places.waiting.insert(number);
            number
        };
        *lock(&position.0) = Some(number);
        Some(Self { queue: Arc::clone(queue), number, position: position.clone() })
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        lock(&self.queue.places).waiting.remove(&self.number);
        *lock(&self.position.0) = None;
    }
}

/// Does `work` on a blocking thread.
///
/// # Errors
/// Those of `work`, and one without details when it panics.
pub(crate) async fn blocking<T: Send + 'static>(
    work: impl FnOnce() -> ApiResult<T> + Send + 'static,
) -> ApiResult<T> {
    let done = tokio::task::spawn_blocking(work).await;
    done.unwrap_or_else(|failed| Err(ApiError::internal(failed.to_string())))
}

#[cfg(test)]
#[path = "jobs_tests.rs"]
mod tests;
