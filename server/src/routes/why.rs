//! `…/steps/{step}/why`: the derivation of a value of a step, and its verdict as one sentence.

use axum::Json;
use sightline_api::endpoint::Endpoint;
use sightline_api::endpoints::ShowWhy;
use sightline_api::query::ValueName;
use sightline_session::why::{Book, Explanation};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::extract::Params;
use crate::jobs::blocking;
use crate::problem::{ApiError, ApiResult};
use crate::recorded_step::RecordedStep;
use crate::routes::route::route;
use crate::state::AppState;

/// The routes of this resource.
pub(crate) fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new().routes(route::<ShowWhy>(routes!(why)))
}

/// The derivation of a value of a step
///
/// A tree of formula, inputs, stage and file or pose, with the verdict of the step as one sentence.
#[utoipa::path(get, operation_id = "why", path = ShowWhy::PATH,
    tag = "why", params(ValueName),
    responses((status = 200, body = Explanation), ApiError))]
async fn why(asked: RecordedStep, Params(asking): Params<ShowWhy>) -> ApiResult<Json<Explanation>> {
    blocking(move || {
        let book = Book {
            trace: &asked.recorded,
            before: asked.last.as_deref(),
            settings: &asked.settings,
            prediction_px: asked.prediction_px,
            sources: &asked.live.traverse().traverse,
        };
        Ok(Json(book.explain(asking.value.as_deref())?))
    })
    .await
}
