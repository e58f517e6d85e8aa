//! `…/targets/{target}/runs`: forks, cancels and resumes runs.

use std::sync::Arc;

use axum::Json;
use axum::extract::State;
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Response};
use sightline_api::endpoint::Endpoint;
use sightline_api::endpoints::{CancelRun, ForkRun, ResumeRun, ShowRun};
use sightline_api::location::AtRun;
use sightline_api::query::FirstRow;
use sightline_api::wire::NewRun;
use sightline_session::Session;
use sightline_session::view::RunView;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::cancel::CancelFlag;
use crate::extract::{Body, Params, RunPath, TargetPath};
use crate::jobs::blocking;
use crate::limits::Limit;
use crate::live_session::LiveSession;
use crate::problem::{ApiError, ApiResult};
use crate::revision;
use crate::routes::route::{location, route};
use crate::routes::targets::start_or_fail;
use crate::routes::what_if;
use crate::runner;
use crate::state::AppState;

/// The routes of this resource.
pub(crate) fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new()
        .routes(route::<ForkRun>(routes!(fork)))
        .routes(route::<ShowRun>(routes!(show)))
        .routes(route::<CancelRun>(routes!(cancel)))
        .routes(route::<ResumeRun>(routes!(resume)))
}

/// Forks a run of a target at a step, with changed settings
///
/// Nothing is overwritten: the new run shares the earlier steps. At the step of the designation, the target is designated
/// again.
#[utoipa::path(post, operation_id = "fork_run", path = ForkRun::PATH, tag = "runs", request_body = NewRun, responses((status = 202, body = RunView), ApiError))]
async fn fork(
    State(state): State<AppState>,
    TargetPath { live, target }: TargetPath,
    Body(new): Body<ForkRun>,
) -> ApiResult<Response> {
    live.with(|session| session.target(target).map(|_| ()))
        .map_err(|error| ApiError::from(error).about_path())?;
    let work_state = state.clone();
    state.designations().run_until_dropped(move |cancel| add(&work_state, &live, target, &new, cancel)).await
}

/// A run with its steps so far
///
/// The answer has an ETag; with a matching `If-None-Match` the answer is 304.
#[utoipa::path(get, operation_id = "show_run", path = ShowRun::PATH, tag = "runs", params(FirstRow,
    ("If-None-Match" = Option<String>, Header, description = "The ETag of the answer that you have")),
    responses((status = 200, body = RunView, headers(("etag" = String, description = "Changes with the answer"))),
    (status = 304, description = "It is the one that you have (If-None-Match)"), ApiError))]
async fn show(
    State(state): State<AppState>,
    RunPath { live, target, run }: RunPath,
    Params(rows): Params<ShowRun>,
    headers: HeaderMap,
) -> ApiResult<Response> {
    blocking(move || {
        let view = view_from(&state, &live, target, run, rows.from_row)?;
        let json = serde_json::to_vec(&view).map_err(|error| ApiError::internal(error.to_string()))?;
        Ok(revision::unless_known(&headers, "application/json", json))
    })
    .await
}

/// Stops a run after its last step so far
#[utoipa::path(post, operation_id = "cancel_run", path = CancelRun::PATH, tag = "runs", responses((status = 200, body = RunView), ApiError))]
async fn cancel(
    State(state): State<AppState>,
    RunPath { live, target, run }: RunPath,
) -> ApiResult<Json<RunView>> {
    blocking(move || {
        let before = view(&state, &live, target, run)?;
        if before.complete || before.stopped.is_some() {
            return Err(ApiError::conflict("The run has ended already."));
        }
        // Cancels while the session is locked, so that no step is recorded afterwards.
        let tell = |(): &()| live.cancel_runs(target, Some(run));
        state.change_and(&live, |session| Ok(session.cancel(target, run)?), tell)?;
        Ok(Json(view(&state, &live, target, run)?))
    })
    .await
}

/// Resumes a stopped run
#[utoipa::path(post, operation_id = "resume_run", path = ResumeRun::PATH, tag = "runs", responses((status = 202, body = RunView), ApiError))]
async fn resume(
    State(state): State<AppState>,
    RunPath { live, target, run }: RunPath,
) -> ApiResult<(StatusCode, Json<RunView>)> {
    blocking(move || {
        if view(&state, &live, target, run)?.stopped.is_none() {
            return Err(ApiError::conflict("The run was not stopped."));
        }
        state.change(&live, |session| Ok(session.resume(target, run)?))?;
        start_or_fail(&state, &live, target, run);
        Ok((StatusCode::ACCEPTED, Json(view(&state, &live, target, run)?)))
    })
    .await
}

/// Adds the run, unless the request was dropped while its target was designated again.
fn add(
    state: &AppState,
    live: &Arc<LiveSession>,
    target: usize,
    new: &NewRun,
    cancel: &CancelFlag,
) -> ApiResult<Response> {
    let (designation, settings) = live.with(|session| {
        let (record, parent) = (session.target(target)?, session.run(target, new.run)?);
        Ok::<_, ApiError>((record.designation, parent.settings.with(&new.settings)?))
    })?;
    let stops = live.traverse().traverse.stop_count();
    if !(designation.step..stops).contains(&new.from_step) {
        let (first, last, given) = (designation.step, stops - 1, new.from_step);
        return Err(ApiError::invalid(
            "field",
            format!("from_step: must be from {first} to {last}, not {given}"),
        ));
    }
    what_if::check_pixel(new.prediction_px)?;
    if new.prediction_px.is_some() && new.from_step == designation.step {
        let detail = "prediction_px: the target is designated at this step, so that nothing is predicted";
        return Err(ApiError::invalid("field", detail).hint("Leave it out, or run from a later step."));
    }
    let redesignated = if new.from_step == designation.step {
        Some(Arc::new(runner::designate(&live.traverse(), designation, &settings, cancel)?))
    } else {
        None
    };
    let run = state.change(live, |session| {
        has_room(session, target, &state.limits().runs)?;
        // A fork at the step at which its parent was displaced inherits the displacement, unless the request specifies one.
        let inherited = session.run(target, new.run)?.displaced_at(new.from_step);
        let run = session.fork(target, new.run, new.from_step, &new.settings, redesignated)?;
        if let Some(pixel) = new.prediction_px.or(inherited) {
            session.displace(target, run, pixel)?;
        }
        Ok(run)
    })?;
    start_or_fail(state, live, target, run);
    let location = location::<ShowRun>(&AtRun { session: live.id.clone(), target, run });
    Ok((StatusCode::ACCEPTED, location, Json(view(state, live, target, run)?)).into_response())
}

fn has_room(session: &Session, target: usize, limit: &Limit) -> ApiResult<()> {
    let most = limit.count();
    if session.target(target)?.runs.len() < most {
        return Ok(());
    }
    Err(ApiError::conflict(format!("A target may have at most {most} runs.")).hint(limit.raise()))
}

/// The run named in the path.
fn view(state: &AppState, live: &LiveSession, target: usize, run: usize) -> ApiResult<RunView> {
    view_from(state, live, target, run, 0)
}

/// The run named in the path, with its rows starting at `from`.
fn view_from(
    state: &AppState,
    live: &LiveSession,
    target: usize,
    run: usize,
    from_row: usize,
) -> ApiResult<RunView> {
    let found = live
        .with(|session| session.run(target, run).map(|found| session.run_view_from(run, found, from_row)));
    let view = found.map_err(|error| ApiError::from(error).about_path())?;
    Ok(RunView { waits_for: state.runner().waits_for(live, target, run), ..view })
}
