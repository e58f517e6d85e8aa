//! `…/targets/{target}/runs`: running a target again from a step, cancelling, resuming, and the columns of a run.

use std::sync::Arc;

use axum::Json;
use axum::extract::State;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::Deserialize;
use sightline_core::session::Session;
use sightline_core::session::view::RunView;
use sightline_core::session::wire::NewRun;
use utoipa::IntoParams;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::columns;
use crate::extract::{Body, Params, Path};
use crate::jobs::blocking;
use crate::live::{LiveSession, RUN_LIMIT};
use crate::problem::{ApiError, ApiResult};
use crate::runner;
use crate::state::AppState;
use crate::targets::start_or_say;
use crate::what_if;

/// The routes of this resource.
pub fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new()
        .routes(routes!(fork))
        .routes(routes!(show))
        .routes(routes!(cancel))
        .routes(routes!(resume))
        .routes(routes!(columns_csv))
        .routes(routes!(columns_jsonl))
}

/// The names of a run in a path.
pub type RunPath = (String, usize, usize);

/// Runs a target again from a step with changed settings
///
/// Nothing is overwritten: a new run shares the steps before that one. From the designation's own step on,
/// the target is designated anew.
#[utoipa::path(post, operation_id = "fork_run", path = "/sessions/{session}/targets/{target}/runs", tag = "runs", params(
    ("session" = String, Path), ("target" = usize, Path)),
    request_body = NewRun, responses((status = 202, body = RunView), ApiError))]
async fn fork(
    State(state): State<AppState>,
    Path((session, target)): Path<(String, usize)>,
    Body(new): Body<NewRun>,
) -> ApiResult<Response> {
    let live = state.session(&session)?;
    live.with(|session| session.target(target).map(|_| ()))
        .map_err(|error| ApiError::from(error).about_path())?;
    let work_state = state.clone();
    state.designations().run(move || add(&work_state, &live, target, &new)).await
}

/// What of a run is asked for.
#[derive(Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
struct RowParams {
    /// The first row that is sent, counted from 0: of a run that goes on, how many are there already.
    #[serde(default)]
    from_row: usize,
}

/// A run so far
#[utoipa::path(get, operation_id = "show_run", path = "/sessions/{session}/targets/{target}/runs/{run}", tag = "runs", params(
    ("session" = String, Path), ("target" = usize, Path), ("run" = usize, Path), RowParams),
    responses((status = 200, body = RunView), ApiError))]
async fn show(
    State(state): State<AppState>,
    Path((session, target, run)): Path<RunPath>,
    Params(rows): Params<RowParams>,
) -> ApiResult<Json<RunView>> {
    Ok(Json(view_from(&*state.session(&session)?, target, run, rows.from_row)?))
}

/// Stops a run after its last step so far
#[utoipa::path(post, operation_id = "cancel_run", path = "/sessions/{session}/targets/{target}/runs/{run}/cancel", tag = "runs", params(
    ("session" = String, Path), ("target" = usize, Path), ("run" = usize, Path)),
    responses((status = 200, body = RunView), ApiError))]
async fn cancel(
    State(state): State<AppState>,
    Path((session, target, run)): Path<RunPath>,
) -> ApiResult<Json<RunView>> {
    let live = state.session(&session)?;
    blocking(move || {
        let before = view(&live, target, run)?;
        if before.complete || before.stopped.is_some() {
            return Err(ApiError::conflict("The run has ended already."));
        }
        live.with(|session| {
            // Told under the session's lock, so that no step is recorded after this.
            live.tell_to_end(target, Some(run));
            session.cancel(target, run)
        })?;
        state.changed(&live)?;
        Ok(Json(view(&live, target, run)?))
    })
    .await
}

/// Lets a stopped run go on
#[utoipa::path(post, operation_id = "resume_run", path = "/sessions/{session}/targets/{target}/runs/{run}/resume", tag = "runs", params(
    ("session" = String, Path), ("target" = usize, Path), ("run" = usize, Path)),
    responses((status = 202, body = RunView), ApiError))]
async fn resume(
    State(state): State<AppState>,
    Path((session, target, run)): Path<RunPath>,
) -> ApiResult<(StatusCode, Json<RunView>)> {
    let live = state.session(&session)?;
    blocking(move || {
        if view(&live, target, run)?.stopped.is_none() {
            return Err(ApiError::conflict("The run was not stopped."));
        }
        live.with(|session| session.resume(target, run))?;
        start_or_say(&state, &live, target, run);
        state.changed(&live)?;
        Ok((StatusCode::ACCEPTED, Json(view(&live, target, run)?)))
    })
    .await
}

/// The columns of a run as a CSV table
#[utoipa::path(get, operation_id = "run_columns_csv", path = "/sessions/{session}/targets/{target}/runs/{run}/columns.csv", tag = "runs", params(
    ("session" = String, Path), ("target" = usize, Path), ("run" = usize, Path)),
    responses((status = 200, content_type = "text/csv", body = String), ApiError))]
async fn columns_csv(State(state): State<AppState>, Path(path): Path<RunPath>) -> ApiResult<Response> {
    let (name, run) = named(&state, path, "csv")?;
    Ok(download("text/csv; charset=utf-8", &name, columns::csv(&run.rows)))
}

/// The columns of a run as JSON Lines, one step each
#[utoipa::path(get, operation_id = "run_columns_jsonl", path = "/sessions/{session}/targets/{target}/runs/{run}/columns.jsonl", tag = "runs", params(
    ("session" = String, Path), ("target" = usize, Path), ("run" = usize, Path)),
    responses((status = 200, content_type = "application/jsonl", body = String), ApiError))]
async fn columns_jsonl(State(state): State<AppState>, Path(path): Path<RunPath>) -> ApiResult<Response> {
    let (name, run) = named(&state, path, "jsonl")?;
    Ok(download("application/jsonl", &name, columns::jsonl(&run.rows)))
}

fn add(state: &AppState, live: &Arc<LiveSession>, target: usize, new: &NewRun) -> ApiResult<Response> {
    let (designation, settings) = live.with(|session| {
        let (record, parent) = (session.target(target)?, session.run(target, new.run)?);
        Ok::<_, ApiError>((record.designation, parent.settings.with(&new.settings)?))
    })?;
    let stops = live.traverse.traverse.stop_count();
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
        Some(Arc::new(runner::designate(&live.traverse, designation, &settings)?))
    } else {
        None
    };
    let run = live.with(|session| {
        has_room(session, target)?;
        // A run again from the very step at which its parent was displaced is displaced alike, unless it says where.
        let inherited = session.run(target, new.run)?.displaced_at(new.from_step);
        let run = session.fork(target, new.run, new.from_step, &new.settings, redesignated)?;
        if let Some(pixel) = new.prediction_px.or(inherited) {
            session.displace(target, run, pixel)?;
        }
        Ok::<_, ApiError>(run)
    })?;
    start_or_say(state, live, target, run);
    state.changed(live)?;
    let location = format!("/api/v1/sessions/{}/targets/{target}/runs/{run}", live.id);
    let location = [(header::LOCATION, location)];
    Ok((StatusCode::ACCEPTED, location, Json(view(live, target, run)?)).into_response())
}

fn has_room(session: &Session, target: usize) -> ApiResult<()> {
    let full = session.target(target)?.runs.len() >= RUN_LIMIT;
    if full {
        Err(ApiError::conflict(format!("A target may have at most {RUN_LIMIT} runs.")))
    } else {
        Ok(())
    }
}

/// The run that the path names.
fn view(live: &LiveSession, target: usize, run: usize) -> ApiResult<RunView> {
    view_from(live, target, run, 0)
}

/// That run with its rows from one on.
fn view_from(live: &LiveSession, target: usize, run: usize, from_row: usize) -> ApiResult<RunView> {
    let found = live
        .with(|session| session.run(target, run).map(|found| session.run_view_from(run, found, from_row)));
    found.map_err(|error| ApiError::from(error).about_path())
}

/// A run with a name for its file.
fn named(state: &AppState, (session, target, run): RunPath, ending: &str) -> ApiResult<(String, RunView)> {
    let live = state.session(&session)?;
    let view = view(&live, target, run)?;
    Ok((format!("{}-target-{target}-run-{run}.{ending}", live.id), view))
}

/// An answer that browsers save under `name`, which is made of our own names.
pub fn download(media_type: &'static str, name: &str, text: String) -> Response {
    let disposition = format!("attachment; filename=\"{name}\"");
    let headers = [(header::CONTENT_TYPE, media_type.to_owned()), (header::CONTENT_DISPOSITION, disposition)];
    (headers, text).into_response()
}
