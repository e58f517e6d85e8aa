//! Removing runs, and taking the removal of targets and runs back: nothing that was recorded is lost.

use std::sync::Arc;

use axum::Json;
use axum::extract::State;
use sightline_api::endpoint::Endpoint;
use sightline_api::endpoints::{RemoveRun, RestoreRun, RestoreTarget};
use sightline_geometry::error::Result;
use sightline_session::Session;
use sightline_session::view::SessionView;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::extract::{RunPath, TargetPath};
use crate::jobs::blocking;
use crate::live_session::LiveSession;
use crate::problem::{ApiError, ApiResult};
use crate::routes::route::route;
use crate::state::AppState;

/// The routes of this resource.
pub(crate) fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new()
        .routes(route::<RemoveRun>(routes!(remove_run)))
        .routes(route::<RestoreRun>(routes!(restore_run)))
        .routes(route::<RestoreTarget>(routes!(restore_target)))
}

/// Removes a run; its number is not used again, and what left it keeps the steps that both share
#[utoipa::path(delete, operation_id = "remove_run", path = RemoveRun::PATH, tag = "runs", responses((status = 200, body = SessionView), ApiError))]
async fn remove_run(
    State(state): State<AppState>,
    RunPath { live, target, run }: RunPath,
) -> ApiResult<Json<SessionView>> {
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
#[utoipa::path(post, operation_id = "restore_run", path = RestoreRun::PATH, tag = "runs", responses((status = 200, body = SessionView), ApiError))]
async fn restore_run(
    State(state): State<AppState>,
    RunPath { live, target, run }: RunPath,
) -> ApiResult<Json<SessionView>> {
    blocking(move || {
        restored(&live, |session| session.restore_run(target, run))?;
        state.runner().go_on_with(&live, target)?;
        saved(&state, &live)
    })
    .await
}

/// Takes the removal of a target back
#[utoipa::path(post, operation_id = "restore_target", path = RestoreTarget::PATH, tag = "targets", responses((status = 200, body = SessionView), ApiError))]
async fn restore_target(
    State(state): State<AppState>,
    TargetPath { live, target }: TargetPath,
) -> ApiResult<Json<SessionView>> {
    blocking(move || {
        restored(&live, |session| session.restore_target(target))?;
        state.runner().go_on_with(&live, target)?;
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
