//! `…/steps/{step}/why`: where a value of a step came from, and its verdict as one sentence.

use axum::Json;
use axum::extract::State;
use serde::Deserialize;
use sightline_core::session::why::{Book, Explanation};
use utoipa::IntoParams;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::asked::{Asked, StepPath};
use crate::extract::{Params, Path};
use crate::jobs::blocking;
use crate::problem::{ApiError, ApiResult};
use crate::state::AppState;

/// The routes of this resource.
pub fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new().routes(routes!(why))
}

/// What is asked about.
#[derive(Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
struct Asking {
    /// The value's name; left out: the verdict, and the names that can be asked for.
    value: Option<String>,
}

/// Where a value of a step came from
///
/// A tree of formula, inputs, stage and file or pose; with the verdict of the step as one sentence.
#[utoipa::path(get, operation_id = "why", path = "/sessions/{session}/targets/{target}/runs/{run}/steps/{step}/why",
    tag = "why", params(
    ("session" = String, Path), ("target" = usize, Path), ("run" = usize, Path), ("step" = usize, Path), Asking),
    responses((status = 200, body = Explanation), ApiError))]
async fn why(
    State(state): State<AppState>,
    Path(path): Path<StepPath>,
    Params(asking): Params<Asking>,
) -> ApiResult<Json<Explanation>> {
    let asked = Asked::find(&state, &path)?;
    blocking(move || {
        let book = Book {
            trace: &asked.recorded,
            before: asked.last.as_deref(),
            settings: &asked.settings,
            prediction_px: asked.prediction_px,
            sources: &asked.live.traverse.traverse,
        };
        Ok(Json(book.explain(asking.value.as_deref())?))
    })
    .await
}
