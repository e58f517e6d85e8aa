//! Computes runs in the background, one step at a time: lock, get the next task, unlock, compute, lock, record. After each
//! step a run goes to the end of the queue.
//!
//! A step is recorded only if its computation was not cancelled, so a cancelled run gains no further steps. Recorded steps
//! release their images, which the traverse can reload: only a run's last step keeps the image for the next template.

mod driving;

use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex};

use sightline_api::event::Event;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::{Error, Result};
use sightline_rover::pair;
use sightline_rover::pipeline::Stops;
use sightline_session::step::RunStep;
use sightline_session::track::{self, NextStep};
use sightline_session::view::waiting_for;
use sightline_session::{Next, Pending, Session};
use sightline_track::cycle_stage::CycleStage;
use sightline_track::settings::Settings;
use sightline_track::target::Designation;
use tokio::sync::broadcast;

use crate::cancel::{CancelFlag, Deadline};
use crate::commanded_drive::OpenTraverses;
use crate::jobs::{Lane, Position};
use crate::limits::SharedLimits;
use crate::live_session::LiveSession;
use crate::memory;
use crate::problem::{ApiError, ApiResult};
use crate::rendering::OpenTraverse;
use crate::request_priority::Requests;
use crate::sessions::Sessions;
use crate::stopwatch::Stopwatch;
use crate::store::Store;

/// Computes runs: the lane in which they queue, and the state that they change.
#[derive(Clone)]
pub(crate) struct Runner {
    lane: Lane,
    events: broadcast::Sender<Event>,
    /// The open drives; a commanded one grows.
    traverses: OpenTraverses,
    /// All sessions, whose steps share a memory limit.
    sessions: Arc<Mutex<Sessions>>,
    /// Stores a session when its drive continues to the next target.
    store: Arc<Store>,
    limits: SharedLimits,
    /// Requests, which have priority over runs.
    requests: Arc<Requests>,
}

impl Runner {
    /// A runner that computes its runs in `lane`.
    pub(crate) fn new(
        lane: Lane,
        events: broadcast::Sender<Event>,
        (traverses, sessions): (&OpenTraverses, &Arc<Mutex<Sessions>>),
        store: &Arc<Store>,
        limits: &SharedLimits,
        requests: &Arc<Requests>,
    ) -> Self {
        let (traverses, sessions) = (Arc::clone(traverses), Arc::clone(sessions));
        let (store, limits, requests) = (Arc::clone(store), Arc::clone(limits), Arc::clone(requests));
        Self { lane, events, traverses, sessions, store, limits, requests }
    }

    /// The lane in which runs are computed.
    pub(crate) fn lane(&self) -> &Lane {
        &self.lane
    }

    /// Continues a run in the background.
    ///
    /// # Errors
    /// A problem if the queue is full; the run is then unchanged.
    pub(crate) fn start(&self, live: &Arc<LiveSession>, target: usize, run: usize) -> ApiResult<()> {
        let flag = live.begin(target, run);
        let (runner, owned_live, owned_flag) = (self.clone(), Arc::clone(live), Arc::clone(&flag));
        let turn = move || runner.turn(&owned_live, target, run, &owned_flag);
        let position = live.position(target, run);
        let submitted = self.lane.submit_by_turns(&position, turn);
        match &submitted {
            Err(_) => live.end(target, run, &flag),
            Ok(()) => {
                if let Some(before) = self.lane.jobs_ahead(&position) {
                    self.send_event(progress(live, target, run, waiting_for(before)));
                }
            }
        }
        submitted
    }

    /// Number of jobs ahead of a run in the queue; `None` unless it waits.
    pub(crate) fn waits_for(&self, live: &LiveSession, target: usize, run: usize) -> Option<usize> {
        self.lane.jobs_ahead(&live.position(target, run))
    }

    /// Recomputes all runs of a restored session in the background, parents before their forks, and calls `then` once all
    /// have ended.
    ///
    /// # Errors
    /// A problem if the queue is full.
    pub(crate) fn restore(
        &self,
        live: &Arc<LiveSession>,
        then: impl FnOnce() + Send + 'static,
    ) -> ApiResult<()> {
        live.set_restoring(true);
        let restoring = Restoring { live: Arc::clone(live), then: Some(Box::new(then)) };
        self.resume_runs(live, Some(restoring), every_run)
    }

    /// Computes the missing steps of a target's runs in the background, parents before their forks; does not affect runs in
    /// progress.
    ///
    /// # Errors
    /// A problem if the queue is full.
    pub(crate) fn resume_target(&self, live: &Arc<LiveSession>, target: usize) -> ApiResult<()> {
        self.resume_runs(live, None, move |session| {
            every_run(session).into_iter().filter(|(own, _)| *own == target).collect()
        })
    }

    fn resume_runs(
        &self,
        live: &Arc<LiveSession>,
        mut restoring: Option<Restoring>,
        which: impl FnOnce(&Session) -> Vec<(usize, usize)> + Send + 'static,
    ) -> ApiResult<()> {
        let (runner, live) = (self.clone(), Arc::clone(live));
        let mut which = Some(which);
        let (mut runs, mut current) = (Vec::new().into_iter(), None);
        self.lane.submit_by_turns(&Position::default(), move || {
            if let Some(which) = which.take() {
                runs = live.with(|session| which(session)).into_iter();
            }
            if current.is_none() {
                let next = runs.find(|(target, run)| !live.is_computing(*target, *run));
                current = next.map(|(target, run)| (target, run, live.begin(target, run)));
            }
            let Some((target, run, flag)) = &current else {
                if let Some(restored) = restoring.take() {
                    restored.end();
                    runner.resume_driving(&live);
                }
                return ControlFlow::Break(());
            };
            if runner.turn(&live, *target, *run, flag).is_break() {
                current = None;
            }
            ControlFlow::Continue(())
        })
    }

    fn send_event(&self, event: Option<Event>) {
        if let Some(event) = event {
            // An error only means that there are no subscribers.
            let _ = self.events.send(event);
        }
    }

    /// Computes the next step of a run; breaks when the run has ended or is cancelled.
    fn turn(&self, live: &LiveSession, target: usize, run: usize, flag: &CancelFlag) -> ControlFlow<()> {
        if self.lane.running() >= rayon::current_num_threads() {
            self.requests.wait_for_requests();
        }
        let deadline = Deadline::begin(self.limits.step_s.time(), flag);
        let outcome = match catch_unwind(AssertUnwindSafe(|| self.compute_step(live, target, run, flag))) {
            Ok(Ok(true)) => return ControlFlow::Continue(()),
            Ok(Err(Error::Cancelled)) if deadline.has_passed() => {
                let limit = &self.limits.step_s;
                Err(limit.hint(&ApiError::too_long(limit).problem().detail))
            }
            Ok(Ok(false) | Err(Error::Cancelled)) => Ok(()),
            Ok(Err(error)) => Err(error.to_string()),
            Err(_) => Err("the server met a fault of its own; its log says more".to_owned()),
        };
        live.end(target, run, flag);
        if let Err(why) = outcome {
            tracing::warn!(
                session = live.id,
                target,
                run,
                "a run stopped: {}",
                crate::printable::printable(&why)
            );
            // The target may have been removed in the meantime.
            let _ = live.with(|session| session.fail(target, run, why));
        }
        self.send_event(progress(live, target, run, "done".to_owned()));
        ControlFlow::Break(())
    }

    /// Computes and records one step; false if there is nothing left to compute.
    fn compute_step(&self, live: &LiveSession, target: usize, run: usize, flag: &CancelFlag) -> Result<bool> {
        if flag.load(Ordering::Relaxed) || live.is_removed() {
            return Err(Error::Cancelled);
        }
        let trace = match live.with(|session| session.next(target, run))? {
            Next::Nothing => return Ok(false),
            _ if !memory::has_room(&self.sessions, &self.limits, live) => {
                let limit = &self.limits.step_bytes;
                let way_out = "The steps of all sessions take too much memory: remove targets or sessions that are not needed.";
                return Err(Error::Request(limit.hint(way_out)));
            }
            Next::Designate { designation, settings } => {
                designate(&live.traverse(), designation, &settings, flag)?
            }
            Next::Advance(pending) => self.advance(live, (target, run), &pending, flag)?,
            // The drive continues after the session is restored.
            Next::Prepare { .. } | Next::Drive { .. } if live.is_restoring() => return Ok(false),
            Next::Prepare { last, before } => return self.prepare(live, (target, run), &last, before, flag),
            Next::Drive { steering, steps } => return self.drive(live, &steering, &steps, flag),
        };
        live.with(|session| {
            if flag.load(Ordering::Relaxed) {
                Err(Error::Cancelled)
            } else {
                record(session, target, run, trace)
            }
        })?;
        live.measure();
        self.send_event(progress(live, target, run, "tracking".to_owned()));
        Ok(true)
    }

    /// Computes the step after the last one; renders missing images first.
    fn advance(
        &self,
        live: &LiveSession,
        (target, run): (usize, usize),
        pending: &Pending,
        flag: &CancelFlag,
    ) -> Result<RunStep> {
        let open = live.traverse();
        let traverse = &open.traverse;
        let step = pending.last.step + 1;
        let has_images = pending.before.is_none_or(|before| before > CycleStage::Capture)
            && !traverse.is_odometry_alone(step);
        let camera = pending.first.update.target.designation.camera;
        if has_images && !traverse.is_rendered(step, camera) {
            self.send_event(progress(live, target, run, format!("rendering stop {step}")));
            // The step itself encounters any other failure and records it as a fault of the stop.
            if let Err(Error::Cancelled) = open.make_camera_ready(step, camera, flag) {
                return Err(Error::Cancelled);
            }
        }
        let last = with_image(&live.traverse(), &pending.last)?;
        let watch = Stopwatch::start();
        let ended = |stage| watch.ended(stage);
        let next = NextStep {
            first: &pending.first,
            last: &last,
            settings: &pending.settings,
            prediction_px: pending.prediction_px,
            before: pending.before,
            ended: Some(&ended),
            cancel: flag.as_ref().into(),
        };
        let step = next.compute(traverse)?;
        Ok(without_pair(RunStep { took: watch.took(), ..step }))
    }
}

/// Marks a session as being restored until dropped, even after a panic or if the queue is full.
struct Restoring {
    live: Arc<LiveSession>,
    then: Option<Box<dyn FnOnce() + Send>>,
}

impl Restoring {
    /// Called when all runs have ended.
    fn end(mut self) {
        self.live.set_restoring(false);
        if let Some(then) = self.then.take() {
            then();
        }
    }
}

impl Drop for Restoring {
    fn drop(&mut self) {
        self.live.set_restoring(false);
    }
}

/// All runs of a session, those of the selected target first.
fn every_run(session: &Session) -> Vec<(usize, usize)> {
    let mut targets: Vec<_> = (0..session.targets.len()).filter(|&t| !session.targets[t].removed).collect();
    targets.sort_by_key(|&target| session.cursor.target != Some(target));
    let runs = |target: usize| {
        let needed =
            (0..session.targets[target].runs.len()).filter(move |run| session.is_needed(target, *run));
        needed.map(move |run| (target, run))
    };
    targets.into_iter().flat_map(runs).collect()
}

/// Designates a target: renders the stop if necessary, and computes the first step of a run.
///
/// # Errors
/// As [`track::designate`]; [`Error::Cancelled`] soon after `cancel` is set.
pub(crate) fn designate(
    open: &OpenTraverse,
    designation: Designation,
    settings: &Settings,
    cancel: &CancelFlag,
) -> Result<RunStep> {
    let Designation { step, pixel, camera } = designation;
    if step < open.traverse.stop_count()
        // The tracker rejects a missing pair or a pixel outside the image, without a need for the images.
        && let Ok(pair) = pair::of_stop(&open.traverse, step, camera)
        && pixel.is_inside(pair.left.width(), pair.left.height())
    {
        open.make_camera_ready(step, camera, cancel)?;
    }
    let cancel = Cancel::from(cancel.as_ref());
    track::designate_until(&open.traverse, designation, settings, cancel).map(without_pair)
}

/// Reloads the image for the next template, which recorded steps release.
///
/// # Errors
/// If that image cannot be read.
pub(crate) fn with_image(open: &OpenTraverse, step: &Arc<RunStep>) -> Result<Arc<RunStep>> {
    let mut step = Arc::clone(step);
    if let Some(stop) = step.update.target.memory.lacks_image_of() {
        let camera = step.update.target.designation.camera;
        let image = open.traverse.capture_one(stop, camera, true)?;
        Arc::make_mut(&mut step).update.target.memory.set_image(image);
    }
    Ok(step)
}

/// Appends a step to its run, or replaces a paused one; the previous step releases its image.
fn record(session: &mut Session, target: usize, run: usize, trace: RunStep) -> Result<()> {
    let trace = Arc::new(trace);
    let current = session.run_mut(target, run)?;
    if current.steps.is_empty() {
        current.steps.push(trace);
        return Ok(());
    }
    session.record(target, run, trace)?;
    if let [.., before, _] = &mut session.run_mut(target, run)?.steps[..] {
        Arc::make_mut(before).update.target.memory.set_image(Arc::default());
    }
    Ok(())
}

/// The step without the stop's images.
fn without_pair(mut trace: RunStep) -> RunStep {
    if let Some(capture) = trace.capture_mut() {
        capture.pair = Default::default();
    }
    trace
}

/// The progress of a run; `None` if it was removed.
fn progress(live: &LiveSession, target: usize, run: usize, doing: String) -> Option<Event> {
    let (k, n, stopped) = live.with(|session| {
        let record = session.target(target).ok()?;
        let found = record.runs.get(run)?;
        Some((found.steps.len(), session.stop_count - record.designation.step, found.why_stopped()))
    })?;
    let ended = !live.is_computing(target, run);
    let doing = match stopped {
        Some(why) if ended => why,
        _ => doing,
    };
    Some(Event::RunProgress { session: live.id.clone(), target, run, k, n, ended, doing })
}
