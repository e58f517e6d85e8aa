//! `…/steps/{step}/what_if`: recomputes one step with changed settings or a displaced prediction, without storing it.

use axum::Json;
use axum::extract::State;
use sightline_api::endpoint::Endpoint;
use sightline_api::endpoints::TryStep;
use sightline_geometry::frames::Pixel;
use sightline_session::what_if::{Ghost, WhatIf, try_step};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::extract::Body;
use crate::problem::{ApiError, ApiResult};
use crate::recorded_step::RecordedStep;
use crate::routes::route::route;
use crate::state::AppState;

/// Maximum absolute coordinate of a displaced prediction, px.
const PIXEL_LIMIT: f64 = 1e5;
/// Maximum number of arrays per request.
const ARRAY_LIMIT: usize = 8;

/// The routes of this resource.
pub(crate) fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new().routes(route::<TryStep>(routes!(what_if)))
}

/// Tries a step with changed settings or a displaced prediction
///
/// Starts from the state after the run's previous step; nothing is stored. To continue with the changes, fork the run at
/// this step with the same settings and prediction.
#[utoipa::path(post, operation_id = "what_if", path = TryStep::PATH,
    tag = "why", request_body = WhatIf, responses((status = 200, body = Ghost), ApiError))]
async fn what_if(
    State(state): State<AppState>,
    mut step: RecordedStep,
    Body(what_if): Body<TryStep>,
) -> ApiResult<Json<Ghost>> {
    check_pixel(what_if.prediction_px)?;
    if what_if.arrays.len() > ARRAY_LIMIT {
        let detail = format!("arrays: at most {ARRAY_LIMIT} can be asked for at a time");
        return Err(ApiError::invalid("field", detail));
    }
    let settings = step.settings.with(&what_if.settings)?;
    state
        .tries()
        .run_until_dropped(move |cancel| {
            step.prepare(cancel)?;
            let open = step.live.traverse();
            let drive = &open.traverse;
            let tried = try_step(drive, step.base(), &what_if, cancel.as_ref().into())?;
            Ok(Json(Ghost::new(what_if, &tried, &step.recorded, &settings)))
        })
        .await
}

/// Rejects a pixel outside the valid range of a prediction.
///
/// # Errors
/// A problem that names the field.
pub(crate) fn check_pixel(pixel: Option<Pixel>) -> ApiResult<()> {
    let is_far = |v: f64| !(-PIXEL_LIMIT..=PIXEL_LIMIT).contains(&v);
    match pixel.filter(|pixel| is_far(pixel.x) || is_far(pixel.y)) {
        Some(_) => Err(ApiError::invalid(
            "field",
            format!("prediction_px: x and y must be from -{PIXEL_LIMIT} to {PIXEL_LIMIT} px"),
        )),
        None => Ok(()),
    }
}
