//! `…/compare` and `…/runs/{run}/metrics`: runs side by side, and the metrics of one run.

use axum::Json;
use axum::extract::State;
use sightline_api::endpoint::Endpoint;
use sightline_api::endpoints::{CompareRuns, ShowMetrics};
use sightline_session::compare::{self, Compared, Comparison, NewComparison, RunName};
use sightline_session::metrics::{self, RunMetrics};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::extract::{Body, RunPath, SessionPath};
use crate::problem::{ApiError, ApiResult};
use crate::routes::route::route;
use crate::state::AppState;

/// The routes of this resource.
pub(crate) fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new()
        .routes(route::<CompareRuns>(routes!(compare_runs)))
        .routes(route::<ShowMetrics>(routes!(run_metrics)))
}

/// Compares two to four runs of a session
///
/// The first run is the reference: the answer contains the columns of the others with differences, the first step at which
/// each differs, and the settings that are not equal. Has no side effects.
#[utoipa::path(post, operation_id = "compare_runs", path = CompareRuns::PATH, tag = "runs", request_body = NewComparison, responses((status = 200, body = Comparison), ApiError))]
async fn compare_runs(
    State(state): State<AppState>,
    SessionPath(live): SessionPath,
    Body(new): Body<CompareRuns>,
) -> ApiResult<Json<Comparison>> {
    // The steps are shared, so the session is not locked during the comparison.
    let runs = live.with(|session| session.compared(&new.runs))?;
    state.queries().run(move || Ok(Json(compare::compare(&runs, &new)?))).await
}

/// The metrics of a run so far, each with its worst step
#[utoipa::path(get, operation_id = "run_metrics", path = ShowMetrics::PATH, tag = "runs",
    responses((status = 200, body = RunMetrics), ApiError))]
async fn run_metrics(State(state): State<AppState>, path: RunPath) -> ApiResult<Json<RunMetrics>> {
    let name = RunName { target: path.target, run: path.run };
    let found = path.with_run(|_, run| Compared::new(name, run))?;
    state.queries().run(move || Ok(Json(metrics::metrics(&found.steps)))).await
}
