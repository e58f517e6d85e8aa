//! `…/drive`: commanded drives.
//!
//! A commanded drive has its own world and session: starting one, or branching at an earlier stop, does not change the
//! original session.

use std::sync::Arc;

use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use sightline_api::endpoint::Endpoint;
use sightline_api::endpoints::{BeginDrive, ShowDrive, ShowHazards, ShowSession, SteerDrive};
use sightline_api::location::{AtDriveStop, AtSession};
use sightline_api::wire::NewDrive;
use sightline_recordings::DrivenTraverse;
use sightline_rover::driving::DriveCommand;
use sightline_session::driving::{DriveView, Steering};
use sightline_session::faults;
use sightline_session::hazard_view::HazardView;
use sightline_session::view::{SavedSession, SavedTarget, SessionView};
use sightline_session::visits::Visit;
use sightline_session::{Cursor, Fork, Session};
use sightline_world::scenario::Fault;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::cancel::CancelFlag;
use crate::commanded_drive;
use crate::drives::scenario_of;
use crate::extract::{Body, Path, RunPath, SessionPath};
use crate::jobs::blocking;
use crate::live_session::LiveSession;
use crate::problem::{ApiError, ApiResult};
use crate::rendering::OpenTraverse;
use crate::routes::route::{location, route};
use crate::routes::targets::start_or_fail;
use crate::state::AppState;

/// The routes of this resource.
pub(crate) fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new()
        .routes(route::<BeginDrive>(routes!(begin)))
        .routes(route::<ShowDrive>(routes!(show)))
        .routes(route::<SteerDrive>(routes!(steer)))
        .routes(route::<ShowHazards>(routes!(hazards)))
}

/// Begins a commanded drive with a run
///
/// The rover drives towards the run's target on the run's estimates, in a new session with its own world. A commanded drive
/// can be branched at any stop; any other simulated drive restarts at its first stop.
#[utoipa::path(post, operation_id = "begin_drive", path = BeginDrive::PATH, tag = "drive", request_body = NewDrive, responses((status = 201, body = SessionView), ApiError))]
async fn begin(
    State(state): State<AppState>,
    RunPath { live, target, run }: RunPath,
    Body(new): Body<BeginDrive>,
) -> ApiResult<Response> {
    let work_state = state.clone();
    let work = move |cancel: &CancelFlag| {
        let driving = add(&work_state, &live, (target, run), &new, cancel)?;
        let location = location::<ShowSession>(&AtSession { session: driving.id.clone() });
        Ok((StatusCode::CREATED, location, Json(work_state.view(&driving))).into_response())
    };
    state.designations().run_until_dropped(work).await
}

/// The drive of a session
#[utoipa::path(get, operation_id = "show_drive", path = ShowDrive::PATH, tag = "drive", responses((status = 200, body = DriveView), ApiError))]
async fn show(SessionPath(live): SessionPath) -> ApiResult<Json<DriveView>> {
    blocking(move || Ok(Json(commanded_drive::view(&live)))).await
}

/// The goodness map at a stop of the drive of a session
///
/// The map used by the navigator to choose the path there, from the stereo pairs of the stops so far.
#[utoipa::path(get, operation_id = "show_hazards", path = ShowHazards::PATH, tag = "drive", responses((status = 200, body = HazardView), ApiError))]
async fn hazards(
    State(state): State<AppState>,
    Path(AtDriveStop { session, step }): Path<ShowHazards>,
) -> ApiResult<Json<HazardView>> {
    let live = state.session(&session)?;
    let work = move |cancel: &CancelFlag| Ok(Json(commanded_drive::hazards(&live, step, cancel)?));
    state.tries().run_until_dropped(work).await
}

/// Makes a run steer the drive, or changes its command
///
/// A stopped run continues. `pause_at` makes the rover wait at a stop: the current stop is a pause, the next one a single
/// step. `pause` chooses the stage before or after which it waits; the step of that stop is computed up to there, also in
/// every run forked from it.
#[utoipa::path(put, operation_id = "steer_drive", path = SteerDrive::PATH, tag = "drive", request_body = Steering, responses((status = 200, body = DriveView), ApiError))]
async fn steer(
    State(state): State<AppState>,
    SessionPath(live): SessionPath,
    Body(steering): Body<SteerDrive>,
) -> ApiResult<Json<DriveView>> {
    blocking(move || {
        let open = live.traverse();
        if open.commanded.is_none() {
            return Err(ApiError::conflict("The drive of this session is not on commands.")
                .hint("POST …/targets/{target}/runs/{run}/drive begins one from it."));
        }
        let Steering { target, run, .. } = steering;
        state.change(&live, |session| {
            session.steer(&open.traverse, steering)?;
            if session.run(target, run)?.why_stopped().is_some() {
                session.resume(target, run)?;
            }
            Ok(())
        })?;
        // The pause also applies to the other runs.
        state.runner().follow(&live, (&live, (target, run)));
        start_or_fail(&state, &live, target, run);
        Ok(Json(commanded_drive::view(&live)))
    })
    .await
}

/// Creates the world and the session of a drive, and starts to drive.
fn add(
    state: &AppState,
    live: &Arc<LiveSession>,
    (target, run): (usize, usize),
    new: &NewDrive,
    cancel: &CancelFlag,
) -> ApiResult<Arc<LiveSession>> {
    let command = new.command.clone();
    let then = new.then.clone();
    let steering = Steering { target, run, command, then, pause_at: new.pause_at, pause: new.pause };
    let open = live.traverse();
    let (saved, last, waiting) = live.with(|session| {
        let steps = &session.run(target, run).map_err(|error| ApiError::from(error).about_path())?.steps;
        // Checked before a world is created.
        let mut steered = session.clone();
        steered.steer(&open.traverse, steering.clone())?;
        let waiting = steered.steering.map(|steered| steered.command.waiting).unwrap_or_default();
        Ok::<_, ApiError>((session.saved(), steps.last().map_or(0, |last| last.step), waiting))
    })?;
    let designated = saved.targets[target].designation.step;
    let from_step = from_step(&open, new, designated, last)?;
    // From an earlier stop, the approach to the goal starts at the position of the designation.
    let since = steering.command.since.filter(|since| *since <= from_step);
    let steering = Steering { command: DriveCommand { waiting, since, ..steering.command }, ..steering };
    for (index, later) in new.then.iter().enumerate() {
        let designated = saved.targets[*later].designation.step;
        if designated > from_step {
            let problem = format!(
                "then[{index}]: target {later} is designated at stop {designated}, later than stop {from_step}, from which is driven"
            );
            return Err(ApiError::invalid("field", problem)
                .hint("Designate it at that stop or an earlier one, or leave it out."));
        }
    }
    let known = |number: usize| {
        let target = saved.targets.get(number).filter(|target| !target.removed);
        target.map(|target| target.designation)
    };
    let faults = faults::placed(&open.traverse, &new.faults, known, target)?;
    let folder = commanded_drive::new_folder(state.folders(), &open.traverse.index().name)?;
    let made = world(&open, from_step, &faults, &folder, cancel).and_then(|world| {
        state.limits().check_drive(world.traverse())?;
        let opened = commanded_drive::open(world, state.cache(), state.events())?;
        Ok(state.add_traverse(Arc::new(opened))?)
    });
    let opened = made.inspect_err(|_| {
        // If this fails too, the next start lists the drive, where the user can remove it.
        let _ = std::fs::remove_dir_all(&folder);
    })?;
    let driving = state.enter_session(Arc::clone(&opened), false, |id| {
        let saved = session_of(saved, steering, from_step);
        let saved = SavedSession { id, traverse: opened.id.clone(), ..saved };
        Ok((Session::restored(&saved, from_step + 1)?, Default::default()))
    })?;
    // Loading the session starts its runs, and then the drive.
    state.session(&driving.id)
}

/// The stop at which the drive begins.
fn from_step(open: &OpenTraverse, new: &NewDrive, designated: usize, last: usize) -> ApiResult<usize> {
    let is_driven = open.commanded.is_some();
    let step = new.from_step.unwrap_or(if is_driven { last } else { 0 });
    let wrong = |what: String| Err(ApiError::invalid("field", format!("from_step: {what}")));
    if !is_driven && (step > 0 || designated > 0) {
        let what = "the other stops of this drive were planned beforehand; only the first one, 0, can be driven from";
        return wrong(what.to_owned()).map_err(|problem: ApiError| {
            problem.hint("Designate the target at the first stop, and begin the drive there.")
        });
    }
    if step < designated || step > last {
        return wrong(format!("must be from {designated} to {last}, the steps of the run, not {step}"));
    }
    Ok(step)
}

/// The world of the drive.
fn world(
    open: &OpenTraverse,
    from_step: usize,
    faults: &[Fault],
    folder: &std::path::Path,
    cancel: &CancelFlag,
) -> ApiResult<DrivenTraverse> {
    if let Some(drive) = &open.commanded {
        return Ok(drive.with(|world| world.branch(from_step + 1, faults, folder, cancel.as_ref().into()))?);
    }
    let mut scenario = scenario_of(&open.traverse).ok_or_else(|| {
        ApiError::conflict("A recorded drive cannot be driven.")
            .hint("Open a scenario: the world must be simulated.")
    })?;
    scenario.events.faults.extend_from_slice(faults);
    Ok(DrivenTraverse::begin(&scenario, folder, cancel.as_ref().into())?)
}

/// The initial session of the drive: its targets with their runs, the current target first, and the visits that ended before
/// the first stop of the drive.
fn session_of(saved: SavedSession, steering: Steering, from_step: usize) -> SavedSession {
    let Steering { target, run, .. } = steering;
    let visits = saved.visits.into_iter().filter(|visit| visit.until <= from_step);
    let mut visits: Vec<Visit> = visits.collect();
    let mut numbers = vec![target];
    for number in steering.then.iter().copied().chain(visits.iter().map(|visit| visit.target)) {
        if !numbers.contains(&number) {
            numbers.push(number);
        }
    }
    let renumbered = |number: usize| numbers.iter().position(|known| *known == number).unwrap_or(0);
    visits.iter_mut().for_each(|visit| visit.target = renumbered(visit.target));
    let then = steering.then.iter().map(|number| renumbered(*number)).collect();
    let targets = numbers.iter().filter_map(|number| saved.targets.get(*number).cloned());
    let mut targets: Vec<SavedTarget> = targets.collect();
    // A stopped run continues.
    let drivers = targets.first_mut().and_then(|target| target.runs.get_mut(run));
    drivers.into_iter().for_each(|run| run.stop_after = None);
    // The new drive lacks the later stops, so changes there apply from its first stop.
    let forks = targets.iter_mut().flat_map(|target| &mut target.runs).filter_map(|run| run.fork.as_mut());
    for fork in forks.filter(|fork| fork.from_step > from_step) {
        *fork = Fork::new(fork.run, from_step);
    }
    SavedSession {
        cursor: Cursor { target: Some(0), run, step: from_step },
        targets,
        steering: Some(Steering { target: 0, then, ..steering }),
        visits,
        ..saved
    }
}
