//! Computes runs in the background, one step at a time: lock, ask what is next, unlock, compute, lock, record.
//!
//! A step is recorded only while its computation was not told to end, so a cancelled run gains nothing more.
//! Recorded steps let go of their images, which the traverse has anyway: only a run's last step keeps the one
//! from which the next template is cut.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::Ordering;

use sightline_core::error::{Error, Result};
use sightline_core::session::wire::Event;
use sightline_core::session::{Next, Pending, Session, track};
use sightline_core::settings::Settings;
use sightline_core::target::Designation;
use sightline_core::trace::StepTrace;

use crate::live::{CancelFlag, LiveSession};
use crate::problem::ApiResult;
use crate::rendering::OpenTraverse;
use crate::state::AppState;

/// Continues a run in the background.
///
/// # Errors
/// A problem when too much is waiting already; the run then stays as it is.
pub fn start(state: &AppState, live: &Arc<LiveSession>, target: usize, run: usize) -> ApiResult<()> {
    let flag = live.begin(target, run);
    let (owned_state, owned_live, owned_flag) = (state.clone(), Arc::clone(live), Arc::clone(&flag));
    let job = move || compute(&owned_state, &owned_live, target, run, &owned_flag);
    let submitted = state.jobs().submit(job);
    if submitted.is_err() {
        live.end(target, run, &flag);
    }
    submitted
}

/// Computes all runs of a session that was read back, in the background; parents come before their forks.
///
/// # Errors
/// A problem when too much is waiting already.
pub fn restore(state: &AppState, live: &Arc<LiveSession>) -> ApiResult<()> {
    live.set_restoring(true);
    let restoring = Restoring(Arc::clone(live));
    go_on(state, live, Some(restoring), every_run)
}

/// Computes what is missing of a target's runs in the background, parents before their forks; what goes on already is left
/// alone.
///
/// # Errors
/// A problem when too much is waiting already.
pub fn go_on_with(state: &AppState, live: &Arc<LiveSession>, target: usize) -> ApiResult<()> {
    go_on(state, live, None, move |session| {
        every_run(session).into_iter().filter(|(own, _)| *own == target).collect()
    })
}

fn go_on(
    state: &AppState,
    live: &Arc<LiveSession>,
    restoring: Option<Restoring>,
    which: impl FnOnce(&Session) -> Vec<(usize, usize)> + Send + 'static,
) -> ApiResult<()> {
    let (state_in_job, live) = (state.clone(), Arc::clone(live));
    state.jobs().submit(move || {
        let _until_the_end = restoring;
        let runs = live.with(|session| which(session));
        for (target, run) in runs {
            if !live.is_computing(target, run) {
                let flag = live.begin(target, run);
                compute(&state_in_job, &live, target, run, &flag);
            }
        }
    })
}

/// A session whose runs are being computed again, until this goes away, also by a panic or a queue that is full.
struct Restoring(Arc<LiveSession>);

impl Drop for Restoring {
    fn drop(&mut self) {
        self.0.set_restoring(false);
    }
}

/// All runs of a session, those of the target that is looked at first.
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

/// Designates a target: renders the stop where that is needed, and computes the first step of a run.
///
/// # Errors
/// As [`track::designate`].
pub fn designate(open: &OpenTraverse, designation: Designation, settings: &Settings) -> Result<StepTrace> {
    let (step, pixel) = (designation.step, designation.pixel);
    if step < open.traverse.stop_count() {
        let left = open.traverse.left_camera(step);
        // A pixel outside is refused by the tracker; nothing needs to be rendered for that.
        if pixel.is_inside(left.width(), left.height()) {
            open.make_ready(step, &CancelFlag::default())?;
        }
    }
    track::designate(&open.traverse, designation, settings).map(without_pair)
}

/// Computes what is missing of a run, until it ends or is told to.
fn compute(state: &AppState, live: &LiveSession, target: usize, run: usize, flag: &CancelFlag) {
    let outcome = loop {
        match catch_unwind(AssertUnwindSafe(|| one_step(state, live, target, run, flag))) {
            Ok(Ok(true)) => {}
            Ok(Ok(false) | Err(Error::Cancelled)) => break Ok(()),
            Ok(Err(error)) => break Err(error.to_string()),
            Err(_) => break Err("the server met a fault of its own; its log says more".to_owned()),
        }
    };
    live.end(target, run, flag);
    if let Err(why) = outcome {
        tracing::warn!(session = live.id, target, run, "a run stopped: {}", crate::plain(&why));
        // The target may have been removed meanwhile.
        let _ = live.with(|session| session.fail(target, run, why));
    }
    if let Some(event) = progress(live, target, run, "done".to_owned()) {
        state.tell(event);
    }
}

/// Computes and records one step; false when there is nothing more to compute.
fn one_step(
    state: &AppState,
    live: &LiveSession,
    target: usize,
    run: usize,
    flag: &CancelFlag,
) -> Result<bool> {
    if flag.load(Ordering::Relaxed) {
        return Err(Error::Cancelled);
    }
    let trace = match live.with(|session| session.next(target, run))? {
        Next::Nothing => return Ok(false),
        Next::Designate { designation, settings } => designate(&live.traverse, designation, &settings)?,
        Next::Advance(pending) => advance(state, live, (target, run), &pending, flag)?,
    };
    live.with(|session| {
        if flag.load(Ordering::Relaxed) { Err(Error::Cancelled) } else { record(session, target, run, trace) }
    })?;
    if let Some(event) = progress(live, target, run, "tracking".to_owned()) {
        state.tell(event);
    }
    Ok(true)
}

/// The step after the last one, from images that are rendered first where they are missing.
fn advance(
    state: &AppState,
    live: &LiveSession,
    (target, run): (usize, usize),
    pending: &Pending,
    flag: &CancelFlag,
) -> Result<StepTrace> {
    let traverse = &live.traverse.traverse;
    let step = pending.last.step + 1;
    if !traverse.is_ready(step) {
        if let Some(event) = progress(live, target, run, format!("rendering stop {step}")) {
            state.tell(event);
        }
        // Any other failure is met again by the step itself, which records it as the stop's fault.
        if let Err(Error::Cancelled) = live.traverse.make_ready(step, flag) {
            return Err(Error::Cancelled);
        }
    }
    let last = with_image(&live.traverse, &pending.last)?;
    let (first, prediction_px) = (&pending.first, pending.prediction_px);
    Ok(without_pair(track::advance_displaced(traverse, first, &last, &pending.settings, prediction_px)))
}

/// A step with the image from which the next template is cut, which a recorded step let go of.
///
/// # Errors
/// When that image cannot be read.
pub fn with_image(open: &OpenTraverse, step: &Arc<StepTrace>) -> Result<Arc<StepTrace>> {
    let mut step = Arc::clone(step);
    let appearance = &step.update.target.appearance;
    if appearance.image.is_empty() {
        let image = open.traverse.capture(appearance.step)?.left;
        Arc::make_mut(&mut step).update.target.appearance.image = image;
    }
    Ok(step)
}

/// Adds a step to its run; the one before lets go of its image.
fn record(session: &mut Session, target: usize, run: usize, trace: StepTrace) -> Result<()> {
    let current = session.run_mut(target, run)?;
    match current.steps.last_mut() {
        None => current.steps.push(Arc::new(trace)),
        Some(last) => {
            let mut lighter = Arc::clone(last);
            Arc::make_mut(&mut lighter).update.target.appearance.image = Arc::default();
            session.record(target, run, Arc::new(trace))?;
            let steps = &mut session.run_mut(target, run)?.steps;
            let before = steps.len() - 2;
            steps[before] = lighter;
        }
    }
    Ok(())
}

/// The step without the stop's images.
fn without_pair(mut trace: StepTrace) -> StepTrace {
    if let Some(capture) = &mut trace.capture {
        capture.pair = Default::default();
    }
    trace
}

/// How far a run has come; none when it is not there any more.
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
