//! `…/compare` and `…/runs/{run}/metrics`: runs side by side, and what one is worth.

use axum::Json;
use axum::extract::State;
use sightline_core::session::compare::{self, Compared, Comparison, NewComparison, RunName};
use sightline_core::session::metrics::{self, RunMetrics};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::extract::{Body, Path};
use crate::jobs::blocking;
use crate::problem::{ApiError, ApiResult};
use crate::runs::RunPath;
use crate::state::AppState;

/// The routes of this resource.
pub fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new().routes(routes!(compare_runs)).routes(routes!(run_metrics))
}

/// Compares two to four runs of a session
///
/// The first one is what the others are compared with: their columns with differences, where each differs from it
/// first, and the settings that are not alike. Nothing is changed by it.
#[utoipa::path(post, operation_id = "compare_runs", path = "/sessions/{session}/compare", tag = "runs", params(
    ("session" = String, Path)), request_body = NewComparison, responses((status = 200, body = Comparison), ApiError))]
async fn compare_runs(
    State(state): State<AppState>,
    Path(session): Path<String>,
    Body(new): Body<NewComparison>,
) -> ApiResult<Json<Comparison>> {
    let live = state.session(&session)?;
    // The steps are shared values: the session is not locked while they are compared.
    let runs = live.with(|session| session.compared(&new.runs))?;
    blocking(move || Ok(Json(compare::compare(&runs, &new)?))).await
}

/// The metrics of a run so far, each with its worst step
#[utoipa::path(get, operation_id = "run_metrics", path = "/sessions/{session}/targets/{target}/runs/{run}/metrics", tag = "runs",
    params(("session" = String, Path), ("target" = usize, Path), ("run" = usize, Path)),
    responses((status = 200, body = RunMetrics), ApiError))]
async fn run_metrics(
    State(state): State<AppState>,
    Path(path): Path<RunPath>,
) -> ApiResult<Json<RunMetrics>> {
    let (session, target, run) = path;
    let live = state.session(&session)?;
    let name = RunName { target, run };
    let found = live.with(|session| session.run(target, run).map(|run| Compared::new(name, run)));
    let found = found.map_err(|error| ApiError::from(error).about_path())?;
    blocking(move || Ok(Json(metrics::metrics(&found.steps)))).await
}
