//! Removes sessions, runs and drives, and restores removed sessions, targets and runs.

use std::sync::Arc;

use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use sightline_api::endpoint::Endpoint;
use sightline_api::endpoints::{
    RemoveRun, RemoveSession, RemoveTraverse, RestoreRun, RestoreSession, RestoreTarget,
};
use sightline_api::location::{AtSession, AtTraverse};
use sightline_session::Session;
use sightline_session::view::SessionView;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::extract::{Path, RunPath, TargetPath};
use crate::import_session;
use crate::jobs::blocking;
use crate::live_session::LiveSession;
use crate::problem::{ApiError, ApiResult};
use crate::routes::route::route;
use crate::routes::targets;
use crate::state::AppState;

/// The routes of this resource.
pub(crate) fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new()
        .routes(route::<RemoveRun>(routes!(remove_run)))
        .routes(route::<RestoreRun>(routes!(restore_run)))
        .routes(route::<RestoreTarget>(routes!(restore_target)))
        .routes(route::<RemoveSession>(routes!(remove_session)))
        .routes(route::<RestoreSession>(routes!(restore_session)))
        .routes(route::<RemoveTraverse>(routes!(remove_traverse)))
}

/// Removes a session
///
/// Its runs are cancelled. The last 16 removed sessions can be restored until the server ends.
#[utoipa::path(delete, operation_id = "remove_session", path = RemoveSession::PATH, tag = "sessions", responses((status = 204), ApiError))]
async fn remove_session(
    State(state): State<AppState>,
    Path(AtSession { session }): Path<RemoveSession>,
) -> ApiResult<StatusCode> {
    blocking(move || state.remove_session(&session).map(|()| StatusCode::NO_CONTENT)).await
}

/// Restores a removed session; its runs are recomputed
#[utoipa::path(post, operation_id = "restore_session", path = RestoreSession::PATH, tag = "sessions", responses((status = 200, body = SessionView), ApiError))]
async fn restore_session(
    State(state): State<AppState>,
    Path(AtSession { session }): Path<RestoreSession>,
) -> ApiResult<Json<SessionView>> {
    blocking(move || {
        let live = state.restore_session(&session)?;
        Ok(Json(state.view(&live)))
    })
    .await
}

/// Removes a drive that was opened from a scenario
///
/// Deletes its folder with the rendered images. Refused (409) for a drive with sessions, or one given at the server's start.
/// The same scenario opens the drive again.
#[utoipa::path(delete, operation_id = "remove_traverse", path = RemoveTraverse::PATH, tag = "traverses", responses((status = 204), ApiError))]
async fn remove_traverse(
    State(state): State<AppState>,
    Path(AtTraverse { id }): Path<RemoveTraverse>,
) -> ApiResult<StatusCode> {
    let open = state.traverse(&id)?;
    if !state.is_removable(&open) {
        return Err(ApiError::conflict(format!("The drive {id} was given when the server was started."))
            .hint("Start the server without it."));
    }
    blocking(move || import_session::remove_traverse(&state, &open).map(|()| StatusCode::NO_CONTENT)).await
}

/// Removes a run; its number is not reused, and runs forked from it keep the shared steps
#[utoipa::path(delete, operation_id = "remove_run", path = RemoveRun::PATH, tag = "runs", responses((status = 200, body = SessionView), ApiError))]
async fn remove_run(
    State(state): State<AppState>,
    RunPath { live, target, run }: RunPath,
) -> ApiResult<Json<SessionView>> {
    let found = live.with(|session| session.run(target, run).map(|_| ()));
    found.map_err(|error| ApiError::from(error).about_path())?;
    blocking(move || {
        let remove = |session: &mut Session| {
            session.remove_run(target, run)?;
            Ok(session.is_needed(target, run))
        };
        state.change_and(&live, remove, |is_needed| {
            if !is_needed {
                live.cancel_runs(target, Some(run));
            }
        })?;
        Ok(Json(state.view(&live)))
    })
    .await
}

/// Restores a removed run
#[utoipa::path(post, operation_id = "restore_run", path = RestoreRun::PATH, tag = "runs", responses((status = 200, body = SessionView), ApiError))]
async fn restore_run(
    State(state): State<AppState>,
    RunPath { live, target, run }: RunPath,
) -> ApiResult<Json<SessionView>> {
    blocking(move || restored(&state, &live, target, |session| Ok(session.restore_run(target, run)?))).await
}

/// Restores a removed target
#[utoipa::path(post, operation_id = "restore_target", path = RestoreTarget::PATH, tag = "targets", responses((status = 200, body = SessionView), ApiError))]
async fn restore_target(
    State(state): State<AppState>,
    TargetPath { live, target }: TargetPath,
) -> ApiResult<Json<SessionView>> {
    blocking(move || {
        restored(&state, &live, target, |session| {
            targets::has_room(session, state.limits())?;
            Ok(session.restore_target(target)?)
        })
    })
    .await
}

/// Restores a run or target, and continues the runs of the target.
fn restored(
    state: &AppState,
    live: &Arc<LiveSession>,
    target: usize,
    restore: impl FnOnce(&mut Session) -> ApiResult<()>,
) -> ApiResult<Json<SessionView>> {
    state.change(live, |session| restore(session).map_err(ApiError::about_path))?;
    state.runner().resume_target(live, target)?;
    Ok(Json(state.view(live)))
}
