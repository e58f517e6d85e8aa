//! `…/drive`: driving on commands.
//!
//! A drive on commands has a world and a session of its own: beginning one, or branching one at an earlier stop, leaves the
//! session from which it begins as it is.

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
use crate::driven;
use crate::drives::scenario_of;
use crate::extract::{Body, Path, RunPath, SessionPath};
use crate::jobs::blocking;
use crate::live_session::LiveSession;
use crate::problem::{ApiError, ApiResult};
use crate::rendering::OpenTraverse;
use crate::routes::route::{location, route};
use crate::routes::targets::start_or_say;
use crate::state::AppState;

/// The routes of this resource.
pub(crate) fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new()
        .routes(route::<BeginDrive>(routes!(begin)))
        .routes(route::<ShowDrive>(routes!(show)))
        .routes(route::<SteerDrive>(routes!(steer)))
        .routes(route::<ShowHazards>(routes!(hazards)))
}

/// Begins a drive on commands with a run
///
/// The rover drives towards the run's target on the run's estimates, in a new session with a world of its own. From a drive on
/// commands it branches at any stop; any other simulated drive is driven anew from its first stop.
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
    blocking(move || Ok(Json(driven::view(&live)))).await
}

/// The goodness map at a stop of the drive of a session
///
/// The map on which the navigator chose the path there, from the stereo pairs of the stops up to it.
#[utoipa::path(get, operation_id = "show_hazards", path = ShowHazards::PATH, tag = "drive", responses((status = 200, body = HazardView), ApiError))]
async fn hazards(
    State(state): State<AppState>,
    Path(AtDriveStop { session, step }): Path<ShowHazards>,
) -> ApiResult<Json<HazardView>> {
    let live = state.session(&session)?;
    let work = move |cancel: &CancelFlag| Ok(Json(driven::hazards(&live, step, cancel)?));
    state.tries().run_until_dropped(work).await
}

/// Lets a run drive, or changes its command
///
/// A run that was stopped goes on. `pause_at` lets the rover wait at a stop: at the present one it is a pause, at the next one a
/// single step. `pause` chooses the stage before or after which it waits; the step of a stop is then computed up to there, and again
/// up to there with every run that is forked from it.
#[utoipa::path(put, operation_id = "steer_drive", path = SteerDrive::PATH, tag = "drive", request_body = Steering, responses((status = 200, body = DriveView), ApiError))]
async fn steer(
    State(state): State<AppState>,
    SessionPath(live): SessionPath,
    Body(steering): Body<SteerDrive>,
) -> ApiResult<Json<DriveView>> {
    blocking(move || {
        let open = live.traverse();
        if open.driven.is_none() {
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
        // The pause holds the other runs, too.
        state.runner().follow(&live, (&live, (target, run)));
        start_or_say(&state, &live, target, run);
        Ok(Json(driven::view(&live)))
    })
    .await
}

/// Makes the world and the session of a drive, and begins to drive.
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
        // Refused before a world is made.
        let mut steered = session.clone();
        steered.steer(&open.traverse, steering.clone())?;
        let waiting = steered.steering.map(|steered| steered.command.waiting).unwrap_or_default();
        Ok::<_, ApiError>((session.saved(), steps.last().map_or(0, |last| last.step), waiting))
    })?;
    let designated = saved.targets[target].designation.step;
    let from_step = from_step(&open, new, designated, last)?;
    // From an earlier stop, the goal is approached from the place of the designation.
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
    let folder = driven::new_folder(state.folders(), &open.traverse.index().name)?;
    let made = world(&open, from_step, &faults, &folder, cancel).and_then(|world| {
        state.limits().check_drive(world.traverse())?;
        let opened = driven::open(world, state.cache(), state.events())?;
        Ok(state.add_traverse(Arc::new(opened))?)
    });
    let opened = made.inspect_err(|_| {
        // If this fails too, the next start lists the drive, and it can be removed there.
        let _ = std::fs::remove_dir_all(&folder);
    })?;
    let driving = state.enter_session(Arc::clone(&opened), false, |id| {
        let saved = session_of(saved, steering, from_step);
        let saved = SavedSession { id, traverse: opened.id.clone(), ..saved };
        Ok((Session::restored(&saved, from_step + 1)?, Default::default()))
    })?;
    // Asking for it begins its runs, and then the drive.
    state.session(&driving.id)
}

/// The stop from which is driven.
fn from_step(open: &OpenTraverse, new: &NewDrive, designated: usize, last: usize) -> ApiResult<usize> {
    let is_driven = open.driven.is_some();
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

/// The world in which is driven.
fn world(
    open: &OpenTraverse,
    from_step: usize,
    faults: &[Fault],
    folder: &std::path::Path,
    cancel: &CancelFlag,
) -> ApiResult<DrivenTraverse> {
    if let Some(driven) = &open.driven {
        return Ok(driven.with(|world| world.branch(from_step + 1, faults, folder, cancel.as_ref().into()))?);
    }
    let mut scenario = scenario_of(&open.traverse).ok_or_else(|| {
        ApiError::conflict("A recorded drive cannot be driven.")
            .hint("Open a scenario: the world must be simulated.")
    })?;
    scenario.events.faults.extend_from_slice(faults);
    Ok(DrivenTraverse::begin(&scenario, folder, cancel.as_ref().into())?)
}

/// What the session of the drive begins with: its targets with their runs, the first one first. The visits that had ended up to
/// the stop from which is driven are those of the drive, too.
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
    // A run that was stopped drives on.
    let drivers = targets.first_mut().and_then(|target| target.runs.get_mut(run));
    drivers.into_iter().for_each(|run| run.stop_after = None);
    // The new drive lacks the later stops: what was changed there is changed from here on.
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
