//! Removing runs, and taking the removal of targets and runs back: nothing that was recorded is lost.

use std::sync::Arc;

use axum::Json;
use axum::extract::State;
use sightline_core::error::Result;
use sightline_core::session::Session;
use sightline_core::session::view::SessionView;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::extract::Path;
use crate::jobs::blocking;
use crate::live::LiveSession;
use crate::problem::{ApiError, ApiResult};
use crate::runner;
use crate::runs::RunPath;
use crate::state::AppState;

/// The routes of this resource.
pub fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new()
        .routes(routes!(remove_run))
        .routes(routes!(restore_run))
        .routes(routes!(restore_target))
}

/// Removes a run; its number is not used again, and what left it keeps the steps that both share
#[utoipa::path(delete, operation_id = "remove_run", path = "/sessions/{session}/targets/{target}/runs/{run}", tag = "runs", params(
    ("session" = String, Path), ("target" = usize, Path), ("run" = usize, Path)),
    responses((status = 200, body = SessionView), ApiError))]
async fn remove_run(
    State(state): State<AppState>,
    Path((session, target, run)): Path<RunPath>,
) -> ApiResult<Json<SessionView>> {
    let live = state.session(&session)?;
    let found = live.with(|session| session.run(target, run).map(|_| ()));
    found.map_err(|error| ApiError::from(error).about_path())?;
    blocking(move || {
        live.with(|session| {
            session.remove_run(target, run)?;
            if !session.is_needed(target, run) {
                live.tell_to_end(target, Some(run));
            }
            Ok::<_, ApiError>(())
        })?;
        saved(&state, &live)
    })
    .await
}

/// Takes the removal of a run back
#[utoipa::path(post, operation_id = "restore_run", path = "/sessions/{session}/targets/{target}/runs/{run}/restore", tag = "runs", params(
    ("session" = String, Path), ("target" = usize, Path), ("run" = usize, Path)),
    responses((status = 200, body = SessionView), ApiError))]
async fn restore_run(
    State(state): State<AppState>,
    Path((session, target, run)): Path<RunPath>,
) -> ApiResult<Json<SessionView>> {
    let live = state.session(&session)?;
    blocking(move || {
        restored(&live, |session| session.restore_run(target, run))?;
        runner::go_on_with(&state, &live, target)?;
        saved(&state, &live)
    })
    .await
}

/// Takes the removal of a target back
#[utoipa::path(post, operation_id = "restore_target", path = "/sessions/{session}/targets/{target}/restore", tag = "targets", params(
    ("session" = String, Path), ("target" = usize, Path)),
    responses((status = 200, body = SessionView), ApiError))]
async fn restore_target(
    State(state): State<AppState>,
    Path((session, target)): Path<(String, usize)>,
) -> ApiResult<Json<SessionView>> {
    let live = state.session(&session)?;
    blocking(move || {
        restored(&live, |session| session.restore_target(target))?;
        runner::go_on_with(&state, &live, target)?;
        saved(&state, &live)
    })
    .await
}

fn restored(live: &LiveSession, restore: impl FnOnce(&mut Session) -> Result<()>) -> ApiResult<()> {
    live.with(restore).map_err(|error| ApiError::from(error).about_path())
}

fn saved(state: &AppState, live: &Arc<LiveSession>) -> ApiResult<Json<SessionView>> {
    state.changed(live)?;
    Ok(Json(live.with(|session| session.view())))
}
